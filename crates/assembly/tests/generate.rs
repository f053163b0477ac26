//! Generated models: their shape, and that they are the same bits on every machine and for ever.

mod common;

use common::{Digest, body_placements};
use glam::DVec3;
use vertebra_assembly::generate::{self, Masses, RandomTree, Rod};
use vertebra_assembly::{Joint, JointKind, Model, ModelError, Random, State};

fn bush(count: usize) -> RandomTree {
    RandomTree {
        count,
        reach: count,
        floating: true,
        mixed: true,
        articulations: 3,
    }
}

/// Models and states are inputs of published measurements: a change of one bit makes others.
#[test]
fn the_bits_of_seeded_models_never_change() {
    let rod = Rod::with_length(0.3);
    let revolute = Joint::revolute(DVec3::X);
    let spherical = Joint::spherical();
    let mixed = RandomTree::mixed(60);
    // Name, model, digest of its description, digest of a random state.
    let cases = [
        (
            "chain",
            generate::chain(40, &revolute, &rod),
            0x1fb5_8857_b4b2_96fd,
            0xebe8_7c6a_3f2c_7382,
        ),
        (
            "balls",
            generate::chain(40, &spherical, &rod),
            0x71bb_e405_1c20_8741,
            0x5950_6241_aa9f_04b4,
        ),
        (
            "random 1",
            generate::random_chain(40, &rod, 1),
            0xc874_5dc9_7398_c6c4,
            0xebe8_7c6a_3f2c_7382,
        ),
        (
            "random 2",
            generate::random_chain(40, &rod, 2),
            0xc3ae_64b2_c5cb_89a7,
            0xebe8_7c6a_3f2c_7382,
        ),
        (
            "helix",
            generate::helix(40, &rod, 0.3, 0.2),
            0x81c7_7056_93a3_253a,
            0xebe8_7c6a_3f2c_7382,
        ),
        (
            "tree",
            generate::tree(40, 3, &rod),
            0xde1e_3791_b386_9929,
            0xebe8_7c6a_3f2c_7382,
        ),
        (
            "mixed",
            generate::random_tree(&mixed, 7),
            0x9efa_ed32_163e_a17b,
            0xd7b4_87cd_1e7b_ae47,
        ),
        (
            "forest",
            generate::random_tree(&bush(60), 8),
            0xcc71_e7a0_35aa_0979,
            0x96a8_adec_8482_d6a1,
        ),
    ];
    let mut changed = String::new();
    for (name, model, bits, state_bits) in cases {
        let model = model.unwrap();
        let found = Digest::of(&model.describe());
        let state_found = Digest::of_state(&State::random(&model, 11));
        if (found, state_found) != (bits, state_bits) {
            changed += &format!("{name}: {found:#018x}, {state_found:#018x}\n");
        }
    }
    assert!(changed.is_empty(), "these changed:\n{changed}");
}

#[test]
fn a_digest_sees_one_bit() {
    let model = generate::random_chain(5, &Rod::default(), 1).unwrap();
    let mut description = model.describe();
    let before = Digest::of(&description);
    let x = &mut description.bodies[4].mass.center.x;
    *x = f64::from_bits(x.to_bits() ^ 1);
    assert_ne!(before, Digest::of(&description));
}

#[test]
fn a_chain_hangs_in_a_line() {
    let rod = Rod {
        mass: 2.0,
        length: 0.25,
        radius: 0.01,
    };
    let model = generate::chain(100, &Joint::revolute(DVec3::Y), &rod).unwrap();
    assert_eq!(model.bodies().len(), 100);
    assert_eq!(model.depth(), 100);
    assert_eq!(model.dof_count(), 100);
    let placements = body_placements(&model, &State::neutral(&model).q);
    for (index, (body, placement)) in model.bodies().iter().zip(&placements).enumerate() {
        assert_eq!(body.parent.map(|p| p.index()), index.checked_sub(1));
        assert_eq!(body.mass.mass, 2.0);
        let expected = DVec3::new(0.0, 0.0, 0.25 * index as f64);
        assert_eq!(placement.translation, expected);
    }
}

#[test]
fn a_helix_closes_where_its_angles_say() {
    // Without twist a helix is a ring: 24 rods bent by 15 degrees come back to their start.
    let count = 24;
    let bend = core::f64::consts::TAU / count as f64;
    let model = generate::helix(count + 1, &Rod::default(), bend, 0.0).unwrap();
    let placements = body_placements(&model, &State::neutral(&model).q);
    let tolerance = 8.0 * f64::EPSILON * (count * count) as f64;
    common::assert_same_placement(&placements[0], &placements[count], tolerance, "ring");
    let apart = placements[0].translation - placements[count / 2].translation;
    // Half-way round stands the far end of the polygon's diameter, 1 / tan(pi / n) wide.
    assert!(apart.length() > 7.0, "{apart}");
}

#[test]
fn a_tree_branches_as_asked() {
    for branching in [1, 2, 3, 7] {
        let model = generate::tree(200, branching, &Rod::default()).unwrap();
        let mut children = vec![0; 200];
        for body in &model.bodies()[1..] {
            children[body.parent.unwrap().index()] += 1;
        }
        assert!(children.iter().all(|&count| count <= branching));
        assert_eq!(children[0], branching);
        // Levels hold 1, b, b^2, ... bodies until 200 are used up.
        let (mut levels, mut width, mut used) = (0, 1, 0);
        while used < 200 {
            used += width;
            width *= branching;
            levels += 1;
        }
        assert_eq!(model.depth(), levels, "branching {branching}");
    }
}

#[test]
fn random_trees_are_valid_and_as_asked() {
    let mut kinds = [0; 5];
    for case in 0..300 {
        let seed = case as u64;
        let tree = RandomTree {
            count: 1 + (case * 7) % 90,
            reach: 1 + case % 9,
            floating: seed.is_multiple_of(2),
            mixed: !seed.is_multiple_of(3),
            articulations: 1 + case % 4,
        };
        let model = generate::random_tree(&tree, seed).unwrap();
        assert_eq!(model.bodies().len(), tree.count);
        let roots = model.bodies().iter().filter(|b| b.parent.is_none()).count();
        let block = tree.count.div_ceil(tree.articulations);
        assert_eq!(roots, tree.count.div_ceil(block));
        for (index, body) in model.bodies().iter().enumerate() {
            match body.parent {
                Some(parent) => assert!(index - parent.index() <= tree.reach),
                None => assert_eq!(
                    body.joint.kind == JointKind::Free || tree.mixed,
                    tree.floating || tree.mixed
                ),
            }
            if !(tree.mixed || tree.floating && body.parent.is_none()) {
                assert!(matches!(body.joint.kind, JointKind::Revolute { .. }));
            }
            kinds[match body.joint.kind {
                JointKind::Fixed => 0,
                JointKind::Revolute { .. } => 1,
                JointKind::Prismatic { .. } => 2,
                JointKind::Spherical => 3,
                JointKind::Free => 4,
                JointKind::Screw { .. } => 5,
            }] += 1;
            assert!(body.mass.violation().is_none());
        }
        State::random(&model, seed).check(&model).unwrap();
        State::neutral(&model).check(&model).unwrap();
        // A reach of one is a chain.
        if tree.reach == 1 {
            assert_eq!(model.depth(), block.min(tree.count));
        }
    }
    assert!(kinds.iter().all(|&count| count > 100), "{kinds:?}");
}

#[test]
fn seeds_and_streams_differ() {
    let rod = Rod::default();
    let digest = |seed| Digest::of(&generate::random_chain(8, &rod, seed).unwrap().describe());
    assert_ne!(digest(1), digest(2));
    assert_eq!(digest(1), digest(1));
    let model = generate::random_chain(8, &rod, 1).unwrap();
    assert_ne!(State::random(&model, 1), State::random(&model, 2));
}

/// Means of the streams against their expectations: n samples stray by 5 standard deviations at
/// most (a chance of 1e-6, and the seed is fixed).
#[test]
fn random_streams_are_centred() {
    let mut random = Random::new(3);
    let n = 10_000;
    let spread = 5.0 / f64::from(n).sqrt();
    let mut direction = DVec3::ZERO;
    let mut turned = DVec3::ZERO;
    let mut unit = 0.0;
    for _ in 0..n {
        let d = random.direction();
        assert!((d.length() - 1.0).abs() <= 4.0 * f64::EPSILON);
        direction += d;
        turned += random.rotation() * DVec3::X;
        let u = random.unit();
        assert!((0.0..1.0).contains(&u));
        unit += u;
        assert!(random.below(7) < 7);
    }
    assert_eq!(random.below(0), 0);
    // A coordinate of a uniform direction has variance 1/3, a uniform number 1/12.
    let deviation = spread / 3.0_f64.sqrt();
    assert!((direction / f64::from(n)).abs().max_element() < deviation);
    assert!((turned / f64::from(n)).abs().max_element() < deviation);
    assert!((unit / f64::from(n) - 0.5).abs() < spread / 12.0_f64.sqrt());
}

#[test]
fn bad_parameters_are_named() {
    let rod = Rod::default();
    let joint = Joint::revolute(DVec3::X);
    let named = |result: Result<Model, ModelError>, name: &str| match result {
        Err(ModelError::BadParameter { parameter, .. }) => assert_eq!(parameter, name),
        other => panic!("{other:?}"),
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let with = |change: fn(&mut Rod, f64)| {
            let mut rod = Rod::default();
            change(&mut rod, bad);
            generate::chain(3, &joint, &rod)
        };
        named(with(|rod, bad| rod.mass = bad), "mass");
        named(with(|rod, bad| rod.length = bad), "length");
        named(with(|rod, bad| rod.radius = bad), "radius");
    }
    named(generate::tree(3, 0, &rod), "branching");
    let zero = |change: fn(&mut RandomTree)| {
        let mut tree = RandomTree::mixed(5);
        change(&mut tree);
        generate::random_tree(&tree, 1)
    };
    named(zero(|tree| tree.reach = 0), "reach");
    named(zero(|tree| tree.articulations = 0), "articulations");
    let empty = |result| matches!(result, Err(ModelError::Empty { .. }));
    assert!(empty(generate::chain(0, &joint, &rod)));
    assert!(empty(generate::random_chain(0, &rod, 1)));
    assert!(empty(generate::helix(0, &rod, 0.1, 0.1)));
    assert!(empty(generate::tree(0, 2, &rod)));
    assert!(empty(zero(|tree| tree.count = 0)));
    assert!(generate::helix(3, &rod, f64::NAN, 0.0).is_err());
    assert!(generate::helix(3, &rod, 0.0, f64::INFINITY).is_err());
}

/// Of a tree only the last body, whatever other tips there are.
#[test]
fn heavy_tips_and_the_last_one_alone() {
    let heavy = |masses| {
        let tree = generate::uneven_tree(40, 4, &Rod::default(), &masses, 5).unwrap();
        let heavy = tree.bodies().iter().map(|body| body.mass.mass == 100.0);
        heavy.collect::<Vec<_>>()
    };
    let (tips, last) = (
        heavy(Masses::HeavyTips(100.0)),
        heavy(Masses::HeavyLast(100.0)),
    );
    let count = |heavy: &[bool]| heavy.iter().filter(|heavy| **heavy).count();
    assert!(count(&tips) > 3 && tips[39]);
    assert!(count(&last) == 1 && last[39]);
}

/// Refused at once, not when memory has run out.
#[test]
fn more_bodies_than_can_be_counted_are_refused() {
    let rod = Rod::default();
    let too_large = |result| matches!(result, Err(ModelError::TooLarge { .. }));
    for count in [usize::MAX, u32::MAX as usize / 8 + 1] {
        let tree = RandomTree::mixed(count);
        assert!(too_large(generate::chain(count, &Joint::free(), &rod)));
        assert!(too_large(generate::random_chain(count, &rod, 1)));
        assert!(too_large(generate::helix(count, &rod, 0.1, 0.1)));
        assert!(too_large(generate::tree(count, 2, &rod)));
        assert!(too_large(generate::random_tree(&tree, 1)));
    }
}
