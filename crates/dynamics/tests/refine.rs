//! Iterative refinement against the reference.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

use glam::DVec3;
use vertebra_assembly::generate::{self, Masses, RandomTree, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription, Random, State};
use vertebra_dynamics::{
    DcaOptions, DcaWorkspace, Error, Forces, Precision, Solved, Workspace, Wrench, aba,
    check_accelerations, dca, forward_error, joint_wrenches, refine, residual,
};
use vertebra_spatial::Pose;

fn inputs(model: &Model, seed: u64) -> (State, Forces) {
    let mut forces = Forces::none(model);
    let mut random = Random::new(seed);
    // None larger than a body's weight, so that no light body's acceleration hides the others.
    for body in model.bodies() {
        for force in &mut forces.joint[body.dof_range()] {
            *force = random.symmetric() * body.mass.mass;
        }
    }
    let bodies: Vec<_> = model.body_ids().collect();
    for _ in 0..3 {
        let at = random.below(bodies.len());
        let weight = model.bodies()[at].mass.mass;
        let wrench = Wrench::at_point(random.direction() * weight, random.direction())
            .with_torque(random.direction() * weight);
        forces.push(bodies[at], wrench);
    }
    (State::random(model, seed), forces)
}

fn reference(model: &Model, state: &State, forces: &Forces) -> Workspace {
    let mut workspace = Workspace::new(model, Precision::Reference);
    aba(model, state, forces, &mut workspace).unwrap();
    workspace
}

fn tree(model: &Model, chunks: Precision, tree: Precision, window: usize) -> DcaWorkspace {
    let options = DcaOptions {
        chunks,
        tree,
        schedule: Some(ScheduleOptions::with_window(window)),
        parallel: false,
    };
    DcaWorkspace::new(model, &options).unwrap()
}

/// Trees, forests, chains; joints of all kinds; fixed and floating bases; chunks of every length: from
/// joins in f32 each sweep gains their digits, whatever the shape.
#[test]
fn each_sweep_gains_the_digits_of_the_joins() {
    let mut seed = 0;
    for count in [2, 9, 40, 150] {
        for reach in [1, 3, count] {
            for (window, articulations) in [(1, 1), (2, 3), (8, 1), (32, 2)] {
                seed += 1;
                let shape = RandomTree {
                    count,
                    reach,
                    articulations,
                    floating: seed % 2 == 0,
                    mixed: true,
                };
                let model = generate::random_tree(&shape, seed).unwrap();
                let (state, forces) = inputs(&model, seed);
                let reference = reference(&model, &state, &forces);
                let mut workspace = tree(&model, Precision::F64, Precision::F32, window);
                dca(&model, &state, &forces, &mut workspace).unwrap();
                let error = |workspace: &DcaWorkspace| {
                    forward_error(workspace.joint_accelerations().unwrap(), &reference).unwrap()
                };
                let start = error(&workspace);
                let first = refine(&forces, &mut workspace).unwrap();
                let once = error(&workspace);
                refine(&forces, &mut workspace).unwrap();
                let third = refine(&forces, &mut workspace).unwrap();
                let thrice = error(&workspace);
                let label = format!("{shape:?}, window {window}, seed {seed}");
                let floor = 256.0 * f64::EPSILON * (count as f64).sqrt();
                assert!(once <= 1e-2 * start + floor, "{label}: {start:e}, {once:e}");
                assert!(thrice <= floor, "{label}: {thrice:e}");
                // What the first changed is the error there was; the last had nothing left to change.
                let off = (first.change - start).abs();
                assert!(off <= 0.1 * start + floor, "{label}: {first:?}, {start:e}");
                assert!(third.change <= floor, "{label}: {third:?}");
                assert!(third.residual <= floor, "{label}: {third:?}");
            }
        }
    }
}

/// In the reference precision over joins in f32 and f64, whose digits are gained again and again: the
/// equations are those of the solution, to the last of 106 bits.
#[test]
fn corrections_reach_the_last_bits_of_the_reference() {
    for (joins, sweeps) in [(Precision::F32, 6), (Precision::F64, 3)] {
        for (seed, reach) in [(1, 1), (2, 3), (3, 60)] {
            let shape = RandomTree {
                reach,
                floating: seed == 2,
                ..RandomTree::mixed(60)
            };
            let model = generate::random_tree(&shape, seed).unwrap();
            let (state, forces) = inputs(&model, seed);
            let mut workspace = tree(&model, Precision::Reference, joins, 4);
            dca(&model, &state, &forces, &mut workspace).unwrap();
            for _ in 0..sweeps {
                refine(&forces, &mut workspace).unwrap();
            }
            workspace.compute_joint_wrenches(&forces).unwrap();
            let left = residual(&model, &state, &forces, &workspace).unwrap();
            let bound = 64.0 * Precision::Reference.epsilon() * model.depth() as f64;
            assert!(left.by_body <= bound, "{joins}, reach {reach}: {left:?}");
        }
    }
}

/// Forces beyond the range of f32 that the world takes: nothing moves, and of what is left nothing is known.
#[test]
fn where_terms_overflow_the_residual_is_all_of_them() {
    let body = MassProperties::rod(1.0, 1.0, 0.05);
    let model = ModelDescription::new("held")
        .body("held", None, Joint::fixed(), body)
        .build()
        .unwrap();
    let (state, mut forces) = (State::neutral(&model), Forces::none(&model));
    forces.push(model.last_body(), Wrench::at_center([1e60, -1e60, 1e60]));
    for (precision, left) in [(Precision::F32, 1.0), (Precision::F64, 0.0)] {
        let mut alone = Workspace::new(&model, precision);
        aba(&model, &state, &forces, &mut alone).unwrap();
        let mut joined = tree(&model, precision, precision, 4);
        dca(&model, &state, &forces, &mut joined).unwrap();
        let found = [refine(&forces, &mut alone), refine(&forces, &mut joined)];
        assert_eq!(found.map(|found| found.unwrap().residual), [left; 2]);
    }
}

/// Masses that cost digits, the recursion included: two sweeps end where no solver in f64 does.
#[test]
fn uneven_masses() {
    for masses in [
        Masses::Equal,
        Masses::HeavyLast(1e8),
        Masses::HeavyBase(1e8),
        Masses::Alternating(1e6),
        Masses::EveryEighth(1e-16),
        Masses::EveryEighth(1e4),
        Masses::Decades(4.0),
        Masses::Decades(8.0),
        Masses::HeavyTips(1e4),
    ] {
        for (reach, seed) in [(1, 1), (1, 2), (4, 3), (4, 4)] {
            let model = generate::uneven_tree(300, reach, &Rod::default(), &masses, seed).unwrap();
            let (state, forces) = inputs(&model, seed);
            let reference = reference(&model, &state, &forces);
            let check = |name: &str, solved: &[f64]| {
                let error = forward_error(solved, &reference).unwrap();
                let label = format!("{masses:?}, reach {reach}, {name}");
                assert!(error <= 1e-13, "{label}: {error:e}");
            };
            let mut recursion = Workspace::new(&model, Precision::F64);
            aba(&model, &state, &forces, &mut recursion).unwrap();
            let mut joined = tree(&model, Precision::F64, Precision::F32, 32);
            dca(&model, &state, &forces, &mut joined).unwrap();
            let sweeps = if matches!(masses, Masses::HeavyTips(_)) {
                4
            } else {
                2
            };
            for _ in 0..sweeps {
                refine(&forces, &mut recursion).unwrap();
                refine(&forces, &mut joined).unwrap();
            }
            check("recursion", recursion.joint_accelerations().unwrap());
            check("tree", joined.joint_accelerations().unwrap());
        }
    }
}

/// What rounding adds up of places along a chain, and two corrections took over, is gone: what is left does not
/// grow with the number of bodies. Joints of all kinds, both algorithms.
#[test]
fn drift_is_taken_out() {
    let rods = |seed| generate::random_chain(1500, &Rod::default(), seed).unwrap();
    let mixed = |seed| {
        let shape = RandomTree {
            reach: 1,
            floating: seed % 2 == 0,
            ..RandomTree::mixed(1500)
        };
        generate::random_tree(&shape, seed).unwrap()
    };
    for models in [rods as fn(u64) -> Model, mixed] {
        let (mut once, mut twice) = (0.0_f64, 0.0_f64);
        for seed in 0..4 {
            let model = models(seed);
            let (state, forces) = inputs(&model, seed);
            let reference = reference(&model, &state, &forces);
            let error = |qdd: &[f64]| forward_error(qdd, &reference).unwrap();
            let mut recursion = Workspace::new(&model, Precision::F64);
            aba(&model, &state, &forces, &mut recursion).unwrap();
            let mut joined = tree(&model, Precision::F64, Precision::F64, 32);
            dca(&model, &state, &forces, &mut joined).unwrap();
            for largest in [&mut once, &mut twice] {
                refine(&forces, &mut recursion).unwrap();
                refine(&forces, &mut joined).unwrap();
                for qdd in [
                    recursion.joint_accelerations(),
                    joined.joint_accelerations(),
                ] {
                    *largest = largest.max(error(qdd.unwrap()));
                }
            }
            // And the forces still solve the equations of the bodies.
            joint_wrenches(&mut recursion).unwrap();
            let left = residual(&model, &state, &forces, &recursion).unwrap();
            let bound = 64.0 * f64::EPSILON * model.depth() as f64;
            assert!(left.by_body <= bound, "{left:?}");
        }
        assert!(twice <= 64.0 * f64::EPSILON, "{once:e}, {twice:e}");
        assert!(twice <= 0.2 * once, "{once:e}, {twice:e}");
    }
}

/// The forces in the joints are as exact as the accelerations.
#[test]
fn forces_in_the_joints() {
    let shape = RandomTree {
        reach: 3,
        floating: true,
        ..RandomTree::mixed(120)
    };
    let model = generate::random_tree(&shape, 5).unwrap();
    let (state, forces) = inputs(&model, 5);
    let mut exact = reference(&model, &state, &forces);
    joint_wrenches(&mut exact).unwrap();
    let mut recursion = Workspace::new(&model, Precision::F64);
    aba(&model, &state, &forces, &mut recursion).unwrap();
    let mut joined = tree(&model, Precision::F64, Precision::F32, 4);
    dca(&model, &state, &forces, &mut joined).unwrap();
    for _ in 0..3 {
        refine(&forces, &mut recursion).unwrap();
        refine(&forces, &mut joined).unwrap();
    }
    joint_wrenches(&mut recursion).unwrap();
    joined.compute_joint_wrenches(&forces).unwrap();
    let bodies = || {
        model
            .body_ids()
            .map(|body| exact.joint_wrench(body).unwrap())
    };
    let largest = bodies().fold(0.0_f64, |m, f| {
        m.max(f.force.length()).max(f.moment.length())
    });
    for (body, exact) in model.body_ids().zip(bodies()) {
        for found in [recursion.joint_wrench(body), joined.joint_wrench(body)] {
            let found = found.unwrap();
            let off = (found.force - exact.force)
                .length()
                .max((found.moment - exact.moment).length());
            assert!(
                off <= 1e3 * f64::EPSILON * largest,
                "{off:e} of {largest:e}"
            );
        }
    }
    for left in [
        residual(&model, &state, &forces, &recursion).unwrap(),
        residual(&model, &state, &forces, &joined).unwrap(),
    ] {
        let bound = 64.0 * f64::EPSILON * model.depth() as f64;
        assert!(left.by_body <= bound, "{left:?}");
    }
}

/// Bodies that heavy branches hang from on joints of all kinds are cut, and light beside what they transmit: what
/// f32 joins have lost there one correction finds, whichever half of a body it is left on.
#[test]
fn bodies_between_heavy_branches_lose_nothing() {
    let shape = RandomTree {
        floating: true,
        ..RandomTree::mixed(128)
    };
    for seed in 0..64 {
        let model = generate::random_tree(&shape, seed).unwrap();
        let model = generate::weighted(&model, &Masses::HeavyTips(1e4), seed).unwrap();
        let (state, forces) = inputs(&model, seed);
        let reference = reference(&model, &state, &forces);
        let mut joined = tree(&model, Precision::F64, Precision::F32, 32);
        dca(&model, &state, &forces, &mut joined).unwrap();
        let mut largest = 0.0;
        for bound in [1e-10, 128.0 * f64::EPSILON * 128.0_f64.sqrt()] {
            refine(&forces, &mut joined).unwrap();
            let qdd = joined.joint_accelerations().unwrap();
            largest = forward_error(qdd, &reference).unwrap();
            assert!(largest <= bound, "seed {seed}: {largest:e}");
        }
        assert!(largest > 0.0);
    }
}

/// A body that weighs nothing and floats, whose equation has no term but the rounding of what its children take.
#[test]
fn equations_without_terms_leave_no_more_than_all_of_them() {
    let nothing = MassProperties::MASSLESS;
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let model = ModelDescription::new("kite")
        .body("frame", None, Joint::free(), nothing)
        .body("rod", Some("frame"), Joint::fixed(), rod)
        .build()
        .unwrap();
    let forces = Forces::none(&model);
    let mut largest = 0.0_f64;
    for seed in 0..8 {
        let state = State::random(&model, seed);
        for chunks in [Precision::F32, Precision::F64] {
            let mut recursion = Workspace::new(&model, chunks);
            aba(&model, &state, &forces, &mut recursion).unwrap();
            let mut joined = tree(&model, chunks, Precision::F32, 8);
            dca(&model, &state, &forces, &mut joined).unwrap();
            for refined in [
                refine(&forces, &mut recursion),
                refine(&forces, &mut joined),
            ] {
                let residual = refined.unwrap().residual;
                assert!(residual <= 1.0, "seed {seed}: {residual:e}");
                largest = largest.max(residual);
            }
        }
    }
    assert!(largest > 0.0);
}

/// What is left of bodies that only fall is rounding of their weights, which their accelerations are without; and of a wrong
/// answer what is wrong with it.
#[test]
fn what_falls_is_measured_by_its_weight() {
    let rod = MassProperties::rod(1.0, 1.0, 0.05).placed(&Pose::from_translation(DVec3::X));
    let kite = ModelDescription::new("kite")
        .body("frame", None, Joint::free(), MassProperties::MASSLESS)
        .body("rod", Some("frame"), Joint::fixed(), rod)
        .build()
        .unwrap();
    let forests = (0..8)
        .zip([1, 3, 5].into_iter().cycle())
        .map(|(seed, reach)| {
            let shape = RandomTree {
                reach,
                articulations: reach.min(4),
                floating: true,
                ..RandomTree::mixed(60)
            };
            generate::random_tree(&shape, seed).unwrap()
        });
    for model in forests.chain([kite]) {
        let mut state = State::random(&model, 3);
        state.qd.fill(0.0);
        let forces = Forces::none(&model);
        let bound = |epsilon: f64| 64.0 * epsilon * model.depth() as f64;
        for (chunks, joins) in [
            (Precision::F32, Precision::F32),
            (Precision::F64, Precision::F32),
            (Precision::F64, Precision::F64),
        ] {
            let mut recursion = Workspace::new(&model, chunks);
            aba(&model, &state, &forces, &mut recursion).unwrap();
            joint_wrenches(&mut recursion).unwrap();
            let left = residual(&model, &state, &forces, &recursion).unwrap();
            let mut joined = tree(&model, chunks, joins, 4);
            dca(&model, &state, &forces, &mut joined).unwrap();
            let of_joined = refine(&forces, &mut joined).unwrap().residual;
            let of_recursion = refine(&forces, &mut recursion).unwrap().residual;
            for (found, epsilon) in [
                (left.by_body, chunks.epsilon()),
                (of_recursion, chunks.epsilon()),
                (of_joined, joins.epsilon()),
            ] {
                let name = model.name();
                assert!(
                    found <= bound(epsilon),
                    "{name}, {chunks}: {left:?}, {found:e}"
                );
            }
        }
        let mut workspace = Workspace::new(&model, Precision::F64);
        let exact = aba(&model, &state, &forces, &mut workspace)
            .unwrap()
            .to_vec();
        let root = model.bodies()[0].dof_range();
        for size in [1e-8, 1e-4, 1e-2] {
            let mut planted = exact.clone();
            for qdd in &mut planted[root.clone()] {
                *qdd *= 1.0 + size;
            }
            let found =
                check_accelerations(&model, &state, &forces, &planted, &mut workspace).unwrap();
            // A weight of which all entries are alike is 1.7 times as large as these; momentum sums up along a run.
            let part = found.residual / size;
            assert!((0.1..=100.0).contains(&part), "{size:e}: {found:?}");
        }
    }
}

/// What a correction changes is the error there was, to a tenth, as long as that is more than rounding: of solutions
/// that masses have cost digits, by the recursion and over joins in f32 between short chunks, and of
/// corrected ones.
#[test]
fn changes_are_the_errors_before() {
    let mut told = 0;
    for masses in [
        Masses::Equal,
        Masses::HeavyLast(1e8),
        Masses::Alternating(1e4),
        Masses::Decades(8.0),
        Masses::HeavyTips(1e4),
    ] {
        for (reach, seed) in [(1, 1), (1, 2), (4, 3), (4, 4)] {
            let model = generate::uneven_tree(200, reach, &Rod::default(), &masses, seed).unwrap();
            let (state, forces) = inputs(&model, seed);
            let reference = reference(&model, &state, &forces);
            let error = |qdd: &[f64]| forward_error(qdd, &reference).unwrap();
            let mut recursion = Workspace::new(&model, Precision::F64);
            aba(&model, &state, &forces, &mut recursion).unwrap();
            let mut joined = tree(&model, Precision::F64, Precision::F32, 2);
            dca(&model, &state, &forces, &mut joined).unwrap();
            let floor = 256.0 * f64::EPSILON * 200.0_f64.sqrt();
            let mut check = |name: &str, before: f64, change: f64| {
                let label = format!("{masses:?}, reach {reach}, {name}: {change:e}, {before:e}");
                assert!((change - before).abs() <= 0.1 * before + floor, "{label}");
                told += usize::from(before > 10.0 * floor);
            };
            for _ in 0..2 {
                let before = error(recursion.joint_accelerations().unwrap());
                let change = refine(&forces, &mut recursion).unwrap().change;
                check("recursion", before, change);
                let before = error(joined.joint_accelerations().unwrap());
                let change = refine(&forces, &mut joined).unwrap().change;
                check("tree", before, change);
            }
        }
    }
    assert!(told >= 20, "{told} errors beyond rounding");
}

/// Whatever the number of threads, the same bits.
#[test]
fn threads_change_nothing() {
    let shape = RandomTree {
        reach: 3,
        ..RandomTree::mixed(6000)
    };
    let model = generate::random_tree(&shape, 3).unwrap();
    let (state, forces) = inputs(&model, 3);
    let solve = |parallel| {
        let options = DcaOptions {
            parallel,
            tree: Precision::F32,
            ..DcaOptions::default()
        };
        let mut workspace = DcaWorkspace::new(&model, &options).unwrap();
        dca(&model, &state, &forces, &mut workspace).unwrap();
        let refined = [(); 2].map(|()| refine(&forces, &mut workspace).unwrap());
        let qdd = workspace.joint_accelerations().unwrap();
        let bits: Vec<_> = qdd.iter().map(|x| x.to_bits()).collect();
        (bits, refined)
    };
    let alone = solve(false);
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        assert!(pool.install(|| solve(true)) == alone, "{threads} threads");
    }
}

/// Nothing to refine, forces of another model; and a failed solve leaves nothing to refine.
#[test]
fn refusals() {
    fn refused(result: Result<impl Sized, Error>) -> bool {
        matches!(result, Err(Error::NotComputed { .. }))
    }
    fn empty(model: &Model, solved: &mut impl Solved) {
        assert!(refused(refine(&Forces::none(model), solved)));
    }
    let model = generate::random_chain(40, &Rod::default(), 1).unwrap();
    let (mut state, forces) = inputs(&model, 1);
    let mut recursion = Workspace::new(&model, Precision::F64);
    let mut joined = tree(&model, Precision::F64, Precision::F32, 8);
    empty(&model, &mut recursion);
    empty(&model, &mut joined);
    dca(&model, &state, &forces, &mut joined).unwrap();
    let other = generate::random_chain(3, &Rod::default(), 1).unwrap();
    let foreign = refine(&Forces::none(&other), &mut joined);
    assert!(matches!(foreign, Err(Error::Model(_))), "{foreign:?}");
    refine(&forces, &mut joined).unwrap();
    state.qd[3] = 1e200;
    assert!(dca(&model, &state, &forces, &mut joined).is_err());
    empty(&model, &mut joined);
}
