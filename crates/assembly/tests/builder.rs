//! Builders against descriptions written by hand, solids against closed forms.

mod common;

use common::{Digest, assert_same_placement, body_placements};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use vertebra_assembly::generate::{self, Rod};
use vertebra_assembly::{
    BodyShape, Builder, Centerline, Compound, Joint, JointLimits, MassProperties, Mimic,
    ModelDescription, Random, State, mechanism,
};
use vertebra_spatial::Pose;

fn up(length: f64) -> Pose {
    Pose::from_translation(DVec3::new(0.0, 0.0, length))
}

/// To the last bit.
fn assert_same(built: &Builder, written: &ModelDescription) {
    let (a, b) = (built.describe(), written.clone());
    let names = |d: &ModelDescription| -> Vec<String> {
        d.bodies
            .iter()
            .map(|b| format!("{} on {:?}", b.name, b.parent))
            .collect()
    };
    assert_eq!(names(&a), names(&b));
    assert_eq!(Digest::of(&a), Digest::of(&b));
    assert_eq!(a, b);
}

#[test]
fn sentences_are_descriptions_written_by_hand() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let fork = up(0.5);
    let side = Pose::from_translation(DVec3::X);
    let wrist = || Joint::universal(DVec3::X, DVec3::Y);
    let built = Builder::new("arms")
        .gravity(DVec3::new(0.0, -9.0, 0.0))
        .body("trunk", Joint::fixed(), rod)
        .branch(|trunk| {
            trunk
                .body("upper", Joint::revolute(DVec3::X).at(fork), rod)
                .body("lower", wrist().at(fork), rod)
        })
        .body("left", Joint::prismatic(DVec3::Y).at(side), rod)
        .from("upper")
        .frame("mark", side)
        .from_world()
        .body("other", Joint::free(), rod)
        .weld(rod.placed(&side));
    let written = ModelDescription::new("arms")
        .gravity(DVec3::new(0.0, -9.0, 0.0))
        .body("trunk", None, Joint::fixed(), rod)
        .body(
            "upper",
            Some("trunk"),
            Joint::revolute(DVec3::X).at(fork),
            rod,
        )
        .body(
            "lower.1",
            Some("upper"),
            Joint::revolute(DVec3::X).at(fork),
            MassProperties::MASSLESS,
        )
        .body("lower", Some("lower.1"), Joint::revolute(DVec3::Y), rod)
        .body(
            "left",
            Some("trunk"),
            Joint::prismatic(DVec3::Y).at(side),
            rod,
        )
        .body(
            "other",
            None,
            Joint::free(),
            rod.combined(&rod.placed(&side)),
        )
        .frame("mark", Some("upper"), side);
    assert_same(&built, &written);
}

#[test]
fn chains_and_helices_are_those_of_the_generators() {
    let rod = Rod::default();
    let mass = MassProperties::rod(rod.mass, rod.length, rod.radius);
    let joint = Joint::spherical();
    let chain = Builder::new("chain").chain("body", 17, joint.clone(), mass, up(rod.length));
    assert_same(
        &chain,
        &generate::chain(17, &joint, &rod).unwrap().describe(),
    );
    let helix = Builder::new("helix").helix(
        "body",
        9,
        Joint::revolute(DVec3::X),
        mass,
        (rod.length, 0.3, 0.7),
    );
    assert_same(
        &helix,
        &generate::helix(9, &rod, 0.3, 0.7).unwrap().describe(),
    );
}

#[test]
fn parts_are_inserted_under_names_of_their_own() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let mut coupled = Joint::revolute(DVec3::X).at(up(0.5));
    coupled.mimic = Some(Mimic {
        body: "bone-0".to_owned(),
        multiplier: 0.5,
        offset: 0.0,
    });
    let finger = Builder::new("finger")
        .chain("bone", 2, Joint::revolute(DVec3::X), rod, up(0.5))
        .body("tip", coupled, rod)
        .joint_named("knuckle")
        .tag("tip")
        .frame("nail", up(0.5));
    let at = |x: f64| Pose::from_translation(DVec3::new(x, 0.0, 0.0));
    let hand = Builder::new("hand")
        .body("palm", Joint::free(), rod)
        .attach("left", &finger, at(-1.0))
        .attach("right", &finger, at(1.0))
        .tag("palm")
        .build()
        .unwrap();
    assert_eq!(hand.model.bodies().len(), 7);
    let palm = hand.model.find("palm");
    assert_eq!(hand.tagged("palm"), [palm.unwrap()]);
    let tips: Vec<_> = ["left/tip", "right/tip"]
        .map(|name| hand.model.find(name).unwrap())
        .into();
    assert_eq!(hand.tagged("tip"), tips);
    assert_eq!(hand.joint("right/knuckle"), Some(tips[1]));
    assert!(hand.tagged("none").is_empty() && hand.joint("knuckle").is_none());
    let body = |name: &str| hand.model.body(hand.model.find(name).unwrap()).unwrap();
    assert_eq!(body("left/bone-0").parent, palm);
    assert_eq!(body("right/bone-0").joint.parent_placement, at(1.0));
    assert_eq!(
        body("right/tip").joint.mimic.as_ref().unwrap().body,
        "right/bone-0"
    );
    let nail = hand.model.find_frame("left/nail").unwrap();
    assert_eq!(nail.body, Some(tips[0]));
}

/// The same coordinates put the mirror image where the mirror shows the original.
#[test]
fn mirror_images_move_as_mirrors_show() {
    let mut random = Random::new(8);
    let mut limb = Builder::new("limb");
    for index in 0..12 {
        let axis = random.direction();
        let joint = match index % 5 {
            0 => Compound::from(Joint::revolute(axis)),
            1 => Joint::prismatic(axis).into(),
            2 => Joint::screw(axis, 0.3).into(),
            3 => Joint::cylindrical(axis),
            _ => Joint::universal(axis, axis.any_orthonormal_vector()),
        };
        let mut pose = || Pose::new(random.rotation(), random.direction());
        let joint = joint.at(pose()).on_child(pose());
        let matter = BodyShape::cuboid(DVec3::new(0.1, 0.2, 0.3)).placed(&pose());
        limb = limb.body(format!("part {index}"), joint, matter);
    }
    let normal = DVec3::new(1.0, -2.0, 0.5);
    let original = limb.clone().build().unwrap().model;
    let image = Builder::new("image").mirror("m", &limb, normal, Pose::IDENTITY);
    let image = image.build().unwrap().model;
    let state = State::random(&original, 3);
    let (shown, moved) = (
        body_placements(&original, &state.q),
        body_placements(&image, &state.q),
    );
    let n = normal.normalize();
    let mirror = DMat3::IDENTITY - 2.0 * DMat3::from_cols(n * n.x, n * n.y, n * n.z);
    let mirror = DAffine3::from_mat3(mirror);
    for (index, (shown, moved)) in shown.iter().zip(&moved).enumerate() {
        assert_same_placement(
            &(mirror * *shown * mirror),
            moved,
            1e-12,
            &format!("part {index}"),
        );
        let (a, b) = (&original.bodies()[index].mass, &image.bodies()[index].mass);
        let expected = mirror.matrix3 * a.inertia * mirror.matrix3;
        let off = (expected - b.inertia).to_cols_array();
        assert!(off.iter().all(|x| x.abs() <= 1e-14 * (1.0 + a.mass)));
        assert!((mirror.matrix3 * a.center - b.center).length() <= 1e-14);
    }
    // A mirror in a coordinate plane is exact, and twice is none.
    let once = Builder::new("").mirror("a", &limb, DVec3::X, Pose::IDENTITY);
    let twice = Builder::new("").mirror("b", &once, DVec3::X, Pose::IDENTITY);
    for (a, b) in limb.describe().bodies.iter().zip(twice.describe().bodies) {
        assert_eq!((a.mass, &a.joint), (b.mass, &b.joint));
    }
}

#[test]
fn strands_follow_their_curves() {
    let bend = |t: f64| DVec3::new(t, (2.0 * t).sin(), 0.3 * t * t);
    let points: Vec<DVec3> = (0..12).map(|k| bend(0.25 * f64::from(k))).collect();
    for curve in [
        Centerline::polyline(points.clone()),
        Centerline::spline(points.clone()),
    ] {
        let count = 40;
        let joint = Joint::spherical();
        let hair = |length| BodyShape::capsule(1e-3, length).placed(&up(0.5 * length));
        let strand = Builder::new("hair").along_curve("link", &curve, count, joint, hair);
        let model = strand.build().unwrap().model;
        assert_eq!(model.bodies().len(), count);
        let placements = body_placements(&model, &State::neutral(&model).q);
        let step = curve.length() / count as f64;
        for (index, placement) in placements.iter().enumerate() {
            let start = placement.translation;
            // Starts lie on the curve, which is within a chord's sagitta of its points' polyline.
            let near = (0..=2750).map(|k| bend(1e-3 * f64::from(k)).distance(start));
            let near = near.fold(f64::INFINITY, f64::min);
            assert!(near <= 0.05, "link {index}: {near}");
            let end = match placements.get(index + 1) {
                Some(next) => next.translation,
                None => points[11],
            };
            let along = placement.transform_vector3(DVec3::Z);
            let chord = end - start;
            assert!(
                along.dot(chord) >= chord.length() * (1.0 - 1e-12),
                "link {index}"
            );
            assert!(chord.length() <= step * (1.0 + 1e-9) && chord.length() >= 0.8 * step);
        }
        let start = placements[0].translation;
        assert!((start - points[0]).length() <= 1e-15);
    }
}

/// A box as a mesh, turned and moved far away: mass properties of a cuboid, whatever the orientation of the
/// triangles and whether corners are shared.
#[test]
fn solids_are_those_of_closed_forms() {
    let size = DVec3::new(0.2, 0.5, 0.3);
    let corner = |k: u32| {
        let bit = |b: u32| f64::from((k >> b) & 1) - 0.5;
        DVec3::new(bit(0), bit(1), bit(2)) * size
    };
    let corners: Vec<DVec3> = (0..8).map(corner).collect();
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles: Vec<[u32; 3]> = (faces.iter())
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let expected = BodyShape::cuboid(size)
        .of_density(700.0)
        .mass_properties()
        .unwrap();
    assert!((expected.mass - 700.0 * 0.03).abs() <= 1e-13);
    let place = Pose::new(
        DQuat::from_xyzw(0.5, 0.5, -0.5, 0.5),
        DVec3::new(1e3, -2e3, 5e2),
    );
    let moved: Vec<DVec3> = corners.iter().map(|&c| place.transform_point(c)).collect();
    let flipped: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let soup: Vec<DVec3> = triangles
        .iter()
        .flatten()
        .map(|&k| corners[k as usize])
        .collect();
    let apart: Vec<[u32; 3]> = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    for (vertices, triangles, expected) in [
        (&corners, &triangles, expected),
        (&corners, &flipped, expected),
        (&soup, &apart, expected),
        (&moved, &triangles, expected.placed(&place)),
    ] {
        let found = BodyShape::mesh(vertices, triangles)
            .of_density(700.0)
            .mass_properties()
            .unwrap();
        // Places as far away as 2000 m have their rounding in sizes.
        let far = if vertices == &moved { 2e3 / 0.2 } else { 1.0 };
        let bound = 64.0 * f64::EPSILON * far;
        assert!((found.mass / expected.mass - 1.0).abs() <= bound);
        assert!((found.center - expected.center).length() <= bound);
        let off = (found.inertia - expected.inertia).to_cols_array();
        assert!(
            off.iter()
                .all(|x| x.abs() <= bound * expected.inertia.x_axis.length()),
            "{off:?}"
        );
    }
    // Shapes of revolution against a fine sum of discs.
    for (solid, radius_at, half) in [
        (
            BodyShape::sphere(0.3),
            (|z: f64| (0.09 - z * z).max(0.0).sqrt()) as fn(f64) -> f64,
            0.3,
        ),
        (BodyShape::cylinder(0.2, 1.0), |_| 0.2, 0.5),
        (
            BodyShape::capsule(0.2, 1.0),
            |z: f64| (0.04 - (z.abs() - 0.5).max(0.0).powi(2)).max(0.0).sqrt(),
            0.7,
        ),
    ] {
        let found = solid.of_density(1.0).mass_properties().unwrap();
        let (mut mass, mut along, mut across) = (0.0, 0.0, 0.0);
        let slices = 100_000;
        for k in 0..slices {
            let z = half * ((2.0 * f64::from(k) + 1.0) / f64::from(slices) - 1.0);
            let r2 = radius_at(z).powi(2);
            let m = core::f64::consts::PI * r2 * 2.0 * half / f64::from(slices);
            mass += m;
            along += 0.5 * m * r2;
            across += m * (0.25 * r2 + z * z);
        }
        for (found, sum) in [
            (found.mass, mass),
            (found.inertia.z_axis.z, along),
            (found.inertia.x_axis.x, across),
        ] {
            assert!((found / sum - 1.0).abs() <= 1e-8, "{found} for {sum}");
        }
    }
}

/// What joints have in them is written and read to the last bit.
#[test]
fn joints_are_saved_with_their_elements() {
    let model = generate::random_mechanism(40, true, 2).unwrap();
    let text = serde_json::to_string(&model).unwrap();
    let read: ModelDescription = serde_json::from_str(&text).unwrap();
    let joints =
        |d: &ModelDescription| d.bodies.iter().map(|b| b.joint.clone()).collect::<Vec<_>>();
    for (a, b) in joints(&read).iter().zip(&joints(&model.describe())) {
        assert_eq!((a.stop, a.kind.dof_count()), (b.stop, b.kind.dof_count()));
        assert_eq!(a.spring.is_some(), b.spring.is_some());
        let close = |x: f64, y: f64| (x - y).abs() <= 1e-15 * x.abs();
        assert!(close(a.damping, b.damping) && close(a.armature, b.armature));
    }
    let wrong = r#"{"type":"revolute","axis":[0,0,1],"pitch":0.1}"#;
    let error = serde_json::from_str::<Joint>(wrong).unwrap_err();
    assert!(error.to_string().contains("pitch"), "{error}");
    let limits = JointLimits::default();
    assert_eq!(limits.position, None);
}

/// A description that goes through a builder is the same.
#[test]
fn descriptions_come_back() {
    let (mail, _) = mechanism::chain_mail(2, 3).unwrap();
    let description = mail.describe();
    assert!(!description.loops.is_empty());
    let again = Builder::of_description(description.clone());
    assert_eq!(again.describe(), description);
    let within = Builder::new("within").attach("p", &again, Pose::IDENTITY);
    let inserted = within.describe();
    assert_eq!(
        inserted.loops[0].placements,
        description.loops[0].placements
    );
    assert_eq!(
        inserted.build().unwrap().loops().len(),
        description.loops.len()
    );
}

/// The mirror image of a motion has the coordinates that [`Builder::mirror`] says: vectors of turns are reversed and
/// reflected, those of slides reflected, and all others stay.
#[test]
fn mirror_images_of_coordinates_are_those_stated() {
    let rod = MassProperties::rod(1.0, 0.5, 0.1);
    let mut random = Random::new(8);
    for round in 0..20 {
        let mut place = || {
            let shift = DVec3::from_array([(); 3].map(|()| random.symmetric()));
            Pose::new(random.rotation(), shift)
        };
        let part = Builder::new("part")
            .body("free", Joint::free().at(place()).on_child(place()), rod)
            .body(
                "ball",
                Joint::spherical().at(place()).on_child(place()),
                rod,
            )
            .body(
                "hinge",
                Joint::revolute(DVec3::new(1.0, 2.0, 3.0)).at(place()),
                rod,
            )
            .body("nut", Joint::screw(DVec3::ONE, 0.2).at(place()), rod)
            .body("table", Joint::planar(DVec3::X, DVec3::Y).at(place()), rod);
        let normal = if round == 0 {
            DVec3::Y
        } else {
            random.direction()
        };
        let pair = Builder::new("pair")
            .attach("left", &part, Pose::IDENTITY)
            .mirror("right", &part, normal * 3.0, Pose::IDENTITY)
            .build()
            .unwrap()
            .model;
        let slide = |v: DVec3| v - 2.0 * normal.dot(v) * normal;
        let turn = |v: DVec3| -slide(v);
        let random = State::random(&pair, round);
        let (coordinates, freedoms) = (pair.position_count() / 2, pair.dof_count() / 2);
        let half = &random.q[..coordinates];
        // Positions at the start, and after all rates acted for a while.
        let mirrored = |q: &[f64]| -> Vec<f64> {
            let quaternion = |q: &[f64]| {
                let v = turn(DVec3::from_slice(q));
                [v.x, v.y, v.z, q[3]]
            };
            let free = slide(DVec3::from_slice(q)).to_array();
            let (turned, ball) = (quaternion(&q[3..7]), quaternion(&q[7..11]));
            [&free, &turned[..], &ball, &q[11..]].concat()
        };
        let rates = &random.qd[..freedoms];
        let mirrored_rates = {
            let at = |start: usize| DVec3::from_slice(&rates[start..]);
            let parts = [turn(at(0)), slide(at(3)), turn(at(6))];
            [&parts.map(|v| v.to_array()).concat(), &rates[9..]].concat()
        };
        // Free joints move along the axes of the child and turn about them, as spherical ones do.
        let moved = |q: &[f64], qd: &[f64]| -> Vec<f64> {
            let turned = |q: &[f64], w: &[f64]| {
                DQuat::from_slice(q) * DQuat::from_scaled_axis(DVec3::from_slice(w))
            };
            let along = DQuat::from_slice(&q[3..]) * DVec3::from_slice(&qd[3..]);
            let free = (DVec3::from_slice(q) + along).to_array();
            let (spun, ball) = (
                turned(&q[3..], qd).to_array(),
                turned(&q[7..], &qd[6..]).to_array(),
            );
            let rest: Vec<f64> = q[11..].iter().zip(&qd[9..]).map(|(q, qd)| q + qd).collect();
            [&free, &spun[..], &ball, &rest].concat()
        };
        let image = mirrored(half);
        for (left, right) in [
            (half.to_vec(), image.clone()),
            (moved(half, rates), moved(&image, &mirrored_rates)),
        ] {
            let placements = body_placements(&pair, &[left, right].concat());
            let (left, right) = placements.split_at(placements.len() / 2);
            let n = normal;
            let outer = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            let mirror = DAffine3::from_mat3(DMat3::IDENTITY - outer * 2.0);
            for (left, right) in left.iter().zip(right) {
                let expected = mirror * *left * mirror;
                assert_same_placement(right, &expected, 1e-13, "a mirror image");
            }
        }
    }
}
