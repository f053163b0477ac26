//! Write-back: a model as URDF text.

use super::joint::{UNBOUNDED, is_unbounded};
use crate::xml::{EXTENSION, from_roll_pitch_yaw};
use crate::{Body, BodyId, JointKind, JointLimits, MassProperties, Mimic, Model, Stop};
use core::fmt::{self, Write as _};
use glam::{DQuat, DVec3};
use std::collections::HashMap;
use thiserror::Error;
use vertebra_spatial::Pose;

/// What a model has and URDF cannot state.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A joint of a kind that URDF does not have.
    #[error(
        "URDF has no {kind} joint, which body `{body}` hangs from; replace it by revolute and prismatic ones with massless bodies between"
    )]
    JointKind {
        /// The body whose joint it is.
        body: String,
        /// The kind.
        kind: &'static str,
    },
    /// A joint that is not where the frame of its body is.
    #[error(
        "the joint of body `{body}` is not at the origin of the body's frame, as URDF needs it; describe the body in the frame of its joint"
    )]
    ChildPlacement {
        /// The body.
        body: String,
    },
    /// A property that URDF does not have at a joint of this kind.
    #[error(
        "URDF does not state {property} of a joint of this kind, as body `{body}` has it; remove it"
    )]
    Property {
        /// The body whose joint has it.
        body: String,
        /// The property.
        property: &'static str,
    },
    /// A closed loop.
    #[error(
        "URDF has no closed loops, and the model closes one by `{name}`; open the loop, or save the model as JSON"
    )]
    Loop {
        /// The loop.
        name: String,
    },
    /// A coupling of a joint that follows another already: URDF states one of each joint.
    #[error(
        "URDF couples a joint to one other, and that of body `{body}` follows another one beside the coupling `{name}`; couple one of the others to it instead, or save the model as JSON"
    )]
    Coupling {
        /// The coupling.
        name: String,
        /// The body whose joint follows.
        body: String,
    },
    /// A name that XML cannot hold, or that would be read as a xacro expression.
    #[error(
        "the name `{name}` cannot stand in URDF: it has a control character or `$(` or `${{`; rename it"
    )]
    Name {
        /// The name.
        name: String,
    },
}

/// A model as URDF text.
///
/// [`parse`](super::parse) gives back every body, joint and frame to the last bit, limb by limb. A
/// root link that bears the name of a frame at the world's origin, or else `world`, stands for the
/// world and becomes a frame of it. The joint of a body is called as the body with `_joint` behind.
/// Frames become links without mass on fixed joints; fixed bodies come back as bodies with
/// [`keep_fixed`](super::Options::keep_fixed) (and then frames do, too). A coupling comes back as a mimic
/// of the joint that follows, without its name. URDF does not state gravity: reading it is told by
/// [`gravity`](super::Options::gravity).
///
/// URDF demands of every `<limit>` an effort and a velocity, and of prismatic joints a range: where the model has
/// none they are stated as 1e16, which is read as none here and in SDFormat.
///
/// Rotations are written as roll, pitch and yaw. Where no such angles give the last bit of a
/// quaternion, an attribute of this library's own namespace adds it; other programs pass over it.
///
/// # Errors
/// [`WriteError`], naming the body, loop or coupling and what URDF cannot state.
pub fn write(model: &Model) -> Result<String, WriteError> {
    if let Some(closed) = model.loops().first() {
        return Err(WriteError::Loop {
            name: closed.name.clone(),
        });
    }
    let coupled = coupled(model)?;
    let root = root_name(model);
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    line(
        &mut text,
        format_args!(
            "<robot name={} xmlns:{EXTENSION}=\"{EXTENSION}\">",
            quoted(model.name())?
        ),
    );
    let link_of = |body: Option<BodyId>| {
        body.and_then(|id| model.body(id))
            .map_or(root.as_str(), |body| body.name.as_str())
    };
    line(&mut text, format_args!("  <link name={}/>", quoted(&root)?));
    for body in model.bodies() {
        write_link(&mut text, &body.name, &body.mass)?;
    }
    for frame in model.frames().iter().filter(|frame| frame.name != root) {
        write_link(&mut text, &frame.name, &MassProperties::MASSLESS)?;
    }
    for id in limb_by_limb(model) {
        if let Some(body) = model.body(id) {
            let mimic = coupled.get(&id).or_else(|| {
                let own = body.joint.mimic.as_ref();
                own.filter(|mimic| model.find(&mimic.body).is_some())
            });
            write_joint(&mut text, body, mimic, link_of(body.parent))?;
        }
    }
    for frame in model.frames().iter().filter(|frame| frame.name != root) {
        open_joint(&mut text, &frame.name, "fixed", link_of(frame.body))?;
        write_origin(&mut text, &frame.placement);
        text.push_str("  </joint>\n");
    }
    text.push_str("</robot>\n");
    Ok(text)
}

/// What joints mimic by couplings of the model, by the body that follows.
fn coupled(model: &Model) -> Result<HashMap<BodyId, Mimic>, WriteError> {
    let mut coupled = HashMap::new();
    let bodies = model.bodies();
    for coupling in &model.inner.couplings {
        let body = &bodies[coupling.body.index()];
        let mimic = Mimic {
            body: bodies[coupling.other.index()].name.clone(),
            multiplier: coupling.ratio,
            offset: coupling.offset,
        };
        if body.joint.mimic.is_some() || coupled.insert(coupling.body, mimic).is_some() {
            return Err(WriteError::Coupling {
                name: coupling.name.clone(),
                body: body.name.clone(),
            });
        }
    }
    Ok(coupled)
}

/// What stands for the world: a frame at its origin, or a name that nothing has.
fn root_name(model: &Model) -> String {
    let at_origin =
        |frame: &&crate::Frame| frame.body.is_none() && frame.placement == Pose::IDENTITY;
    if let Some(frame) = model.frames().iter().find(at_origin) {
        return frame.name.clone();
    }
    let mut name = "world".to_owned();
    while model.find(&name).is_some() || model.find_frame(&name).is_some() {
        name.push('_');
    }
    name
}

/// The bodies depth first, siblings in the order of the model: that is how they are read.
fn limb_by_limb(model: &Model) -> Vec<BodyId> {
    let mut children = vec![Vec::new(); model.bodies().len()];
    let mut stack = Vec::new();
    for (id, body) in model.body_ids().zip(model.bodies()).rev() {
        match body.parent {
            Some(parent) => children[parent.index()].push(id),
            None => stack.push(id),
        }
    }
    let mut order = Vec::with_capacity(children.len());
    while let Some(id) = stack.pop() {
        order.push(id);
        stack.append(&mut children[id.index()]);
    }
    order
}

fn write_link(text: &mut String, name: &str, mass: &MassProperties) -> Result<(), WriteError> {
    let name = quoted(name)?;
    if *mass == MassProperties::MASSLESS {
        line(text, format_args!("  <link name={name}/>"));
        return Ok(());
    }
    let (c, m) = (mass.center, &mass.inertia);
    line(text, format_args!("  <link name={name}>"));
    text.push_str("    <inertial>\n");
    line(
        text,
        format_args!("      <origin xyz=\"{}\"/>", Numbers(&c.to_array())),
    );
    line(
        text,
        format_args!("      <mass value=\"{:?}\"/>", mass.mass),
    );
    line(
        text,
        format_args!(
            "      <inertia ixx=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" iyy=\"{:?}\" iyz=\"{:?}\" izz=\"{:?}\"/>",
            m.x_axis.x, m.x_axis.y, m.x_axis.z, m.y_axis.y, m.y_axis.z, m.z_axis.z
        ),
    );
    text.push_str("    </inertial>\n  </link>\n");
    Ok(())
}

fn write_joint(
    text: &mut String,
    body: &Body,
    mimic: Option<&Mimic>,
    parent: &str,
) -> Result<(), WriteError> {
    let joint = &body.joint;
    let named = || body.name.clone();
    if joint.child_placement != Pose::IDENTITY {
        return Err(WriteError::ChildPlacement { body: named() });
    }
    let other = |kind| {
        Err(WriteError::JointKind {
            body: named(),
            kind,
        })
    };
    let foreign = [
        (joint.armature != 0.0, "armature"),
        (joint.spring.is_some(), "a spring"),
        (joint.stop != Stop::HARD, "how a stop gives way"),
        (
            joint.limits.is_some_and(|limits| is_beyond(&limits)),
            "a bound of 1e16 or more",
        ),
    ];
    if let Some(&(_, property)) = foreign.iter().find(|(has, _)| *has) {
        return Err(WriteError::Property {
            body: named(),
            property,
        });
    }
    let has_range = joint.limits.is_some_and(|limits| limits.position.is_some());
    let (kind, axis) = match joint.kind {
        JointKind::Fixed => ("fixed", None),
        JointKind::Free => ("floating", None),
        JointKind::Revolute { axis } if has_range => ("revolute", Some(axis)),
        JointKind::Revolute { axis } => ("continuous", Some(axis)),
        JointKind::Prismatic { axis } => ("prismatic", Some(axis)),
        JointKind::Spherical => return other("spherical"),
        JointKind::Screw { .. } => return other("screw"),
    };
    let with_axis = [
        (joint.limits.is_some(), "limits"),
        (joint.damping != 0.0, "damping"),
        (joint.friction != 0.0, "friction"),
        (joint.mimic.is_some(), "a mimic"),
    ];
    if axis.is_none()
        && let Some(&(_, property)) = with_axis.iter().find(|(has, _)| *has)
    {
        return Err(WriteError::Property {
            body: named(),
            property,
        });
    }
    open_joint(text, &body.name, kind, parent)?;
    write_origin(text, &joint.parent_placement);
    let Some(axis) = axis else {
        text.push_str("  </joint>\n");
        return Ok(());
    };
    line(
        text,
        format_args!("    <axis xyz=\"{}\"/>", Numbers(&axis.to_array())),
    );
    let slides = matches!(joint.kind, JointKind::Prismatic { .. });
    if joint.limits.is_some() || slides {
        let limits = joint.limits.unwrap_or_default();
        text.push_str("    <limit");
        // A bound that is left out counts as zero.
        let range = limits.position;
        if let Some([lower, upper]) = range.or(slides.then_some([-UNBOUNDED, UNBOUNDED])) {
            put(
                text,
                format_args!(" lower=\"{lower:?}\" upper=\"{upper:?}\""),
            );
        }
        let [velocity, effort] = [limits.velocity, limits.effort].map(|b| b.unwrap_or(UNBOUNDED));
        line(
            text,
            format_args!(" velocity=\"{velocity:?}\" effort=\"{effort:?}\"/>"),
        );
    }
    if joint.damping != 0.0 || joint.friction != 0.0 {
        let (damping, friction) = (joint.damping, joint.friction);
        line(
            text,
            format_args!("    <dynamics damping=\"{damping:?}\" friction=\"{friction:?}\"/>"),
        );
    }
    if let Some(mimic) = mimic {
        line(
            text,
            format_args!(
                "    <mimic joint={} multiplier=\"{:?}\" offset=\"{:?}\"/>",
                quoted(&joint_name(&mimic.body))?,
                mimic.multiplier,
                mimic.offset
            ),
        );
    }
    text.push_str("  </joint>\n");
    Ok(())
}

/// Whether a bound is one that would be read back as none.
fn is_beyond(limits: &JointLimits) -> bool {
    let strengths = [limits.velocity, limits.effort];
    limits.position.is_some_and(is_unbounded)
        || strengths.into_iter().flatten().any(|b| b >= UNBOUNDED)
}

fn joint_name(body: &str) -> String {
    format!("{body}_joint")
}

fn open_joint(text: &mut String, child: &str, kind: &str, parent: &str) -> Result<(), WriteError> {
    let name = quoted(&joint_name(child))?;
    line(text, format_args!("  <joint name={name} type=\"{kind}\">"));
    line(text, format_args!("    <parent link={}/>", quoted(parent)?));
    line(text, format_args!("    <child link={}/>", quoted(child)?));
    Ok(())
}

fn write_origin(text: &mut String, placement: &Pose) {
    if *placement == Pose::IDENTITY {
        return;
    }
    let translation = placement.translation.to_array();
    put(
        text,
        format_args!("    <origin xyz=\"{}\"", Numbers(&translation)),
    );
    if placement.rotation != DQuat::IDENTITY {
        let turns = nearest_roll_pitch_yaw(placement.rotation);
        put(
            text,
            format_args!(" rpy=\"{}\"", Numbers(&turns.to_array())),
        );
        if from_roll_pitch_yaw(turns) != placement.rotation {
            let exact = placement.rotation.to_array();
            put(
                text,
                format_args!(" {EXTENSION}:quaternion=\"{}\"", Numbers(&exact)),
            );
        }
    }
    text.push_str("/>\n");
}

/// Angles of Rz(yaw) Ry(pitch) Rx(roll).
fn nearest_roll_pitch_yaw(rotation: DQuat) -> DVec3 {
    let DQuat { x, y, z, w } = rotation;
    let sine = 2.0 * (w * y - x * z);
    let cosine = f64::hypot(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z));
    let pitch = libm::atan2(sine, cosine);
    let turns = if cosine > 1e-8 {
        DVec3::new(
            libm::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            pitch,
            libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        )
    } else {
        // Yaw is taken as zero: the whole turn about the vertical is roll.
        DVec3::new(2.0 * libm::atan2(x, w), pitch, 0.0)
    };
    // The nearest of few digits, where a person wrote them.
    let rounded = turns.map(|turn| (turn * 1e6).round() / 1e6);
    if from_roll_pitch_yaw(rounded) == rotation {
        return rounded;
    }
    turns
}

/// A name as the value of an attribute.
fn quoted(name: &str) -> Result<String, WriteError> {
    let cannot = |c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    if name.contains(cannot) || name.contains("${") || name.contains("$(") {
        return Err(WriteError::Name {
            name: name.to_owned(),
        });
    }
    let mut text = String::with_capacity(name.len() + 2);
    text.push('"');
    for c in name.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '"' => text.push_str("&quot;"),
            _ => text.push(c),
        }
    }
    text.push('"');
    Ok(text)
}

/// Numbers with blanks between, each in the fewest digits that give its last bit.
struct Numbers<'a>(&'a [f64]);

impl fmt::Display for Numbers<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, number) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_char(' ')?;
            }
            write!(f, "{number:?}")?;
        }
        Ok(())
    }
}

fn line(text: &mut String, arguments: fmt::Arguments<'_>) {
    put(text, arguments);
    text.push('\n');
}

fn put(text: &mut String, arguments: fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = text.write_fmt(arguments);
}
