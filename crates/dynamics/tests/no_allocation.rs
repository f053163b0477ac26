//! After the first step nothing is allocated.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::{Body, Model, State, mechanism};
use vertebra_dynamics::{
    Batch, BodyPoint, Centroidal, DcaOptions, DcaWorkspace, Derivatives, Forces, Integrator, Motor,
    Precision, Simulation, Solver, SolverOptions, Workspace, Wrench, aba, aba_batch,
    aba_derivatives, body_poses, centroidal, dca, refine, rnea, rnea_derivatives,
};

fn tree() -> Model {
    let tree = RandomTree {
        floating: true,
        ..RandomTree::mixed(200)
    };
    generate::random_tree(&tree, 11).unwrap()
}

#[test]
fn steps_allocate_nothing() {
    let model = tree();
    for precision in [Precision::F64, Precision::F32] {
        for integrator in [
            Integrator::SemiImplicitEuler,
            Integrator::RungeKutta4,
            Integrator::ImplicitMidpoint,
        ] {
            let mut simulation = Simulation::new(model.clone())
                .unwrap()
                .with_integrator(integrator)
                .with_precision(precision)
                .unwrap();
            simulation.set_state(State::random(&model, 2)).unwrap();
            simulation
                .forces_mut()
                .push(model.last_body(), Wrench::at_center([1.0, 0.0, 0.0]));
            simulation.step(1e-4).unwrap();
            let count = allocation_counter::measure(|| {
                for _ in 0..10 {
                    simulation.step(1e-4).unwrap();
                    simulation.pose(model.last_body()).unwrap();
                }
            });
            assert_eq!(count.count_total, 0, "{precision} {integrator:?}");
        }
    }
}

#[test]
fn steps_of_closed_loops_allocate_nothing() {
    let (model, state) = mechanism::jansen_leg().unwrap();
    for integrator in [
        Integrator::SemiImplicitEuler,
        Integrator::RungeKutta4,
        Integrator::ImplicitMidpoint,
    ] {
        let mut simulation = Simulation::new(model.clone())
            .unwrap()
            .with_integrator(integrator);
        simulation.set_state(state.clone()).unwrap();
        simulation.step(1e-4).unwrap();
        let count = allocation_counter::measure(|| {
            for _ in 0..10 {
                simulation.step(1e-4).unwrap();
            }
        });
        assert_eq!(count.count_total, 0, "{integrator:?}");
    }
}

#[test]
fn quantities_allocate_nothing() {
    let model = tree();
    let (state, forces) = (State::random(&model, 1), Forces::none(&model));
    let qdd = vec![0.5; model.dof_count()];
    let mut workspace = Workspace::new(&model, Precision::F64);
    let (mut out, mut whole) = (Derivatives::new(&model), Centroidal::new(&model));
    let mut jacobian = vec![0.0; 6 * model.dof_count()];
    let mut all = || {
        rnea_derivatives(&model, &state, &qdd, &forces, &mut workspace, &mut out).unwrap();
        aba_derivatives(&model, &state, &forces, &mut workspace, &mut out).unwrap();
        body_poses(&mut workspace).unwrap();
        centroidal(&workspace, &mut whole).unwrap();
        let tip = BodyPoint::origin(model.last_body());
        workspace.jacobian(tip, &mut jacobian).unwrap();
    };
    all();
    assert_eq!(allocation_counter::measure(all).count_total, 0);
}

#[test]
fn steps_with_elements_and_motors_allocate_nothing() {
    let model = generate::random_mechanism(30, true, 5).unwrap();
    let slides = |body: &&Body| body.dof_range().len() == 1;
    let driven = model.bodies().iter().find(slides).unwrap();
    let driven = model.find(&driven.name).unwrap();
    let mut simulation = Simulation::new(model).unwrap();
    simulation.set_motor(driven, Motor::torque(1.0)).unwrap();
    simulation.step(1e-3).unwrap();
    let count = allocation_counter::measure(|| {
        for step in 0..50 {
            let target = f64::from(step) * 0.01;
            let motor = Motor::position(target, 100.0, 1.0).limited(10.0);
            simulation.set_motor(driven, motor).unwrap();
            simulation.step(1e-3).unwrap();
        }
    });
    assert_eq!(count.count_total, 0);
}

#[test]
fn algorithms_allocate_nothing() {
    let model = tree();
    let (state, forces) = (State::random(&model, 1), Forces::none(&model));
    let mut workspace = Workspace::new(&model, Precision::F64);
    let qdd = aba(&model, &state, &forces, &mut workspace)
        .unwrap()
        .to_vec();
    let options = DcaOptions {
        parallel: false,
        ..DcaOptions::default()
    };
    let mut tree = DcaWorkspace::new(&model, &options).unwrap();
    // Corrections take their memory when the first one is asked for.
    dca(&model, &state, &forces, &mut tree).unwrap();
    refine(&forces, &mut tree).unwrap();
    refine(&forces, &mut workspace).unwrap();
    let count = allocation_counter::measure(|| {
        aba(&model, &state, &forces, &mut workspace).unwrap();
        dca(&model, &state, &forces, &mut tree).unwrap();
        // The second of a solution takes the drift of places out.
        for _ in 0..2 {
            refine(&forces, &mut tree).unwrap();
            refine(&forces, &mut workspace).unwrap();
        }
        rnea(&model, &state, &qdd, &forces, &mut workspace).unwrap();
    });
    assert_eq!(count.count_total, 0);
    // The counter counts.
    assert_ne!(
        allocation_counter::measure(|| drop(qdd.clone())).count_total,
        0
    );
}

#[test]
fn solvers_to_a_tolerance_allocate_nothing() {
    let model = tree();
    let (state, forces) = (State::random(&model, 1), Forces::none(&model));
    let mut solver = Solver::new(&model, &SolverOptions::to_tolerance(1e-10)).unwrap();
    solver.forward_dynamics(&model, &state, &forces).unwrap();
    let count = allocation_counter::measure(|| {
        solver.forward_dynamics(&model, &state, &forces).unwrap();
    });
    assert_eq!(count.count_total, 0);
}

#[test]
fn batches_allocate_nothing() {
    let model = tree();
    let states: Vec<_> = (0..21).map(|seed| State::random(&model, seed)).collect();
    let forces = vec![Forces::none(&model); states.len()];
    for precision in [Precision::F64, Precision::F32] {
        let mut batch = Batch::with_threads(&model, precision, 1);
        aba_batch(&model, &states, &forces, &mut batch).unwrap();
        let count = allocation_counter::measure(|| {
            aba_batch(&model, &states, &forces, &mut batch).unwrap();
        });
        assert_eq!(count.count_total, 0, "{precision}");
    }
}
