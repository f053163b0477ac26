//! The `compiler` element: how angles and orientations are stated.

use super::defaults::Element;
use crate::{FileError, Problem};
use glam::{DMat3, DQuat, DVec3};
use vertebra_assembly::xml::{Node, Reader, XmlProblem};
use vertebra_spatial::Pose;

/// Attributes that state an orientation; an element has one of them at most.
const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];

/// Which inertia a body has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FromGeoms {
    Never,
    Always,
    WhereNotStated,
}

/// How the file states things.
#[derive(Clone, Debug)]
pub(super) struct Compiler {
    /// Radians an angle unit.
    pub(super) angle: f64,
    /// Axes of `euler`, first turn first; lower case turns with the body, upper case does not.
    euler: [char; 3],
    pub(super) auto_limits: bool,
    pub(super) from_geoms: FromGeoms,
    /// Groups of geoms that weigh.
    pub(super) groups: [f64; 2],
}

impl Compiler {
    pub(super) fn read<'a>(
        reader: &mut Reader<'a>,
        nodes: &[Node<'_, 'a>],
    ) -> Result<Self, FileError> {
        let mut compiler = Self {
            angle: 1_f64.to_radians(),
            euler: ['x', 'y', 'z'],
            auto_limits: true,
            from_geoms: FromGeoms::WhereNotStated,
            groups: [0.0, 5.0],
        };
        for &node in nodes {
            compiler.apply(reader, node)?;
        }
        Ok(compiler)
    }

    fn apply<'a>(&mut self, reader: &mut Reader<'a>, node: Node<'_, 'a>) -> Result<(), FileError> {
        let known = [
            "angle",
            "eulerseq",
            "autolimits",
            "inertiafromgeom",
            "inertiagrouprange",
            "coordinate",
            // Where meshes and textures are, which is for the caller to know.
            "meshdir",
            "texturedir",
            "assetdir",
        ];
        reader.ignore_attributes_but(node, &known);
        let refuse = |reader: &Reader<'a>, attribute, found: &str, supported| {
            let problem = Problem::UnknownValue {
                attribute,
                found: found.to_owned(),
                supported,
            };
            Err(FileError::new(reader.location(node), problem))
        };
        match reader.optional_text(node, "angle")? {
            Some("radian") => self.angle = 1.0,
            Some("degree") => self.angle = 1_f64.to_radians(),
            Some(other) => return refuse(reader, "angle", other, "`degree` or `radian`"),
            None => {}
        }
        if let Some(text) = reader.optional_text(node, "eulerseq")? {
            let axes: Vec<char> = text.chars().collect();
            match <[char; 3]>::try_from(axes) {
                Ok(axes) if axes.iter().all(|axis| "xyzXYZ".contains(*axis)) => self.euler = axes,
                _ => return refuse(reader, "eulerseq", text, "three of x, y, z, X, Y, Z"),
            }
        }
        if let Some(flag) = boolean(reader, node, "autolimits")? {
            self.auto_limits = flag;
        }
        match reader.optional_text(node, "inertiafromgeom")? {
            Some("false") => self.from_geoms = FromGeoms::Never,
            Some("true") => self.from_geoms = FromGeoms::Always,
            Some("auto") => self.from_geoms = FromGeoms::WhereNotStated,
            Some(other) => {
                return refuse(
                    reader,
                    "inertiafromgeom",
                    other,
                    "`true`, `false` or `auto`",
                );
            }
            None => {}
        }
        if let Some(range) = reader.optional_numbers(node, "inertiagrouprange")? {
            self.groups = range;
        }
        match reader.optional_text(node, "coordinate")? {
            Some("local") | None => Ok(()),
            Some(other) => refuse(reader, "coordinate", other, "`local`, which MuJoCo saves"),
        }
    }

    /// Where an element is in the frame it is stated in: its `pos` and whichever orientation it has.
    pub(super) fn placement<'a>(
        &self,
        reader: &Reader<'a>,
        element: Element<'_, '_, 'a>,
    ) -> Result<Pose, FileError> {
        let translation = element.vector(reader, "pos")?.unwrap_or_default();
        Ok(Pose::new(self.rotation(reader, element)?, translation))
    }

    /// An orientation of the element itself goes before one of its defaults.
    fn rotation<'a>(
        &self,
        reader: &Reader<'a>,
        element: Element<'_, '_, 'a>,
    ) -> Result<DQuat, FileError> {
        let own = |attribute: &&&str| element.node.has_attribute(**attribute);
        let stated = ORIENTATIONS.iter().filter(own).count();
        if stated > 1 {
            let problem = Problem::Contradiction {
                first: "one orientation",
                second: "another",
            };
            return Err(FileError::new(reader.location(element.node), problem));
        }
        let any = |attribute: &&&str| element.has(attribute);
        let Some(&attribute) = ORIENTATIONS
            .iter()
            .find(own)
            .or_else(|| ORIENTATIONS.iter().find(any))
        else {
            return Ok(DQuat::IDENTITY);
        };
        let node = element.source(attribute);
        let direction = |v: DVec3| unit(reader, node, attribute, v);
        Ok(match attribute {
            "quat" => {
                let [w, x, y, z] = element.numbers(reader, attribute)?.unwrap_or_default();
                reader.unit_quaternion(node, attribute, DQuat::from_xyzw(x, y, z, w))?
            }
            "axisangle" => {
                let [x, y, z, turn] = element.numbers(reader, attribute)?.unwrap_or_default();
                turned(direction(DVec3::new(x, y, z))?, turn * self.angle)
            }
            "xyaxes" => {
                let [a, b, c, d, e, f] = element.numbers(reader, attribute)?.unwrap_or_default();
                let x = direction(DVec3::new(a, b, c))?;
                let y = DVec3::new(d, e, f);
                let y = direction(y - x * x.dot(y))?;
                DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize()
            }
            "zaxis" => {
                let z = direction(element.vector(reader, attribute)?.unwrap_or_default())?;
                DQuat::from_rotation_arc(DVec3::Z, z)
            }
            _ => {
                let turns: [f64; 3] = element.numbers(reader, attribute)?.unwrap_or_default();
                let mut rotation = DQuat::IDENTITY;
                for (axis, turn) in self.euler.into_iter().zip(turns) {
                    let next = turned(axis_of(axis), turn * self.angle);
                    // What turns with the body is applied behind what was before.
                    rotation = match axis.is_lowercase() {
                        true => rotation * next,
                        false => next * rotation,
                    };
                }
                rotation.normalize()
            }
        })
    }
}

/// The known attributes that place an element, and these.
pub(super) fn placed<const N: usize>(others: [&'static str; N]) -> Vec<&'static str> {
    let placing = ["name", "class", "pos"];
    placing
        .into_iter()
        .chain(ORIENTATIONS)
        .chain(others)
        .collect()
}

/// `true` or `false`, if the attribute is there.
pub(super) fn boolean<'a>(
    reader: &Reader<'a>,
    node: Node<'_, 'a>,
    attribute: &'static str,
) -> Result<Option<bool>, FileError> {
    match reader.optional_text(node, attribute)? {
        None => Ok(None),
        Some("true") => Ok(Some(true)),
        Some("false") => Ok(Some(false)),
        Some(other) => {
            let problem = Problem::UnknownValue {
                attribute,
                found: other.to_owned(),
                supported: "`true` or `false`",
            };
            Err(FileError::new(reader.location(node), problem))
        }
    }
}

/// A vector made a direction.
pub(super) fn unit<'a>(
    reader: &Reader<'a>,
    node: Node<'_, 'a>,
    attribute: &'static str,
    v: DVec3,
) -> Result<DVec3, FileError> {
    let length = v.length();
    if (1e-100..=1e100).contains(&length) {
        return Ok(v / length);
    }
    Err(reader
        .error(node, XmlProblem::NoRotation { attribute })
        .into())
}

/// `libm` makes the model the same, bit for bit, on every machine.
pub(super) fn turned(axis: DVec3, angle: f64) -> DQuat {
    let v = axis * libm::sin(0.5 * angle);
    DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle)).normalize()
}

fn axis_of(letter: char) -> DVec3 {
    match letter.to_ascii_lowercase() {
        'x' => DVec3::X,
        'y' => DVec3::Y,
        _ => DVec3::Z,
    }
}
