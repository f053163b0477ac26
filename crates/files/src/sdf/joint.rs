//! Joints: what they connect and how it may move.

use super::frames::MODEL;
use super::values::{self, Stated, bound, flag, number, numbers, text};
use crate::{FileError, Problem};
use glam::DVec3;
use vertebra_assembly::xml::{Node, Reader, XmlProblem};
use vertebra_assembly::{JointLimits, Spring};

/// The types that are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Fixed,
    Revolute,
    Prismatic,
    Ball,
    /// A nut that goes so far a radian [m/rad].
    Screw(f64),
    /// Two hinges, one behind the other.
    TwoHinges,
}

impl Kind {
    /// Its freedoms.
    pub(super) const fn freedoms(self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Revolute | Self::Prismatic | Self::Screw(_) => 1,
            Self::TwoHinges => 2,
            Self::Ball => 3,
        }
    }
}

/// A joint that follows another: q = multiplier (q_other - reference) + offset.
pub(super) struct Mimic<'n, 'a> {
    pub(super) node: Node<'n, 'a>,
    pub(super) joint: &'n str,
    pub(super) multiplier: f64,
    pub(super) offset: f64,
    pub(super) reference: f64,
}

/// An axis of a joint.
pub(super) struct Axis<'n, 'a> {
    pub(super) direction: DVec3,
    pub(super) expressed_in: Option<&'n str>,
    pub(super) limits: Option<JointLimits>,
    pub(super) damping: f64,
    pub(super) friction: f64,
    pub(super) spring: Option<Spring>,
    pub(super) mimic: Option<Mimic<'n, 'a>>,
}

/// A joint as the file states it.
pub(super) struct Joint<'n, 'a> {
    pub(super) node: Node<'n, 'a>,
    pub(super) name: &'n str,
    pub(super) kind: Kind,
    pub(super) parent: &'n str,
    pub(super) child: &'n str,
    pub(super) stated: Option<Stated<'n>>,
    pub(super) axes: [Axis<'n, 'a>; 2],
}

/// Reads a joint.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    node: Node<'n, 'a>,
) -> Result<Joint<'n, 'a>, FileError> {
    let name = reader.text(node, "name")?;
    reader.ignore_attributes_but(node, &["name", "type"]);
    let mut kind = match reader.text(node, "type")? {
        "fixed" => Kind::Fixed,
        "revolute" | "continuous" => Kind::Revolute,
        "prismatic" => Kind::Prismatic,
        "ball" => Kind::Ball,
        "screw" => Kind::Screw(core::f64::consts::TAU.recip()),
        "universal" | "revolute2" => Kind::TwoHinges,
        other => {
            let problem = Problem::UnknownValue {
                attribute: "type",
                found: other.to_owned(),
                supported: "fixed, revolute, continuous, prismatic, ball, screw, universal or revolute2",
            };
            return Err(FileError::new(reader.location(node), problem));
        }
    };
    let names = [
        "pose",
        "parent",
        "child",
        "axis",
        "axis2",
        "screw_thread_pitch",
        "thread_pitch",
    ];
    let [pose, parent, child, axis, axis2, pitch, threads] = reader.only(node, names)?;
    if let Kind::Screw(pitch_of_radian) = &mut kind {
        // Metres a turn; or, as it was first, radians a metre of a left-handed thread.
        if let Some(pitch) = number(reader, pitch, "screw_thread_pitch")? {
            *pitch_of_radian = pitch / core::f64::consts::TAU;
        } else if let Some(threads) = number(reader, threads, "thread_pitch")? {
            *pitch_of_radian = -threads.recip();
        }
        if !pitch_of_radian.is_finite() {
            let problem = Problem::OutOfRange {
                quantity: "`thread_pitch`",
                value: 0.0,
                requirement: "other than zero",
            };
            return Err(FileError::new(reader.location(node), problem));
        }
    } else {
        for node in [pitch, threads].into_iter().flatten() {
            reader.ignore(node);
        }
    }
    let parent = text(
        reader,
        reader.needed(node, "parent", parent)?,
        "the name of a link",
    )?;
    let child = text(
        reader,
        reader.needed(node, "child", child)?,
        "the name of a link",
    )?;
    let wanted = match kind {
        Kind::Fixed | Kind::Ball => [false, false],
        Kind::Revolute | Kind::Prismatic | Kind::Screw(_) => [true, false],
        Kind::TwoHinges => [true, true],
    };
    let mut read_axis = |wanted: bool, node: Option<Node<'n, 'a>>| match (wanted, node) {
        (true, node) => read_axis(reader, node),
        (false, Some(node)) => {
            reader.ignore(node);
            read_axis(reader, None)
        }
        (false, None) => read_axis(reader, None),
    };
    let axes = [read_axis(wanted[0], axis)?, read_axis(wanted[1], axis2)?];
    Ok(Joint {
        node,
        name,
        kind,
        parent,
        child,
        stated: Some(values::pose(reader, pose)?),
        axes,
    })
}

/// The axis an element states; z where it does not.
fn read_axis<'n, 'a>(
    reader: &mut Reader<'a>,
    node: Option<Node<'n, 'a>>,
) -> Result<Axis<'n, 'a>, FileError> {
    let mut axis = Axis {
        direction: DVec3::Z,
        expressed_in: node.is_some_and(super::has_axes_of_models).then_some(MODEL),
        limits: None,
        damping: 0.0,
        friction: 0.0,
        spring: None,
        mimic: None,
    };
    let Some(node) = node else {
        return Ok(axis);
    };
    let names = [
        "xyz",
        "limit",
        "dynamics",
        "mimic",
        "use_parent_model_frame",
    ];
    let [xyz, limit, dynamics, mimic, of_model] = reader.only(node, names)?;
    if let Some(of_model) = of_model
        && !super::has_flags_of_axes(of_model)
    {
        reader.ignore(of_model);
    } else if let Some(of_model) = of_model {
        let stated = text(reader, of_model, "`true` or `false`")?;
        let is_of_model = flag(reader, of_model, "use_parent_model_frame", stated)?;
        axis.expressed_in = is_of_model.then_some(MODEL);
    }
    axis.mimic = mimic.map(|node| read_mimic(reader, node)).transpose()?;
    if let Some(xyz) = xyz {
        reader.ignore_attributes_but(xyz, &["expressed_in"]);
        let direction = DVec3::from_array(numbers(reader, xyz, "xyz")?);
        if direction == DVec3::ZERO {
            let problem = XmlProblem::NoRotation { attribute: "xyz" };
            return Err(reader.error(xyz, problem).into());
        }
        axis.direction = direction;
        let expressed_in = reader.optional_text(xyz, "expressed_in")?;
        let expressed_in = expressed_in.filter(|name| !name.is_empty());
        axis.expressed_in = expressed_in.or(axis.expressed_in);
    }
    if let Some(limit) = limit {
        let names = ["lower", "upper", "effort", "velocity"];
        let [lower, upper, effort, velocity] = reader.only(limit, names)?;
        let range = match (
            bound(reader, lower, "lower")?,
            bound(reader, upper, "upper")?,
        ) {
            (Some(lower), Some(upper)) => Some([lower, upper]),
            (None, None) => None,
            // One-sided: the other bound is beyond all angles and lengths that are met.
            (lower, upper) => Some([lower.unwrap_or(-1e16), upper.unwrap_or(1e16)]),
        };
        // A negative strength states that there is no bound.
        let strength = |bound: Option<f64>| bound.filter(|&bound| bound >= 0.0);
        let limits = JointLimits {
            position: range,
            velocity: strength(bound(reader, velocity, "velocity")?),
            effort: strength(bound(reader, effort, "effort")?),
            ..JointLimits::default()
        };
        let states = range.is_some() || limits.velocity.is_some() || limits.effort.is_some();
        axis.limits = states.then_some(limits);
    }
    if let Some(dynamics) = dynamics {
        let names = [
            "damping",
            "friction",
            "spring_stiffness",
            "spring_reference",
        ];
        let [damping, friction, stiffness, rest] = reader.only(dynamics, names)?;
        let stiffness = number(reader, stiffness, "spring_stiffness")?.unwrap_or(0.0);
        let rest = number(reader, rest, "spring_reference")?.unwrap_or(0.0);
        axis.spring = (stiffness != 0.0).then(|| Spring::at(stiffness, rest));
        axis.damping = number(reader, damping, "damping")?.unwrap_or(0.0);
        axis.friction = number(reader, friction, "friction")?.unwrap_or(0.0);
    }
    Ok(axis)
}

fn read_mimic<'n, 'a>(
    reader: &mut Reader<'a>,
    node: Node<'n, 'a>,
) -> Result<Mimic<'n, 'a>, FileError> {
    let [multiplier, offset, reference] =
        reader.only(node, ["multiplier", "offset", "reference"])?;
    let joint = reader.text(node, "joint")?;
    Ok(Mimic {
        node,
        joint,
        multiplier: number(reader, multiplier, "multiplier")?.unwrap_or(1.0),
        offset: number(reader, offset, "offset")?.unwrap_or(0.0),
        reference: number(reader, reference, "reference")?.unwrap_or(0.0),
    })
}
