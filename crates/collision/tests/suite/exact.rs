//! The exact pair test against rational arithmetic, over families of hard cases.

use crate::support::{ORDERS, Random, Triangle, hulls_meet, oracle, step_f32};
use glam::{DQuat, DVec3, Vec3};
use vertebra_collision::exact::triangles_intersect;
use vertebra_collision::{Query, RelativePose, TriangleMesh};
use vertebra_spatial::Pose;

/// Compares the test with the oracle on `count` generated pairs, some of them in all 72 relabellings.
///
/// A family in which one answer never occurs would test nothing, so both must.
fn agree(family: &str, count: usize, mut pair: impl FnMut(&mut Random) -> (Triangle, Triangle)) {
    let mut random = Random::new(7);
    let mut hits = 0;
    for case in 0..count {
        let (a, b) = pair(&mut random);
        let expected = oracle(&a, &b);
        assert_eq!(
            triangles_intersect(&a, &b),
            expected,
            "{family} {case}: {a:?} {b:?}"
        );
        if case % 8 == 0 {
            for order in ORDERS {
                for other in ORDERS {
                    let (a, b) = (order.map(|i| a[i]), other.map(|i| b[i]));
                    assert_eq!(
                        triangles_intersect(&a, &b),
                        expected,
                        "{family}: {a:?} {b:?}"
                    );
                    assert_eq!(
                        triangles_intersect(&b, &a),
                        expected,
                        "{family}: {b:?} {a:?}"
                    );
                }
            }
        }
        hits += usize::from(expected);
    }
    assert!(
        0 < hits && hits < count,
        "{family}: {hits} hits of {count} pairs"
    );
}

/// Lattice points make every degeneracy there is: touching, shared parts, coplanar, zero area of all kinds.
#[test]
fn small_lattice() {
    let mut random = Random::new(1);
    let mut hits = 0;
    for _ in 0..150_000 {
        let (a, b) = (random.lattice_triangle(0, 2), random.lattice_triangle(0, 2));
        let integers = |t: Triangle| t.map(|p| p.to_array().map(|x| x as i128));
        let expected = hulls_meet(integers(a), integers(b));
        assert_eq!(triangles_intersect(&a, &b), expected, "{a:?} {b:?}");
        hits += usize::from(expected);
    }
    assert!(0 < hits && hits < 150_000);
}

/// Triangle, segment and point against each other, on a lattice that lets them touch often.
#[test]
fn all_kinds_of_zero_area() {
    fn shape(kind: usize, random: &mut Random) -> Triangle {
        let start = random.lattice(-2, 2);
        let direction = random.lattice(-1, 1);
        match kind {
            0 => random.lattice_triangle(-2, 2),
            1 => [0, 1, 2].map(|_| start + direction * random.int(-2, 2) as f64),
            _ => [start; 3],
        }
    }
    for a in 0..3 {
        for b in 0..3 {
            agree(&format!("shapes {a} {b}"), 1000, |random| {
                (shape(a, random), shape(b, random))
            });
        }
    }
}

/// A triangle whose corners are multiples of 16, so that the points taken on it are exact.
fn coarse(random: &mut Random) -> Triangle {
    random.lattice_triangle(-60, 60).map(|p| p * 16.0)
}

fn nudge(random: &mut Random, p: DVec3, steps: i64) -> DVec3 {
    let mut coordinates = p.to_array();
    let k = random.int(0, 2) as usize;
    coordinates[k] = step_f32(coordinates[k], random.int(-steps, steps));
    DVec3::from(coordinates)
}

#[test]
fn a_vertex_within_an_ulp_of_a_face() {
    agree("vertex on face", 3000, |random| {
        let a = coarse(random);
        let (i, j) = (random.int(0, 16), random.int(0, 16));
        let on_face = a[0] + (a[1] - a[0]) * (i as f64 / 16.0) + (a[2] - a[0]) * (j as f64 / 16.0);
        let tip = nudge(random, on_face, 2);
        // The rest of b stays on one side of a's plane, so that only the tip can touch.
        let normal = (a[1] - a[0]).cross(a[2] - a[0]);
        let [p, q] = [(); 2].map(|()| {
            let height = 0.1 + random.unit().abs();
            let p = on_face + random.lattice(-99, 99) + normal * height;
            p.as_vec3().as_dvec3()
        });
        (a, [tip, p, q])
    });
}

#[test]
fn an_edge_within_an_ulp_of_an_edge() {
    agree("edge on edge", 3000, |random| {
        let a = coarse(random);
        let on_edge = a[0] + (a[1] - a[0]) * (random.int(-1, 17) as f64 / 16.0);
        let direction = random.lattice(-99, 99);
        let outward = (a[0] - a[2]) + (a[1] - a[2]);
        let b = [
            nudge(random, on_edge + direction, 2),
            on_edge - direction,
            (on_edge + outward * 2.0).as_vec3().as_dvec3(),
        ];
        (a, b)
    });
}

#[test]
fn neighbours_of_a_mesh_pulled_apart_by_an_ulp() {
    agree("shared vertex", 1500, |random| {
        let a = coarse(random);
        let b = coarse(random).map(|p| p + a[0] * 2.0);
        (a, [nudge(random, a[0], 1), b[1], b[2]])
    });
    agree("shared edge", 1500, |random| {
        let a = coarse(random);
        // Folded flat onto a, flat away from it, or at any angle.
        let apex = match random.int(0, 2) {
            0 => a[2],
            1 => a[0] + a[1] - a[2],
            _ => random.lattice(-999, 999),
        };
        let shift = DVec3::from([0.0, 0.0, random.int(0, 1) as f64]);
        let b = [a[0] + shift, a[1] + shift, apex + shift];
        (a, b.map(|p| nudge(random, p, 1)))
    });
}

#[test]
fn coplanar_in_oblique_planes() {
    agree("coplanar", 4000, |random| {
        let (origin, u, v) = (
            random.lattice(-9, 9),
            random.lattice(-5, 5),
            random.lattice(-5, 5),
        );
        let mut triangle = || {
            [(); 3].map(|()| origin + u * random.int(-4, 4) as f64 + v * random.int(-4, 4) as f64)
        };
        let (a, b) = (triangle(), triangle());
        (a, b)
    });
    // One contains the other, or not.
    agree("contained", 500, |random| {
        let a = [
            DVec3::ZERO,
            DVec3::new(8.0, 0.0, 8.0),
            DVec3::new(0.0, 8.0, 0.0),
        ];
        let corner = random.lattice(-1, 6);
        let b = [DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0), DVec3::Y];
        (a, b.map(|p| p + DVec3::new(corner.x, corner.y, corner.x)))
    });
}

#[test]
fn near_parallel_by_ulps() {
    agree("near parallel", 3000, |random| {
        let a: Triangle = [(); 3].map(|()| random.point().as_dvec3());
        let b = a.map(|p| (p * 1.25).as_vec3().as_dvec3());
        let lift = DVec3::splat(1e-6 * random.unit());
        let b = b.map(|p| nudge(random, p - (b[0] - a[0]) + lift, 3));
        (a, b.map(|p| p.as_vec3().as_dvec3()))
    });
}

#[test]
fn slivers() {
    agree("slivers", 3000, |random| {
        let mut sliver = || {
            let (p, q) = (random.point().as_dvec3(), random.point().as_dvec3());
            let thin = 10.0_f64.powi(-random.int(1, 9) as i32);
            let along = p + (q - p) * random.unit();
            let r = along + random.point().as_dvec3() * thin;
            [p, q, r.as_vec3().as_dvec3()]
        };
        let (a, mut b) = (sliver(), sliver());
        // Bring b's first corner onto a, up to rounding, or short of it.
        let target = (a[0] + a[1] + a[2]) / 3.0 + random.point().as_dvec3() * 1e-3;
        let shift = target - b[0];
        b = b.map(|p| (p + shift).as_vec3().as_dvec3());
        (a, b)
    });
}

#[test]
fn extreme_sizes_and_offsets() {
    for exponent in [-149, -100, -40, 0, 40, 100, 120] {
        let size = 2.0_f64.powi(exponent);
        agree(&format!("size 2^{exponent}"), 600, |random| {
            let scaled = |t: Triangle| t.map(|p| p * size);
            let b = random.lattice_triangle(-30, 30);
            (scaled(random.lattice_triangle(-30, 30)), scaled(b))
        });
    }
    for offset in [1e1, 1e3, 1e5, 1e7] {
        agree(&format!("offset {offset}"), 600, |random| {
            let mut triangle = || {
                random
                    .lattice_triangle(-3, 3)
                    .map(|p| (p * 0.37 + offset).as_vec3().as_dvec3())
            };
            (triangle(), triangle())
        });
    }
    // Subnormal and large coordinates in one triangle, and negative zeros.
    agree("mixed", 2000, |random| {
        let mut coordinate = || {
            let size = [0.0, -0.0, 1e-45, 1e-30, 1.0, 1e7, 3e38][random.int(0, 6) as usize];
            f64::from(size * random.int(-1, 1) as f32)
        };
        let mut triangle = || [(); 3].map(|()| DVec3::from([(); 3].map(|()| coordinate())));
        (triangle(), triangle())
    });
}

#[test]
fn posed_points() {
    agree("posed", 3000, |random| {
        let rotation = DQuat::from_xyzw(
            random.unit(),
            random.unit(),
            random.unit(),
            1.0 + random.unit(),
        )
        .normalize();
        let pose = Pose::new(rotation, random.point().as_dvec3());
        let relative = RelativePose::between(&Pose::IDENTITY, &pose).unwrap();
        let a: [Vec3; 3] = [(); 3].map(|()| random.point());
        // b touches a, up to the rounding of the way there and back.
        let target = (a[0] + a[1]).as_dvec3() / 2.0;
        let tip = pose.inverse().transform_point(target).as_vec3();
        let b = [tip, random.point(), random.point()];
        (a.map(|p| p.as_dvec3()), b.map(|p| relative.apply(p)))
    });
}

/// Subnormal coordinates turned by tiny angles: posed coordinates so small that both meshes are scaled.
#[test]
fn posed_points_far_below_f32() {
    let mut random = Random::new(3);
    let (mut hits, mut tiny) = (0, 0);
    for _ in 0..400 {
        let mut triangle = || -> [Vec3; 3] {
            [(); 3].map(|()| (random.lattice(-2, 2).as_vec3()) * f32::from_bits(1))
        };
        let (a, b) = (triangle(), triangle());
        let tilt = DQuat::from_xyzw(2e-40, -7e-50, 3e-55, 1.0);
        let shift = random.lattice(-1, 1) * 2.0_f64.powi(-199);
        let pose = Pose::new(tilt, shift);
        let relative = RelativePose::between(&Pose::IDENTITY, &pose).unwrap();
        let points = b.map(|p| relative.apply(p));
        let is_tiny = |p: &DVec3| p.to_array().iter().any(|&c| c != 0.0 && c.abs() < 1e-76);
        tiny += usize::from(points.iter().any(is_tiny));
        let expected = oracle(&a.map(|p| p.as_dvec3()), &points);
        let mesh = |t: [Vec3; 3]| TriangleMesh::new(t.to_vec(), vec![[0, 1, 2]]).unwrap();
        let (a, b) = (mesh(a), mesh(b));
        let query = Query::new(&a, &b).pose_b(pose).unwrap();
        assert_eq!(query.any().unwrap(), expected);
        hits += usize::from(expected);
    }
    assert!(hits > 0 && hits < 400, "{hits}");
    assert!(tiny > 100, "{tiny}");
}

#[test]
fn invariant_under_exact_maps() {
    let mut random = Random::new(5);
    for _ in 0..2000 {
        let (a, b) = (
            random.lattice_triangle(-4, 4),
            random.lattice_triangle(-4, 4),
        );
        let expected = triangles_intersect(&a, &b);
        let same = |map: &dyn Fn(DVec3) -> DVec3| {
            assert_eq!(
                triangles_intersect(&a.map(map), &b.map(map)),
                expected,
                "{a:?} {b:?}"
            );
        };
        for exponent in [-140, -3, 10, 120] {
            same(&|p| p * 2.0_f64.powi(exponent));
        }
        for order in ORDERS {
            same(&|p| DVec3::from(order.map(|k| p[k])));
        }
        same(&|p| p * DVec3::new(-1.0, 1.0, 1.0));
        same(&|p| p * DVec3::new(1.0, -1.0, -1.0));
        same(&|p| p + DVec3::new(1e6, -16_777_000.0, 31.0));
    }
}

/// Cutting a triangle at exact midpoints hits exactly what the whole hits.
#[test]
fn invariant_under_subdivision() {
    let mut random = Random::new(6);
    for _ in 0..3000 {
        let a = random.lattice_triangle(-4, 4);
        let b = random.lattice_triangle(-4, 4);
        let [p, q, r] = a;
        let [pq, qr, rp] = [(p + q) / 2.0, (q + r) / 2.0, (r + p) / 2.0];
        let parts = [[p, pq, rp], [pq, q, qr], [rp, qr, r], [pq, qr, rp]];
        let any = parts.iter().any(|part| triangles_intersect(part, &b));
        assert_eq!(any, triangles_intersect(&a, &b), "{a:?} {b:?}");
    }
}
