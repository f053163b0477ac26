//! Solids of uniform density.

use super::mesh;
use crate::MassProperties;
use glam::{DMat3, DVec3};
use thiserror::Error;
use vertebra_spatial::Pose;

/// A solid of uniform density, of which a body may be made.
///
/// ```
/// use glam::DVec3;
/// use vertebra_assembly::BodyShape;
///
/// let bar = BodyShape::capsule(0.02, 0.3).of_mass(1.2);
/// let brick = BodyShape::cuboid(DVec3::new(0.2, 0.1, 0.05)).of_density(1900.0);
/// assert!((bar.mass_properties()?.mass - 1.2).abs() < 1e-15);
/// assert!((brick.mass_properties()?.mass - 1.9).abs() < 1e-12);
/// # Ok::<(), vertebra_assembly::SolidError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BodyShape {
    /// Of density 1, or why there is no such solid.
    unit: Result<MassProperties, SolidError>,
    amount: Amount,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Amount {
    Density(f64),
    Mass(f64),
}

/// Why a solid has no mass properties.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SolidError {
    /// A length, density or mass that is not positive.
    #[error("the {what} of the {shape} is {value}; give a number above zero")]
    NotPositive {
        /// Kind of solid.
        shape: &'static str,
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A triangle that names a vertex which is not there.
    #[error(
        "triangle {triangle} of the mesh names vertex {vertex}, but there are {count}; correct it"
    )]
    UnknownVertex {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the vertex.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A vertex that is no place.
    #[error("vertex {vertex} of the mesh is not finite; give numbers")]
    NonFiniteVertex {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A mesh with a boundary, or whose triangles face different ways.
    #[error(
        "the mesh is not closed: the side of triangle {triangle} from vertex {from} to vertex {to} has no triangle on its other side that runs it backwards; close the hole, or orient all triangles alike"
    )]
    OpenMesh {
        /// Index of a triangle with such a side.
        triangle: usize,
        /// Vertex the side starts from.
        from: u32,
        /// Vertex it ends at.
        to: u32,
    },
    /// A mesh that encloses nothing.
    #[error("the mesh encloses no volume; give a solid one")]
    NoVolume,
}

impl BodyShape {
    fn new(
        shape: &'static str,
        sizes: &[(&'static str, f64)],
        unit: impl FnOnce() -> MassProperties,
    ) -> Self {
        let bad = sizes
            .iter()
            .find(|(_, size)| !(size.is_finite() && *size > 0.0));
        Self {
            unit: match bad {
                Some(&(what, value)) => Err(SolidError::NotPositive { shape, what, value }),
                None => Ok(unit()),
            },
            amount: Amount::Density(1000.0),
        }
    }

    /// A ball about the frame's origin \[m\]. This and all others have the density of water until they are
    /// given another, or a mass.
    #[must_use]
    pub fn sphere(radius: f64) -> Self {
        let volume = 4.0 / 3.0 * core::f64::consts::PI * radius * radius * radius;
        Self::new("sphere", &[("radius", radius)], || {
            MassProperties::sphere(volume, radius)
        })
    }

    /// A box with edges of `size` \[m\] about the frame's origin.
    #[must_use]
    pub fn cuboid(size: DVec3) -> Self {
        let sizes = [("width", size.x), ("depth", size.y), ("height", size.z)];
        let volume = size.x * size.y * size.z;
        Self::new("box", &sizes, || MassProperties::cuboid(volume, size))
    }

    /// A cylinder along z about the frame's origin \[m\].
    #[must_use]
    pub fn cylinder(radius: f64, length: f64) -> Self {
        let volume = core::f64::consts::PI * radius * radius * length;
        Self::new(
            "cylinder",
            &[("radius", radius), ("length", length)],
            || {
                let rod = MassProperties::rod(volume, length, radius);
                MassProperties {
                    center: DVec3::ZERO,
                    ..rod
                }
            },
        )
    }

    /// A cylinder along z of `length` between the centres of two half balls of `radius`, about the frame's
    /// origin \[m\].
    #[must_use]
    pub fn capsule(radius: f64, length: f64) -> Self {
        Self::new("capsule", &[("radius", radius), ("length", length)], || {
            let (r, l) = (radius, length);
            let barrel = core::f64::consts::PI * r * r * l;
            let ball = 4.0 / 3.0 * core::f64::consts::PI * r * r * r;
            // A half ball about its flat side has half of the ball's moments; its centre is 3/8 r off.
            let along = 0.5 * barrel * r * r + 0.4 * ball * r * r;
            let across = barrel * (3.0 * r * r + l * l) / 12.0
                + ball * (0.4 * r * r + 0.25 * l * l + 0.375 * l * r);
            MassProperties {
                mass: barrel + ball,
                center: DVec3::ZERO,
                inertia: DMat3::from_diagonal(DVec3::new(across, across, along)),
            }
        })
    }

    /// What a closed mesh of triangles encloses, in the mesh's frame \[m\]. Sides must match in pairs, by
    /// the places of their ends, so that vertices may be repeated; triangles may all face outwards or all
    /// inwards.
    #[must_use]
    pub fn mesh(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        Self {
            unit: mesh::unit_density(vertices, triangles),
            amount: Amount::Density(1000.0),
        }
    }

    /// Makes it of a density [kg/m^3].
    #[must_use]
    pub fn of_density(mut self, density: f64) -> Self {
        self.amount = Amount::Density(density);
        self
    }

    /// Gives it a mass \[kg\], spread evenly.
    #[must_use]
    pub fn of_mass(mut self, mass: f64) -> Self {
        self.amount = Amount::Mass(mass);
        self
    }

    /// Moves it to a place in the body's frame.
    #[must_use]
    pub fn placed(mut self, placement: &Pose) -> Self {
        self.unit = self.unit.map(|unit| unit.placed(placement));
        self
    }

    /// Mass, centre and inertia.
    ///
    /// # Errors
    /// [`SolidError`].
    pub fn mass_properties(&self) -> Result<MassProperties, SolidError> {
        let unit = self.unit.clone()?;
        let (what, value, factor) = match self.amount {
            Amount::Density(density) => ("density", density, density),
            Amount::Mass(mass) => ("mass", mass, mass / unit.mass),
        };
        if !(value.is_finite() && value > 0.0) {
            let shape = "solid";
            return Err(SolidError::NotPositive { shape, what, value });
        }
        Ok(MassProperties {
            mass: unit.mass * factor,
            inertia: unit.inertia * factor,
            ..unit
        })
    }
}
