//! Values in the text of elements.

use crate::{FileError, Problem};
use glam::{DQuat, DVec3};
use vertebra_assembly::xml::{Node, Reader, XmlProblem, from_roll_pitch_yaw};
use vertebra_spatial::Pose;

/// The text of an element that must have one.
pub(super) fn text<'n, 'a>(
    reader: &Reader<'a>,
    node: Node<'n, 'a>,
    what: &'static str,
) -> Result<&'n str, FileError> {
    let text = node.text().map(str::trim).filter(|text| !text.is_empty());
    text.ok_or_else(|| {
        let problem = Problem::Syntax {
            expected: what,
            found: "nothing".to_owned(),
        };
        FileError::new(reader.location(node), problem)
    })
}

/// A list of numbers.
pub(super) fn numbers<const N: usize>(
    reader: &Reader<'_>,
    node: Node<'_, '_>,
    what: &'static str,
) -> Result<[f64; N], FileError> {
    Ok(reader.numbers(node, what, node.text().unwrap_or_default())?)
}

/// A number in the element, if there is one.
pub(super) fn number(
    reader: &Reader<'_>,
    node: Option<Node<'_, '_>>,
    what: &'static str,
) -> Result<Option<f64>, FileError> {
    let Some(node) = node else {
        return Ok(None);
    };
    let [number] = numbers(reader, node, what)?;
    Ok(Some(number))
}

/// A bound in the element; infinite ones, and the format's word for them, 1e16, are none.
pub(super) fn bound(
    reader: &Reader<'_>,
    node: Option<Node<'_, '_>>,
    what: &'static str,
) -> Result<Option<f64>, FileError> {
    let word = node.and_then(|node| node.text()).map(str::trim);
    if word.is_some_and(|word| {
        word.trim_start_matches(['-', '+'])
            .eq_ignore_ascii_case("inf")
    }) {
        return Ok(None);
    }
    let number = number(reader, node, what)?;
    Ok(number.filter(|number| number.abs() < 1e16))
}

/// `true` or `false`, as 1 or 0 too.
pub(super) fn flag(
    reader: &Reader<'_>,
    node: Node<'_, '_>,
    what: &'static str,
    text: &str,
) -> Result<bool, FileError> {
    match text.trim() {
        "true" | "1" => Ok(true),
        "false" | "0" => Ok(false),
        found => {
            let problem = Problem::UnknownValue {
                attribute: what,
                found: found.to_owned(),
                supported: "`true` or `false`",
            };
            Err(FileError::new(reader.location(node), problem))
        }
    }
}

/// A pose as it is written, and the frame it is relative to.
pub(super) struct Stated<'n> {
    pub(super) pose: Pose,
    pub(super) relative_to: Option<&'n str>,
}

/// Reads a `<pose>`; the identity where there is none.
pub(super) fn pose<'n, 'a>(
    reader: &mut Reader<'a>,
    node: Option<Node<'n, 'a>>,
) -> Result<Stated<'n>, FileError> {
    let Some(node) = node else {
        return Ok(Stated {
            pose: Pose::IDENTITY,
            relative_to: None,
        });
    };
    reader.ignore_attributes_but(node, &["relative_to", "degrees", "rotation_format"]);
    let relative_to = reader
        .optional_text(node, "relative_to")?
        .filter(|name| !name.is_empty());
    let degrees = match reader.optional_text(node, "degrees")? {
        Some(text) => flag(reader, node, "degrees", text)?,
        None => false,
    };
    let list = reader.number_list(node, "pose", node.text().unwrap_or_default())?;
    let format = reader
        .optional_text(node, "rotation_format")?
        .unwrap_or("euler_rpy");
    let (translation, rotation) = match (format, &list[..]) {
        // An empty pose is the identity.
        (_, []) => (DVec3::ZERO, DQuat::IDENTITY),
        ("euler_rpy", &[x, y, z, roll, pitch, yaw]) => {
            let unit = if degrees { 1_f64.to_radians() } else { 1.0 };
            let turns = DVec3::new(roll, pitch, yaw) * unit;
            (DVec3::new(x, y, z), from_roll_pitch_yaw(turns))
        }
        ("quat_xyzw", &[x, y, z, qx, qy, qz, qw]) => {
            let stated = DQuat::from_xyzw(qx, qy, qz, qw);
            (
                DVec3::new(x, y, z),
                reader.unit_quaternion(node, "pose", stated)?,
            )
        }
        ("euler_rpy" | "quat_xyzw", list) => {
            let problem = XmlProblem::WrongCount {
                attribute: "pose",
                expected: if format == "euler_rpy" { 6 } else { 7 },
                found: list.len(),
            };
            return Err(reader.error(node, problem).into());
        }
        (other, _) => {
            let problem = Problem::UnknownValue {
                attribute: "rotation_format",
                found: other.to_owned(),
                supported: "`euler_rpy` or `quat_xyzw`",
            };
            return Err(FileError::new(reader.location(node), problem));
        }
    };
    Ok(Stated {
        pose: Pose::new(rotation, translation),
        relative_to,
    })
}
