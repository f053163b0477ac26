//! Motors and servos.

use super::Sections;
use super::defaults::Element;
use crate::{FileError, Problem};
use std::collections::BTreeMap;
use vertebra_assembly::BodyId;
use vertebra_assembly::xml::{Node, Reader};

/// A motor or servo on a joint with one freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// The body whose joint it moves.
    pub body: BodyId,
    /// How it turns its control into a force.
    pub drive: Drive,
    /// The joint force is this times the actuator's; the actuator's position and rate are this times
    /// the joint's.
    pub gear: f64,
    /// Bounds of its control, where it has any.
    pub control_range: Option<[f64; 2]>,
    /// Bounds of its force, where it has any [N m or N].
    pub force_range: Option<[f64; 2]>,
}

/// How an actuator turns its control u into a force, at position q and rate qd.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Drive {
    /// u.
    Motor,
    /// stiffness (u - q) - damping qd.
    Position {
        /// [N m/rad or N/m].
        stiffness: f64,
        /// [N m s/rad or N s/m].
        damping: f64,
    },
    /// damping (u - qd).
    Velocity {
        /// [N m s/rad or N s/m].
        damping: f64,
    },
}

/// Reads the actuators on joints; others are listed.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    joints: &BTreeMap<String, BodyId>,
) -> Result<Vec<Actuator>, FileError> {
    let mut actuators = Vec::new();
    for &section in &sections.actuators {
        for (tag, node) in reader.children(section)? {
            let element = sections.defaults.element(reader, node, None)?;
            let gain = |reader: &Reader<'a>, attribute, default: f64| {
                Ok::<_, FileError>(element.number(reader, attribute)?.unwrap_or(default))
            };
            let (drive, own): (_, &[&str]) = match tag {
                "motor" => (Drive::Motor, &[]),
                "position" => {
                    let stiffness = gain(reader, "kp", 1.0)?;
                    let damping = gain(reader, "kv", 0.0)?;
                    (Drive::Position { stiffness, damping }, &["kp", "kv"])
                }
                "velocity" => {
                    let damping = gain(reader, "kv", 1.0)?;
                    (Drive::Velocity { damping }, &["kv"])
                }
                _ => {
                    reader.ignore(node);
                    continue;
                }
            };
            let Some(joint) = element.text(reader, "joint")? else {
                reader.ignore(node);
                continue;
            };
            let Some(&body) = joints.get(joint) else {
                let problem = Problem::UnknownName {
                    what: "joint",
                    name: joint.to_owned(),
                };
                return Err(FileError::new(reader.location(node), problem));
            };
            let common = [
                "name",
                "class",
                "joint",
                "gear",
                "ctrlrange",
                "ctrllimited",
                "forcerange",
                "forcelimited",
            ];
            let known: Vec<&str> = common.into_iter().chain(own.iter().copied()).collect();
            reader.ignore_attributes_but(node, &known);
            let gears = element.list(reader, "gear")?.unwrap_or_default();
            actuators.push(Actuator {
                name: reader.optional_text(node, "name")?.map(str::to_owned),
                body,
                drive,
                gear: gears.first().copied().unwrap_or(1.0),
                control_range: range(reader, sections, element, ["ctrlrange", "ctrllimited"])?,
                force_range: range(reader, sections, element, ["forcerange", "forcelimited"])?,
            });
        }
    }
    Ok(actuators)
}

fn range<'a>(
    reader: &Reader<'a>,
    sections: &Sections<'_, 'a>,
    element: Element<'_, '_, 'a>,
    [range, limited]: [&'static str; 2],
) -> Result<Option<[f64; 2]>, FileError> {
    let stated = element.numbers::<2>(reader, range)?;
    let automatic = sections.compiler.auto_limits && stated.is_some();
    if !element.flag(reader, limited, automatic)? {
        return Ok(None);
    }
    let [lower, upper] = stated.unwrap_or_default();
    if lower >= upper {
        let problem = Problem::OutOfRange {
            quantity: "the upper bound",
            value: upper,
            requirement: "above the lower one",
        };
        let node: Node<'_, '_> = element.source(range);
        return Err(FileError::new(reader.location(node), problem));
    }
    Ok(stated)
}
