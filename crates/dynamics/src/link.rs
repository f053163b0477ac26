//! The model as the sweeps read it: constants a body in working precision and the model's units.

use vertebra_assembly::{Body, BodyId, JointKind, Model, Units};
use vertebra_spatial::{Mat3, Pose, Real, RigidInertia, Sym3, Transform, Vec3};

/// Constants of one body.
///
/// Inside the solvers a body's frame is its **joint frame**: origin at the joint, axes those of the
/// joint frame on the child. Placements on the child are thereby worked in once and for all.
#[derive(Clone, Debug)]
pub(crate) struct Link<T> {
    /// Index of the parent body.
    pub(crate) parent: Option<usize>,
    /// The joint's motion.
    pub(crate) kind: Kind<T>,
    /// The joint frame on the parent, in the parent's joint frame.
    pub(crate) placement: Transform<T>,
    /// Inertia about the joint's origin in joint axes.
    pub(crate) inertia: RigidInertia<T>,
    /// Centre of mass in the joint frame.
    pub(crate) center: Vec3<T>,
    /// The body's own frame seen from its joint frame.
    pub(crate) body_frame: Pose,
    /// Start of its coordinates in q.
    pub(crate) q: usize,
    /// Start of its freedoms in qd.
    pub(crate) v: usize,
}

/// A joint's motion with what it needs at hand.
#[derive(Clone, Debug)]
pub(crate) enum Kind<T> {
    Fixed,
    /// The rotation to the parent is `still + cos q * swing + sin q * turn`: Rodrigues' formula
    /// 1 + sin q a~ + (1 - cos q) a~ a~, multiplied by the placement's rotation.
    Revolute {
        axis: Vec3<T>,
        still: Mat3<T>,
        swing: Mat3<T>,
        turn: Mat3<T>,
    },
    Prismatic {
        axis: Vec3<T>,
    },
    Spherical,
    Free,
}

impl<T> Kind<T> {
    pub(crate) const fn dof_count(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Revolute { .. } | Self::Prismatic { .. } => 1,
            Self::Spherical => 3,
            Self::Free => 6,
        }
    }
}

impl<T: Real> Link<T> {
    pub(crate) fn of_model(model: &Model) -> Vec<Self> {
        model
            .bodies()
            .iter()
            .map(|body| Self::new(body, model))
            .collect()
    }

    fn new(body: &Body, model: &Model) -> Self {
        let units = model.units();
        let body_frame = body.joint.child_placement.inverse();
        let parent_joint = body
            .parent
            .and_then(|id| model.body(id))
            .map_or(Pose::IDENTITY, |parent| {
                parent.joint.child_placement.inverse()
            });
        let placement = scaled(&compose(&parent_joint, &body.joint.parent_placement), units);
        let mass = if body_frame == Pose::IDENTITY {
            body.mass
        } else {
            body.mass.placed(&body_frame)
        };
        let moment_unit = units.mass * units.length * units.length;
        let center = Vec3::from_glam(mass.center / units.length);
        let inertia = RigidInertia::from_center(
            T::from_f64(mass.mass / units.mass),
            center,
            Sym3::from_glam(mass.inertia * (1.0 / moment_unit)),
        );
        let transform = Transform::from_pose(&placement);
        Self {
            parent: body.parent.map(BodyId::index),
            kind: kind(body.joint.kind, &transform.rotation),
            placement: transform,
            inertia,
            center,
            body_frame: scaled(&body_frame, units),
            q: body.position_start,
            v: body.dof_start,
        }
    }
}

fn kind<T: Real>(joint: JointKind, placement: &Mat3<T>) -> Kind<T> {
    match joint {
        JointKind::Fixed => Kind::Fixed,
        JointKind::Revolute { axis } => {
            let axis = Vec3::from_glam(axis);
            let along = Mat3::outer(axis, axis);
            Kind::Revolute {
                axis,
                still: *placement * along,
                swing: *placement * (Mat3::IDENTITY - along),
                turn: *placement * Mat3::cross_matrix(axis),
            }
        }
        JointKind::Prismatic { axis } => Kind::Prismatic {
            axis: Vec3::from_glam(axis),
        },
        JointKind::Spherical => Kind::Spherical,
        JointKind::Free => Kind::Free,
    }
}

/// Composition that leaves exact placements exact.
fn compose(a: &Pose, b: &Pose) -> Pose {
    if *a == Pose::IDENTITY { *b } else { *a * *b }
}

fn scaled(pose: &Pose, units: &Units) -> Pose {
    Pose::new(pose.rotation, pose.translation / units.length)
}

/// Factors between SI and the model's units for each degree of freedom.
#[derive(Clone, Debug)]
pub(crate) struct Scales {
    /// SI rate times this is a rate in model units.
    pub(crate) rate: Vec<f64>,
    /// Acceleration in model units times this is SI.
    pub(crate) acceleration: Vec<f64>,
    /// Joint force in model units times this is SI.
    pub(crate) force: Vec<f64>,
}

impl Scales {
    pub(crate) fn of_model(model: &Model) -> Self {
        let units = model.units();
        let mut scales = Self {
            rate: Vec::with_capacity(model.dof_count()),
            acceleration: Vec::with_capacity(model.dof_count()),
            force: Vec::with_capacity(model.dof_count()),
        };
        for body in model.bodies() {
            for dof in 0..body.joint.kind.dof_count() {
                let linear = match body.joint.kind {
                    JointKind::Prismatic { .. } => true,
                    JointKind::Free => dof >= 3,
                    _ => false,
                };
                let length = if linear { units.length } else { 1.0 };
                scales.rate.push(units.time / length);
                scales.acceleration.push(length / (units.time * units.time));
                scales.force.push(units.energy() / length);
            }
        }
        scales
    }
}
