//! Refuses joints that move no inertia whatever the positions.

use crate::mass::pivots_exceed;
use crate::{Body, Joint, JointKind, MassProperties, Model, ModelError};
use glam::DVec3;
use std::collections::HashMap;
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
    if all_resist(model.bodies()) {
        return Ok(());
    }
    match problems(model).into_iter().next() {
        Some(problem) => Err(problem),
        None => Ok(()),
    }
}

/// Whether each cluster alone resists the motion of its joint. Of a body to which none is welded its part knows;
/// only the others are put together.
fn all_resist(bodies: &[Body]) -> bool {
    if bodies.iter().all(|body| body.resists) {
        return true;
    }
    let mut carriers: Vec<usize> = (0..bodies.len()).collect();
    let mut is_single = vec![true; bodies.len()];
    for (index, body) in bodies.iter().enumerate() {
        if let Some(parent) = body.parent
            && body.joint.kind == JointKind::Fixed
        {
            carriers[index] = carriers[parent.index()];
            is_single[carriers[index]] = false;
        }
    }
    let (mut seats, mut clusters) = (HashMap::new(), HashMap::new());
    for (index, body) in bodies.iter().enumerate() {
        let carrier = carriers[index];
        if is_single[carrier] {
            if body.resists || body.joint.kind == JointKind::Fixed {
                continue;
            }
            return false;
        }
        let below = body.parent.and_then(|parent| seats.get(&parent.index()));
        let seat = seat(index, body, below);
        let cluster = clusters.entry(carrier).or_insert(MassProperties::MASSLESS);
        *cluster = cluster.combined(&body.mass.placed(&seat.placement));
        seats.insert(index, seat);
    }
    (clusters.iter()).all(|(&carrier, cluster)| resists(cluster, &bodies[carrier].joint.kind))
}

/// Whether a body on this joint resists its motion by its own mass; one that is welded does not.
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
    let mut undone = vec![None; bodies.len()];
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
                undone: undone[index].map(|by: usize| bodies[by].name.as_str().into()),
            });
        }
        if let Some(parent) = body.parent
            && (cluster.mass > 0.0 || loaded[index])
        {
            let joint = seats[parent.index()].at(&body.joint.parent_placement);
            let carrier = joint.carrier;
            if gives_way(kind, &joint, &bodies[carrier].joint.kind) {
                undone[carrier] = Some(index);
            } else {
                loaded[carrier] = true;
            }
        }
    }
    problems
}

fn seats(bodies: &[Body]) -> Vec<Seat> {
    let mut seats: Vec<Seat> = Vec::with_capacity(bodies.len());
    for (index, body) in bodies.iter().enumerate() {
        let below = body.parent.map(|parent| &seats[parent.index()]);
        seats.push(seat(index, body, below));
    }
    seats
}

/// The seat of a body, given its parent's.
fn seat(index: usize, body: &Body, below: Option<&Seat>) -> Seat {
    let joint = match below {
        Some(below) if body.joint.kind == JointKind::Fixed => {
            below.at(&body.joint.parent_placement)
        }
        _ => Seat {
            carrier: index,
            placement: Pose::IDENTITY,
            reach: 0.0,
        },
    };
    joint.at(&body.joint.child_placement.inverse())
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
