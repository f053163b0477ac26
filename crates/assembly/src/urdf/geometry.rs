//! Shapes of links.

use super::{Problem, UrdfError};
use crate::BodyId;
use crate::xml::{Reader, XmlProblem};
use glam::DVec3;
use roxmltree::Node;
use vertebra_spatial::Pose;

/// A shape that a link shows or collides with.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// Name of the link.
    pub link: String,
    /// The body the link belongs to; none for the world.
    pub body: Option<BodyId>,
    /// Where the shape's frame is in that body's frame, or in the world.
    pub placement: Pose,
    /// What it is for.
    pub role: Role,
    /// The shape.
    pub shape: Shape,
}

/// What a shape is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// To be looked at.
    Visual,
    /// To collide.
    Collision,
}

/// A shape in its own frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A box about the origin.
    Box {
        /// Lengths of its edges \[m\].
        size: DVec3,
    },
    /// A cylinder about the origin, along z.
    Cylinder {
        /// Radius \[m\].
        radius: f64,
        /// Length \[m\].
        length: f64,
    },
    /// A ball about the origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// Triangles in a file; [`Robot::mesh_path`](super::Robot::mesh_path) finds it.
    Mesh(Mesh),
}

/// A mesh file, by name: it is looked for only when its path is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Its name as the URDF states it, such as `package://panda/meshes/hand.stl`.
    pub file: String,
    /// Factors on its coordinates, along x, y and z.
    pub scale: DVec3,
    /// Name of the link it belongs to.
    pub link: String,
    /// Line of the URDF on which it stands, from 1.
    pub line: u32,
}

/// A shape as the file states it, in its link's frame.
pub(super) struct Part {
    pub(super) role: Role,
    pub(super) placement: Pose,
    pub(super) shape: Shape,
}

/// Reads a `<visual>` or `<collision>`. One of an unknown shape is passed over.
pub(super) fn read<'a>(
    reader: &mut Reader<'a>,
    node: Node<'_, 'a>,
    role: Role,
) -> Result<Option<Part>, UrdfError> {
    let [origin, geometry] = reader.only(node, ["origin", "geometry"])?;
    let placement = reader.placement(origin)?;
    let geometry = reader.needed(node, "geometry", geometry)?;
    let mut known = None;
    let mut unknown = false;
    for (tag, child) in reader.children(geometry)? {
        match tag {
            "box" | "cylinder" | "sphere" | "mesh" => reader.once(&mut known, child)?,
            _ => {
                unknown = true;
                reader.ignore(child);
            }
        }
    }
    let Some(shape) = known else {
        if unknown {
            return Ok(None);
        }
        let child = "box>, <cylinder>, <sphere> or <mesh";
        return Err(reader
            .error(geometry, XmlProblem::MissingElement { child })
            .into());
    };
    Ok(Some(Part {
        role,
        placement,
        shape: read_shape(reader, shape)?,
    }))
}

fn read_shape<'a>(reader: &Reader<'a>, node: Node<'_, 'a>) -> Result<Shape, UrdfError> {
    let size = |attribute: &'static str, value: f64| {
        if value < 0.0 {
            let problem = Problem::NegativeSize { attribute, value };
            return Err(UrdfError::at(reader.location(node), problem));
        }
        Ok(value)
    };
    let length = |attribute| size(attribute, reader.number(node, attribute)?);
    Ok(match node.tag_name().name() {
        "box" => {
            let edges = reader.optional_vector(node, "size")?;
            let edges = edges.ok_or_else(|| {
                reader.error(node, XmlProblem::MissingAttribute { attribute: "size" })
            })?;
            size("size", edges.min_element())?;
            Shape::Box { size: edges }
        }
        "cylinder" => Shape::Cylinder {
            radius: length("radius")?,
            length: length("length")?,
        },
        "sphere" => Shape::Sphere {
            radius: length("radius")?,
        },
        _ => Shape::Mesh(Mesh {
            file: reader.text(node, "filename")?.trim().to_owned(),
            scale: reader.optional_vector(node, "scale")?.unwrap_or(DVec3::ONE),
            link: link_of(node),
            line: reader.line(node),
        }),
    })
}

fn link_of(node: Node<'_, '_>) -> String {
    node.ancestors()
        .find(|ancestor| ancestor.tag_name().name() == "link")
        .and_then(|link| link.attribute("name"))
        .unwrap_or_default()
        .to_owned()
}
