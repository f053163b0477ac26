//! Joints of a body.

use super::Sections;
use super::content::Placed;
use super::defaults::Element;
use crate::{FileError, Problem};
use core::f64::consts::PI;
use glam::{DQuat, DVec3};
use vertebra_assembly::xml::{Reader, XmlProblem};
use vertebra_assembly::{BallRange, Joint, JointKind, Spring};
use vertebra_spatial::Pose;

/// A joint as the file states it.
pub(super) struct Read<'n> {
    pub(super) name: Option<&'n str>,
    /// Where it turns, in the body's frame at the pose of the file \[m\].
    pub(super) anchor: DVec3,
    /// What the file calls its position at q = 0 [rad or m].
    pub(super) reference: f64,
    /// The joint without its placements.
    pub(super) joint: Joint,
}

/// Reads a `<joint>` or `<freejoint>`.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    placed: &Placed<'n, 'a>,
) -> Result<Read<'n>, FileError> {
    let node = placed.node;
    let name = reader.optional_text(node, "name")?;
    if node.tag_name().name() == "freejoint" {
        reader.ignore_attributes_but(node, &["name"]);
        return Ok(Read {
            name,
            anchor: DVec3::ZERO,
            reference: 0.0,
            joint: Joint::free(),
        });
    }
    let known = [
        "name",
        "class",
        "type",
        "pos",
        "axis",
        "range",
        "limited",
        "damping",
        "frictionloss",
        "armature",
        "stiffness",
        "springref",
        "ref",
        "actuatorfrcrange",
        "actuatorfrclimited",
    ];
    reader.ignore_attributes_but(node, &known);
    let element = sections.defaults.element(reader, node, placed.class)?;
    let axis = element.vector(reader, "axis")?.unwrap_or(DVec3::Z);
    let axis = placed.offset.rotation * axis;
    let (kind, unit) = match element.text(reader, "type")? {
        None | Some("hinge") => (JointKind::Revolute { axis }, sections.compiler.angle),
        Some("slide") => (JointKind::Prismatic { axis }, 1.0),
        Some("ball") => (JointKind::Spherical, sections.compiler.angle),
        Some("free") => (JointKind::Free, 1.0),
        Some(other) => {
            let problem = Problem::UnknownValue {
                attribute: "type",
                found: other.to_owned(),
                supported: "hinge, slide, ball or free",
            };
            return Err(FileError::new(reader.location(node), problem));
        }
    };
    if axis == DVec3::ZERO
        && matches!(
            kind,
            JointKind::Revolute { .. } | JointKind::Prismatic { .. }
        )
    {
        let problem = XmlProblem::NoRotation { attribute: "axis" };
        return Err(reader.error(element.source("axis"), problem).into());
    }
    let mut joint = Joint::new(kind);
    if kind == JointKind::Free {
        return Ok(Read {
            name,
            anchor: DVec3::ZERO,
            reference: 0.0,
            joint,
        });
    }
    joint.damping = element.number(reader, "damping")?.unwrap_or(0.0);
    joint.friction = element.number(reader, "frictionloss")?.unwrap_or(0.0);
    joint.armature = element.number(reader, "armature")?.unwrap_or(0.0);
    let reference = element.number(reader, "ref")?.unwrap_or(0.0);
    let stiffness = element.number(reader, "stiffness")?.unwrap_or(0.0);
    if stiffness != 0.0 {
        let rest = element.number(reader, "springref")?.unwrap_or(0.0);
        joint.spring = Some(match kind {
            JointKind::Spherical => Spring::turned(stiffness, DQuat::IDENTITY),
            _ => Spring::at(stiffness, (rest - reference) * unit),
        });
    }
    let range = element.numbers::<2>(reader, "range")?;
    let automatic = sections.compiler.auto_limits && range.is_some();
    if element.flag(reader, "limited", automatic)? {
        let range = range.ok_or_else(|| missing(reader, element, "range"))?;
        match kind {
            // From any axis, and by pi at most all of them.
            JointKind::Spherical if range[1] * unit >= PI => {}
            JointKind::Spherical => {
                joint = joint.with_ball_range(BallRange::turn(range[1] * unit));
            }
            _ => {
                let [lower, upper] = range.map(|bound| (bound - reference) * unit);
                joint = joint.with_range(lower, upper);
            }
        }
    }
    read_effort(reader, sections, element, &mut joint)?;
    let position = element.vector(reader, "pos")?.unwrap_or_default();
    Ok(Read {
        name,
        anchor: placed.offset.transform_point(position),
        reference: reference * unit,
        joint,
    })
}

/// An element that is limited, and does not say how.
pub(super) fn missing(
    reader: &Reader<'_>,
    element: Element<'_, '_, '_>,
    attribute: &'static str,
) -> FileError {
    let problem = XmlProblem::MissingAttribute { attribute };
    reader.error(element.node, problem).into()
}

/// The bounds of what all its motors exert together, if they are one number.
fn read_effort<'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'_, 'a>,
    element: Element<'_, '_, 'a>,
    joint: &mut Joint,
) -> Result<(), FileError> {
    let range = element.numbers::<2>(reader, "actuatorfrcrange")?;
    let automatic = sections.compiler.auto_limits && range.is_some();
    if !element.flag(reader, "actuatorfrclimited", automatic)? {
        return Ok(());
    }
    let [lower, upper] = range.ok_or_else(|| missing(reader, element, "actuatorfrcrange"))?;
    if lower == -upper && upper >= 0.0 && joint.kind.dof_count() == 1 {
        joint.limits.get_or_insert_default().effort = Some(upper);
    } else {
        let why = "an effort is one number, for both directions of a joint of one freedom";
        let node = element.source("actuatorfrcrange");
        reader.ignore_attribute_because(node, "actuatorfrcrange", why);
    }
    Ok(())
}

/// The joint placed for a body that stands at `pose` in its parent at q = 0.
pub(super) fn placed(read: &Read<'_>, pose: Pose) -> Joint {
    let anchor = Pose::from_translation(read.anchor);
    read.joint.clone().at(pose * anchor).on_child(anchor)
}
