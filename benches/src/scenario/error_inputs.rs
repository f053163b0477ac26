//! Pairs of triangles on which tests of collision err: near touching, tiny and huge, far from the
//! origin, stacked face to face, thin, in one plane, in nearly parallel ones; and what two meshes make
//! of them.

use super::meshes;
use vertebra::collision::RelativePose;
use vertebra::glam::{DVec3, Vec3};
use vertebra::{Pose, Random};

/// Two triangles \[m].
pub type TrianglePair = [[Vec3; 3]; 2];

/// Draws one pair.
type Draw = fn(&mut Random) -> TrianglePair;

/// Pairs of each generated list.
const COUNT: usize = 2000;

/// Units of length that the random pairs are given in: one metre, as numbers.
/// The smallest are subnormal in f32.
const SCALES: [f32; 8] = [1e-40, 1e-30, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e30];

/// Distances of the random pairs from the origin \[m].
const OFFSETS: [f32; 5] = [1.0, 1e2, 1e4, 1e6, 1e7];

/// The lists and their names.
///
/// # Errors
/// None in practice: the meshes are valid.
pub fn lists(seed: u64) -> anyhow::Result<Vec<(String, Vec<TrianglePair>)>> {
    let mut lists = Vec::new();
    for subject in meshes::subjects()? {
        lists.push((subject.scenario.clone(), candidates(&subject)?));
    }
    let mut random = Random::new(seed);
    lists.push(("nearly touching".to_owned(), nearly_touching(&mut random)));
    lists.push((
        "nearly touching at origin".to_owned(),
        nearly_touching_at_the_origin(&mut random),
    ));
    let pairs: Vec<TrianglePair> = (0..COUNT).map(|_| random_pair(&mut random)).collect();
    let moved = |change: &dyn Fn(Vec3) -> Vec3| -> Vec<TrianglePair> {
        pairs
            .iter()
            .map(|pair| pair.map(|t| t.map(change)))
            .collect()
    };
    for scale in SCALES {
        lists.push((format!("size {scale:e}"), moved(&|p| p * scale)));
    }
    // Along no axis, so that all coordinates lose digits.
    let aside = Vec3::new(0.6, -0.5, 0.62);
    for offset in OFFSETS {
        lists.push((format!("offset {offset:e}"), moved(&|p| p + aside * offset)));
    }
    lists.push(("stacked boxes".to_owned(), stacked_boxes(&mut random)));
    let drawn: [(&str, Draw); 10] = [
        ("lattice", lattice_pair),
        ("one plane", coplanar_pair),
        ("common edges", edge_pair),
        ("common corners", corner_pair),
        ("parallel planes ulps apart", parallel_pair),
        ("nearly parallel planes", tilted_pair),
        ("slivers", sliver_pair),
        ("touching in fractions", touching_pair),
        ("pieces of a triangle", pieces_pair),
        ("a millionth apart", apart_pair),
    ];
    for (name, draw) in drawn {
        let pairs = (0..COUNT).map(|_| draw(&mut random)).collect();
        lists.push((name.to_owned(), pairs));
    }
    Ok(lists)
}

/// Pairs of triangles of two meshes whose boxes overlap: what culling leaves to the test.
fn candidates(subject: &meshes::Subject) -> anyhow::Result<Vec<TrianglePair>> {
    let pose = RelativePose::between(&Pose::IDENTITY, &subject.pose_b)?;
    let corners = |mesh: &vertebra::TriangleMesh, place: &dyn Fn(Vec3) -> Vec3| {
        let vertices: Vec<Vec3> = mesh.vertices().iter().map(|&v| place(v)).collect();
        let triangle = |t: &[u32; 3]| t.map(|v| vertices[v as usize]);
        mesh.triangles().iter().map(triangle).collect::<Vec<_>>()
    };
    let a = corners(&subject.a, &|v| v);
    let b = corners(&subject.b, &|v| pose.apply(v).as_vec3());
    let extent = |t: &[Vec3; 3]| {
        let [p, q, r] = *t;
        (p.min(q).min(r), p.max(q).max(r))
    };
    let boxes_b: Vec<(Vec3, Vec3)> = b.iter().map(extent).collect();
    let mut pairs = Vec::new();
    for t in &a {
        let (low, high) = extent(t);
        for (u, (low_b, high_b)) in b.iter().zip(&boxes_b) {
            if low.cmple(*high_b).all() && low_b.cmple(high).all() {
                pairs.push([*t, *u]);
            }
        }
    }
    Ok(pairs)
}

fn single(random: &mut Random) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "a random number")]
    let number = random.symmetric() as f32;
    number
}

fn random_triangle(random: &mut Random) -> [Vec3; 3] {
    std::array::from_fn(|_| Vec3::new(single(random), single(random), single(random)))
}

/// Two triangles with corners in a cube of 2 m.
fn random_pair(random: &mut Random) -> TrianglePair {
    [random_triangle(random), random_triangle(random)]
}

/// Corners at whole numbers from 0 to 2: every kind of touching, often.
fn lattice_pair(random: &mut Random) -> TrianglePair {
    let coordinates = [0.0, 1.0, 2.0];
    let mut corner = || Vec3::from_array(std::array::from_fn(|_| coordinates[random.below(3)]));
    std::array::from_fn(|_| std::array::from_fn(|_| corner()))
}

/// Both in one plane across an axis.
fn coplanar_pair(random: &mut Random) -> TrianglePair {
    let (axis, height) = (random.below(3), single(random));
    random_pair(random).map(|t| t.map(|corner| with(corner, axis, height)))
}

/// With an edge in common, folded anyhow, every fourth time flat but for two ulps.
fn edge_pair(random: &mut Random) -> TrianglePair {
    let [p, q, r] = random_triangle(random);
    let mut apex = random_triangle(random)[0];
    if random.below(4) == 0 {
        let flat = r.as_dvec3() * 1.25 - p.as_dvec3() * 0.25;
        apex = flat.as_vec3();
    }
    [[p, q, r], [apex, q, p]]
}

/// With a corner in common.
fn corner_pair(random: &mut Random) -> TrianglePair {
    let [p, q, r] = random_triangle(random);
    let [s, t, _] = random_triangle(random);
    [[p, q, r], [s, p, t]]
}

/// In planes across an axis that lie up to four ulps apart.
fn parallel_pair(random: &mut Random) -> TrianglePair {
    let (axis, low) = (random.below(3), single(random));
    let high = (0..random.below(5)).fold(low, |height, _| height.next_up());
    let [a, b] = random_pair(random);
    [
        a.map(|corner| with(corner, axis, low)),
        b.map(|corner| with(corner, axis, high)),
    ]
}

/// In planes that meet under an angle of 2^-10 to 2^-24, through the middle of both.
fn tilted_pair(random: &mut Random) -> TrianglePair {
    let [a, b] = random_pair(random);
    let slope = [0.5_f32.powi(10), 0.5_f32.powi(17), 0.5_f32.powi(24)][random.below(3)];
    [
        a.map(|corner| with(corner, 2, 0.0)),
        b.map(|corner| with(corner, 2, slope * corner.x)),
    ]
}

/// A million times as long as wide, past each other at a distance of that width.
fn sliver_pair(random: &mut Random) -> TrianglePair {
    const WIDTH: f32 = 1e-6;
    std::array::from_fn(|_| {
        let [tip, aside, shift] = random_triangle(random);
        [tip, -tip, aside * WIDTH].map(|corner| corner + shift * (0.3 * WIDTH))
    })
}

/// A corner or the middle of a side of one exactly on a face or side of the other: all coordinates are 64ths, and the
/// place has quarters and halves of them.
fn touching_pair(random: &mut Random) -> TrianglePair {
    let mut grid = || {
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let mut number = || random.below(129) as f32 / 64.0 - 1.0;
        Vec3::new(number(), number(), number())
    };
    let [p, q, r, s, t] = [(); 5].map(|()| grid());
    let on = match random.below(3) {
        0 => p * 0.5 + (q + r) * 0.25,
        1 => (p + q) * 0.5,
        _ => p * 0.25 + q * 0.75,
    };
    let b = match random.below(2) {
        0 => [on, s, t],
        _ => [on + s, on - s, t],
    };
    [[p, q, r], b]
}

/// A quarter of a triangle and a sixteenth of it, whose corners are middles of sides, rounded: neighbours in one surface,
/// some with corners on others' sides.
fn pieces_pair(random: &mut Random) -> TrianglePair {
    let piece = |[p, q, r]: [Vec3; 3], which: usize| {
        let [pq, qr, rp] = [(p + q) * 0.5, (q + r) * 0.5, (r + p) * 0.5];
        [[p, pq, rp], [pq, q, qr], [rp, qr, r], [pq, qr, rp]][which]
    };
    let whole = random_triangle(random);
    let [a, b, c] = [(); 3].map(|()| random.below(4));
    [piece(whole, a), piece(piece(whole, b), c)]
}

/// A triangle, and another that stands a millionth of their size above or below its plane.
fn apart_pair(random: &mut Random) -> TrianglePair {
    let a = random_triangle(random);
    let [p, q, r] = a.map(Vec3::as_dvec3);
    let up = (q - p).cross(r - p).normalize_or(DVec3::Z);
    let (s, t) = (share(random), share(random));
    let on = p + (q - p) * (s * (1.0 - t)) + (r - p) * t;
    let gap = 2.5e-6 * random.symmetric();
    let mut beyond = || {
        let aside = DVec3::new(random.symmetric(), random.symmetric(), random.symmetric());
        (on + aside * 0.3 + up * 0.6).as_vec3()
    };
    [a, [(on + up * gap).as_vec3(), beyond(), beyond()]]
}

fn with(corner: Vec3, axis: usize, height: f32) -> Vec3 {
    let mut coordinates = corner.to_array();
    coordinates[axis] = height;
    Vec3::from_array(coordinates)
}

/// A triangle, and another with one corner within two ulps of it.
fn nearly_touching(random: &mut Random) -> Vec<TrianglePair> {
    pairs_of_area(random, |random| {
        let a = random_triangle(random);
        let [p, q, r] = a.map(Vec3::as_dvec3);
        let (s, t) = (share(random), share(random));
        (a, p + (q - p) * (s * (1.0 - t)) + (r - p) * t)
    })
}

/// The same where the origin lies on an edge and the near corner within 1e-9 m of it: there single
/// precision tells places apart that differ by less than double precision resolves at the other
/// corners.
fn nearly_touching_at_the_origin(random: &mut Random) -> Vec<TrianglePair> {
    pairs_of_area(random, |random| {
        let [p, q, _] = random_triangle(random);
        let inward = q.as_dvec3() * share(random) + p.as_dvec3() * (0.3 * random.symmetric());
        ([p, -p, q], inward * 1e-9)
    })
}

/// Pairs of a triangle and one that touches it nearly, from triangles and points on them.
fn pairs_of_area(
    random: &mut Random,
    mut next: impl FnMut(&mut Random) -> ([Vec3; 3], DVec3),
) -> Vec<TrianglePair> {
    let mut pairs = Vec::new();
    while pairs.len() < COUNT {
        let (a, on) = next(random);
        let [p, q, r] = a.map(Vec3::as_dvec3);
        let normal = (q - p).cross(r - p);
        if normal.length() > 0.1 {
            pairs.push([a, standing_on(random, normal, on)]);
        }
    }
    pairs
}

/// A number in (0.05, 0.95).
fn share(random: &mut Random) -> f64 {
    0.05 + 0.9 * random.unit()
}

/// A triangle with one corner within two ulps of a point in a plane, the others beyond the plane.
fn standing_on(random: &mut Random, normal: DVec3, on: DVec3) -> [Vec3; 3] {
    let mut tip = on.as_vec3().to_array();
    let across = &mut tip[largest(normal)];
    let ulps = random.below(5);
    for _ in 0..ulps.abs_diff(2) {
        *across = if ulps > 2 {
            across.next_up()
        } else {
            across.next_down()
        };
    }
    let up = normal.normalize();
    let mut beyond = || {
        let aside = DVec3::new(random.symmetric(), random.symmetric(), random.symmetric());
        (on + aside * 0.3 + up * 0.6).as_vec3()
    };
    [Vec3::from_array(tip), beyond(), beyond()]
}

fn largest(v: DVec3) -> usize {
    let v = v.abs().to_array();
    let mut axis = 0;
    for k in 1..3 {
        if v[k] > v[axis] {
            axis = k;
        }
    }
    axis
}

/// Boxes standing on boxes, with sides that are no binary fractions: all triangles of one against
/// all of the other. Every other box floats by one ulp.
fn stacked_boxes(random: &mut Random) -> Vec<TrianglePair> {
    let mut pairs = Vec::new();
    let mut floats = false;
    while pairs.len() < COUNT {
        // Tenths: boxes often share edges and corners too.
        #[expect(clippy::cast_precision_loss, reason = "at most ten")]
        let mut tenth = |below: usize| (1 + random.below(below)) as f32 * 0.1;
        let lower_size = Vec3::new(tenth(9), tenth(9), tenth(9));
        let upper_size = Vec3::new(tenth(9), tenth(9), tenth(9));
        let top = lower_size.z;
        let bottom = if floats { top.next_up() } else { top };
        floats = !floats;
        let corner = Vec3::new(tenth(5) - 0.3, tenth(5) - 0.3, bottom);
        let lower = cuboid(Vec3::ZERO, lower_size);
        let upper = cuboid(corner, corner + upper_size);
        for t in lower {
            pairs.extend(upper.map(|u| [t, u]));
        }
    }
    pairs
}

/// The twelve triangles of a box.
fn cuboid(low: Vec3, high: Vec3) -> [[Vec3; 3]; 12] {
    let corner = |index: usize| {
        let pick = |bit: usize, low: f32, high: f32| if index >> bit & 1 == 0 { low } else { high };
        Vec3::new(
            pick(0, low.x, high.x),
            pick(1, low.y, high.y),
            pick(2, low.z, high.z),
        )
    };
    std::array::from_fn(|k| {
        let (face, half) = (k / 2, k % 2);
        // The corners of the face where coordinate `axis` is low or high, once around.
        let (axis, side) = (face / 2, face % 2);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let around = [0, 1 << u, 1 << u | 1 << v, 1 << v].map(|c| corner(c | side << axis));
        [around[0], around[1 + half], around[2 + half]]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_closed() {
        let triangles = cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0));
        let area: f32 = triangles
            .iter()
            .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
            .sum();
        assert_eq!(area, 22.0);
    }

    #[test]
    fn lists_are_the_same_for_the_same_seed() -> anyhow::Result<()> {
        let (first, again) = (lists(1)?, lists(1)?);
        assert!(first == again && first.iter().all(|(_, pairs)| pairs.len() > 300));
        assert!(lists(2)? != first);
        Ok(())
    }
}
