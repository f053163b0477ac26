//! Shapes: what bodies look like, and what they weigh.

use glam::{DMat3, DVec3};
use std::sync::Arc;
use vertebra_assembly::{BodyId, BodyShape, MassProperties, SolidError};
use vertebra_spatial::Pose;

/// A shape on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The body; none for the world.
    pub body: Option<BodyId>,
    /// Where the shape's frame is in the body's frame, or in the world.
    pub placement: Pose,
    /// The shape.
    pub shape: Shape,
}

/// A shape about the origin of its own frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A box.
    Box {
        /// Lengths of its edges \[m\].
        size: DVec3,
    },
    /// A ball.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius \[m\].
        radius: f64,
        /// Length \[m\].
        length: f64,
    },
    /// A cylinder along z with half a ball on either end.
    Capsule {
        /// Radius \[m\].
        radius: f64,
        /// Length of the cylinder alone \[m\].
        length: f64,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Half its lengths along x, y and z \[m\].
        radii: DVec3,
    },
    /// Triangles that enclose a volume, counter-clockwise seen from outside.
    Mesh(Arc<TriangleSoup>),
}

/// Triangles over vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleSoup {
    /// Vertices \[m\].
    pub vertices: Vec<DVec3>,
    /// Triangles, by index into the vertices.
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// Mass properties of the solid shape at a density [kg/m^3].
    ///
    /// # Errors
    /// [`SolidError`] where a size is not positive or triangles do not enclose a volume.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, SolidError> {
        let solid = match self {
            Self::Box { size } => BodyShape::cuboid(*size),
            Self::Sphere { radius } => BodyShape::sphere(*radius),
            Self::Cylinder { radius, length } => BodyShape::cylinder(*radius, *length),
            Self::Capsule { radius, length } => BodyShape::capsule(*radius, *length),
            Self::Ellipsoid { radii } => return ellipsoid(density, *radii),
            Self::Mesh(mesh) => BodyShape::mesh(&mesh.vertices, &mesh.triangles),
        };
        solid.of_density(density).mass_properties()
    }
}

/// A ball stretched along its axes: second moments of mass grow with the squares of the radii.
fn ellipsoid(density: f64, radii: DVec3) -> Result<MassProperties, SolidError> {
    let volume = radii.x * radii.y * radii.z;
    let ball = BodyShape::sphere(1.0).of_density(density * volume);
    let ball = ball.mass_properties()?;
    let s = radii * radii;
    let moments = DVec3::new(s.y + s.z, s.x + s.z, s.x + s.y) * (0.2 * ball.mass);
    Ok(MassProperties {
        inertia: DMat3::from_diagonal(moments),
        ..ball
    })
}
