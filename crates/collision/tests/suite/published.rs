//! Pairs on which published triangle tests have erred, each with the report (project#number on GitHub) it is from.

use crate::support::{ORDERS, Random, Triangle, oracle, wide};
use glam::{DVec3, Vec3};
use vertebra_collision::exact::triangles_intersect;
use vertebra_collision::moller::{DEFAULT_EPSILON, PlanedTriangle};
use vertebra_collision::{Query, SelfQuery, TriangleMesh};

/// Checks the answer, and that rational arithmetic gives it, in all 72 relabellings.
fn check(what: &str, a: [[f64; 3]; 3], b: [[f64; 3]; 3], expected: bool) {
    let (a, b): (Triangle, Triangle) = (a.map(DVec3::from), b.map(DVec3::from));
    assert_eq!(oracle(&a, &b), expected, "{what}: the expectation is wrong");
    for order in ORDERS {
        for other in ORDERS {
            let (a, b) = (order.map(|i| a[i]), other.map(|i| b[i]));
            assert_eq!(
                triangles_intersect(&a, &b),
                expected,
                "{what}: {order:?} {other:?}"
            );
            assert_eq!(
                triangles_intersect(&b, &a),
                expected,
                "{what}: {other:?} {order:?}"
            );
        }
    }
}

/// The two-dimensional decision tree of Guigue & Devillers 2003, region IV.b, as printed: two missed hits.
#[test]
fn coplanar_missed_by_the_printed_decision_tree() {
    check(
        "LokiResearch/fast-triangle-triangle-intersection#3",
        [[-1.0, 0.0, 0.0], [2.0, 0.0, -2.0], [2.0, 0.0, 2.0]],
        [[0.551, 0.0, -0.796], [1.224, 0.0, 0.326], [3.469, 0.0, 1.0]],
        true,
    );
    check(
        "LokiResearch/fast-triangle-triangle-intersection#3, second",
        [[0.0, 0.0, 0.0], [0.0, 0.0, 8.0], [8.0, 0.0, 0.0]],
        [[2.0, 0.0, 2.0], [1.0, 0.0, 4.0], [9.0, 0.0, 0.0]],
        true,
    );
}

/// False hits of the same authors' code in double precision on disjoint triangles.
#[test]
fn disjoint_but_hit_in_double_precision() {
    check(
        "benardp/contours#1",
        [
            [12.3015, -0.253368, 5.49101],
            [18.6765, -2.55337, 4.91756],
            [12.3015, -2.55337, 4.91756],
        ],
        [
            [-11.9885, -0.253368, 5.49101],
            [1.61448, -0.253368, 5.49101],
            [1.61448, -2.55337, 4.91756],
        ],
        false,
    );
    let a = [
        [0.392347991466522, 0.384436011314392, 0.447445005178452],
        [0.39079749584197976, 0.3850367590785025, 0.45253425091505073],
        [0.387003496289253, 0.38789276033639897, 0.45634675025939975],
    ];
    let b = [
        [0.3892470002174375, 0.385637506842613, 0.4576234966516495],
        [0.39279749989509577, 0.37299175560474374, 0.455539248883724],
        [0.3876965045928953, 0.3862382546067235, 0.4627127423882482],
    ];
    check("libigl/libigl#2382", a, b, false);
    // The false hit was gone ten times as large.
    let larger = |t: [[f64; 3]; 3]| t.map(|p| p.map(|x| 10.0 * x));
    check("libigl/libigl#2382, tenfold", larger(a), larger(b), false);
}

/// A triangle divided twice, nearly flat, in which five pairs were found that meet beyond their common corners. Rounded to
/// `f32` it is other triangles: what they do, exact arithmetic says.
#[test]
fn subdivided_patch() {
    // libigl/libigl#2381
    let corners: [[f64; 3]; 15] = [
        [0.280039012432098, 0.827663004398346, 0.463775008916855],
        [0.33890101313591, 0.788042008876801, 0.488126993179321],
        [0.318053007125854, 0.768364012241364, 0.493088006973267],
        [0.309470012784004, 0.807852506637573, 0.475951001048088],
        [0.299046009778976, 0.798013508319855, 0.47843150794506],
        [0.328477010130882, 0.778203010559082, 0.490607500076294],
        [0.294754512608051, 0.81775775551796, 0.469863004982472],
        [0.289542511105537, 0.8128382563591, 0.471103258430958],
        [0.324185512959957, 0.797947257757187, 0.482038997113705],
        [0.333689011633396, 0.783122509717942, 0.489367246627808],
        [0.308549508452415, 0.783188760280609, 0.485759757459164],
        [0.323265008628368, 0.773283511400223, 0.49184775352478],
        [0.30425801128149, 0.802933007478714, 0.477191254496574],
        [0.318973511457443, 0.793027758598328, 0.483279250562191],
        [0.313761509954929, 0.788108259439469, 0.484519504010678],
    ];
    let triangles = vec![
        [2, 11, 10],
        [1, 8, 9],
        [0, 7, 6],
        [3, 12, 13],
        [5, 14, 11],
        [3, 13, 8],
        [4, 12, 7],
        [4, 14, 12],
        [4, 10, 14],
        [5, 9, 13],
        [3, 6, 12],
        [5, 13, 14],
        [14, 10, 11],
        [13, 9, 8],
        [12, 6, 7],
        [14, 13, 12],
    ];
    let vertices = corners.map(|p| DVec3::from(p).as_vec3()).to_vec();
    let patch = TriangleMesh::new(vertices, triangles).unwrap();
    assert_eq!(SelfQuery::new(&patch).pairs(), [[0; 2]; 0]);
    let wide = wide(&patch);
    let mut expected = Vec::new();
    for (i, a) in (0..).zip(&wide) {
        for (j, b) in (0..).zip(&wide) {
            if oracle(a, b) {
                expected.push([i, j]);
            }
        }
    }
    assert_eq!(Query::new(&patch, &patch).pairs().unwrap(), expected);
}

/// A corner on a face: the segment that was constructed there had no length, and an assertion failed.
#[test]
fn corner_on_a_face() {
    check(
        "CGAL/cgal#2319",
        [
            [
                0.04576947784423828,
                0.07539492797851563,
                0.01373538398742676,
            ],
            [
                0.03664541244506836,
                0.06001359558105469,
                0.01373538398742676,
            ],
            [
                0.04964596557617187,
                0.05009873580932617,
                0.01373538398742676,
            ],
        ],
        [
            [
                0.04411455535888672,
                0.06683123779296875,
                0.01373538398742676,
            ],
            [0.0444151611328125, 0.06636723327636719, 0.01425909328460693],
            [
                0.04411455535888672,
                0.06630753326416015,
                0.01425909328460693,
            ],
        ],
        true,
    );
}

/// A corner that both triangles share, in a common plane: six of the 36 corner orders once disagreed.
#[test]
fn answer_once_depended_on_the_order_of_corners() {
    check(
        "llnl/axom#152",
        [
            [76.648, 54.6752, 15.0012],
            [76.648, 54.6752, 14.5542],
            [76.582, 54.6752, 14.7879],
        ],
        [
            [76.6252, 54.6752, 14.892],
            [76.582, 54.6752, 14.7879],
            [76.5617, 54.6752, 14.7929],
        ],
        true,
    );
}

/// Near-coplanar pairs whose intersection segments, or even answers by order, were wrong.
#[test]
fn perpendicular_and_near_coplanar() {
    check(
        "gkjohnson/three-mesh-bvh#655: answers differed by the order of the triangles",
        [
            [32.22699737548828, 1.2630000114440918, -11.8149995803833],
            [31.316997528076172, 1.2630000114440918, -11.739999771118164],
            [32.22699737548828, 1.2630000114440918, -11.739999771118164],
        ],
        [
            [31.316997528076172, 1.933000087738037, -7.585000038146973],
            [31.316997528076172, -0.8669999837875366, -7.295000076293945],
            [31.316997528076172, -0.8669999837875366, -7.585000038146973],
        ],
        false,
    );
    check(
        "gkjohnson/three-mesh-bvh#538: a plane that is slightly bent, by one order only",
        [
            [-5.781455993652344, -7.291503906249993, -30.0],
            [-5.781455993652344, -7.291503906250007, 30.0],
            [0.0, -7.291503906249993, -30.0],
        ],
        [
            [-5.781455993652344, -7.29150390625, -4.098872661590576],
            [-6.386039733886719, 11.163619995117188, -4.485982418060303],
            [13.468360900878906, -6.142303466796875, -4.028029918670654],
        ],
        true,
    );
    check(
        "BrunoLevy/geogram#10: an assertion failed in place of an answer",
        [
            [1898.68, 775.0, 1158.48],
            [2000.0, 775.0, 1166.7],
            [1898.68, 675.0, 1148.6],
        ],
        [
            [1966.41, 675.0, 1163.79],
            [1971.63, 675.0, 1166.95],
            [1967.56, 684.554, 1166.67],
        ],
        false,
    );
    check(
        "a segment through a corner's neighbourhood",
        [[1.0, 4.0, 0.0], [3.0, 2.0, 0.0], [5.0, 4.0, 0.0]],
        [[0.0, 1.0, 0.0], [20.0, 6.0, 0.0], [20.0, 6.0, 0.0]],
        false,
    );
    check(
        "gkjohnson/three-mesh-bvh#543: edge through a nearly parallel triangle",
        [
            [-15.430519104003906, 29.432968139648445, -25.0],
            [-15.430519104003906, 29.43296813964843, 25.0],
            [0.0, 29.432968139648445, -25.0],
        ],
        [
            [-4.854911804199219, 36.03794860839844, 0.0777292251586914],
            [-15.430519104003906, 29.432968139648438, -1.905876636505127],
            [-16.118995666503906, 26.962722778320312, -2.8487582206726074],
        ],
        true,
    );
    check(
        "a point of zero area away from a box side",
        [[0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [0.5, 0.5, -0.5]],
        [[0.0; 3]; 3],
        false,
    );
}

/// A coplanarity test without an absolute value takes any parallel triangle on one side for coplanar.
#[test]
fn parallel_at_any_distance() {
    let a = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for z in [-1e6, -1.0, -1e-12, 1e-12, 1e6] {
        check("parallel", a, a.map(|[x, y, _]| [x, y, z]), false);
    }
}

/// What the baseline's documentation says of it: errors by unit of length, by size, and far from the origin.
#[test]
fn where_the_interval_test_errs() {
    let base = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let above = base.map(|p| p + Vec3::Z * 0.5);
    let answers = |a: [Vec3; 3], b: [Vec3; 3]| {
        let exact = triangles_intersect(&a.map(|p| p.as_dvec3()), &b.map(|p| p.as_dvec3()));
        let moller = PlanedTriangle::new(a).intersects(&PlanedTriangle::new(b), DEFAULT_EPSILON);
        (exact, moller)
    };
    assert_eq!(answers(base, above), (false, false));
    // Millimetre triangles in metres, up to a metre apart, are taken for coplanar.
    let small = |t: [Vec3; 3]| t.map(|p| p * 1e-3);
    assert_eq!(answers(small(base), small(above)), (false, true));
    let apart = base.map(|p| p * 0.7e-3 + Vec3::Z * 0.9);
    assert_eq!(answers(small(base), apart), (false, true));
    // Far from the origin N·x and d cancel: parallel triangles two steps of f32 apart seem to meet.
    let mut random = Random::new(2);
    let mut wrong = 0;
    for _ in 0..200 {
        let a = [(); 3].map(|()| random.point() + Vec3::splat(10_000.0));
        let b = a.map(|p| p + Vec3::Z * (2.0 * 16_384.0 * f32::EPSILON / 2.0));
        let (exact, moller) = answers(a, b);
        assert!(!exact);
        wrong += usize::from(moller);
    }
    assert!(wrong > 20, "{wrong}");
}
