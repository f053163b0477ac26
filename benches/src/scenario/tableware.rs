//! Meshes with exactly the triangle counts of the source, whose own models are not available: a
//! sphere and a cylinder; a cup, a sugar bowl and a spoon, each a closed surface of revolution
//! (2 N R triangles for R profile points turned in N steps) with closed tubes for handles (2 K M
//! triangles for M rings of K points).
//!
//! All are of size about 1 and stand so that the second really cuts into the first. Coordinates come
//! from `libm`, so that the meshes are the same on every machine.

use std::f64::consts::{PI, TAU};
use vertebra::glam::{DVec2, DVec3, Vec3};
use vertebra::{MeshError, TriangleMesh};

/// Vertices and triangles under construction.
#[derive(Default)]
struct Builder {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Builder {
    fn vertex(&mut self, p: DVec3) -> u32 {
        self.vertices.push(p.as_vec3());
        index(self.vertices.len() - 1)
    }

    /// A grid of `rows` x `columns` points, closed in both directions.
    fn torus(&mut self, rows: usize, columns: usize, point: impl Fn(usize, usize) -> DVec3) {
        let start = self.vertices.len();
        for row in 0..rows {
            for column in 0..columns {
                self.vertex(point(row, column));
            }
        }
        let at =
            |row: usize, column: usize| index(start + (row % rows) * columns + column % columns);
        for row in 0..rows {
            for column in 0..columns {
                let (a, b) = (at(row, column), at(row, column + 1));
                let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
                self.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }

    fn build(self) -> Result<TriangleMesh, MeshError> {
        TriangleMesh::new(self.vertices, self.triangles)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "the meshes have a few million vertices"
)]
const fn index(i: usize) -> u32 {
    i as u32
}

#[expect(clippy::cast_precision_loss, reason = "small counts")]
const fn fraction(i: usize, n: usize) -> f64 {
    i as f64 / n as f64
}

fn circle(angle: f64) -> DVec2 {
    DVec2::new(libm::cos(angle), libm::sin(angle))
}

/// UV sphere of 32 x 16 steps: 960 triangles.
///
/// # Errors
/// None in practice: the mesh is valid.
pub fn sphere() -> Result<TriangleMesh, MeshError> {
    uv_sphere(32, 16)
}

/// Sphere of radius 1 m, `around` steps by `down` steps from pole to pole: 2 around (down - 1)
/// triangles.
///
/// # Errors
/// [`MeshError`] if there are too few steps.
pub fn uv_sphere(around: usize, down: usize) -> Result<TriangleMesh, MeshError> {
    let mut mesh = Builder::default();
    let north = mesh.vertex(DVec3::Z);
    for ring in 1..down {
        let height = circle(PI * fraction(ring, down));
        for step in 0..around {
            let c = circle(TAU * fraction(step, around)) * height.y;
            mesh.vertex(c.extend(height.x));
        }
    }
    let south = mesh.vertex(-DVec3::Z);
    let at = |ring: usize, step: usize| index(1 + (ring - 1) * around + step % around);
    for step in 0..around {
        mesh.triangles.push([north, at(1, step), at(1, step + 1)]);
        for ring in 1..down - 1 {
            let (a, b) = (at(ring, step), at(ring, step + 1));
            let (c, d) = (at(ring + 1, step), at(ring + 1, step + 1));
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
        mesh.triangles
            .push([south, at(down - 1, step + 1), at(down - 1, step)]);
    }
    mesh.build()
}

/// Cylinder of 18 sides and 5 segments with caps, lying slantwise through the sphere's side: 216
/// triangles.
///
/// # Errors
/// None in practice: the mesh is valid.
pub fn cylinder() -> Result<TriangleMesh, MeshError> {
    let (sides, segments) = (18, 5);
    let axis = DVec3::new(0.6, 0.3, 0.74).normalize();
    let across = axis.any_orthonormal_vector();
    let third = axis.cross(across);
    let center = DVec3::new(0.55, 0.2, 0.1);
    let place = |height: f64, c: DVec2| center + axis * height + across * c.x + third * c.y;
    let mut mesh = Builder::default();
    for segment in 0..=segments {
        for side in 0..sides {
            let c = circle(TAU * fraction(side, sides)) * 0.4;
            mesh.vertex(place(2.0 * fraction(segment, segments) - 1.0, c));
        }
    }
    let bottom = mesh.vertex(place(-1.0, DVec2::ZERO));
    let top = mesh.vertex(place(1.0, DVec2::ZERO));
    let at = |segment: usize, side: usize| index(segment * sides + side % sides);
    for side in 0..sides {
        for segment in 0..segments {
            let (a, b) = (at(segment, side), at(segment, side + 1));
            let (c, d) = (at(segment + 1, side), at(segment + 1, side + 1));
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
        mesh.triangles.push([bottom, at(0, side + 1), at(0, side)]);
        mesh.triangles
            .push([top, at(segments, side), at(segments, side + 1)]);
    }
    mesh.build()
}

/// A closed profile (radius, height) turned about z.
fn turned(mesh: &mut Builder, steps: usize, profile: &[DVec2]) {
    mesh.torus(profile.len(), steps, |row, step| {
        let c = circle(TAU * fraction(step, steps)) * profile[row].x;
        c.extend(profile[row].y)
    });
}

/// A tube of `rings` rings of `sides` points about a closed curve in the plane of x and z.
fn handle(
    mesh: &mut Builder,
    rings: usize,
    sides: usize,
    loop_: impl Fn(f64) -> DVec2,
    radius: f64,
) {
    mesh.torus(rings, sides, |ring, side| {
        let angle = TAU * fraction(ring, rings);
        let at = loop_(angle);
        let ahead = loop_(angle + 1e-3);
        let tangent = (ahead - at).normalize();
        let normal = DVec3::new(tangent.y, 0.0, -tangent.x);
        let c = circle(TAU * fraction(side, sides)) * radius;
        DVec3::new(at.x, 0.0, at.y) + normal * c.x + DVec3::Y * c.y
    });
}

/// A wall of `points` points: up the outside, down the inside, of a vessel whose outer radius at
/// height fraction t is `outer(t)`.
fn vessel(points: usize, height: f64, wall: f64, outer: impl Fn(f64) -> f64) -> Vec<DVec2> {
    let up = points / 2;
    let down = points - up;
    let mut profile = Vec::with_capacity(points);
    for k in 0..up {
        let t = fraction(k, up - 1);
        // The first point closes the foot near the axis.
        let radius = if k == 0 { 0.05 } else { outer(t) };
        profile.push(DVec2::new(radius, height * t));
    }
    for k in 0..down {
        let t = 1.0 - fraction(k, down - 1);
        let radius = if k + 1 == down { 0.05 } else { outer(t) - wall };
        profile.push(DVec2::new(radius, wall + (height - wall) * t));
    }
    profile
}

/// Cup with one handle: 2 (90 x 37 + 23 x 20) = 7580 triangles.
///
/// # Errors
/// None in practice: the mesh is valid.
pub fn cup() -> Result<TriangleMesh, MeshError> {
    let mut mesh = Builder::default();
    let outer = |t: f64| 0.55 + 0.25 * libm::sin(0.5 * PI * t);
    turned(&mut mesh, 90, &vessel(37, 1.0, 0.06, outer));
    let ear = |angle: f64| DVec2::new(0.85, 0.5) + circle(angle) * DVec2::new(0.3, 0.28);
    handle(&mut mesh, 23, 20, ear, 0.06);
    mesh.build()
}

/// Sugar bowl with two handles, standing so that its wall cuts the cup's: 2 (75 x 29 + 2 x 15 x 15)
/// = 5250 triangles.
///
/// # Errors
/// None in practice: the mesh is valid.
pub fn bowl() -> Result<TriangleMesh, MeshError> {
    let mut mesh = Builder::default();
    let outer = |t: f64| 0.5 + 0.45 * libm::sin(PI * (0.15 + 0.6 * t));
    turned(&mut mesh, 75, &vessel(29, 0.9, 0.05, outer));
    for side in [-1.0, 1.0] {
        let ear = |angle: f64| DVec2::new(side * 1.0, 0.5) + circle(angle) * DVec2::new(0.22, 0.2);
        handle(&mut mesh, 15, 15, ear, 0.05);
    }
    for v in &mut mesh.vertices {
        *v += Vec3::new(-1.31, 0.42, 0.083);
    }
    mesh.build()
}

/// Spoon leaning in the cup and through its wall: 2 (120 x 80 + 131 x 26) = 26012 triangles.
///
/// # Errors
/// None in practice: the mesh is valid.
pub fn spoon() -> Result<TriangleMesh, MeshError> {
    let mut mesh = Builder::default();
    // The spoon's bowl: a thin shell, outside then inside.
    let rows = 80;
    let profile: Vec<DVec2> = (0..rows)
        .map(|row| {
            let half = rows / 2;
            let (t, scale) = if row < half {
                (fraction(row, half - 1), 1.0)
            } else {
                (1.0 - fraction(row - half, half - 1), 0.93)
            };
            let c = circle(0.5 * PI * t) * scale;
            DVec2::new(0.02 + 0.3 * c.y, -0.12 * c.x)
        })
        .collect();
    turned(&mut mesh, 120, &profile);
    for v in &mut mesh.vertices {
        v.x *= 1.4;
    }
    let stem = |angle: f64| DVec2::new(1.15, 0.1) + circle(angle) * DVec2::new(0.8, 0.05);
    handle(&mut mesh, 131, 26, stem, 0.035);
    // Lean it: turned about y, then moved into the cup.
    let (sin, cos) = (libm::sin(-0.6), libm::cos(-0.6));
    for v in &mut mesh.vertices {
        let p = v.as_dvec3();
        let turned = DVec3::new(cos * p.x + sin * p.z, p.y, -sin * p.x + cos * p.z);
        *v = (turned + DVec3::new(-0.35, 0.03, 0.31)).as_vec3();
    }
    mesh.build()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra::Query;

    #[test]
    fn counts_are_the_sources() -> Result<(), MeshError> {
        assert_eq!(sphere()?.len(), 960);
        assert_eq!(cylinder()?.len(), 216);
        assert_eq!(cup()?.len(), 7580);
        assert_eq!(bowl()?.len(), 5250);
        assert_eq!(spoon()?.len(), 26012);
        Ok(())
    }

    #[test]
    fn all_interpenetrate_and_none_is_degenerate() -> Result<(), Box<dyn std::error::Error>> {
        for (a, b) in [
            (sphere()?, cylinder()?),
            (cup()?, bowl()?),
            (cup()?, spoon()?),
        ] {
            assert!(Query::new(&a, &b).count()? > 50);
            assert!(a.zero_area().is_empty() && b.zero_area().is_empty());
        }
        Ok(())
    }
}
