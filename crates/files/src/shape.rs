//! Shapes: what bodies look like, and what they weigh.

use core::f64::consts::PI;
use core::fmt;
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::sync::Arc;
use vertebra_assembly::{BodyId, MassProperties};
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
    /// Triangles, counter-clockwise seen from outside.
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

/// Why triangles do not enclose a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum OpenMesh {
    /// A triangle names a vertex that is not there.
    UnknownVertex {
        /// The triangle, from 0.
        triangle: usize,
    },
    /// An edge that no triangle runs along in the other direction.
    OpenEdge {
        /// The triangle, from 0.
        triangle: usize,
    },
    /// The volume is zero, or negative: the triangles face inwards.
    NoVolume,
}

impl fmt::Display for OpenMesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownVertex { triangle } => {
                write!(f, "triangle {triangle} names a vertex that is not there")
            }
            Self::OpenEdge { triangle } => {
                write!(
                    f,
                    "an edge of triangle {triangle} has no triangle on its other side"
                )
            }
            Self::NoVolume => {
                f.write_str("its volume is not positive, so its triangles face inwards")
            }
        }
    }
}

impl Shape {
    /// Mass properties of the solid shape at a density [kg/m^3].
    ///
    /// # Errors
    /// [`OpenMesh`] where triangles do not enclose a volume.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, OpenMesh> {
        Ok(match self {
            Self::Box { size } => MassProperties::cuboid(density * size.x * size.y * size.z, *size),
            Self::Sphere { radius } => {
                MassProperties::sphere(density * 4.0 / 3.0 * PI * radius.powi(3), *radius)
            }
            Self::Cylinder { radius, length } => cylinder(density, *radius, *length),
            Self::Capsule { radius, length } => capsule(density, *radius, *length),
            Self::Ellipsoid { radii } => ellipsoid(density, *radii),
            Self::Mesh(mesh) => mesh.mass_properties(density)?,
        })
    }
}

fn centred(mass: f64, moments: DVec3) -> MassProperties {
    MassProperties {
        mass,
        center: DVec3::ZERO,
        inertia: DMat3::from_diagonal(moments),
    }
}

fn cylinder(density: f64, radius: f64, length: f64) -> MassProperties {
    let mass = density * PI * radius * radius * length;
    let across = mass * (3.0 * radius * radius + length * length) / 12.0;
    centred(
        mass,
        DVec3::new(across, across, 0.5 * mass * radius * radius),
    )
}

/// A half ball's centre of mass is 3/8 r beyond the end of the cylinder, at l/2. About that end it
/// has the ball's moment 2/5 m r^2, as it is half a ball; moving it out by l/2 adds
/// m (l^2/4 + 2 (l/2) (3/8) r).
fn capsule(density: f64, radius: f64, length: f64) -> MassProperties {
    let tube = cylinder(density, radius, length);
    let ends = density * 4.0 / 3.0 * PI * radius.powi(3);
    let along = 0.4 * ends * radius * radius;
    let across = along + ends * length * (0.25 * length + 0.375 * radius);
    let moments = DVec3::new(across, across, along);
    MassProperties {
        mass: tube.mass + ends,
        inertia: tube.inertia + DMat3::from_diagonal(moments),
        ..tube
    }
}

fn ellipsoid(density: f64, radii: DVec3) -> MassProperties {
    let mass = density * 4.0 / 3.0 * PI * radii.x * radii.y * radii.z;
    let s = radii * radii;
    centred(
        mass,
        DVec3::new(s.y + s.z, s.x + s.z, s.x + s.y) * (0.2 * mass),
    )
}

impl TriangleSoup {
    /// Mass properties of the solid that the triangles enclose, at a density [kg/m^3].
    ///
    /// Every triangle and a common point o make a tetrahedron of signed volume V = a . (b x c) / 6,
    /// first moment V s / 4 with s = a + b + c, and second moment V (aa' + bb' + cc' + ss') / 20
    /// about o. Taking o amid the vertices keeps the terms small.
    ///
    /// # Errors
    /// [`OpenMesh`], naming the triangle at which the surface is open.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, OpenMesh> {
        self.check_closed()?;
        let count = self.vertices.len().max(1);
        #[expect(clippy::cast_precision_loss, reason = "any point serves")]
        let amid = self.vertices.iter().sum::<DVec3>() / count as f64;
        let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|index| self.vertices[index as usize] - amid);
            let part = a.dot(b.cross(c)) / 6.0;
            let sum = a + b + c;
            volume += part;
            first += sum * (part / 4.0);
            second += (outer(a) + outer(b) + outer(c) + outer(sum)) * (part / 20.0);
        }
        if volume.is_nan() || volume <= 0.0 {
            return Err(OpenMesh::NoVolume);
        }
        let center = first / volume;
        let about_center = second - outer(center) * volume;
        let trace = about_center.x_axis.x + about_center.y_axis.y + about_center.z_axis.z;
        Ok(MassProperties {
            mass: density * volume,
            center: amid + center,
            inertia: (DMat3::from_diagonal(DVec3::splat(trace)) - about_center) * density,
        })
    }

    /// Every edge must be run along once in each direction, over all triangles.
    fn check_closed(&self) -> Result<(), OpenMesh> {
        let mut balance: HashMap<[u32; 2], (i64, usize)> = HashMap::new();
        for (index, triangle) in self.triangles.iter().enumerate() {
            if triangle
                .iter()
                .any(|&vertex| vertex as usize >= self.vertices.len())
            {
                return Err(OpenMesh::UnknownVertex { triangle: index });
            }
            let [a, b, c] = *triangle;
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let key = [from.min(to), from.max(to)];
                let edge = balance.entry(key).or_insert((0, index));
                edge.0 += if from < to { 1 } else { -1 };
            }
        }
        let open = balance.values().filter(|(sum, _)| *sum != 0);
        match open.map(|&(_, triangle)| triangle).min() {
            Some(triangle) => Err(OpenMesh::OpenEdge { triangle }),
            None => Ok(()),
        }
    }
}
