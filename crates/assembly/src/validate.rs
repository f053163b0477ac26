//! Checks of a model description, each ending in an error that names the culprit.

use crate::description::MODEL_VERSION;
use crate::{
    BallRange, Joint, JointKind, JointLimits, MassProperties, ModelDescription, ModelError, Rest,
    Stop,
};
use crate::{closure, spelling};
use core::f64::consts::PI;
use glam::{DMat3, DQuat, DVec3};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};
use vertebra_spatial::Pose;

/// Sizes outside 1e-100..1e100 overflow when they are multiplied, and no body has them.
const LARGEST: f64 = 1e100;

/// Index limit of positions and degrees of freedom: seven of them a body still fit 32 bits.
const BODY_LIMIT: usize = (u32::MAX / 8) as usize;

/// Checks everything but the joints that move no inertia and returns an order with parents first.
pub(crate) fn check(description: &ModelDescription) -> Result<Vec<usize>, ModelError> {
    let Checked {
        order, problems, ..
    } = check_all(description);
    match problems.into_iter().next() {
        Some(problem) => Err(problem),
        None => Ok(order),
    }
}

/// What the checks of a description found.
pub(crate) struct Checked {
    /// The bodies' indices, parents first, if they are sound.
    pub(crate) order: Vec<usize>,
    /// Whether nothing is wrong with the bodies, their joints and their parents.
    pub(crate) are_bodies_sound: bool,
    /// Everything that is wrong: of each number, vector and placement the first thing.
    pub(crate) problems: Vec<ModelError>,
}

/// The first of the problems that a check finds.
pub(crate) fn first(check: impl FnOnce(&mut Vec<ModelError>)) -> Result<(), ModelError> {
    let mut problems = Vec::new();
    check(&mut problems);
    problems.into_iter().next().map_or(Ok(()), Err)
}

/// The same, and everything that is wrong.
pub(crate) fn check_all(description: &ModelDescription) -> Checked {
    let mut problems = Vec::new();
    check_whole(description, &mut problems);
    let of_whole = problems.len();
    let bodies = &description.bodies;
    let mut by_name = HashMap::with_capacity(bodies.len());
    for (index, body) in bodies.iter().enumerate() {
        problems.extend(check_name("body", index, &body.name).err());
        if by_name.insert(body.name.as_str(), index).is_some() && !body.name.is_empty() {
            problems.push(ModelError::DuplicateName {
                name: body.name.clone(),
            });
        }
        check_joint(&body.name, &body.joint, &mut problems);
        check_mass(&body.name, &body.mass, &mut problems);
    }
    let order = parents_first(description, &by_name, &mut problems);
    let are_bodies_sound = problems.len() == of_whole && !bodies.is_empty();
    for body in bodies {
        if let Some(mimic) = &body.joint.mimic
            && !by_name.contains_key(mimic.body.as_str())
        {
            problems.push(ModelError::UnknownBody {
                user: body.name.as_str().into(),
                body: mimic.body.as_str().into(),
                meant: None,
            });
        }
    }
    check_frames(description, &by_name, &mut problems);
    closure::check(description, &by_name, &mut problems);
    hint(description, &mut problems);
    Checked {
        order,
        are_bodies_sound,
        problems,
    }
}

/// Of unknown names so many are looked for among those that are spelt alike: each takes a look at all.
pub(crate) const HINTS: usize = 16;

/// Adds to bodies that are missing which ones may be meant.
fn hint(description: &ModelDescription, problems: &mut [ModelError]) {
    let unknown = problems.iter_mut().filter_map(|problem| match problem {
        ModelError::UnknownParent {
            parent: name,
            meant,
            ..
        }
        | ModelError::UnknownBody {
            body: name, meant, ..
        } => Some((name, meant)),
        _ => None,
    });
    for (name, meant) in unknown.take(HINTS) {
        let names = description.bodies.iter().map(|body| body.name.as_str());
        *meant = spelling::nearest(name, names).map(Box::from);
    }
}

/// Checks what is not of a single body.
fn check_whole(description: &ModelDescription, problems: &mut Vec<ModelError>) {
    if description.version != MODEL_VERSION {
        problems.push(ModelError::UnsupportedVersion {
            what: "model",
            found: description.version,
            supported: MODEL_VERSION,
        });
    }
    let bodies = &description.bodies;
    if bodies.is_empty() {
        problems.push(ModelError::Empty {
            model: description.name.clone(),
        });
    }
    problems.extend(check_count(bodies.len()).err());
    let sized = sized_vector("gravity", &description.name, description.gravity);
    problems.extend(sized.err());
}

/// Checks that indices can count the bodies and their freedoms.
pub(crate) fn check_count(bodies: usize) -> Result<(), ModelError> {
    if bodies > BODY_LIMIT {
        return Err(ModelError::TooLarge {
            what: "bodies",
            requested: bodies,
            limit: BODY_LIMIT,
        });
    }
    Ok(())
}

pub(crate) fn check_name(what: &'static str, index: usize, name: &str) -> Result<(), ModelError> {
    if name.is_empty() {
        return Err(ModelError::EmptyName { what, index });
    }
    Ok(())
}

fn check_frames(
    description: &ModelDescription,
    by_name: &HashMap<&str, usize>,
    problems: &mut Vec<ModelError>,
) {
    let mut names = HashSet::with_capacity(description.frames.len());
    for (index, frame) in description.frames.iter().enumerate() {
        problems.extend(check_name("frame", index, &frame.name).err());
        if by_name.contains_key(frame.name.as_str()) || !names.insert(frame.name.as_str()) {
            problems.push(ModelError::DuplicateName {
                name: frame.name.clone(),
            });
        }
        if let Some(body) = &frame.body
            && !by_name.contains_key(body.as_str())
        {
            problems.push(ModelError::UnknownBody {
                user: frame.name.as_str().into(),
                body: body.as_str().into(),
                meant: None,
            });
        }
        problems.extend(check_placement("placement", &frame.name, &frame.placement).err());
    }
}

/// Kahn's algorithm, the smallest index first: an order that has parents first is kept.
fn parents_first(
    description: &ModelDescription,
    by_name: &HashMap<&str, usize>,
    problems: &mut Vec<ModelError>,
) -> Vec<usize> {
    let known = problems.len();
    let bodies = &description.bodies;
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); bodies.len()];
    let mut ready = BinaryHeap::new();
    for (index, body) in bodies.iter().enumerate() {
        match &body.parent {
            None => ready.push(Reverse(index)),
            Some(parent) => match by_name.get(parent.as_str()) {
                Some(&parent) => children[parent].push(index),
                None => problems.push(ModelError::UnknownParent {
                    body: body.name.as_str().into(),
                    parent: parent.as_str().into(),
                    meant: None,
                }),
            },
        }
    }
    let mut order = Vec::with_capacity(bodies.len());
    while let Some(Reverse(index)) = ready.pop() {
        order.push(index);
        ready.extend(children[index].iter().map(|&child| Reverse(child)));
    }
    // What hangs from a missing parent, or from one of two of a name, may not be placed either.
    let is_twice = |problem: &ModelError| matches!(problem, ModelError::DuplicateName { .. });
    let is_clear = problems.len() == known && !problems.iter().any(is_twice);
    if order.len() < bodies.len() && is_clear {
        problems.push(ModelError::Cycle {
            body: bodies[body_on_cycle(description, by_name, &order)]
                .name
                .clone(),
        });
    }
    order
}

/// Walks from an unplaced body towards its parents as often as there are bodies: that ends on the
/// cycle itself, not on something that merely hangs from it.
fn body_on_cycle(
    description: &ModelDescription,
    by_name: &HashMap<&str, usize>,
    placed: &[usize],
) -> usize {
    let placed: HashSet<_> = placed.iter().copied().collect();
    let mut index = (0..description.bodies.len())
        .find(|index| !placed.contains(index))
        .unwrap_or(0);
    for _ in 0..description.bodies.len() {
        if let Some(&parent) = description.bodies[index]
            .parent
            .as_ref()
            .and_then(|parent| by_name.get(parent.as_str()))
        {
            index = parent;
        }
    }
    index
}

pub(crate) fn check_joint(body: &str, joint: &Joint, problems: &mut Vec<ModelError>) {
    let mut note = |checked: Result<(), ModelError>| problems.extend(checked.err());
    if let Some(axis) = joint.kind.axis() {
        note(check_axis("joint axis", body, axis));
    }
    if let JointKind::Screw { pitch, .. } = joint.kind {
        let sized = || not_absurd("joint pitch", body, pitch.abs());
        note(finite("joint pitch", body, pitch).and_then(|()| sized()));
    }
    for (quantity, placement) in [
        ("joint placement on the parent", &joint.parent_placement),
        ("joint placement on the body", &joint.child_placement),
    ] {
        note(check_placement(quantity, body, placement));
    }
    for (quantity, value) in [
        ("joint damping", joint.damping),
        ("joint friction", joint.friction),
        ("joint armature", joint.armature),
    ] {
        note(not_negative(quantity, body, value));
    }
    if let Some(spring) = &joint.spring {
        note(not_negative("joint stiffness", body, spring.stiffness));
        note(check_rest(body, joint.kind, &spring.rest));
    }
    match joint.stop {
        Stop::Hard { restitution } => note(check_restitution(body, restitution)),
        Stop::Soft { stiffness, damping } => {
            note(not_negative("joint stop stiffness", body, stiffness));
            note(not_negative("joint stop damping", body, damping));
        }
    }
    if let Some(limits) = &joint.limits {
        note(check_range(body, joint.kind, limits));
        if let Some(range) = &limits.orientation {
            note(check_ball_range(body, joint.kind, range));
        }
        for (quantity, limit) in [
            ("joint velocity limit", limits.velocity),
            ("joint effort limit", limits.effort),
        ] {
            note(not_negative(quantity, body, limit.unwrap_or(0.0)));
        }
    }
    if let Some(mimic) = &joint.mimic {
        note(finite("mimic multiplier", body, mimic.multiplier));
        note(finite("mimic offset", body, mimic.offset));
    }
}

pub(crate) fn check_axis(
    quantity: &'static str,
    element: &str,
    axis: DVec3,
) -> Result<(), ModelError> {
    finite_vector(quantity, element, axis)?;
    if axis == DVec3::ZERO {
        return Err(ModelError::ZeroAxis {
            body: element.to_owned(),
        });
    }
    Ok(())
}

fn check_range(body: &str, kind: JointKind, limits: &JointLimits) -> Result<(), ModelError> {
    let Some([lower, upper]) = limits.position else {
        return Ok(());
    };
    if kind == JointKind::Spherical {
        return Err(ModelError::UnsuitedRange {
            body: body.to_owned(),
        });
    }
    finite("joint position limit", body, lower)?;
    finite("joint position limit", body, upper)?;
    if lower > upper {
        return Err(ModelError::EmptyRange {
            body: body.to_owned(),
            lower,
            upper,
        });
    }
    Ok(())
}

fn check_ball_range(body: &str, kind: JointKind, range: &BallRange) -> Result<(), ModelError> {
    let bad = |reason| {
        Err(ModelError::BadBallRange {
            body: body.to_owned(),
            reason,
        })
    };
    if kind != JointKind::Spherical {
        return bad("only spherical joints have one; a joint of one freedom takes `with_range`");
    }
    // Written so that NaN fails.
    let is_angle = |angle: f64| angle > 0.0 && angle < PI;
    match *range {
        BallRange::Turn { angle } if is_angle(angle) => Ok(()),
        BallRange::Cone { swing, .. } if !is_angle(swing) => {
            bad("its swing must be above 0 and below pi")
        }
        BallRange::Turn { .. } => bad("its angle must be above 0 and below pi"),
        BallRange::Cone { axis, twist, .. } => {
            check_axis("joint axis", body, axis)?;
            match twist {
                None => Ok(()),
                Some([lower, upper]) if -PI <= lower && lower <= upper && upper <= PI => Ok(()),
                Some(_) => bad("its twists must lie within -pi and pi, the smaller one first"),
            }
        }
    }
}

fn check_rest(body: &str, kind: JointKind, rest: &Rest) -> Result<(), ModelError> {
    let suits = match (kind.dof_count(), *rest) {
        (1, Rest::Position(rest)) => {
            finite("joint rest position", body, rest)?;
            true
        }
        (3, Rest::Orientation(rest)) => {
            let pose = Pose::new(rest, DVec3::ZERO);
            check_placement("joint rest orientation", body, &pose)?;
            true
        }
        _ => false,
    };
    if suits {
        return Ok(());
    }
    Err(ModelError::UnsuitedSpring {
        body: body.to_owned(),
    })
}

fn check_restitution(body: &str, restitution: f64) -> Result<(), ModelError> {
    not_negative("joint restitution", body, restitution)?;
    if restitution > 1.0 {
        return Err(ModelError::OutOfRange {
            quantity: "joint restitution",
            element: body.into(),
            value: restitution,
            requirement: "between 0 and 1",
        });
    }
    Ok(())
}

fn not_negative(quantity: &'static str, body: &str, value: f64) -> Result<(), ModelError> {
    finite(quantity, body, value)?;
    if value < 0.0 {
        return Err(ModelError::Negative {
            quantity,
            body: body.to_owned(),
            value,
        });
    }
    Ok(())
}

pub(crate) fn check_placement(
    quantity: &'static str,
    element: &str,
    placement: &Pose,
) -> Result<(), ModelError> {
    sized_vector(quantity, element, placement.translation)?;
    for value in placement.rotation.to_array() {
        finite(quantity, element, value)?;
    }
    if !placement.is_valid() {
        return Err(ModelError::NonUnitQuaternion {
            quantity,
            element: element.to_owned(),
            length: placement.rotation.length(),
        });
    }
    Ok(())
}

pub(crate) fn check_mass(body: &str, mass: &MassProperties, problems: &mut Vec<ModelError>) {
    let sound = problems.len();
    check_mass_numbers(body, mass, problems);
    if problems.len() == sound
        && let Some(reason) = mass.violation()
    {
        problems.push(ModelError::NonPhysicalInertia {
            body: body.to_owned(),
            reason,
        });
    }
}

/// Checks one body's mass properties, but not whether the inertia is possible.
pub(crate) fn check_mass_numbers(
    body: &str,
    mass: &MassProperties,
    problems: &mut Vec<ModelError>,
) {
    problems.extend(check_weight(body, mass.mass).err());
    problems.extend(sized_vector("centre of mass", body, mass.center).err());
    problems.extend(check_inertia(body, &mass.inertia).err());
}

fn check_weight(body: &str, mass: f64) -> Result<(), ModelError> {
    finite("mass", body, mass)?;
    if mass < 0.0 {
        return Err(ModelError::NegativeMass {
            body: body.to_owned(),
            mass,
        });
    }
    not_absurd("mass", body, mass)
}

fn check_inertia(body: &str, inertia: &DMat3) -> Result<(), ModelError> {
    for value in inertia.to_cols_array() {
        finite("inertia", body, value)?;
    }
    let largest = largest_entry(inertia);
    not_absurd("inertia", body, largest)?;
    let skew = *inertia - inertia.transpose();
    if largest_entry(&skew) > 1e-9 * largest {
        return Err(ModelError::AsymmetricInertia {
            body: body.to_owned(),
        });
    }
    Ok(())
}

fn largest_entry(m: &DMat3) -> f64 {
    m.to_cols_array().iter().fold(0.0, |a, b| a.max(b.abs()))
}

fn not_absurd(quantity: &'static str, element: &str, value: f64) -> Result<(), ModelError> {
    if value != 0.0 && !(LARGEST.recip()..=LARGEST).contains(&value) {
        return Err(ModelError::AbsurdSize {
            quantity,
            element: element.to_owned(),
            value,
        });
    }
    Ok(())
}

pub(crate) fn finite(quantity: &'static str, element: &str, value: f64) -> Result<(), ModelError> {
    if value.is_finite() {
        return Ok(());
    }
    Err(ModelError::NonFinite {
        quantity,
        element: element.to_owned(),
        value,
    })
}

pub(crate) fn finite_vector(
    quantity: &'static str,
    element: &str,
    v: DVec3,
) -> Result<(), ModelError> {
    v.to_array()
        .into_iter()
        .try_for_each(|value| finite(quantity, element, value))
}

/// Checks a vector whose length means something.
fn sized_vector(quantity: &'static str, element: &str, v: DVec3) -> Result<(), ModelError> {
    finite_vector(quantity, element, v)?;
    not_absurd(quantity, element, v.abs().max_element())
}

/// A direction that is not zero, of unit length.
pub(crate) fn unit_axis(axis: DVec3) -> DVec3 {
    // One that is of unit length to rounding already stays as it is written.
    if (axis.length_squared() - 1.0).abs() <= 4.0 * f64::EPSILON {
        return axis;
    }
    // An axis may be as short as 1e-200: bring it near 1 before it is squared.
    let scaled = axis / axis.abs().max_element();
    scaled / scaled.length()
}

/// Axes of unit length, quaternions too, and no limits where they state nothing.
pub(crate) fn normalized(mut joint: Joint) -> Joint {
    if let Some(axis) = joint.kind.axis_mut() {
        *axis = unit_axis(*axis);
    }
    let range = joint.limits.as_mut().and_then(|l| l.orientation.as_mut());
    if let Some(BallRange::Cone { axis, .. }) = range {
        *axis = unit_axis(*axis);
    }
    joint.limits = joint.limits.filter(|&l| l != JointLimits::default());
    for placement in [&mut joint.parent_placement, &mut joint.child_placement] {
        placement.rotation = unit_rotation(placement.rotation);
    }
    joint
}

/// A quaternion near unit length, of unit length; one that is so to rounding already stays as it is written.
pub(crate) fn unit_rotation(rotation: DQuat) -> DQuat {
    match (rotation.length_squared() - 1.0).abs() <= 4.0 * f64::EPSILON {
        true => rotation,
        false => rotation.normalize(),
    }
}
