//! Divide and conquer against the articulated-body algorithm and the reference.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

use glam::{DMat3, DVec3};
use vertebra_assembly::generate::{self, Masses, RandomTree, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription, Random, State};
use vertebra_dynamics::{
    DcaOptions, DcaWorkspace, Error, Forces, Precision, Workspace, Wrench, aba, dca, forward_error,
    joint_wrenches, residual,
};
use vertebra_spatial::Pose;

/// Where the next rod is carried.
fn tip() -> Pose {
    Pose::from_translation(DVec3::new(0.0, 0.0, 1.0))
}

fn inputs(model: &Model, seed: u64) -> (State, Forces) {
    let mut forces = Forces::none(model);
    let mut random = Random::new(seed);
    forces.joint.fill_with(|| random.symmetric());
    let bodies: Vec<_> = model.body_ids().collect();
    for _ in 0..3 {
        let wrench = Wrench::at_point(random.direction() * 5.0, random.direction())
            .with_torque(random.direction());
        forces.push(bodies[random.below(bodies.len())], wrench);
    }
    (State::random(model, seed), forces)
}

fn options(chunks: Precision, tree: Precision, window: usize) -> DcaOptions {
    DcaOptions {
        chunks,
        tree,
        schedule: Some(ScheduleOptions::with_window(window)),
        parallel: false,
    }
}

/// Forward error of a tree against the reference of the articulated-body algorithm.
fn error(model: &Model, seed: u64, options: &DcaOptions) -> f64 {
    let (state, forces) = inputs(model, seed);
    let mut reference = Workspace::new(model, Precision::Reference);
    aba(model, &state, &forces, &mut reference).unwrap();
    let mut workspace = DcaWorkspace::new(model, options).unwrap();
    let qdd = dca(model, &state, &forces, &mut workspace).unwrap();
    forward_error(qdd, &reference).unwrap()
}

/// In 106 bits all algorithms are one, whatever the shape of tree and schedule: joints of all kinds,
/// fixed and floating bases, forests, external forces, chunks short and long.
#[test]
fn the_reference_of_the_tree_is_that_of_the_recursion() {
    let mut seed = 0;
    for count in [1, 2, 3, 7, 20, 100] {
        for reach in [1, 2, 5, count] {
            for (window, articulations) in [(1, 1), (2, 3), (8, 1), (8, 5), (64, 1)] {
                seed += 1;
                let tree = RandomTree {
                    count,
                    reach,
                    articulations,
                    floating: seed % 2 == 0,
                    mixed: true,
                };
                let model = generate::random_tree(&tree, seed).unwrap();
                let options = options(Precision::Reference, Precision::Reference, window);
                let error = error(&model, seed, &options);
                // Rounded to f64, they differ by its last bit at most.
                let bound = f64::EPSILON;
                assert!(
                    error <= bound,
                    "{tree:?}, window {window}, seed {seed}: {error:e}"
                );
            }
        }
    }
}

/// Chunks in one precision, joins in another: the error of the joins comes in squared, and not at all where there
/// are none to make.
#[test]
fn the_error_of_the_joins_is_squared() {
    for (chunks, tree) in [
        (Precision::F64, Precision::F32),
        (Precision::Reference, Precision::F32),
        (Precision::Reference, Precision::F64),
    ] {
        for seed in 0..8 {
            let chain = generate::random_chain(64, &Rod::default(), seed).unwrap();
            let joined = error(&chain, seed, &options(chunks, tree, 8));
            let whole = error(&chain, seed, &options(chunks, tree, 64));
            let condition = 1e3;
            // Accelerations are given in f64.
            let rounding = condition * chunks.epsilon().max(f64::EPSILON);
            let squared = (condition * tree.epsilon()).powi(2);
            assert!(joined <= squared + rounding, "{tree}: {joined:e}");
            assert!(whole <= rounding, "{chunks}: {whole:e}");
        }
    }
    let chain = generate::random_chain(3, &Rod::default(), 1).unwrap();
    assert_eq!(
        DcaWorkspace::new(&chain, &options(Precision::F32, Precision::F64, 8)).err(),
        Some(Error::TreePrecision {
            chunks: Precision::F32,
            tree: Precision::F64
        })
    );
}

/// Joins in f32 are made in f32: beside those in f64 their rounding shows in the accelerations.
#[test]
fn joins_are_made_in_their_precision() {
    let chain = generate::random_chain(300, &Rod::default(), 1).unwrap();
    let (state, forces) = inputs(&chain, 2);
    let solve = |tree| {
        let mut workspace = DcaWorkspace::new(&chain, &options(Precision::F64, tree, 8)).unwrap();
        let qdd = dca(&chain, &state, &forces, &mut workspace).unwrap();
        qdd.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert_ne!(solve(Precision::F32), solve(Precision::F64));
}

/// Masses over eight decades, massless links, heavy tips: what the cut bodies are for. In f64 no
/// digit more is lost than the recursion loses by its own; a heavy tip costs nothing.
#[test]
fn uneven_masses() {
    let f64s = options(Precision::F64, Precision::F64, 8);
    let mixed = options(Precision::F64, Precision::F32, 8);
    for (masses, reach, bound) in [
        (Masses::Equal, 1, 1e3),
        (Masses::HeavyTips(1e8), 1, 1e3),
        (Masses::HeavyBase(1e8), 1, 1e3),
        (Masses::Alternating(1e6), 1, 1e3),
        (Masses::EveryEighth(1e-12), 1, 1e3),
        (Masses::EveryEighth(1e-16), 1, 1e3),
        (Masses::EveryEighth(1e-16), 4, 1e3),
        (Masses::Decades(4.0), 1, 1e4),
        (Masses::Decades(4.0), 4, 1e4),
        // As many digits as the masses have decades, less those that the cuts save.
        (Masses::Decades(8.0), 1, 1e6),
        (Masses::Decades(8.0), 4, 1e6),
    ] {
        for seed in 0..4 {
            let model = generate::uneven_tree(300, reach, &Rod::default(), &masses, seed).unwrap();
            let all = error(&model, seed, &f64s);
            assert!(
                all <= bound * f64::EPSILON,
                "{masses:?} reach {reach}: {all:e}"
            );
            let default = error(&model, seed, &mixed);
            let joins = (500.0 * Precision::F32.epsilon()).powi(2);
            assert!(
                default <= joins + bound * f64::EPSILON,
                "{masses:?} reach {reach}: {default:e}"
            );
        }
    }
}

/// A light cross between two joints, as universal joints are modelled, without any inertia of its
/// own: no leaf may be joined to it, and nothing is divided by its mass.
#[test]
fn links_without_mass() {
    let mut description = ModelDescription::new("crosses");
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let mut parent: Option<String> = None;
    for index in 0..40 {
        let (cross, link) = (format!("cross-{index}"), format!("link-{index}"));
        let start = if index == 0 { Pose::IDENTITY } else { tip() };
        description = description
            .body(
                &cross,
                parent.as_deref(),
                Joint::revolute(DVec3::X).at(start),
                MassProperties::MASSLESS,
            )
            .body(&link, Some(&cross), Joint::revolute(DVec3::Y), rod);
        parent = Some(link);
    }
    let model = description.build().unwrap();
    for window in [2, 8] {
        let error = error(&model, 3, &options(Precision::F64, Precision::F64, window));
        assert!(error <= 1e3 * f64::EPSILON, "window {window}: {error:e}");
    }
}

/// A heavy body at the end of joints that all move the same way: their compliance has one direction,
/// or three in a plane, however many they are, and nothing heavy may be joined to it as a leaf.
#[test]
fn many_freedoms_in_few_directions() {
    let slide = Joint::prismatic(DVec3::X);
    let hinge = Joint::revolute(DVec3::X);
    for (name, joint, decades) in [
        ("gantry", slide, [4, 8, 12]),
        // What the recursion keeps of the light links: 53 bits less those of the ratio.
        ("planar", hinge, [2, 4, 8]),
    ] {
        for ratio in decades.map(|decades| 10_f64.powi(decades)) {
            let mut description = ModelDescription::new(name);
            for index in 0..60_usize {
                let mass = if index == 59 { ratio } else { 1.0 };
                let start = if index == 0 { Pose::IDENTITY } else { tip() };
                let parent = index.checked_sub(1).map(|above| format!("link-{above}"));
                description = description.body(
                    format!("link-{index}"),
                    parent.as_deref(),
                    joint.clone().at(start),
                    MassProperties::rod(mass, 1.0, 0.05),
                );
            }
            let model = description.build().unwrap();
            let (state, forces) = inputs(&model, 2);
            let mut recursion = Workspace::new(&model, Precision::F64);
            let qdd = aba(&model, &state, &forces, &mut recursion).unwrap();
            let mut reference = Workspace::new(&model, Precision::Reference);
            aba(&model, &state, &forces, &mut reference).unwrap();
            let lost = forward_error(qdd, &reference).unwrap().max(f64::EPSILON);
            let at = |window| error(&model, 2, &options(Precision::F64, Precision::F64, window));
            let long = at(32);
            assert!(long <= 1e3 * lost, "{name} {ratio:e}: {long:e} of {lost:e}");
            // Short chunks invert a light half of what the heavy body stiffens: as many digits as the
            // ratio has.
            let short = at(8);
            let bound = (1e3 * lost).max(16.0 * f64::EPSILON * ratio);
            assert!(
                short <= bound,
                "{name} {ratio:e}: {short:e} in short chunks"
            );
        }
    }
}

/// A hub without inertia to speak of, from which chains hang by joints about the hub's own axis: they
/// leave it nothing, and what rounding of a tree in f32 leaves is not taken for an inertia.
#[test]
fn rounding_of_the_tree_is_no_inertia() {
    let bare = MassProperties {
        mass: 1e-9,
        center: DVec3::ZERO,
        inertia: DMat3::from_diagonal(DVec3::splat(1e-17)),
    };
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let mut description = ModelDescription::new("hub")
        .body("frame", None, Joint::revolute(DVec3::Y), rod)
        .body(
            "hub",
            Some("frame"),
            Joint::revolute(DVec3::X).at(tip()),
            bare,
        );
    let mut random = Random::new(4);
    for chain in 0..3 {
        let mut parent = "hub".to_owned();
        for index in 0..60 {
            let name = format!("rod-{chain}-{index}");
            let (joint, start) = if index == 0 {
                (Joint::revolute(DVec3::X), Pose::IDENTITY)
            } else {
                (Joint::revolute(random.direction()), tip())
            };
            description = description.body(&name, Some(&parent), joint.at(start), rod);
            parent = name;
        }
    }
    let model = description.build().unwrap();
    let (state, forces) = inputs(&model, 5);
    for window in [2, 8, 32] {
        for tree in [Precision::F32, Precision::F64] {
            let options = options(Precision::F64, tree, window);
            let mut workspace = DcaWorkspace::new(&model, &options).unwrap();
            let refused = dca(&model, &state, &forces, &mut workspace);
            let expected = Err(Error::SingularJoint {
                body: "hub".to_owned(),
            });
            assert_eq!(
                refused.map(<[f64]>::len),
                expected,
                "window {window}, {tree}"
            );
        }
    }
}

/// The classic tree of the source, in which every joint is a chunk.
#[test]
fn a_window_of_one_is_the_classic_tree() {
    let chain = generate::random_chain(100, &Rod::default(), 5).unwrap();
    let options = options(Precision::F64, Precision::F64, 1);
    let workspace = DcaWorkspace::new(&chain, &options).unwrap();
    assert_eq!(workspace.schedule().chunks().len(), 100);
    assert_eq!(workspace.schedule().joins().len(), 99);
    let error = error(&chain, 5, &options);
    assert!(error <= 1e4 * f64::EPSILON, "{error:e}");
}

/// The bodies' own equations, and the forces in the joints against those of the recursion.
#[test]
fn forces_in_the_joints() {
    for (seed, (count, reach)) in (0..).zip([(1, 1), (12, 1), (50, 3), (200, 1), (200, 200)]) {
        let tree = RandomTree {
            reach,
            floating: seed % 2 == 0,
            ..RandomTree::mixed(count)
        };
        let model = generate::random_tree(&tree, seed).unwrap();
        let (state, forces) = inputs(&model, seed);
        let mut workspace = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
        dca(&model, &state, &forces, &mut workspace).unwrap();
        workspace.compute_joint_wrenches(&forces).unwrap();
        let own = residual(&model, &state, &forces, &workspace).unwrap();
        let bound = 64.0 * f64::EPSILON * model.depth() as f64;
        assert!(own.max() <= bound, "{count} bodies: {own:?}");

        let mut recursion = Workspace::new(&model, Precision::Reference);
        aba(&model, &state, &forces, &mut recursion).unwrap();
        joint_wrenches(&mut recursion).unwrap();
        let pairs: Vec<_> = (model.body_ids())
            .map(|body| {
                let (a, b) = (workspace.joint_wrench(body), recursion.joint_wrench(body));
                (a.unwrap(), b.unwrap())
            })
            .collect();
        let largest = (pairs.iter()).fold(0.0_f64, |m, (_, b)| {
            m.max(b.force.length()).max(b.moment.length())
        });
        for (a, b) in pairs {
            let off = (a.force - b.force)
                .length()
                .max((a.moment - b.moment).length());
            assert!(off <= 1e3 * bound * largest, "{a:?} and {b:?} of {largest}");
        }
    }
}

/// Whatever the number of threads, the same bits.
#[test]
fn threads_change_nothing() {
    for (reach, seed) in [(1, 1), (3, 2), (6000, 3)] {
        let tree = RandomTree {
            reach,
            ..RandomTree::mixed(6000)
        };
        let model = generate::random_tree(&tree, seed).unwrap();
        let (state, forces) = inputs(&model, seed);
        let solve = |parallel| {
            let options = DcaOptions {
                parallel,
                ..DcaOptions::default()
            };
            let mut workspace = DcaWorkspace::new(&model, &options).unwrap();
            dca(&model, &state, &forces, &mut workspace)
                .unwrap()
                .to_vec()
        };
        let bits = |qdd: &[f64]| qdd.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let alone = bits(&solve(false));
        for threads in [1, 2, 3, 8] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            assert!(
                pool.install(|| bits(&solve(true))) == alone,
                "{threads} threads"
            );
        }
    }
}

/// Stars, long chains and uneven forests take no stack and memory in proportion.
#[test]
fn shapes_that_overflow_a_recursion() {
    let rod = Rod::default();
    let star = generate::tree(100_001, 100_000, &rod).unwrap();
    let chain = generate::random_chain(1_000_000, &rod, 3).unwrap();
    let forest = RandomTree {
        reach: 2,
        articulations: 7,
        ..RandomTree::mixed(20_003)
    };
    let forest = generate::random_tree(&forest, 4).unwrap();
    for model in [star, chain, forest] {
        let (state, forces) = inputs(&model, 1);
        let mut workspace = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
        let qdd = dca(&model, &state, &forces, &mut workspace).unwrap();
        let mut recursion = Workspace::new(&model, Precision::F64);
        let reference = aba(&model, &state, &forces, &mut recursion).unwrap();
        let largest = reference.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let off = (qdd.iter().zip(reference)).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        let bound = f64::EPSILON * 1e3 * (model.depth() as f64);
        assert!(
            off <= bound * largest,
            "{}: {:e}",
            model.name(),
            off / largest
        );
    }
}

/// Errors name the culprit and leave the workspace usable.
#[test]
fn refusals() {
    let model = generate::random_chain(40, &Rod::default(), 1).unwrap();
    let other = generate::random_chain(40, &Rod::default(), 1).unwrap();
    let (mut state, forces) = inputs(&model, 1);
    let mut workspace = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
    assert!(matches!(
        workspace.joint_accelerations(),
        Err(Error::NotComputed { .. })
    ));
    assert!(matches!(
        dca(&other, &state, &forces, &mut workspace),
        Err(Error::WrongWorkspace { .. })
    ));
    let good = dca(&model, &state, &forces, &mut workspace)
        .unwrap()
        .to_vec();
    let rate = state.qd[17];
    state.qd[17] = 1e200;
    let overflow = dca(&model, &state, &forces, &mut workspace);
    assert!(
        matches!(overflow, Err(Error::Overflow { .. })),
        "{overflow:?}"
    );
    assert!(matches!(
        workspace.joint_accelerations(),
        Err(Error::NotComputed { .. })
    ));
    state.qd[17] = f64::NAN;
    assert!(matches!(
        dca(&model, &state, &forces, &mut workspace),
        Err(Error::Model(_))
    ));
    state.qd[17] = rate;
    assert_eq!(dca(&model, &state, &forces, &mut workspace).unwrap(), good);
}
