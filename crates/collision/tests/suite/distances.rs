//! Distances against exact arithmetic, and lists of close pairs against all pairs.

use crate::support::{
    Exact, Random, Rational, Triangle, between, cross, dot, exact, gold_mesh, minus, oracle,
    rational,
};
use glam::{DQuat, DVec3, Vec3};
use num_traits::{One, Signed, Zero};
use vertebra_collision::{
    Collider, Culling, DistanceBounds, Method, Query, QueryError, TriangleMesh,
};
use vertebra_spatial::Pose;

fn square(p: &Exact, q: &Exact) -> Rational {
    let d = minus(p, q);
    dot(&d, &d)
}

fn clamped(t: Rational) -> Rational {
    t.max(Rational::zero()).min(Rational::one())
}

/// The square of the distance of a point and a segment.
fn to_segment(x: &Exact, [p, q]: [&Exact; 2]) -> Rational {
    let d = minus(q, p);
    let square_length = dot(&d, &d);
    if square_length.is_zero() {
        return square(x, p);
    }
    let t = clamped(dot(&minus(x, p), &d) / square_length);
    square(x, &between(p, q, &t))
}

/// The square of the distance, exactly: of corners from sides and from triangles, and of sides from sides.
fn exact_square(a: &Triangle, b: &Triangle) -> Rational {
    if oracle(a, b) {
        return Rational::zero();
    }
    let (a, b) = (a.map(exact), b.map(exact));
    let mut squares = Vec::new();
    for (t, others) in [(&a, &b), (&b, &a)] {
        let n = cross(&minus(&t[1], &t[0]), &minus(&t[2], &t[0]));
        for x in others {
            for i in 0..3 {
                squares.push(to_segment(x, [&t[i], &t[(i + 1) % 3]]));
            }
            let inside = |i: usize| {
                let side = cross(&minus(&t[(i + 1) % 3], &t[i]), &minus(x, &t[i]));
                !dot(&side, &n).is_negative()
            };
            if n.iter().any(|c| !c.is_zero()) && (0..3).all(inside) {
                let height = dot(&minus(x, &t[0]), &n);
                squares.push(&height * &height / dot(&n, &n));
            }
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            let (p, q) = (&a[i], &a[(i + 1) % 3]);
            let (r, s) = (&b[j], &b[(j + 1) % 3]);
            let (d, e, w) = (minus(q, p), minus(s, r), minus(r, p));
            let n = cross(&d, &e);
            let nn = dot(&n, &n);
            if nn.is_zero() {
                continue;
            }
            let (u, v) = (dot(&cross(&w, &e), &n) / &nn, dot(&cross(&w, &d), &n) / &nn);
            if u == clamped(u.clone()) && v == clamped(v.clone()) {
                squares.push(square(&between(p, q, &u), &between(r, s, &v)));
            }
        }
    }
    squares.into_iter().min().unwrap()
}

/// The bounds hold, and are as close as the size of the triangles allows.
fn check(a: &Triangle, b: &Triangle) -> f64 {
    let found = DistanceBounds::of(a, b);
    let expected = exact_square(a, b);
    let (lower, upper) = (rational(found.lower), rational(found.upper));
    assert!(&lower * &lower <= expected, "{a:?} {b:?} {found:?}");
    assert!(expected <= &upper * &upper, "{a:?} {b:?} {found:?}");
    assert_eq!(found.upper == 0.0, expected.is_zero());
    found.upper - found.lower
}

#[test]
fn bounds_on_lattices() {
    let mut random = Random::new(71);
    let mut widest = 0.0_f64;
    for _ in 0..2000 {
        let (a, b) = (random.lattice_triangle(0, 4), random.lattice_triangle(0, 4));
        widest = widest.max(check(&a, &b));
    }
    // Coordinates are below 5: twice the documented term, and as much again for the direction.
    assert!(widest < 4.0 * 32.0 * f64::EPSILON * 5.0, "{widest}");
}

#[test]
fn bounds_on_hard_pairs() {
    let mut random = Random::new(72);
    for case in 0..900 {
        let offset = DVec3::splat([0.0, 1e3, 1e6][case % 3]);
        let thin = 10.0_f64.powi(-random.int(0, 8) as i32);
        let mut triangle = || -> Triangle {
            let (p, q) = (random.point().as_dvec3(), random.point().as_dvec3());
            let r = p + (q - p) * random.unit() + random.point().as_dvec3() * thin;
            [p, q, r].map(|p| (p + offset).as_vec3().as_dvec3())
        };
        let (a, mut b) = (triangle(), triangle());
        if case % 2 == 0 {
            // Nearly parallel and close.
            b = a.map(|p| (p + random.point().as_dvec3() * thin).as_vec3().as_dvec3());
        }
        check(&a, &b);
    }
    for size in [2.0_f64.powi(-240), 1e-44, 1e-30, 1e30, 2.0_f64.powi(320)] {
        let scaled = |t: Triangle| t.map(|p| p * size);
        for _ in 0..60 {
            check(
                &scaled(random.lattice_triangle(-4, 4)),
                &scaled(random.lattice_triangle(-4, 4)),
            );
        }
    }
}

fn soup(random: &mut Random, count: u32) -> TriangleMesh {
    let vertices = (0..count).flat_map(|_| {
        let corner = random.lattice(0, 12);
        [
            corner,
            corner + random.lattice(-1, 1),
            corner + random.lattice(-1, 1),
        ]
        .map(|p| p.as_vec3())
    });
    let vertices = vertices.collect();
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(vertices, triangles.collect()).unwrap()
}

/// No pair is missed and none listed without reason; boxes, trees and threads change nothing. On a lattice ties abound.
#[test]
fn close_pairs_are_all_there() {
    let mut random = Random::new(73);
    let (a, b) = (soup(&mut random, 90), soup(&mut random, 70));
    let colliders = [&a, &b].map(|mesh| Collider::new(mesh.clone()));
    let turn = DQuat::from_xyzw(0.2, 0.1, -0.4, 0.8).normalize();
    let mut ties = 0;
    for pose in [Pose::IDENTITY, Pose::new(turn, DVec3::new(3.0, -1.0, 2.0))] {
        let query = Query::new(&a, &b).pose_b(pose).unwrap();
        let posed = |j: usize| b.triangle(j).map(|v| query.relative_pose().apply(v));
        let corners = |i: usize| a.triangle(i).map(|v| v.as_dvec3());
        let all: Vec<_> = (0..90)
            .flat_map(|i| (0..70).map(move |j| (i, j)))
            .map(|(i, j)| {
                (
                    [i as u32, j as u32],
                    DistanceBounds::of(&corners(i), &posed(j)),
                )
            })
            .collect();
        for distance in [0.0, 1e-30, 1.0, 2.0_f64.sqrt(), 2.5, 100.0, 1e38] {
            let expected: Vec<_> = all
                .iter()
                .filter(|(_, bounds)| {
                    bounds.lower <= distance && (distance > 0.0 || bounds.upper == 0.0)
                })
                .copied()
                .collect();
            for query in [
                query.clone().culling(Culling::AllPairs),
                query.clone().culling(Culling::Bvh),
                query.clone().culling(Culling::Bvh).threads(2),
                Query::new(&colliders[0], &colliders[1]).relative(*query.relative_pose()),
            ] {
                let found = query.within(distance).unwrap();
                let found: Vec<_> = found.iter().map(|p| ([p.a, p.b], p.distance)).collect();
                assert_eq!(found, expected, "{distance}");
            }
            let tied =
                |p: &([u32; 2], DistanceBounds)| p.1.lower < distance && distance < p.1.upper;
            ties += expected.iter().filter(|pair| tied(pair)).count();
        }
        let touching: Vec<[u32; 2]> = query
            .within(0.0)
            .unwrap()
            .iter()
            .map(|p| [p.a, p.b])
            .collect();
        assert_eq!(touching, query.pairs().unwrap());
    }
    assert!(ties > 50, "{ties}");
}

/// A smaller than B, both in place: the case in which trees could change places. Asked for each pair's own lower bound, and
/// for any less, so that the last bit of it decides; and with triangles so long that bounds are wider than boxes are off.
#[test]
fn ties_do_not_depend_on_culling() {
    let mut random = Random::new(74);
    let mut mesh = |count: u32, length: f32| {
        let stretch = Vec3::new(1.0, length, 1.0);
        let vertices =
            (0..3 * count).map(|i| (random.point() + Vec3::X * i as f32 * 0.3) * stretch);
        let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        TriangleMesh::new(vertices.collect(), triangles.collect()).unwrap()
    };
    for length in [1.0, 1e7] {
        let (few, many) = (mesh(5, length), mesh(40, length));
        let query = Query::new(&few, &many);
        let all = query.within(200.0 * f64::from(length)).unwrap();
        assert_eq!(all.len(), 200);
        let apart = all.iter().filter(|pair| pair.distance.lower > 0.0);
        let distances: Vec<f64> = apart
            .map(|pair| pair.distance.lower)
            .flat_map(|lower| [lower, lower.next_down(), f64::from(lower as f32)])
            .collect();
        assert!(distances.len() > 400, "{}", distances.len());
        for distance in distances {
            let pairs = |culling| query.clone().culling(culling).within(distance).unwrap();
            let expected = pairs(Culling::AllPairs);
            assert_eq!(pairs(Culling::Bvh), expected, "{distance}");
            assert_eq!(pairs(Culling::Auto), expected, "{distance}");
        }
    }
}

#[test]
fn gold_meshes_by_trees_and_all_pairs() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let query = Query::new(&a, &b)
        .pose_b(Pose::from_translation(DVec3::X * 3.0))
        .unwrap();
    for distance in [0.3, 1.0, 1.5] {
        let pairs = query
            .clone()
            .culling(Culling::AllPairs)
            .within(distance)
            .unwrap();
        assert_eq!(
            query
                .clone()
                .culling(Culling::Bvh)
                .within(distance)
                .unwrap(),
            pairs
        );
    }
    for distance in [-1.0, f64::NAN, f64::INFINITY, 2.0_f64.powi(127)] {
        let error = query.within(distance).unwrap_err();
        assert!(
            matches!(error, QueryError::InvalidDistance { .. }),
            "{error}"
        );
    }
    let moller = query.method(Method::MOLLER).within(1.0);
    assert_eq!(moller, Err(QueryError::NotExact));
}

/// Boxes at the end of the range grow to infinity and no further.
#[test]
fn ends_of_the_range() {
    let tile = |x: f32| {
        let corner = Vec3::new(x, 0.0, 0.0);
        TriangleMesh::new(
            vec![corner, corner + Vec3::Y, corner + Vec3::Z],
            vec![[0, 1, 2]],
        )
        .unwrap()
    };
    let (left, right) = (tile(-1e38), tile(5e37));
    for culling in [Culling::AllPairs, Culling::Bvh] {
        let query = Query::new(&left, &right).culling(culling);
        assert_eq!(query.within(1.6e38).unwrap().len(), 1);
        assert_eq!(query.within(1.4e38).unwrap().len(), 0);
    }
}
