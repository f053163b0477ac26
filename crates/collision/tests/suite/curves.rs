//! Intersection curves against exact arithmetic: where their points are, that they are complete, and that they close.

use crate::classes::meeting_points;
use crate::support::{
    Exact, Random, Triangle, cuboid, dot, exact, exploded, gold_mesh, minus, rational, wide,
};
use glam::{DQuat, DVec3, Vec3};
use vertebra_collision::{
    CurvePoint, Curves, Method, PairClass, Query, QueryError, SelfQuery, TriangleMesh,
};
use vertebra_spatial::Pose;

fn is_near(position: DVec3, error: f64, (target, rounded): &(Exact, DVec3)) -> bool {
    // Exact arithmetic is for those in question.
    if position.distance(*rounded) > 2.0 * error + 1e-12 * position.length() {
        return false;
    }
    let off = minus(&exact(position), target);
    let error = rational(error);
    dot(&off, &off) <= &error * &error
}

/// Every point of the curves is an exact one, to within its bound; and the exact points of all pairs are there.
fn check_points(curves: &Curves, pairs: &[(Triangle, Triangle)]) {
    let targets: Vec<_> = pairs
        .iter()
        .flat_map(|(a, b)| meeting_points(a, b))
        .collect();
    for point in curves.points() {
        let is_near = |target| is_near(point.position, point.error, target);
        assert!(
            targets.iter().any(is_near),
            "{point:?} is no point of a pair"
        );
    }
    for target in &targets {
        let is_near = |point: &CurvePoint| is_near(point.position, point.error, target);
        assert!(curves.points().iter().any(is_near), "{target:?} is missing");
    }
}

fn check_query(query: &Query<'_>, a: &TriangleMesh, b: &TriangleMesh) -> Curves {
    let pose = query.relative_pose();
    let posed = |j: u32| b.triangle(j as usize).map(|v| pose.apply(v));
    let corners = |i: u32| a.triangle(i as usize).map(|v| v.as_dvec3());
    let pairs = query.pairs().unwrap();
    let pairs: Vec<_> = pairs.iter().map(|&[i, j]| (corners(i), posed(j))).collect();
    let curves = query.curves().unwrap();
    check_points(&curves, &pairs);
    curves
}

fn length(curves: &Curves) -> f64 {
    let of_one = |curve: &vertebra_collision::Curve| {
        let mut points: Vec<DVec3> = curves.positions(curve).collect();
        if curve.closed {
            points.extend(points.first().copied());
        }
        points.windows(2).map(|p| p[0].distance(p[1])).sum::<f64>()
    };
    curves.curves().iter().map(of_one).sum()
}

/// In general position: closed loops of one segment for every pair, in points that neighbours have in common.
#[test]
fn loops_on_gold_meshes() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let turn = DQuat::from_xyzw(0.1, 0.7, -0.3, 0.2).normalize();
    let pose = Pose::new(turn, DVec3::new(0.21, 0.13, -0.08));
    let query = Query::new(&a, &b).pose_b(pose).unwrap();
    let classified = query.classified().unwrap();
    assert!(
        classified
            .iter()
            .all(|pair| pair.class == PairClass::Crossing)
    );
    let curves = check_query(&query, &a, &b);
    assert!(!curves.curves().is_empty());
    assert!(curves.curves().iter().all(|curve| curve.closed));
    let segments: usize = curves.curves().iter().map(|curve| curve.points.len()).sum();
    assert_eq!(segments, classified.len());
    assert_eq!(segments, curves.points().len());
    let worst = curves.points().iter().map(|p| p.error).fold(0.0, f64::max);
    assert!(worst < 4.0 * f64::EPSILON * 2.0, "{worst}");
    // Repeated vertices are the same points, to the last bit.
    let (soup_a, soup_b) = (exploded(&a), exploded(&b));
    let again = Query::new(&soup_a, &soup_b).pose_b(pose).unwrap();
    assert_eq!(again.curves().unwrap(), curves);
    let moller = query.method(Method::MOLLER).curves();
    assert_eq!(moller, Err(QueryError::NotExact));
}

/// The same curves where they have many touching and coplanar pairs: unposed, and the published scenario.
#[test]
fn gold_meshes_as_they_stand() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    check_query(&Query::new(&a, &b), &a, &b);
}

/// Scaling by powers of two scales the points and their errors exactly.
#[test]
fn powers_of_two() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let curves = Query::new(&a, &b).curves().unwrap();
    for scale in [2.0_f32.powi(-60), 2.0_f32.powi(70)] {
        let scaled = |mesh: &TriangleMesh| {
            let vertices = mesh.vertices().iter().map(|&v| v * scale).collect();
            TriangleMesh::new(vertices, mesh.triangles().to_vec()).unwrap()
        };
        let (a, b) = (scaled(&a), scaled(&b));
        let other = Query::new(&a, &b).curves().unwrap();
        assert_eq!(other.curves(), curves.curves());
        for (small, large) in curves.points().iter().zip(other.points()) {
            assert_eq!(small.position * f64::from(scale), large.position);
            assert_eq!(small.error * f64::from(scale), large.error);
        }
    }
}

/// Triangles that are thin, nearly parallel, or meet nearly at their ends: the bound holds.
#[test]
fn errors_of_hard_pairs() {
    let mut random = Random::new(41);
    let (mut found, mut worst) = (0, 0.0_f64);
    for case in 0..800 {
        let thin = 10.0_f64.powi(-random.int(0, 12) as i32);
        let base: Triangle = [(); 3].map(|()| random.point().as_dvec3());
        let near = |random: &mut Random| {
            let [s, t] = [(); 2].map(|()| random.unit());
            let p = base[0] + (base[1] - base[0]) * s + (base[2] - base[0]) * t;
            (p + random.point().as_dvec3() * thin).as_vec3()
        };
        let b = [(); 3].map(|()| near(&mut random));
        let mesh = |t: [Vec3; 3]| TriangleMesh::new(t.to_vec(), vec![[0, 1, 2]]).unwrap();
        let (a, b) = (mesh(base.map(|p| p.as_vec3())), mesh(b));
        let query = Query::new(&a, &b);
        if query.any().unwrap() {
            let curves = query.curves().unwrap();
            check_points(&curves, &[(wide(&a)[0], wide(&b)[0])]);
            let error = |p: &CurvePoint| p.error;
            worst = curves.points().iter().map(error).fold(worst, f64::max);
            found += 1;
        }
        assert!(case < 700 || found > 50);
    }
    assert!(worst < 1e-14, "{worst}");
}

/// Contacts of all kinds, on a lattice: no area, so that every exact point must be there.
#[test]
fn lattice_pairs() {
    let mut random = Random::new(42);
    let mut kinds = [0; 3];
    for _ in 0..3000 {
        let (a, b) = (random.lattice_triangle(0, 3), random.lattice_triangle(0, 3));
        let mesh = |t: Triangle| {
            TriangleMesh::new(t.map(|p| p.as_vec3()).to_vec(), vec![[0, 1, 2]]).unwrap()
        };
        let (a, b) = (mesh(a), mesh(b));
        let query = Query::new(&a, &b);
        for pair in query.classified().unwrap() {
            if pair.class != PairClass::Area {
                check_query(&query, &a, &b);
            }
            kinds[pair.class.dimension() as usize] += 1;
        }
    }
    assert!(kinds.iter().all(|&count| count > 10), "{kinds:?}");
}

/// Boxes on a box, aligned and not: the curve runs around what they share, once.
#[test]
fn contact_areas_have_an_outline() {
    let below = cuboid(Vec3::ZERO, Vec3::new(4.0, 4.0, 1.0));
    for (min, max, outline) in [
        // The same face, a part within, over a corner, over an edge, and along an edge only.
        ([0.0, 0.0], [4.0, 4.0], 16.0),
        ([1.0, 1.0], [2.0, 3.0], 6.0),
        ([3.0, 2.0], [6.0, 7.0], 6.0),
        ([1.0, -1.0], [3.0, 9.0], 12.0),
        ([4.0, 1.0], [5.0, 2.0], 1.0),
    ] {
        let min = Vec3::new(min[0], min[1], 1.0);
        let above = cuboid(min, Vec3::new(max[0], max[1], 2.0));
        for (a, b) in [(&below, &above), (&above, &below)] {
            let curves = Query::new(a, b).curves().unwrap();
            assert_eq!(length(&curves), outline, "{min}: {curves:?}");
            assert_eq!(curves.curves().len(), 1, "{min}: {curves:?}");
            assert_eq!(curves.curves()[0].closed, outline > 1.0);
            let split = Query::new(&exploded(a), &exploded(b)).curves().unwrap();
            assert_eq!(split, curves);
        }
    }
    // A corner on a face, alone; and a surface on itself, which has no outline.
    let tip = TriangleMesh::new(
        vec![
            Vec3::new(1.0, 2.0, 1.0),
            Vec3::new(1.0, 2.0, 5.0),
            Vec3::new(2.0, 2.0, 5.0),
        ],
        vec![[0, 1, 2]],
    );
    let curves = Query::new(&below, &tip.unwrap()).curves().unwrap();
    assert_eq!(curves.curves().len(), 1);
    assert!(!curves.curves()[0].closed);
    assert_eq!(curves.points().len(), 1);
    assert_eq!(curves.points()[0].position, DVec3::new(1.0, 2.0, 1.0));
    assert_eq!(curves.points()[0].error, 0.0);
    let sphere = gold_mesh("sphere");
    assert!(
        Query::new(&sphere, &sphere)
            .curves()
            .unwrap()
            .curves()
            .is_empty()
    );
}

/// Sides through sides, vertices on sides and on vertices: boxes whose corners and diagonals hit each other's.
#[test]
fn degenerate_crossings_close() {
    let cube = cuboid(Vec3::splat(-2.0), Vec3::splat(2.0));
    // An octahedron through the cube's faces: its curves are the cut-off corners, and its vertices stand out.
    let tips = [
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::NEG_Y,
        Vec3::Z,
        Vec3::NEG_Z,
    ];
    let octahedron = |radius: f32| {
        let faces = (0..8).map(|i| [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)]);
        TriangleMesh::new(tips.map(|p| p * radius).to_vec(), faces.collect()).unwrap()
    };
    for (radius, count) in [(3.0, 6), (4.0, 1), (2.0, 6)] {
        let octahedron = octahedron(radius);
        let query = Query::new(&cube, &octahedron);
        let curves = check_query(&query, &cube, &octahedron);
        match count {
            // A square around each tip, of diagonal 2 (r - 2).
            _ if radius == 3.0 => {
                assert_eq!(curves.curves().len(), 6);
                assert!(curves.curves().iter().all(|curve| curve.closed));
                let error = length(&curves) - 6.0 * 4.0 * 2.0_f64.sqrt();
                assert!(error.abs() < 1e-14 * 100.0, "{error}");
            }
            // The squares meet in the middles of the cube's edges: open curves between junctions.
            _ if radius == 4.0 => {
                let error = length(&curves) - 6.0 * 8.0 * 2.0_f64.sqrt();
                assert!(error.abs() < 1e-14 * 100.0, "{error}");
            }
            // The tips only touch, at the middles of the faces, on their diagonals.
            _ => {
                assert_eq!(curves.curves().len(), 6);
                assert!(curves.points().iter().all(|p| p.error == 0.0));
            }
        }
    }
}

/// A side that is cut open by a triangle of zero area: the curve passes over it.
#[test]
fn triangles_of_zero_area_do_not_interrupt() {
    let corners = vec![
        Vec3::ZERO,
        Vec3::X * 8.0,
        Vec3::Y * 8.0,
        Vec3::Z * 8.0,
        Vec3::new(3.0, 0.0, 0.0),
    ];
    // The side 0 1 of the lower face goes by vertex 4, of the front face not.
    let faces = vec![
        [0, 4, 2],
        [4, 1, 2],
        [0, 1, 3],
        [0, 4, 1],
        [0, 2, 3],
        [1, 2, 3],
    ];
    let solid = TriangleMesh::new(corners, faces).unwrap();
    assert_eq!(solid.zero_area(), [3]);
    for x in [1.0, 3.0, 5.3] {
        let wall = [[-30.0, -30.0], [30.0, -30.0], [0.0, 30.0]].map(|[y, z]| Vec3::new(x, y, z));
        let wall = TriangleMesh::new(wall.to_vec(), vec![[0, 1, 2]]).unwrap();
        let query = Query::new(&solid, &wall);
        let curves = check_query(&query, &solid, &wall);
        assert_eq!(curves.curves().len(), 1, "{curves:?}");
        assert!(curves.curves()[0].closed);
    }
}

/// A mesh of two boxes through each other meets itself where the two boxes meet.
#[test]
fn curves_of_a_mesh_with_itself() {
    let one = cuboid(Vec3::ZERO, Vec3::splat(2.0));
    let other = cuboid(Vec3::new(0.5, 0.25, 1.0), Vec3::new(1.5, 1.75, 3.0));
    let apart = Query::new(&one, &other).curves().unwrap();
    let vertices = [one.vertices(), other.vertices()].concat();
    let shifted = other.triangles().iter().map(|t| t.map(|i| i + 8));
    let triangles = one.triangles().iter().copied().chain(shifted).collect();
    let both = TriangleMesh::new(vertices, triangles).unwrap();
    assert_eq!(length(&apart), 5.0);
    // In any order of the triangles, so that either box may have the first of a pair.
    let mut random = Random::new(43);
    for _ in 0..10 {
        let mut mixed = both.triangles().to_vec();
        mixed.sort_by_cached_key(|_| random.int(0, 1000));
        let mixed = TriangleMesh::new(both.vertices().to_vec(), mixed).unwrap();
        let together = SelfQuery::new(&mixed).curves();
        assert_eq!(length(&together), 5.0);
        assert_eq!(together.points().len(), apart.points().len());
        assert!(together.curves().iter().all(|curve| curve.closed));
    }
    assert!(SelfQuery::new(&one).curves().curves().is_empty());
}
