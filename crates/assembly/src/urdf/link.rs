//! Links: mass and geometry.

use super::geometry::{self, Part};
use super::{Problem, Role, UrdfError};
use crate::xml::Reader;
use crate::{InertiaViolation, MassProperties, validate};
use glam::{DMat3, DVec3};
use roxmltree::Node;

/// A link as the file states it.
pub(super) struct Link<'n> {
    pub(super) name: &'n str,
    pub(super) line: u32,
    pub(super) mass: MassProperties,
    /// What makes the mass impossible. That of the body it becomes part of is what counts.
    pub(super) violation: Option<InertiaViolation>,
    pub(super) parts: Vec<Part>,
}

impl<'n> Link<'n> {
    pub(super) fn read<'a>(reader: &mut Reader<'a>, node: Node<'n, 'a>) -> Result<Self, UrdfError> {
        let name = reader.text(node, "name")?;
        let mut inertial = None;
        let mut parts = Vec::new();
        for (tag, child) in reader.children(node)? {
            match tag {
                "inertial" => reader.once(&mut inertial, child)?,
                "visual" => parts.extend(geometry::read(reader, child, Role::Visual)?),
                "collision" => parts.extend(geometry::read(reader, child, Role::Collision)?),
                _ => reader.ignore_unknown(child, &["inertial", "visual", "collision"]),
            }
        }
        let mass = match inertial {
            Some(inertial) => read_inertial(reader, inertial, name)?,
            None => MassProperties::MASSLESS,
        };
        Ok(Self {
            name,
            line: reader.line(node),
            mass,
            violation: mass.violation(),
            parts,
        })
    }
}

fn read_inertial<'a>(
    reader: &mut Reader<'a>,
    node: Node<'_, 'a>,
    link: &str,
) -> Result<MassProperties, UrdfError> {
    let [origin, mass, inertia] = reader.only(node, ["origin", "mass", "inertia"])?;
    let origin = reader.placement(origin)?;
    let mass = reader.number(reader.needed(node, "mass", mass)?, "value")?;
    let inertia = reader.needed(node, "inertia", inertia)?;
    let entry = |attribute| reader.number(inertia, attribute);
    let (ixx, ixy, ixz) = (entry("ixx")?, entry("ixy")?, entry("ixz")?);
    let (iyy, iyz, izz) = (entry("iyy")?, entry("iyz")?, entry("izz")?);
    let properties = MassProperties {
        mass,
        center: DVec3::ZERO,
        inertia: DMat3::from_cols(
            DVec3::new(ixx, ixy, ixz),
            DVec3::new(ixy, iyy, iyz),
            DVec3::new(ixz, iyz, izz),
        ),
    }
    .placed(&origin);
    // Checked here, before folding can hide what is wrong.
    validate::first(|problems| validate::check_mass_numbers(link, &properties, problems))
        .map_err(|error| UrdfError::at(reader.location(node), Problem::Model(error)))?;
    Ok(properties)
}
