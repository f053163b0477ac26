//! Closed loops and coupled joints on a GPU against the CPU.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

mod driven;

use driven::{assert_alike, chain, moved};
use glam::DVec3;
use std::sync::OnceLock;
use vertebra_assembly::generate::{self, RandomTree, Rod};
use vertebra_assembly::{
    Closure, Joint, MassProperties, Model, ModelDescription, State, mechanism,
};
use vertebra_dynamics::gpu::{self, Batch, BatchOptions, Options};
use vertebra_dynamics::{
    Algorithm, Error, Forces, Integrator, Precision, Simulation, Solver, SolverOptions,
};
use vertebra_gpu::{Device, tests_are_left_out};
use vertebra_spatial::Pose;

/// Chunks and joins: the three choices there are.
const PRECISIONS: [(Precision, Precision); 3] = [
    (Precision::F32, Precision::F32),
    (Precision::F64, Precision::F32),
    (Precision::F64, Precision::F64),
];

/// One for all tests, so that pipelines are compiled once.
fn device() -> Option<Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    let open = || (!tests_are_left_out()).then(|| Device::auto().unwrap());
    DEVICE.get_or_init(open).clone()
}

fn options((chunks, tree): (Precision, Precision)) -> Options {
    Options {
        chunks: Some(chunks),
        tree: Some(tree),
        ..Options::default()
    }
}

fn closed(model: Model, state: State) -> (Model, State) {
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state).unwrap();
    simulation.close_loops().unwrap();
    let state = simulation.state().unwrap().clone();
    (model, state)
}

/// Chain mail from a bulge: flat it is singular.
fn mail() -> (Model, State) {
    let (model, mut state) = mechanism::chain_mail(2, 3).unwrap();
    for ring in 0..6 {
        state.q[7 * ring + 1] = 0.03 * (1.0 + ring as f64).sin();
    }
    closed(model, state)
}

/// Two four-bar linkages on one frame that does not move, and a chain beside them that closes nothing.
fn side_by_side() -> (Model, State) {
    let (one, start) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let one = one.describe();
    let mut all = ModelDescription::new("side by side").body(
        "frame",
        None,
        Joint::fixed(),
        MassProperties::rod(1.0, 1.0, 0.1),
    );
    let mut state = Vec::new();
    let mut rates = Vec::new();
    for copy in ["a", "b"] {
        let named = |name: &str| format!("{copy} {name}");
        for body in &one.bodies {
            let mut body = body.clone();
            body.name = named(&body.name);
            body.parent = Some(
                body.parent
                    .map_or("frame".to_owned(), |parent| named(&parent)),
            );
            all.bodies.push(body);
        }
        for closure in &one.loops {
            let mut closure = closure.clone();
            closure.name = named(&closure.name);
            closure.bodies = closure.bodies.map(|body| body.map(|body| named(&body)));
            all.loops.push(closure);
        }
        state.extend(&start.q);
        rates.extend(
            start
                .qd
                .iter()
                .map(|rate| if copy == "a" { *rate } else { 0.0 }),
        );
    }
    let rod = MassProperties::rod(0.5, 0.3, 0.05);
    let all = all
        .body("upper", Some("frame"), Joint::revolute(DVec3::X), rod)
        .body("lower", Some("upper"), Joint::spherical(), rod);
    let model = all.build().unwrap();
    let mut start = State::neutral(&model);
    start.q[..state.len()].copy_from_slice(&state);
    start.qd[..rates.len()].copy_from_slice(&rates);
    closed(model, start)
}

/// Gears on an arm that swings, their shafts skew.
fn gears() -> (Model, State) {
    let wheel = MassProperties::rod(2.0, 0.1, 0.3);
    let at = |x: f64| Pose::from_translation(DVec3::new(x, 0.1, 0.0));
    let model = ModelDescription::new("gears")
        .body("arm", None, Joint::revolute(DVec3::Y), wheel)
        .body(
            "driver",
            Some("arm"),
            Joint::revolute(DVec3::Z).at(at(0.3)),
            wheel,
        )
        .body(
            "rack",
            Some("arm"),
            Joint::prismatic(DVec3::X).at(at(0.5)),
            wheel,
        )
        .body(
            "driven",
            Some("driver"),
            Joint::revolute(DVec3::X).at(at(0.2)),
            wheel,
        )
        .couple("mesh", "driven", "driver", -2.5, 0.3)
        .couple("pinion", "rack", "driver", 0.05, 0.1)
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    state.qd.fill(0.7);
    closed(model, state)
}

/// A nut on a thread, and a rod between two sliders: closures that mechanisms seldom have.
fn threads() -> (Model, State) {
    let mass = MassProperties::rod(1.0, 0.5, 0.1);
    let axis = DVec3::new(0.6, 0.0, 0.8);
    let side = Pose::from_translation(DVec3::new(1.0, 0.4, 0.2));
    let screw = Closure::Screw { axis, pitch: 0.25 };
    let universal = Closure::Universal {
        first: DVec3::X,
        second: DVec3::Y,
    };
    let model = ModelDescription::new("threads")
        .body("nut", None, Joint::prismatic(axis), mass)
        .body("turn", Some("nut"), Joint::revolute(axis), mass)
        .body("bob", None, Joint::free().at(side), mass)
        .body("kite", None, Joint::free(), mass)
        .close("thread", [None, Some("turn")], [Pose::IDENTITY; 2], screw)
        .close(
            "wire",
            [Some("turn"), Some("bob")],
            [Pose::from_translation(DVec3::X * 0.3), Pose::IDENTITY],
            Closure::Distance { length: 0.8 },
        )
        .close(
            "joint",
            [Some("bob"), Some("kite")],
            [Pose::IDENTITY, side],
            universal,
        )
        .close(
            "plane",
            [None, Some("kite")],
            [Pose::IDENTITY; 2],
            Closure::Planar {
                normal: DVec3::new(0.1, -0.2, 1.0),
            },
        )
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    state.q[..2].copy_from_slice(&[0.1, 0.4]);
    state.qd[..2].copy_from_slice(&[0.05, 0.2]);
    closed(model, state)
}

/// Two bodies of a tree that are where they are, held together by a ball; and one of them by the world.
fn held(model: &Model, seed: u64, [one, other]: [usize; 2]) -> (Model, State) {
    let mut state = State::random(model, seed);
    state.qd.iter_mut().for_each(|rate| *rate *= 0.1);
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let ids: Vec<_> = model.body_ids().collect();
    let [a, b] = [one, other].map(|body| simulation.pose(ids[body]).unwrap());
    let [one, other] = [one, other].map(|body| model.bodies()[body].name.clone());
    let on_a = Pose::from_translation(a.rotation.inverse() * (b.translation - a.translation));
    let world = Pose::from_translation(a.translation);
    let model = (model.describe())
        .close(
            "clasp",
            [Some(&one), Some(&other)],
            [on_a, Pose::IDENTITY],
            Closure::Ball,
        )
        .close(
            "hook",
            [None, Some(&one)],
            [world, Pose::IDENTITY],
            Closure::Ball,
        )
        .build()
        .unwrap();
    closed(model, state)
}

/// Bodies of a tree held where they are by closures of every kind, most of which let them slide past each other.
fn every_closure() -> (Model, State) {
    let tree = RandomTree {
        reach: 5,
        floating: true,
        ..RandomTree::mixed(40)
    };
    let model = generate::random_tree(&tree, 9).unwrap();
    let axis = DVec3::new(0.3, -1.0, 0.4);
    let closures = [
        Closure::Prismatic { axis },
        Closure::Cylindrical { axis },
        Closure::Planar { normal: axis },
        Closure::Screw { axis, pitch: 0.2 },
        Closure::Revolute { axis },
        Closure::Universal {
            first: axis,
            second: DVec3::new(1.0, 0.3, 0.0),
        },
    ];
    let mut state = State::random(&model, 10);
    state.qd.iter_mut().for_each(|rate| *rate *= 0.3);
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let poses = simulation.poses().unwrap().to_vec();
    let mut description = model.describe();
    for (k, closure) in closures.into_iter().enumerate() {
        let [one, other] = [5 * k + 4, 5 * k + 9];
        let pair = [one, other].map(|body| model.bodies()[body].name.clone());
        let on_one = poses[one].inverse() * poses[other];
        description = description.close(
            format!("closure {k}"),
            [Some(&pair[0]), Some(&pair[1])],
            [on_one, Pose::IDENTITY],
            closure,
        );
    }
    closed(description.build().unwrap(), state)
}

/// All closed by every kind of closure, some of them twice over.
fn mechanisms() -> Vec<(Model, State)> {
    let (twice, start) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut twice = twice.describe();
    let mut again = twice.loops[0].clone();
    again.name += " again";
    twice.loops.push(again);
    let chain = generate::random_chain(40, &Rod::default(), 1).unwrap();
    let tree = RandomTree {
        reach: 4,
        floating: true,
        ..RandomTree::mixed(60)
    };
    let tree = generate::random_tree(&tree, 4).unwrap();
    vec![
        closed(twice.build().unwrap(), start),
        mechanism::bennett().unwrap(),
        mechanism::jansen_leg().unwrap(),
        mechanism::stewart_platform().unwrap(),
        mail(),
        side_by_side(),
        gears(),
        threads(),
        every_closure(),
        held(&chain, 2, [10, 39]),
        held(&tree, 3, [20, 58]),
    ]
}

/// Loops spread what is rounded by their compliances; in f32 mu is larger, and so is what redundant loops lose.
fn bound((chunks, tree): (Precision, Precision)) -> f64 {
    let spread = if chunks == Precision::F32 { 1e5 } else { 1e4 };
    spread * tree.epsilon()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
}

/// Accelerations, as good as those of the tree.
fn compare_accelerations(model: &Model, state: &State, simulation: &mut Simulation, bound: f64) {
    let mut forces = Forces::none(model);
    for (k, force) in forces.joint.iter_mut().enumerate() {
        *force = (k as f64).sin();
    }
    let mut solver = Solver::new(model, &SolverOptions::default()).unwrap();
    let exact = solver.forward_dynamics(model, state, &forces).unwrap();
    *simulation.forces_mut() = forces;
    let found = simulation.accelerations().unwrap();
    *simulation.forces_mut() = Forces::none(model);
    let off = (found.iter().zip(exact)).map(|(a, b)| (a - b).abs());
    let off = off.fold(0.0_f64, f64::max) / largest(exact);
    assert!(off <= bound, "{}: {off:e} of {bound:e}", model.name());
}

/// Accelerations are the CPU's, and steps, which stay closed.
#[test]
fn mechanisms_move_as_on_the_cpu() {
    let Some(device) = device() else { return };
    for precisions in PRECISIONS {
        let left = match precisions.0 {
            Precision::F32 => 1e-4,
            _ => 1e-9,
        };
        for (index, (model, state)) in mechanisms().into_iter().enumerate() {
            // Kernels take their time to compile, for each precision and integrator.
            let is_third = index % 3 == 0;
            if precisions.1 != Precision::F64 && !is_third {
                continue;
            }
            for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
                let is_higher = integrator == Integrator::RungeKutta4;
                if is_higher && !(is_third && precisions.1 == Precision::F64) {
                    continue;
                }
                let mut host = Simulation::new(model.clone())
                    .unwrap()
                    .with_integrator(integrator);
                let options = Options {
                    integrator,
                    ..options(precisions)
                };
                let mut remote = Simulation::on_gpu(&device, model.clone(), &options).unwrap();
                let bound = bound(precisions);
                for simulation in [&mut host, &mut remote] {
                    simulation.set_state(state.clone()).unwrap();
                }
                if integrator == Integrator::SemiImplicitEuler {
                    compare_accelerations(&model, &state, &mut remote, bound);
                }
                for simulation in [&mut host, &mut remote] {
                    simulation.steps(1e-3, 20).unwrap();
                }
                let [done, expected] = [&mut remote, &mut host].map(|s| s.work().unwrap().loops);
                let energy = host.mechanics().unwrap();
                let energy = energy.kinetic_energy + energy.potential_energy.abs();
                assert!(
                    (done - expected).abs() <= bound * energy,
                    "{} {precisions:?} {integrator:?}: work {done:e}, {expected:e}",
                    model.name()
                );
                let violation = remote.loop_violation().unwrap().unwrap();
                assert!(violation.position <= left, "{precisions:?}: {violation:?}");
                let (a, b) = (host.state().unwrap(), remote.state().unwrap());
                let speed = largest(&a.qd).max(1.0);
                let off = |a: &[f64], b: &[f64]| {
                    (a.iter().zip(b)).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
                };
                let (q, qd) = (off(&a.q, &b.q), off(&a.qd, &b.qd) / speed);
                assert!(
                    q <= bound * speed && qd <= bound,
                    "{} {precisions:?} {integrator:?}: q {q:e}, qd {qd:e}",
                    model.name()
                );
            }
        }
    }
}

/// A chain with everything that acts in joints, which are also held by closures, gears and a hook in the world.
fn loaded() -> (Model, State) {
    let open = chain(24, 3);
    let mut simulation = Simulation::new(open.clone()).unwrap();
    let mut state = State::neutral(&open);
    let poses = simulation.poses().unwrap().to_vec();
    let axis = DVec3::new(0.3, -1.0, 0.4).normalize();
    let mut description = open.describe();
    for (name, [one, other], closure) in [
        ("sleeve", [5, 11], Closure::Cylindrical { axis }),
        (
            "cardan",
            [8, 15],
            Closure::Universal {
                first: axis,
                second: axis.any_orthonormal_vector(),
            },
        ),
        ("wire", [12, 18], Closure::Ball),
    ] {
        let pair = [one, other].map(|body| open.bodies()[body].name.clone());
        description = description.close(
            name,
            [Some(&pair[0]), Some(&pair[1])],
            [poses[one].inverse() * poses[other], Pose::IDENTITY],
            closure,
        );
    }
    let model = description
        .close(
            "hook",
            [None, Some("body-20")],
            [
                Pose::from_translation(poses[20].translation),
                Pose::IDENTITY,
            ],
            Closure::Ball,
        )
        .couple("gear", "body-21", "body-23", -0.5, 0.0)
        .build()
        .unwrap();
    state.qd.copy_from_slice(&State::random(&model, 3).qd);
    closed(model, state)
}

/// Springs, dampers, friction, rotors, stops and motors act between loops as on the CPU.
#[test]
fn elements_act_between_loops() {
    let Some(device) = device() else { return };
    let (model, state) = loaded();
    let expected = moved(Simulation::new(model.clone()).unwrap(), &state, 1e-3, 20);
    let work = expected.1;
    for work in [
        work.motors,
        work.springs,
        work.dampers,
        work.friction,
        work.stops,
    ] {
        assert!(work != 0.0, "{:?}", expected.1);
    }
    let gpu = Simulation::on_gpu(&device, model, &options(PRECISIONS[2])).unwrap();
    let found = moved(gpu, &state, 1e-3, 20);
    // Stops are met to the square root of what solutions are known to.
    assert_alike(&found, &expected, 1e-6, "between loops");
}

/// And inertia of freedoms' own, in accelerations.
#[test]
fn freedoms_between_loops_have_inertia_of_their_own() {
    let Some(device) = device() else { return };
    let (model, state) = loaded();
    let mut forces = Forces::none(&model);
    forces.joint_inertia = (0..model.dof_count()).map(|dof| (dof % 3) as f64).collect();
    let (bare, options) = (model.bare(), options(PRECISIONS[2]));
    let run = |mut simulation: Simulation| {
        simulation.set_state(state.clone()).unwrap();
        *simulation.forces_mut() = forces.clone();
        simulation.accelerations().unwrap()
    };
    let exact = run(Simulation::new(bare.clone()).unwrap());
    let found = run(Simulation::on_gpu(&device, bare, &options).unwrap());
    let off = (found.iter().zip(&exact)).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    let bound = bound(PRECISIONS[2]) * largest(&exact);
    assert!(off <= bound, "{off:e} of {bound:e}");
}

/// Items of a batch are each a mechanism of its own; one that is open is named.
#[test]
fn batches_keep_loops_closed() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::bennett().unwrap();
    let mut states = vec![state; 5];
    for (item, state) in states.iter_mut().enumerate() {
        state.qd.iter_mut().for_each(|rate| *rate *= item as f64);
    }
    let options = BatchOptions {
        precision: Precision::F64,
        ..BatchOptions::default()
    };
    let mut batch = Batch::new(&device, &model, states.len(), &options).unwrap();
    assert_eq!(batch.choice().algorithm, Algorithm::Dca);
    batch.set_states(&states).unwrap();
    let solved = batch.solve().unwrap();
    batch.steps(1e-3, 20).unwrap();
    let dofs = model.dof_count();
    for (item, found) in batch.states().unwrap().iter().enumerate() {
        let mut alone = Simulation::new(model.clone()).unwrap();
        alone.set_state(states[item].clone()).unwrap();
        let qdd = alone.accelerations().unwrap();
        for (a, b) in solved[item * dofs..].iter().zip(&qdd) {
            assert!(
                (a - b).abs() <= 1e-11 * largest(&qdd),
                "{item}: {a} and {b}"
            );
        }
        alone.steps(1e-3, 20).unwrap();
        let rates = &alone.state().unwrap().qd;
        for (a, b) in found.qd.iter().zip(rates) {
            assert!(
                (a - b).abs() <= 1e-11 * largest(rates).max(1.0),
                "{item}: {a} and {b}"
            );
        }
    }
    states[3].q[1] += 0.3;
    batch.set_states(&states).unwrap();
    let error = batch.step(1e-3).unwrap_err();
    assert!(
        matches!(&error, Error::Item { item: 3, source, .. }
            if matches!(&**source, Error::LoopOpen { name, .. } if *name == model.loops()[0].name)),
        "{error}"
    );
    let options = BatchOptions {
        algorithm: Some(Algorithm::Aba),
        ..options
    };
    let refused = Batch::new(&device, &model, 5, &options).err();
    assert!(
        matches!(refused, Some(Error::LoopsUnavailable { .. })),
        "{refused:?}"
    );
}

/// The error of the first of some steps, after which the state is as it was.
fn refusal(device: &Device, model: Model, state: &State) -> Error {
    let mut simulation = Simulation::on_gpu(device, model, &Options::default()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let error = simulation.steps(1e-3, 40).unwrap_err();
    assert_eq!(simulation.state().unwrap(), state);
    assert!(matches!(
        simulation.close_loops(),
        Err(Error::LoopNotClosed { .. })
    ));
    match error {
        Error::Step {
            step: 0, source, ..
        } => *source,
        other => other,
    }
}

/// What cannot be closed is an error that names the loop.
#[test]
fn what_cannot_be_closed_is_refused_by_name() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    // The coupler is too short to reach.
    let mut description = model.describe();
    description.loops[0].placements[0] = Pose::from_translation(DVec3::NEG_Z * 5.0);
    let error = refusal(&device, description.build().unwrap(), &state);
    assert!(
        matches!(&error, Error::LoopOpen { name, violation, .. } if name == "pin" && *violation > 0.1),
        "{error}"
    );
    // A wire that is five thousandths too short.
    let tip = Pose::from_translation(DVec3::X);
    let hook = Pose::from_translation(DVec3::X * 2.005);
    let model = ModelDescription::new("pendulum")
        .body(
            "rod",
            None,
            Joint::revolute(DVec3::Y),
            MassProperties::rod(1.0, 1.0, 0.1),
        )
        .close(
            "wire",
            [Some("rod"), None],
            [tip, hook],
            Closure::Distance { length: 1.0 },
        )
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    state.q[0] = 0.05;
    let error = refusal(&device, model, &state);
    assert!(
        matches!(&error, Error::LoopNotClosed { name, violation, .. } if name == "wire" && *violation > 1e-3),
        "{error}"
    );
}

/// More equations than a workgroup keeps.
#[test]
fn too_many_loops_are_refused() {
    let Some(device) = device() else { return };
    let (model, _) = mechanism::chain_mail(14, 15).unwrap();
    let refused = gpu::Simulation::on(&device, &model, &Options::default()).unwrap_err();
    assert!(
        matches!(refused, Error::TooManyLoops { fit: 1024, .. }),
        "{refused}"
    );
}

/// Tolerances of mechanisms are met by the processor.
#[test]
fn tolerances_are_the_processors() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::jansen_leg().unwrap();
    for tolerance in [1e-6, 1e-14] {
        let tolerance = SolverOptions::to_tolerance(tolerance);
        let host = Simulation::new(model.clone()).unwrap();
        let remote = Simulation::on_gpu(&device, model.clone(), &Options::default()).unwrap();
        let [mut host, mut remote] = [host, remote].map(|simulation| {
            let mut simulation = simulation.with_solver(&tolerance).unwrap();
            simulation.set_state(state.clone()).unwrap();
            simulation.steps(1e-3, 3).unwrap();
            simulation
        });
        assert!(!remote.choice().on_gpu, "{}", remote.choice());
        assert_eq!(host.state().unwrap(), remote.state().unwrap());
    }
}

/// Questions about one state are answered by the processor; loops open by hand are closed.
#[test]
fn questions_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::jansen_leg().unwrap();
    let mut far = state;
    for (k, q) in far.q.iter_mut().enumerate().skip(1) {
        *q += 0.1 * (k as f64).sin();
    }
    let mut host = Simulation::new(model.clone()).unwrap();
    let mut remote = Simulation::on_gpu(&device, model, &options(PRECISIONS[2])).unwrap();
    for simulation in [&mut host, &mut remote] {
        simulation.set_state(far.clone()).unwrap();
        assert!(simulation.loop_violation().unwrap().unwrap().position > 0.01);
        simulation.close_loops().unwrap();
    }
    assert_eq!(host.state().unwrap(), remote.state().unwrap());
    assert_eq!(host.loop_forces().unwrap(), remote.loop_forces().unwrap());
    let qdd = host
        .solve()
        .unwrap()
        .joint_accelerations()
        .unwrap()
        .to_vec();
    assert_eq!(qdd, remote.solve().unwrap().joint_accelerations().unwrap());
    remote.steps(1e-3, 3).unwrap();
    assert!(remote.loop_violation().unwrap().unwrap().position <= 1e-9);
}
