//! Joints: what they connect and how it may move.

use super::{Problem, UrdfError};
use crate::xml::{Reader, XmlProblem};
use crate::{self as assembly, Compound, JointLimits, validate};
use glam::DVec3;
use roxmltree::Node;
use vertebra_spatial::Pose;

/// What stands for no bound where URDF demands one: what SDFormat takes for unbounded, and floats hold.
pub(super) const UNBOUNDED: f64 = 1e16;

/// How a joint moves.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Fixed,
    Free,
    Revolute(DVec3),
    Prismatic(DVec3),
    /// In the plane across a normal.
    Planar(DVec3),
}

impl Kind {
    /// The joint, or several in a row.
    pub(super) fn compound(self) -> Compound {
        match self {
            Self::Fixed => assembly::Joint::fixed().into(),
            Self::Free => assembly::Joint::free().into(),
            Self::Revolute(axis) => assembly::Joint::revolute(axis).into(),
            Self::Prismatic(axis) => assembly::Joint::prismatic(axis).into(),
            Self::Planar(normal) => {
                let normal = validate::unit_axis(normal);
                let x = normal.any_orthonormal_vector();
                assembly::Joint::planar(x, normal.cross(x))
            }
        }
    }
}

/// A joint as the file states it.
pub(super) struct Joint<'n> {
    pub(super) name: &'n str,
    pub(super) line: u32,
    pub(super) kind: Kind,
    pub(super) parent: &'n str,
    pub(super) child: &'n str,
    /// The joint and child frame, seen from the parent link's.
    pub(super) origin: Pose,
    pub(super) limits: Option<JointLimits>,
    pub(super) damping: f64,
    pub(super) friction: f64,
    pub(super) mimic: Option<Mimic<'n>>,
}

/// A joint that follows another.
pub(super) struct Mimic<'n> {
    pub(super) joint: &'n str,
    pub(super) line: u32,
    pub(super) multiplier: f64,
    pub(super) offset: f64,
}

impl<'n> Joint<'n> {
    pub(super) fn read<'a>(reader: &mut Reader<'a>, node: Node<'n, 'a>) -> Result<Self, UrdfError> {
        let name = reader.text(node, "name")?;
        let kind = reader.text(node, "type")?;
        let names = [
            "parent", "child", "origin", "axis", "limit", "dynamics", "mimic",
        ];
        let [parent, child, origin, axis, limit, dynamics, mimic] = reader.only(node, names)?;
        let axis_of = |reader: &Reader<'a>| {
            let stated = axis.map(|axis| reader.optional_vector(axis, "xyz"));
            Ok::<_, UrdfError>(stated.transpose()?.flatten().unwrap_or(DVec3::X))
        };
        let normal_of = |reader: &Reader<'a>| match (axis_of(reader)?, axis) {
            (DVec3::ZERO, Some(node)) => {
                let problem = XmlProblem::NoRotation { attribute: "xyz" };
                Err(UrdfError::from(reader.error(node, problem)))
            }
            (normal, _) => Ok(normal),
        };
        let mut joint = Self {
            name,
            line: reader.line(node),
            kind: match kind {
                "revolute" | "continuous" => Kind::Revolute(axis_of(reader)?),
                "prismatic" => Kind::Prismatic(axis_of(reader)?),
                "planar" => Kind::Planar(normal_of(reader)?),
                "fixed" => Kind::Fixed,
                "floating" => Kind::Free,
                _ => {
                    let kind = kind.to_owned();
                    let problem = Problem::UnsupportedJoint { kind };
                    return Err(UrdfError::at(reader.location(node), problem));
                }
            },
            parent: reader.text(reader.needed(node, "parent", parent)?, "link")?,
            child: reader.text(reader.needed(node, "child", child)?, "link")?,
            origin: reader.placement(origin)?,
            limits: None,
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        };
        // What a joint of one freedom may have says nothing of others.
        if let Kind::Fixed | Kind::Free | Kind::Planar(_) = joint.kind {
            let axis = axis.filter(|_| !matches!(joint.kind, Kind::Planar(_)));
            for node in [axis, limit, dynamics, mimic].into_iter().flatten() {
                reader.ignore(node);
            }
            return Ok(joint);
        }
        if let Some(limit) = limit {
            joint.limits = Some(read_limits(reader, limit, kind == "continuous")?);
        } else if kind != "continuous" {
            let why = "the format asks for one here and there is none, so that the joint moves without bounds";
            reader.note_missing(node, "limit", why);
        }
        if let Some(dynamics) = dynamics {
            let number = |attribute| reader.optional_number(dynamics, attribute);
            joint.damping = number("damping")?.unwrap_or(0.0);
            joint.friction = number("friction")?.unwrap_or(0.0);
        }
        if let Some(mimic) = mimic {
            let followed = reader.text(mimic, "joint")?;
            if followed == name {
                return Err(UrdfError::at(reader.location(mimic), Problem::SelfMimic));
            }
            joint.mimic = Some(Mimic {
                joint: followed,
                line: reader.line(mimic),
                multiplier: reader.optional_number(mimic, "multiplier")?.unwrap_or(1.0),
                offset: reader.optional_number(mimic, "offset")?.unwrap_or(0.0),
            });
        }
        Ok(joint)
    }
}

/// A bound left out is zero where the other one is stated; without both there is no range, nor between two that
/// are [`UNBOUNDED`].
fn read_limits<'a>(
    reader: &Reader<'a>,
    node: Node<'_, 'a>,
    continuous: bool,
) -> Result<JointLimits, UrdfError> {
    let number = |attribute| reader.optional_number(node, attribute);
    let position = match (number("lower")?, number("upper")?) {
        (None, None) => None,
        (lower, upper) => Some([lower.unwrap_or(0.0), upper.unwrap_or(0.0)]),
    };
    let is_bound = |&bound: &f64| bound < UNBOUNDED;
    Ok(JointLimits {
        position: position.filter(|range| !continuous && !is_unbounded(*range)),
        velocity: number("velocity")?.filter(is_bound),
        effort: number("effort")?.filter(is_bound),
        ..JointLimits::default()
    })
}

/// Whether a range stands for none.
pub(super) fn is_unbounded([lower, upper]: [f64; 2]) -> bool {
    lower <= -UNBOUNDED && upper >= UNBOUNDED
}
