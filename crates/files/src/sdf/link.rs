//! Links: mass and shapes.

use super::values::{self, Stated, flag, number, numbers};
use crate::{FileError, Problem, Shape};
use glam::{DMat3, DVec3};
use vertebra_assembly::MassProperties;
use vertebra_assembly::xml::{Node, Reader};
use vertebra_spatial::Pose;

/// Density of shapes where `<inertial auto="true">` states none [kg/m^3].
const WATER: f64 = 1000.0;

/// A link as the file states it.
pub(super) struct Link<'n, 'a> {
    pub(super) node: Node<'n, 'a>,
    pub(super) name: &'n str,
    pub(super) stated: Option<Stated<'n>>,
    pub(super) mass: MassProperties,
    pub(super) shapes: Vec<(Pose, Shape)>,
}

/// Reads a link.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    node: Node<'n, 'a>,
) -> Result<Link<'n, 'a>, FileError> {
    let name = reader.text(node, "name")?;
    reader.ignore_attributes_but(node, &["name"]);
    let (mut pose, mut inertial) = (None, None);
    let (mut collisions, mut visuals) = (Vec::new(), Vec::new());
    for (tag, child) in reader.children(node)? {
        match tag {
            "pose" => reader.once(&mut pose, child)?,
            "inertial" => reader.once(&mut inertial, child)?,
            "collision" => collisions.extend(shape(reader, child, name)?),
            "visual" => visuals.extend(shape(reader, child, name)?),
            _ => reader.ignore_unknown(child, &["pose", "inertial", "collision", "visual"]),
        }
    }
    let mass = mass(reader, inertial, name, &collisions)?;
    Ok(Link {
        node,
        name,
        stated: Some(values::pose(reader, pose)?),
        mass,
        shapes: match collisions.is_empty() {
            true => visuals,
            false => collisions,
        },
    })
}

/// Without `<inertial>`, and for all it leaves out: 1 kg and 1 kg m^2.
fn mass<'a>(
    reader: &mut Reader<'a>,
    node: Option<Node<'_, 'a>>,
    link: &str,
    collisions: &[(Pose, Shape)],
) -> Result<MassProperties, FileError> {
    let unit = MassProperties {
        mass: 1.0,
        center: DVec3::ZERO,
        inertia: DMat3::IDENTITY,
    };
    let Some(node) = node else {
        return Ok(unit);
    };
    let names = ["pose", "mass", "inertia", "density"];
    let [pose, mass, inertia, density] = reader.only(node, names)?;
    let automatic = match reader.optional_text(node, "auto")? {
        Some(text) => flag(reader, node, "auto", text)?,
        None => false,
    };
    if automatic {
        return of_shapes(
            reader,
            node,
            number(reader, density, "density")?,
            collisions,
        );
    }
    let pose = own_pose(reader, pose, link)?;
    let mut properties = MassProperties {
        mass: number(reader, mass, "mass")?.unwrap_or(unit.mass),
        ..unit
    };
    if let Some(inertia) = inertia {
        let names = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];
        let nodes = reader.only(inertia, names)?;
        let mut entries = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        for ((entry, node), name) in entries.iter_mut().zip(nodes).zip(names) {
            *entry = number(reader, node, name)?.unwrap_or(*entry);
        }
        let [xx, yy, zz, xy, xz, yz] = entries;
        properties.inertia = DMat3::from_cols(
            DVec3::new(xx, xy, xz),
            DVec3::new(xy, yy, yz),
            DVec3::new(xz, yz, zz),
        );
    }
    Ok(properties.placed(&pose))
}

/// A pose in the frame of the link itself.
fn own_pose<'a>(
    reader: &mut Reader<'a>,
    node: Option<Node<'_, 'a>>,
    link: &str,
) -> Result<Pose, FileError> {
    let stated = values::pose(reader, node)?;
    match (stated.relative_to, node) {
        (Some(other), Some(node)) if other != link => {
            let problem = Problem::UnknownValue {
                attribute: "relative_to",
                found: other.to_owned(),
                supported: "the frame of the link itself, in which masses and shapes are placed",
            };
            Err(FileError::new(reader.location(node), problem))
        }
        _ => Ok(stated.pose),
    }
}

/// `<inertial auto="true">`: the shapes that collide weigh.
fn of_shapes(
    reader: &Reader<'_>,
    node: Node<'_, '_>,
    density: Option<f64>,
    collisions: &[(Pose, Shape)],
) -> Result<MassProperties, FileError> {
    let refuse = |problem| Err(FileError::new(reader.location(node), problem));
    let density = density.unwrap_or(WATER);
    if density <= 0.0 {
        return refuse(Problem::OutOfRange {
            quantity: "the density [kg/m^3]",
            value: density,
            requirement: "above zero",
        });
    }
    let mut sum: Option<MassProperties> = None;
    for (placement, shape) in collisions {
        let part = match shape.mass_properties(density) {
            Ok(part) => part.placed(placement),
            Err(reason) => return refuse(Problem::Solid(reason)),
        };
        sum = Some(sum.map_or(part, |sum| sum.combined(&part)));
    }
    match sum {
        Some(sum) => Ok(sum),
        None => refuse(Problem::Empty(
            "is to have the mass of its collisions, but no shape of them is read; state its mass and inertia",
        )),
    }
}

/// Reads a `<collision>` or `<visual>`; shapes that are not read are listed.
fn shape<'a>(
    reader: &mut Reader<'a>,
    node: Node<'_, 'a>,
    link: &str,
) -> Result<Option<(Pose, Shape)>, FileError> {
    let [pose, geometry] = reader.only(node, ["pose", "geometry"])?;
    let geometry = reader.needed(node, "geometry", geometry)?;
    let pose = own_pose(reader, pose, link)?;
    for (tag, child) in reader.children(geometry)? {
        let known = match tag {
            "box" => "size",
            "sphere" => "radius",
            "cylinder" | "capsule" => "length",
            "ellipsoid" => "radii",
            _ => {
                reader.ignore(child);
                continue;
            }
        };
        let mut nodes = [known, "radius"]
            .map(|name| child.children().find(|node| node.tag_name().name() == name));
        if known == "radius" {
            nodes[1] = nodes[0];
        }
        let vector = |what: &'static str| {
            let node = reader.needed(child, what, nodes[0])?;
            let values: [f64; 3] = numbers(reader, node, what)?;
            positive(reader, node, values)
        };
        let scalar = |index: usize, what: &'static str| {
            let node = reader.needed(child, what, nodes[index])?;
            let values: [f64; 1] = numbers(reader, node, what)?;
            positive(reader, node, values).map(|[value]| value)
        };
        let shape = match tag {
            "box" => Shape::Box {
                size: vector("size")?.into(),
            },
            "sphere" => Shape::Sphere {
                radius: scalar(1, "radius")?,
            },
            "cylinder" => Shape::Cylinder {
                radius: scalar(1, "radius")?,
                length: scalar(0, "length")?,
            },
            "capsule" => Shape::Capsule {
                radius: scalar(1, "radius")?,
                length: scalar(0, "length")?,
            },
            _ => Shape::Ellipsoid {
                radii: vector("radii")?.into(),
            },
        };
        return Ok(Some((pose, shape)));
    }
    Ok(None)
}

fn positive<const N: usize>(
    reader: &Reader<'_>,
    node: Node<'_, '_>,
    values: [f64; N],
) -> Result<[f64; N], FileError> {
    match values.iter().find(|&&value| value <= 0.0) {
        None => Ok(values),
        Some(&value) => {
            let problem = Problem::OutOfRange {
                quantity: "a size [m]",
                value,
                requirement: "above zero",
            };
            Err(FileError::new(reader.location(node), problem))
        }
    }
}
