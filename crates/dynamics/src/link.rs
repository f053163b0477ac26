//! The model as the sweeps read it: constants a body in working precision and the model's units.
//!
//! Everything that takes arithmetic (unit axes and quaternions, placements, inertias about the joint)
//! is computed in f64 at least, the reference in its own precision, and rounded once. The numbers of the model are exact, and so are its units, powers of two.

use glam::DVec3;
use vertebra_assembly::{Body, BodyId, JointKind, Model, Units};
use vertebra_spatial::{Mat3, Number, Pose, Real, RigidInertia, Sym3, Transform, Vec3, vec3};

/// Constants of one body.
///
/// Inside the solvers a body's frame is its **joint frame**: origin at the joint, axes those of the
/// joint frame on the child, turned so that z is the axis of a revolute or prismatic joint. Placements
/// on the child are thereby worked in once and for all, a turn is one about z, and the axis in the
/// world is a column of the rotation.
#[derive(Clone, Debug)]
pub(crate) struct Link<T> {
    /// Index of the parent body.
    pub(crate) parent: Option<usize>,
    /// The joint's motion.
    pub(crate) kind: Kind,
    /// Displacement a radian of a screw joint, zero of others.
    pub(crate) pitch: T,
    /// Whether it has children other than the next body.
    pub(crate) gathers: bool,
    /// Whether of these children of its parent it is the last, the first on the way up.
    pub(crate) arrives_first: bool,
    /// The joint frame on the parent, in the parent's joint frame.
    pub(crate) placement: Transform<T>,
    /// Inertia about the joint's origin in joint axes.
    pub(crate) inertia: RigidInertia<T>,
    /// Start of its coordinates in q.
    pub(crate) q: usize,
    /// Start of its freedoms in qd.
    pub(crate) v: usize,
}

/// A joint's motion; in joint axes those of one freedom turn about z or slide along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Fixed,
    Revolute,
    Prismatic,
    Screw,
    Spherical,
    Free,
}

impl Kind {
    pub(crate) const fn dof_count(self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Revolute | Self::Prismatic | Self::Screw => 1,
            Self::Spherical => 3,
            Self::Free => 6,
        }
    }
}

/// What of a body the sweeps do not need, in its joint frame.
#[derive(Clone, Debug)]
pub(crate) struct BodyFrame<T> {
    /// Centre of mass.
    pub(crate) center: Vec3<T>,
    /// The body's own frame.
    pub(crate) placement: Transform<T>,
}

impl<T: Real> BodyFrame<T> {
    pub(crate) fn rounded(body: &Body, units: &Units) -> Self {
        Self::narrow(BodyFrame::new(body, units))
    }

    fn narrow(wide: BodyFrame<T::Wide>) -> Self {
        Self {
            center: wide.center.map(T::narrow),
            placement: wide.placement.map(T::narrow),
        }
    }

    pub(crate) fn new(body: &Body, units: &Units) -> Self {
        let placement = joint_frame(body, units).inverse();
        Self {
            center: placement.point(Vec3::from_glam(body.mass.center / units.length)),
            placement,
        }
    }
}

impl<T: Real> Link<T> {
    /// The links and frames of all bodies.
    pub(crate) fn of_model(model: &Model) -> (Vec<Self>, Vec<BodyFrame<T>>) {
        let (bodies, units) = (model.bodies(), model.units());
        let wide = bodies.iter().map(|body| BodyFrame::new(body, units));
        let wide: Vec<BodyFrame<T::Wide>> = wide.collect();
        let link = |(body, frame): (&Body, _)| {
            let parent = body.parent.map(|parent| &wide[parent.index()]);
            Link::between(body, units, parent, frame).map(T::narrow)
        };
        let mut links: Vec<Self> = bodies.iter().zip(&wide).map(link).collect();
        for i in (0..links.len()).rev() {
            if let Some(parent) = links[i].parent.filter(|parent| parent + 1 != i) {
                links[i].arrives_first = !links[parent].gathers;
                links[parent].gathers = true;
            }
        }
        (links, wide.into_iter().map(BodyFrame::narrow).collect())
    }

    /// The link as if it had no children.
    pub(crate) fn new(body: &Body, model: &Model) -> Self {
        let units = model.units();
        let parent = body.parent.and_then(|id| model.body(id));
        let parent = parent.map(|parent| BodyFrame::new(parent, units));
        Self::between(body, units, parent.as_ref(), &BodyFrame::new(body, units))
    }

    /// The same, given the frames of the parent and of the body.
    fn between(
        body: &Body,
        units: &Units,
        parent: Option<&BodyFrame<T>>,
        frame: &BodyFrame<T>,
    ) -> Self {
        let on_parent =
            transform(&body.joint.parent_placement, units) * joint_axes(body.joint.kind);
        let placement = match parent {
            Some(parent) => parent.placement * on_parent,
            None => on_parent,
        };
        Self {
            parent: body.parent.map(BodyId::index),
            kind: match body.joint.kind {
                JointKind::Fixed => Kind::Fixed,
                JointKind::Revolute { .. } => Kind::Revolute,
                JointKind::Prismatic { .. } => Kind::Prismatic,
                JointKind::Screw { .. } => Kind::Screw,
                JointKind::Spherical => Kind::Spherical,
                JointKind::Free => Kind::Free,
            },
            pitch: match body.joint.kind {
                JointKind::Screw { pitch, .. } => T::from_f64(pitch / units.length),
                _ => T::ZERO,
            },
            gathers: false,
            arrives_first: false,
            placement,
            inertia: RigidInertia::from_center(
                T::from_f64(body.mass.mass / units.mass),
                frame.center,
                central(body, units).rotated(&frame.placement.rotation),
            ),
            q: body.position_start,
            v: body.dof_start,
        }
    }

    /// Takes the inertia about the centre of mass.
    pub(crate) fn refer_to_center(&mut self, body: &Body, units: &Units) {
        let axes = BodyFrame::new(body, units).placement.rotation;
        self.inertia = RigidInertia {
            mass: self.inertia.mass,
            moment: Vec3::ZERO,
            rotational: central(body, units).rotated(&axes),
        };
    }

    pub(crate) fn map<U: Number>(self, f: impl Fn(T) -> U) -> Link<U> {
        Link {
            parent: self.parent,
            kind: self.kind,
            pitch: f(self.pitch),
            gathers: self.gathers,
            arrives_first: self.arrives_first,
            placement: self.placement.map(&f),
            inertia: self.inertia.map(&f),
            q: self.q,
            v: self.v,
        }
    }
}

/// Inertia about the centre of mass, in the body's axes and the model's units.
fn central<T: Real>(body: &Body, units: &Units) -> Sym3<T> {
    let moment_unit = units.mass * units.length * units.length;
    Sym3::from_glam(body.mass.inertia * moment_unit.recip())
}

/// A body's joint frame in its own frame.
fn joint_frame<T: Real>(body: &Body, units: &Units) -> Transform<T> {
    transform(&body.joint.child_placement, units) * joint_axes(body.joint.kind)
}

/// The solvers' joint axes in the model's: z along the axis of a joint that has one.
fn joint_axes<T: Real>(joint: JointKind) -> Transform<T> {
    let Some(axis) = joint.axis() else {
        return Transform::IDENTITY;
    };
    Transform {
        rotation: with_z_along(axis),
        translation: Vec3::ZERO,
    }
}

/// Axes of which z has a direction, given to f64's rounding as a vector of unit length.
///
/// Duff et al., Building an Orthonormal Basis, Revisited (JCGT 6, 2017); an axis of z changes nothing.
pub(crate) fn with_z_along<T: Real>(axis: DVec3) -> Mat3<T> {
    let z = unit(axis);
    let sign = T::from_f64(1.0_f64.copysign(axis.z));
    let a = -T::ONE / (sign + z.z);
    let b = z.x * z.y * a;
    Mat3::from_cols(
        vec3(T::ONE + sign * z.x * z.x * a, sign * b, -sign * z.x),
        vec3(b, sign + z.y * z.y * a, -z.y),
        z,
    )
}

/// The model's axes are of unit length to f64's rounding.
fn unit<T: Real>(axis: DVec3) -> Vec3<T> {
    let axis = Vec3::from_glam(axis);
    axis * (T::ONE / axis.length())
}

fn transform<T: Real>(pose: &Pose, units: &Units) -> Transform<T> {
    Transform::from_pose(&Pose::new(pose.rotation, pose.translation / units.length))
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
    /// An inertia that a freedom adds to its own, in SI, times this is in model units.
    pub(crate) fn inertia(&self, dof: usize) -> f64 {
        self.acceleration[dof] / self.force[dof]
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::Sweeps;
    use vertebra_assembly::State;
    use vertebra_assembly::generate::{self, RandomTree};
    use vertebra_spatial::DoubleDouble;

    /// Nothing on the way from the model to the sweeps is rounded to f64: rotations are rotations
    /// and inertias keep their traces to the last bits of the reference.
    #[test]
    fn constants_have_the_bits_of_the_reference() {
        let tree = RandomTree {
            floating: true,
            ..RandomTree::mixed(40)
        };
        let model = generate::random_tree(&tree, 5).unwrap();
        let mut state = State::random(&model, 6);
        // Quaternions of a length that only just passes for 1.
        for body in model.bodies() {
            if body.joint.kind == JointKind::Spherical {
                state.q[body.position_range()].iter_mut().for_each(|x| {
                    *x *= 1.0 + 5e-7;
                });
            }
        }
        let scales = Scales::of_model(&model);
        let mut s = Sweeps::<DoubleDouble>::new(&model);
        s.set_state(&state.q, &state.qd, model.units().length, &scales.rate);
        let eps = DoubleDouble::EPSILON.hi();
        let number = DoubleDouble::from_f64;
        let bound = 16.0 * eps * model.depth() as f64;
        for (i, body) in model.bodies().iter().enumerate() {
            let off = s.rotation[i].transpose() * s.rotation[i] - Mat3::IDENTITY;
            for column in [off.x_axis, off.y_axis, off.z_axis] {
                let largest = column.length().to_f64();
                assert!(largest <= bound, "rotation of {i}: {largest:e}");
            }
            // tr(I + m (|c|^2 1 - c c')) = tr I + 2 m |c|^2, whatever the axes; c from the joint.
            let units = model.units();
            let m = body.mass.mass / units.mass;
            let c = (body.mass.center / units.length).to_array();
            let j = (body.joint.child_placement.translation / units.length).to_array();
            let arm = |k: usize| number(c[k]) - number(j[k]);
            let square = vec3(arm(0), arm(1), arm(2)).length_squared();
            let unit = units.mass * units.length * units.length;
            let central = Sym3::<DoubleDouble>::from_glam(body.mass.inertia * unit.recip());
            let expected = central.trace() + number(2.0 * m) * square;
            let trace = s.links[i].inertia.rotational.trace();
            let error = ((trace - expected) / expected).abs().to_f64();
            assert!(error <= 32.0 * eps, "inertia of {i}: {error:e}");
        }
    }
}
