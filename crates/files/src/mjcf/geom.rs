//! Geoms: shapes and what they weigh.

use super::compiler::placed;
use super::content::Placed;
use super::defaults::Element;
use super::mesh::Mesh;
use super::{Sections, compiler};
use crate::{FileError, Problem, Shape};
use glam::{DQuat, DVec3};
use std::collections::HashMap;
use vertebra_assembly::MassProperties;
use vertebra_assembly::xml::{Reader, XmlProblem};
use vertebra_spatial::Pose;

/// Density where nothing is stated [kg/m^3]: that of water.
const WATER: f64 = 1000.0;

/// A geom in its body's frame.
pub(super) struct Geom {
    /// None for planes, height fields and meshes whose triangles are elsewhere.
    pub(super) shape: Option<Shape>,
    pub(super) placement: Pose,
    /// Its mass in the body's frame, or why there is none.
    pub(super) mass: Result<MassProperties, Problem>,
}

/// Reads a geom.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    meshes: &HashMap<&'n str, Mesh>,
    geom: &Placed<'n, 'a>,
) -> Result<Geom, FileError> {
    let known = placed(["type", "size", "fromto", "mass", "density", "mesh", "group"]);
    reader.ignore_attributes_but(geom.node, &known);
    let element = sections.defaults.element(reader, geom.node, geom.class)?;
    let (shape, own) = shape(reader, sections, meshes, element)?;
    let placement = geom.offset * own;
    let mass = mass(reader, sections, element, shape.as_ref())?;
    Ok(Geom {
        mass: mass.map(|mass| mass.placed(&placement)),
        placement,
        shape,
    })
}

/// The shape and where the geom states it.
fn shape<'n, 'a>(
    reader: &Reader<'a>,
    sections: &Sections<'n, 'a>,
    meshes: &HashMap<&'n str, Mesh>,
    element: Element<'_, 'n, 'a>,
) -> Result<(Option<Shape>, Pose), FileError> {
    let mut placement = sections.compiler.placement(reader, element)?;
    let kind = element.text(reader, "type")?;
    let is_mesh = element.node.has_attribute("mesh") && kind.is_none();
    let kind = if is_mesh {
        "mesh"
    } else {
        kind.unwrap_or("sphere")
    };
    let span = match element.numbers::<6>(reader, "fromto")? {
        Some(ends) if matches!(kind, "capsule" | "cylinder" | "box" | "ellipsoid") => {
            let [a, b, c, d, e, f] = ends;
            let (from, to) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
            let axis = compiler::unit(reader, element.source("fromto"), "fromto", to - from)?;
            // MuJoCo's z axis points from the second end to the first.
            placement = Pose::new(DQuat::from_rotation_arc(DVec3::Z, -axis), (from + to) * 0.5);
            Some((to - from).length())
        }
        _ => None,
    };
    let sizes = element.list(reader, "size")?.unwrap_or_default();
    let size = |index: usize| match sizes.get(index) {
        Some(&size) if size > 0.0 => Ok(size),
        Some(&value) => {
            let problem = Problem::OutOfRange {
                quantity: "a size [m]",
                value,
                requirement: "above zero",
            };
            Err(FileError::new(
                reader.location(element.source("size")),
                problem,
            ))
        }
        None => {
            let problem = XmlProblem::WrongCount {
                attribute: "size",
                expected: index + 1,
                found: sizes.len(),
            };
            Err(FileError::from(
                reader.error(element.source("size"), problem),
            ))
        }
    };
    let length = || span.map_or_else(|| Ok(2.0 * size(1)?), Ok::<_, FileError>);
    // Half the lengths of a box or ellipsoid; one between two ends is as wide as thick.
    let halves = || match span {
        None => Ok(DVec3::new(size(0)?, size(1)?, size(2)?)),
        Some(length) => {
            let across = size(0)?;
            Ok::<_, FileError>(DVec3::new(across, across, 0.5 * length))
        }
    };
    let shape = match kind {
        "sphere" => Shape::Sphere { radius: size(0)? },
        "capsule" => Shape::Capsule {
            radius: size(0)?,
            length: length()?,
        },
        "cylinder" => Shape::Cylinder {
            radius: size(0)?,
            length: length()?,
        },
        "box" => Shape::Box {
            size: halves()? * 2.0,
        },
        "ellipsoid" => Shape::Ellipsoid { radii: halves()? },
        "plane" | "hfield" => return Ok((None, placement)),
        "mesh" => {
            let node = element.source("mesh");
            let name = reader.text(node, "mesh")?;
            let Some(mesh) = meshes.get(name) else {
                let problem = Problem::unknown("mesh", name, meshes.keys().copied());
                return Err(FileError::new(reader.location(node), problem));
            };
            let triangles = mesh.triangles.clone();
            return Ok((triangles.map(Shape::Mesh), placement));
        }
        other => {
            let problem = Problem::UnknownValue {
                attribute: "type",
                found: other.to_owned(),
                supported: "plane, hfield, sphere, capsule, ellipsoid, cylinder, box or mesh",
            };
            return Err(FileError::new(
                reader.location(element.source("type")),
                problem,
            ));
        }
    };
    Ok((Some(shape), placement))
}

/// The mass a geom states, or that of its volume. Why a mesh has none matters only to a body that
/// does not state its inertia.
fn mass<'a>(
    reader: &Reader<'a>,
    sections: &Sections<'_, 'a>,
    element: Element<'_, '_, 'a>,
    shape: Option<&Shape>,
) -> Result<Result<MassProperties, Problem>, FileError> {
    let stated = element.number(reader, "mass")?;
    let density = element.number(reader, "density")?.unwrap_or(WATER);
    for (quantity, value) in [
        ("the mass [kg]", stated.unwrap_or(0.0)),
        ("the density [kg/m^3]", density),
    ] {
        if value < 0.0 {
            let problem = Problem::OutOfRange {
                quantity,
                value,
                requirement: "zero or above",
            };
            return Err(FileError::new(reader.location(element.node), problem));
        }
    }
    let group = element.number(reader, "group")?.unwrap_or(0.0);
    let [first, last] = sections.compiler.groups;
    let weighs = group >= first && group <= last && stated != Some(0.0);
    let Some(shape) = shape else {
        let has_volume = element.text(reader, "type")? == Some("mesh") || element.has("mesh");
        let mesh = element.text(reader, "mesh")?.unwrap_or_default().to_owned();
        return Ok(
            match weighs && has_volume && (stated.is_some() || density > 0.0) {
                true => Err(Problem::MeshMass { mesh }),
                false => Ok(MassProperties::MASSLESS),
            },
        );
    };
    if !weighs {
        return Ok(Ok(MassProperties::MASSLESS));
    }
    Ok(match stated {
        None if density == 0.0 => Ok(MassProperties::MASSLESS),
        None => shape.mass_properties(density).map_err(Problem::Solid),
        Some(stated) => shape
            .mass_properties(1.0)
            .map_err(Problem::Solid)
            .map(|unit| MassProperties {
                mass: stated,
                inertia: unit.inertia * (stated / unit.mass),
                ..unit
            }),
    })
}
