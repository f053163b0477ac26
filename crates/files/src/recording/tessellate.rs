//! Shapes as triangles with normals.

use crate::Shape;
use core::f64::consts::PI;
use glam::DVec3;

/// Corners around a round shape, and steps from pole to equator.
const AROUND: u32 = 16;
const STEPS: u32 = 4;

/// Triangles for a viewer.
#[derive(Default)]
pub(super) struct Surface {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// The surface of a shape.
pub(super) fn surface(shape: &Shape) -> Surface {
    match shape {
        Shape::Box { size } => cuboid(*size),
        Shape::Sphere { radius } => turned(&capped(*radius, 0.0)),
        Shape::Capsule { radius, length } => turned(&capped(*radius, *length)),
        Shape::Cylinder { radius, length } => {
            let (r, h) = (*radius, 0.5 * length);
            turned(&[
                [0.0, h, 0.0, 1.0],
                [r, h, 0.0, 1.0],
                [r, h, 1.0, 0.0],
                [r, -h, 1.0, 0.0],
                [r, -h, 0.0, -1.0],
                [0.0, -h, 0.0, -1.0],
            ])
        }
        Shape::Ellipsoid { radii } => {
            let mut ball = turned(&capped(1.0, 0.0));
            for (position, normal) in ball.positions.iter_mut().zip(&mut ball.normals) {
                *position *= *radii;
                *normal = (*normal / *radii).normalize_or(DVec3::Z);
            }
            ball
        }
        Shape::Mesh(mesh) => {
            let mut faces = Surface::default();
            for (triangle, first) in mesh.triangles.iter().zip((0..).step_by(3)) {
                let [a, b, c] = triangle.map(|index| {
                    mesh.vertices
                        .get(index as usize)
                        .copied()
                        .unwrap_or_default()
                });
                let normal = (b - a).cross(c - a).normalize_or(DVec3::Z);
                faces.positions.extend([a, b, c]);
                faces.normals.extend([normal; 3]);
                faces.triangles.push([first, first + 1, first + 2]);
            }
            faces
        }
    }
}

fn cuboid(size: DVec3) -> Surface {
    let mut faces = Surface::default();
    for (axis, first) in [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .zip((0..).step_by(8))
    {
        let (u, v) = (
            DVec3::new(axis.z, axis.x, axis.y),
            DVec3::new(axis.y, axis.z, axis.x),
        );
        for (sign, first) in [(1.0, first), (-1.0, first + 4)] {
            let normal = axis * sign;
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                faces
                    .positions
                    .push((normal + u * a + v * b * sign) * size * 0.5);
                faces.normals.push(normal);
            }
            faces.triangles.push([first, first + 1, first + 2]);
            faces.triangles.push([first, first + 2, first + 3]);
        }
    }
    faces
}

/// Radius, height and normal along half a ball, a cylinder and half a ball, from the top.
fn capped(radius: f64, length: f64) -> Vec<[f64; 4]> {
    let ball = |step: u32, height: f64| {
        let angle = 0.5 * PI * f64::from(step) / f64::from(STEPS);
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        [radius * sine, height + radius * cosine, sine, cosine]
    };
    let top = (0..=STEPS).map(|step| ball(step, 0.5 * length));
    let bottom = (STEPS..=2 * STEPS).map(|step| ball(step, -0.5 * length));
    top.chain(bottom).collect()
}

/// The surface that a profile from top to bottom makes about z.
fn turned(profile: &[[f64; 4]]) -> Surface {
    let mut skin = Surface::default();
    for &[radius, height, outward, upward] in profile {
        for corner in 0..AROUND {
            let angle = 2.0 * PI * f64::from(corner) / f64::from(AROUND);
            let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
            skin.positions
                .push(DVec3::new(radius * cosine, radius * sine, height));
            let normal = DVec3::new(outward * cosine, outward * sine, upward);
            skin.normals.push(normal.normalize_or(DVec3::Z));
        }
    }
    for (_, ring) in profile.iter().skip(1).zip((0..).step_by(AROUND as usize)) {
        for corner in 0..AROUND {
            let next = (corner + 1) % AROUND;
            let [a, b] = [ring + corner, ring + next];
            let [c, d] = [a + AROUND, b + AROUND];
            skin.triangles.push([a, c, d]);
            skin.triangles.push([a, d, b]);
        }
    }
    skin
}
