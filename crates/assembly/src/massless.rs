//! Refuses joints that move no inertia whatever the positions.

use crate::mass::pivots_exceed;
use crate::model::Body;
use crate::{Joint, JointKind, MassProperties, Model, ModelError};
use glam::DVec3;
use vertebra_spatial::Pose;

/// What rounding leaves of a moment of inertia that is zero, relative to the trace.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Sine of the angle between axes that are one, and their distance relative to the lengths it is
/// computed from. The inertia that such axes leave between them is the square of it.
const COAXIAL: f64 = 1e-12;

/// Where a body sits in its cluster: the bodies welded together that one joint carries.
#[derive(Clone, Copy)]
struct Seat {
    /// Index of the body whose joint carries the cluster.
    carrier: usize,
    /// The body's frame, seen from the frame in which that joint's axis is given.
    placement: Pose,
    /// Sum of the lengths that the placement is composed of \[m\], to which its error is relative.
    reach: f64,
}

impl Seat {
    /// The frame on the body from which a further joint starts.
    fn at(&self, placement: &Pose) -> Self {
        Self {
            placement: self.placement * *placement,
            reach: self.reach + placement.translation.length(),
            ..*self
        }
    }
}

/// Refuses joints that move no inertia whatever the positions.
///
/// What a joint accelerates is its cluster, and whatever hangs from that cluster by further joints.
/// If the cluster alone resists the joint's motion, all is well. If not, mass beyond a further
/// joint must do it, and cannot where that joint gives way to the same motion. Whether it does
/// otherwise depends on the position, and the solvers find out then.
pub(crate) fn check(model: &Model) -> Result<(), ModelError> {
    if model.inner.resist {
        return Ok(());
    }
    match problems(model).into_iter().next() {
        Some(problem) => Err(problem),
        None => Ok(()),
    }
}

/// Whether a body on this joint resists its motion by its own mass. If all do, none of them is welded to
/// another, and nothing has to be put together to see that all is well.
pub(crate) fn resists_alone(joint: &Joint, mass: &MassProperties) -> bool {
    let Joint {
        kind,
        child_placement,
        ..
    } = joint;
    let cluster = match *child_placement == Pose::IDENTITY {
        true => *mass,
        false => mass.placed(&child_placement.inverse()),
    };
    *kind != JointKind::Fixed && resists(&cluster, kind)
}

/// All of them.
pub(crate) fn problems(model: &Model) -> Vec<ModelError> {
    let mut problems = Vec::new();
    let bodies = model.bodies();
    let seats = seats(bodies);
    let mut clusters = vec![MassProperties::MASSLESS; bodies.len()];
    for (body, seat) in bodies.iter().zip(&seats) {
        let cluster = &mut clusters[seat.carrier];
        *cluster = cluster.combined(&body.mass.placed(&seat.placement));
    }
    let mut loaded = vec![false; bodies.len()];
    for (index, body) in bodies.iter().enumerate().rev() {
        let kind = &body.joint.kind;
        let cluster = &clusters[index];
        // A cluster welded to the world is its own carrier; every other weld is in its carrier's.
        if *kind == JointKind::Fixed {
            continue;
        }
        if !loaded[index] && !resists(cluster, kind) {
            problems.push(ModelError::MasslessBody {
                body: body.name.clone(),
            });
        }
        if let Some(parent) = body.parent
            && (cluster.mass > 0.0 || loaded[index])
        {
            let joint = seats[parent.index()].at(&body.joint.parent_placement);
            let carrier = joint.carrier;
            loaded[carrier] |= !gives_way(kind, &joint, &bodies[carrier].joint.kind);
        }
    }
    problems
}

fn seats(bodies: &[Body]) -> Vec<Seat> {
    let mut seats: Vec<Seat> = Vec::with_capacity(bodies.len());
    for (index, body) in bodies.iter().enumerate() {
        let joint = match body.parent {
            Some(parent) if body.joint.kind == JointKind::Fixed => {
                seats[parent.index()].at(&body.joint.parent_placement)
            }
            _ => Seat {
                carrier: index,
                placement: Pose::IDENTITY,
                reach: 0.0,
            },
        };
        seats.push(joint.at(&body.joint.child_placement.inverse()));
    }
    seats
}

/// Whether a cluster, given in the joint's frame, resists every motion of the joint.
fn resists(cluster: &MassProperties, kind: &JointKind) -> bool {
    let about = cluster.about(DVec3::ZERO);
    let floor = ROUNDING * (about.x_axis.x + about.y_axis.y + about.z_axis.z);
    match *kind {
        JointKind::Fixed => true,
        JointKind::Revolute { axis } => axis.dot(about * axis) > floor,
        JointKind::Prismatic { .. } => cluster.mass > 0.0,
        JointKind::Screw { axis, pitch } => {
            axis.dot(about * axis) + cluster.mass * pitch * pitch > floor
        }
        JointKind::Spherical => pivots_exceed(&about, floor),
        JointKind::Free => cluster.mass > 0.0 && pivots_exceed(&cluster.inertia, floor),
    }
}

/// Whether a further joint, which starts at `place`, can undo every motion of the carrying one: then
/// nothing beyond it resists that motion. Both axes are fixed in the cluster between, so that this
/// holds at all positions or at none.
fn gives_way(further: &JointKind, place: &Seat, carrying: &JointKind) -> bool {
    let is_parallel = |axis: DVec3, further: DVec3| {
        axis.cross(place.placement.rotation * further).length() <= COAXIAL
    };
    let is_met_by =
        |axis: DVec3| axis.cross(place.placement.translation).length() <= COAXIAL * place.reach;
    match (*carrying, *further) {
        (_, JointKind::Free) => true,
        (JointKind::Revolute { axis }, JointKind::Revolute { axis: other }) => {
            is_parallel(axis, other) && is_met_by(axis)
        }
        (JointKind::Revolute { axis }, JointKind::Spherical) => is_met_by(axis),
        (
            JointKind::Screw { axis, pitch },
            JointKind::Screw {
                axis: other,
                pitch: further,
            },
        ) => {
            // A thread has the same hand seen from either end.
            is_parallel(axis, other)
                && is_met_by(axis)
                && (pitch - further).abs() <= COAXIAL * (pitch.abs() + further.abs())
        }
        (JointKind::Prismatic { axis }, JointKind::Prismatic { axis: other }) => {
            is_parallel(axis, other)
        }
        _ => false,
    }
}
