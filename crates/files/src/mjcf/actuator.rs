//! Motors and servos.

use super::Sections;
use super::body::Carrier;
use super::defaults::Element;
use super::joint::missing;
use crate::{FileError, Problem};
use std::collections::HashMap;
use vertebra_assembly::xml::{Node, Reader};
use vertebra_assembly::{BodyId, Model};
use vertebra_dynamics::Motor;

/// A motor or servo on a joint with one freedom: its force is
/// `gain` u + `bias[0]` + `bias[1]` l + `bias[2]` dl/dt, with u its control and l = `gear` (q + `reference`) its
/// position. `motor`, `position`, `velocity` and `general` without a state of their own are all of this form.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// The body whose joint it moves.
    pub body: BodyId,
    /// Force a unit of control.
    pub gain: f64,
    /// Its force without control, that a unit of its position, that a unit of its rate; the latter two are
    /// never above zero.
    pub bias: [f64; 3],
    /// The joint force is this times the actuator's; the actuator's position and rate are this times
    /// the joint's.
    pub gear: f64,
    /// What the file calls the joint's position at q = 0 [rad or m].
    pub reference: f64,
    /// Bounds of its control, where it has any.
    pub control_range: Option<[f64; 2]>,
    /// Bound of its force in both directions, where it has any [N m or N].
    pub largest_force: Option<f64>,
}

impl Actuator {
    /// The motor that it is under a control, which is brought into the control's range.
    #[must_use]
    pub fn motor(&self, control: f64) -> Motor {
        let control = match self.control_range {
            // Not `clamp`, which panics where someone has turned the range round.
            Some([lower, _]) if control < lower => lower,
            Some([_, upper]) if control > upper => upper,
            _ => control,
        };
        let gear = self.gear;
        let still = self.gain * control + self.bias[0] + self.bias[1] * gear * self.reference;
        Motor {
            force: gear * still,
            stiffness: -gear * gear * self.bias[1],
            damping: -gear * gear * self.bias[2],
            limit: (self.largest_force).map_or(f64::INFINITY, |force| gear.abs() * force),
            ..Motor::OFF
        }
    }
}

/// Attributes that all kinds have.
const COMMON: [&str; 9] = [
    "name",
    "class",
    "joint",
    "jointinparent",
    "gear",
    "ctrlrange",
    "ctrllimited",
    "forcerange",
    "forcelimited",
];

/// Kinds that are read.
const KINDS: [&str; 4] = ["motor", "position", "velocity", "general"];

/// Gain and bias of a kind, or why it is no motor.
type Law = Result<(f64, [f64; 3]), &'static str>;

/// Reads the actuators that are motors of joints; others are listed, with the reason.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    joints: &HashMap<&'n str, Carrier>,
    model: &Model,
) -> Result<Vec<Actuator>, FileError> {
    let mut actuators: Vec<Actuator> = Vec::new();
    for &section in &sections.actuators {
        for (tag, node) in reader.children(section)? {
            let element = sections.defaults.element(reader, node, None)?;
            let (law, own): (Law, &[&str]) = match tag {
                "motor" => (Ok((1.0, [0.0; 3])), &[]),
                "position" => (position(reader, element)?, &["kp", "kv"]),
                "velocity" => {
                    let damping = element.number(reader, "kv")?.unwrap_or(1.0);
                    (Ok((damping, [0.0, 0.0, -damping])), &["kv"])
                }
                "general" => (
                    general(reader, element)?,
                    &["dyntype", "gaintype", "biastype", "gainprm", "biasprm"],
                ),
                "intvelocity" | "cylinder" | "muscle" => {
                    reader.ignore_because(node, "it has a state of its own");
                    continue;
                }
                "damper" | "adhesion" | "plugin" => {
                    reader.ignore_because(node, "its force is no motor's");
                    continue;
                }
                _ => {
                    reader.ignore_unknown(node, &KINDS);
                    continue;
                }
            };
            let found = match law {
                Ok(law) => actuator(reader, sections, (node, element), law, joints, model)?,
                Err(why) => Err(why),
            };
            let found = found.and_then(|actuator| alone(actuator, &actuators));
            match found {
                Ok(actuator) => {
                    let known = [&COMMON[..], own].concat();
                    reader.ignore_attributes_but(node, &known);
                    actuators.push(actuator);
                }
                Err(why) => reader.ignore_because(node, why),
            }
        }
    }
    Ok(actuators)
}

/// stiffness (u - l) - damping dl/dt.
fn position<'a>(reader: &Reader<'a>, element: Element<'_, '_, 'a>) -> Result<Law, FileError> {
    let number = |attribute| element.number(reader, attribute);
    if number("timeconst")?.is_some_and(|time| time > 0.0) {
        return Ok(Err("its control is filtered, which is a state of its own"));
    }
    if number("dampratio")?.is_some_and(|ratio| ratio > 0.0) {
        return Ok(Err(
            "`dampratio` needs MuJoCo's estimate of inertia; state `kv`",
        ));
    }
    let stiffness = number("kp")?.unwrap_or(1.0);
    let damping = number("kv")?.unwrap_or(0.0);
    Ok(Ok((stiffness, [0.0, -stiffness, -damping])))
}

fn general<'a>(reader: &Reader<'a>, element: Element<'_, '_, 'a>) -> Result<Law, FileError> {
    let kind = |attribute| element.text(reader, attribute);
    if !matches!(kind("dyntype")?, None | Some("none")) {
        return Ok(Err("it has a state of its own (`dyntype`)"));
    }
    if !matches!(kind("gaintype")?, None | Some("fixed")) {
        return Ok(Err("its gain changes (`gaintype`), which no motor's does"));
    }
    let parameters = |attribute| {
        let stated = element.list(reader, attribute)?.unwrap_or_default();
        Ok::<_, FileError>(move |index: usize| stated.get(index).copied())
    };
    let gain = parameters("gainprm")?(0).unwrap_or(1.0);
    match kind("biastype")? {
        None | Some("none") => Ok(Ok((gain, [0.0; 3]))),
        Some("affine") => {
            let bias = parameters("biasprm")?;
            let bias = [0, 1, 2].map(|index| bias(index).unwrap_or(0.0));
            Ok(Ok((gain, bias)))
        }
        Some(_) => Ok(Err("its force without control is not affine (`biastype`)")),
    }
}

/// An actuator of this law, or why it is no motor of a joint.
fn actuator<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    (node, element): (Node<'n, 'a>, Element<'_, 'n, 'a>),
    (gain, bias): (f64, [f64; 3]),
    joints: &HashMap<&'n str, Carrier>,
    model: &Model,
) -> Result<Result<Actuator, &'static str>, FileError> {
    let joint = match element.text(reader, "joint")? {
        Some(joint) => joint,
        None => match element.text(reader, "jointinparent")? {
            Some(joint) => joint,
            None => return Ok(Err("it drives no joint")),
        },
    };
    let carrier = joints.get(joint);
    let found = carrier.and_then(|carrier| Some((carrier, model.find(&carrier.body)?)));
    let Some((carrier, body)) = found else {
        let problem = Problem::unknown("joint", joint, joints.keys().copied());
        return Err(FileError::new(reader.location(node), problem));
    };
    let freedoms = model.body(body).map(|body| body.joint.kind.dof_count());
    if freedoms != Some(1) {
        return Ok(Err("its joint has several freedoms"));
    }
    if bias[1] > 0.0 || bias[2] > 0.0 {
        return Ok(Err(
            "its force grows with position or rate, which no motor's does",
        ));
    }
    let force_range = range(reader, sections, element, ["forcerange", "forcelimited"])?;
    if force_range.is_some_and(|[lower, upper]| lower != -upper) {
        return Ok(Err("`forcerange` is not the same in both directions"));
    }
    let gears = element.list(reader, "gear")?.unwrap_or_default();
    Ok(Ok(Actuator {
        name: reader.optional_text(node, "name")?.map(str::to_owned),
        body,
        gain,
        bias,
        gear: gears.first().copied().unwrap_or(1.0),
        reference: carrier.reference,
        control_range: range(reader, sections, element, ["ctrlrange", "ctrllimited"])?,
        largest_force: force_range.map(|[_, upper]| upper),
    }))
}

/// Several on one joint are one motor where none of them is bounded.
fn alone(actuator: Actuator, others: &[Actuator]) -> Result<Actuator, &'static str> {
    let is_bounded = |actuator: &Actuator| actuator.largest_force.is_some();
    let mut sharing = others.iter().filter(|other| other.body == actuator.body);
    if sharing.any(|other| is_bounded(other) || is_bounded(&actuator)) {
        return Err("its joint has another one, and bounded forces do not add up to one motor");
    }
    Ok(actuator)
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
    let [lower, upper] = stated.ok_or_else(|| missing(reader, element, range))?;
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
