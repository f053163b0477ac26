//! Everything that can be asked of a model.

use vertebra::{
    Algorithm, Batch, BodyId, DcaOptions, DcaWorkspace, Error, Forces, Integrator, Model,
    Precision, Simulation, Solver, SolverOptions, State, Workspace, aba, aba_batch, body_poses,
    crba, crba_forward_dynamics, dca, forward_kinematics, joint_wrenches, mechanics, refine,
    residual, rnea,
};

use super::machine::Machine;
use super::wild::Case;
use vertebra::dynamics::gpu;
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::Features;

/// What came of a question.
pub(super) enum Answer {
    /// Numbers, all of them finite.
    Numbers,
    /// An error.
    Refused(Error),
    /// What must not be.
    Broken(String),
}

/// Steps in time with each integrator.
const STEPS: usize = 3;

/// Bodies up to which dense matrices are asked for.
const DENSE_BODIES: usize = 12;

/// Hands every question and its answer on.
pub(super) fn everything(case: &Case, mut heard: impl FnMut(&'static str, Answer)) {
    let mut ask = |question, answer| heard(question, judged(answer));
    ask("aba f32", recursion(case, Precision::F32));
    ask("aba f64", recursion(case, Precision::F64));
    ask("dca f32", tree(case, Precision::F32, Precision::F32));
    ask("dca f64/f32", tree(case, Precision::F64, Precision::F32));
    ask("dca f64", tree(case, Precision::F64, Precision::F64));
    ask("kinematics f32", kinematics(case, Precision::F32));
    ask("kinematics f64", kinematics(case, Precision::F64));
    ask("rnea f64", inverse(case));
    if case.model.bodies().len() <= DENSE_BODIES {
        ask("crba f64", dense(case));
    }
    ask("batch f64", batch(case));
    ask("tolerance 1e-10", to_tolerance(case));
    for (question, integrator) in [
        ("semi-implicit Euler", Integrator::SemiImplicitEuler),
        ("Runge-Kutta 4", Integrator::RungeKutta4),
        ("implicit midpoint", Integrator::ImplicitMidpoint),
    ] {
        let bare = || Ok(Simulation::new(case.model.clone())?.with_integrator(integrator));
        ask(question, steps(case, bare()));
    }
    match &case.machine {
        None => {}
        Some(Err(error)) => heard("machine", Answer::Refused(error.clone())),
        Some(Ok(machine)) => of_machine(case, machine, |question, answer| {
            heard(question, judged(answer));
        }),
    }
}

/// What elements, motors and loops make of steps, by every algorithm and integrator.
fn of_machine(
    case: &Case,
    machine: &Machine,
    mut ask: impl FnMut(&'static str, Result<Numbers, Error>),
) {
    let with = |options: &SolverOptions, integrator| {
        let simulation = Simulation::new(machine.model.clone())?.with_solver(options)?;
        driven(simulation.with_integrator(integrator), machine)
    };
    let options = |algorithm, precision, tolerance| SolverOptions {
        algorithm: Some(algorithm),
        precision,
        tolerance,
        parallel: false,
        ..SolverOptions::default()
    };
    let (f32, f64) = (Precision::F32, Precision::F64);
    let (euler, midpoint) = (Integrator::SemiImplicitEuler, Integrator::ImplicitMidpoint);
    for (question, options, integrator) in [
        ("machine aba f64", options(Algorithm::Aba, f64, None), euler),
        ("machine aba f32", options(Algorithm::Aba, f32, None), euler),
        ("machine dca f64", options(Algorithm::Dca, f64, None), euler),
        ("machine dca f32", options(Algorithm::Dca, f32, None), euler),
        (
            "machine tolerance 1e-9",
            options(Algorithm::Aba, f64, Some(1e-9)),
            euler,
        ),
        (
            "machine Runge-Kutta 4",
            options(Algorithm::Aba, f64, None),
            Integrator::RungeKutta4,
        ),
        (
            "machine midpoint",
            options(Algorithm::Aba, f64, None),
            midpoint,
        ),
    ] {
        ask(question, steps(case, with(&options, integrator)));
    }
    let closed = with(&options(Algorithm::Aba, f64, None), euler);
    ask("machine close_loops", close_loops(case, closed));
}

/// With the machine's motors.
fn driven(mut simulation: Simulation, machine: &Machine) -> Result<Simulation, Error> {
    for (body, motor) in &machine.motors {
        simulation.set_motor(*body, *motor)?;
    }
    for (body, motor) in &machine.spherical {
        simulation.set_spherical_motor(*body, *motor)?;
    }
    Ok(simulation)
}

/// The same of a GPU: accelerations and steps in every precision it has, bare and, if asked for, of the machine.
pub(super) fn of_gpu(
    case: &Case,
    (device, machines): (&Device, bool),
    mut heard: impl FnMut(&'static str, Answer),
) {
    let mut ask = |question, answer| heard(question, judged(answer));
    let has_f64 = device.features().contains(Features::SHADER_F64);
    let (f32, f64) = (Precision::F32, Precision::F64);
    for (question, of_machine, chunks, tree, sweeps) in [
        ("gpu f32", "gpu machine f32", f32, f32, 0),
        ("gpu f64/f32 + 1", "gpu machine f64/f32 + 1", f64, f32, 1),
        ("gpu f64", "gpu machine f64", f64, f64, 0),
    ] {
        if chunks == f64 && !has_f64 {
            continue;
        }
        let options = gpu::Options {
            chunks: Some(chunks),
            tree: Some(tree),
            sweeps,
            ..gpu::Options::default()
        };
        let on = |model: &Model| Simulation::on_gpu(device, model.clone(), &options);
        ask(question, steps(case, on(&case.model)));
        if let (Some(Ok(machine)), true) = (&case.machine, machines) {
            let simulation = on(&machine.model);
            let simulation = simulation.and_then(|simulation| driven(simulation, machine));
            ask(of_machine, steps(case, simulation));
        }
    }
}

fn judged(answer: Result<Numbers, Error>) -> Answer {
    match answer {
        Ok(numbers) => match numbers.broken {
            None => Answer::Numbers,
            Some(what) => Answer::Broken(what),
        },
        // Whatever a model is, it is no reason to lose a device.
        Err(Error::Gpu(error)) => Answer::Broken(format!("the GPU: {error}")),
        Err(error) => Answer::Refused(error),
    }
}

/// Numbers that were returned.
#[derive(Default)]
struct Numbers {
    /// The first that is none.
    broken: Option<String>,
}

impl Numbers {
    fn see(&mut self, what: &str, values: impl IntoIterator<Item = f64>) {
        if self.broken.is_none()
            && let Some(value) = values.into_iter().find(|value| !value.is_finite())
        {
            self.broken = Some(format!("{what} is {value}"));
        }
    }
}

/// Forward dynamics by the recursion, all that can be read afterwards, and a correction.
fn recursion(case: &Case, precision: Precision) -> Result<Numbers, Error> {
    let (model, mut numbers) = (&case.model, Numbers::default());
    let mut workspace = Workspace::new(model, precision);
    let qdd = aba(model, &case.state, &case.forces, &mut workspace)?;
    numbers.see("a joint acceleration", qdd.iter().copied());
    // What is refused after this costs the answer no part.
    if joint_wrenches(&mut workspace).is_ok() {
        bodies(case, &workspace, &mut numbers);
        if let Ok(left) = residual(model, &case.state, &case.forces, &workspace) {
            numbers.see("a residual", [left.max(), left.by_body]);
        }
        // The second takes out the drift of places.
        for _ in 0..2 {
            let Ok(found) = refine(&case.forces, &mut workspace) else {
                break;
            };
            numbers.see("a refinement", [found.residual, found.change]);
            let qdd = workspace.joint_accelerations()?;
            numbers.see("a corrected acceleration", qdd.iter().copied());
            bodies(case, &workspace, &mut numbers);
        }
    }
    Ok(numbers)
}

fn bodies(case: &Case, workspace: &Workspace, numbers: &mut Numbers) {
    for body in case.model.body_ids() {
        if let Ok(a) = workspace.acceleration(body) {
            numbers.see("a body's acceleration", a.angular.to_array());
            numbers.see("a body's acceleration", a.linear.to_array());
        }
        if let Ok(f) = workspace.joint_wrench(body) {
            numbers.see("a joint wrench", f.moment.to_array());
            numbers.see("a joint wrench", f.force.to_array());
        }
    }
}

/// The same over the assembly tree.
fn tree(case: &Case, chunks: Precision, joins: Precision) -> Result<Numbers, Error> {
    let (model, mut numbers) = (&case.model, Numbers::default());
    let options = DcaOptions {
        chunks,
        tree: joins,
        parallel: false,
        ..DcaOptions::default()
    };
    let mut workspace = DcaWorkspace::new(model, &options)?;
    let qdd = dca(model, &case.state, &case.forces, &mut workspace)?;
    numbers.see("a joint acceleration", qdd.iter().copied());
    if workspace.compute_joint_wrenches(&case.forces).is_ok() {
        for body in model.body_ids() {
            if let Ok(f) = workspace.joint_wrench(body) {
                numbers.see("a joint wrench", f.moment.to_array());
                numbers.see("a joint wrench", f.force.to_array());
            }
        }
        // The second takes out the drift of places.
        for _ in 0..2 {
            let Ok(found) = refine(&case.forces, &mut workspace) else {
                break;
            };
            numbers.see("a refinement", [found.residual, found.change]);
            let qdd = workspace.joint_accelerations()?;
            numbers.see("a corrected acceleration", qdd.iter().copied());
        }
    }
    Ok(numbers)
}

fn kinematics(case: &Case, precision: Precision) -> Result<Numbers, Error> {
    let (model, mut numbers) = (&case.model, Numbers::default());
    let mut workspace = Workspace::new(model, precision);
    forward_kinematics(model, &case.state, &mut workspace)?;
    body_poses(&mut workspace)?;
    let mut of = |body: BodyId| {
        if let Ok(pose) = workspace.pose(body) {
            numbers.see("a position", pose.translation.to_array());
            numbers.see("a rotation", pose.rotation.to_array());
        }
        if let Ok(velocity) = workspace.velocity(body) {
            numbers.see("a velocity", velocity.angular.to_array());
            numbers.see("a velocity", velocity.linear.to_array());
        }
    };
    model.body_ids().for_each(&mut of);
    if let Ok(found) = mechanics(model, &case.state, &mut workspace) {
        numbers.see(
            "an energy",
            [found.kinetic_energy, found.potential_energy, found.mass],
        );
        numbers.see("the centre of mass", found.center.to_array());
        numbers.see("the linear momentum", found.linear_momentum.to_array());
        numbers.see("the angular momentum", found.angular_momentum.to_array());
    }
    Ok(numbers)
}

fn inverse(case: &Case) -> Result<Numbers, Error> {
    let mut numbers = Numbers::default();
    let mut workspace = Workspace::new(&case.model, Precision::F64);
    let tau = rnea(
        &case.model,
        &case.state,
        &case.qdd,
        &case.forces,
        &mut workspace,
    )?;
    numbers.see("a joint force", tau.iter().copied());
    Ok(numbers)
}

fn dense(case: &Case) -> Result<Numbers, Error> {
    let (model, mut numbers) = (&case.model, Numbers::default());
    let mut workspace = Workspace::new(model, Precision::F64);
    let mass = crba(model, &case.state, &mut workspace)?;
    for column in 0..mass.ncols() {
        let of_column = (0..mass.nrows()).map(|row| mass[(row, column)]);
        numbers.see("an entry of the mass matrix", of_column);
    }
    let qdd = crba_forward_dynamics(model, &case.state, &case.forces, &mut workspace)?;
    numbers.see("a joint acceleration", qdd.iter().copied());
    Ok(numbers)
}

/// Several states at once, of which one may fail alone.
fn batch(case: &Case) -> Result<Numbers, Error> {
    let (model, mut numbers) = (&case.model, Numbers::default());
    let states = [
        case.state.clone(),
        State::neutral(model),
        State::random(model, 1),
    ];
    let forces = [
        case.forces.clone(),
        Forces::none(model),
        case.forces.clone(),
    ];
    let mut batch = Batch::with_threads(model, Precision::F64, 1);
    let first = aba_batch(model, &states, &forces, &mut batch).map(|_| ());
    for item in 0..states.len() {
        if let Ok(qdd) = batch.joint_accelerations(item) {
            numbers.see("a joint acceleration of a batch", qdd.iter().copied());
        }
    }
    if numbers.broken.is_none() {
        first?;
    }
    Ok(numbers)
}

/// To a tolerance, met or refused.
fn to_tolerance(case: &Case) -> Result<Numbers, Error> {
    const TOLERANCE: f64 = 1e-10;
    let mut numbers = Numbers::default();
    let options = SolverOptions {
        algorithm: Some(Algorithm::Aba),
        parallel: false,
        ..SolverOptions::to_tolerance(TOLERANCE)
    };
    let mut solver = Solver::new(&case.model, &options)?;
    let qdd = solver.forward_dynamics(&case.model, &case.state, &case.forces)?;
    numbers.see("a joint acceleration", qdd.iter().copied());
    match solver.achieved() {
        Some(achieved) if achieved.error <= TOLERANCE => {
            numbers.see("a residual", [achieved.residual]);
        }
        other => numbers.broken = Some(format!("a tolerance not kept: {other:?}")),
    }
    Ok(numbers)
}

/// Accelerations and some steps in time, and what can be read afterwards; a step that is refused leaves the state as it was.
fn steps(case: &Case, simulation: Result<Simulation, Error>) -> Result<Numbers, Error> {
    let (mut simulation, mut numbers) = (simulation?, Numbers::default());
    simulation.set_state(case.state.clone())?;
    simulation.forces_mut().clone_from(&case.forces);
    if let Ok(qdd) = simulation.accelerations() {
        numbers.see("a joint acceleration", qdd);
    }
    for _ in 0..STEPS {
        let before = simulation.state()?.clone();
        let stepped = simulation.step(case.step);
        let after = simulation.state()?;
        if let Err(error) = stepped {
            if *after != before {
                numbers.broken = Some("a refused step changed the state".to_owned());
                return Ok(numbers);
            }
            return Err(error);
        }
        numbers.see("a position", after.q.iter().copied());
        numbers.see("a rate", after.qd.iter().copied());
    }
    read(&mut simulation, &mut numbers);
    Ok(numbers)
}

/// Poses, and what elements and loops have done; what is refused costs the answer no part.
fn read(simulation: &mut Simulation, numbers: &mut Numbers) {
    let bodies: Vec<BodyId> = simulation.model().body_ids().collect();
    for body in bodies {
        if let Ok(pose) = simulation.pose(body) {
            numbers.see("a position after steps", pose.translation.to_array());
            numbers.see("a rotation after steps", pose.rotation.to_array());
        }
    }
    if let Ok(work) = simulation.work() {
        numbers.see("work", [work.total()]);
    }
    if let Ok(stored) = simulation.stored() {
        numbers.see("stored energy", [stored.springs, stored.rotors]);
    }
    if let Ok(Some(open)) = simulation.loop_violation() {
        numbers.see("a loop's violation", [open.position, open.rate]);
    }
    if let Ok(forces) = simulation.loop_forces() {
        for force in &forces.loops {
            numbers.see("a loop's force", force.force.to_array());
            numbers.see("a loop's moment", force.moment.to_array());
        }
        numbers.see("a coupling's force", forces.couplings);
    }
}

/// Loops closed from wherever they are.
fn close_loops(case: &Case, simulation: Result<Simulation, Error>) -> Result<Numbers, Error> {
    let (mut simulation, mut numbers) = (simulation?, Numbers::default());
    simulation.set_state(case.state.clone())?;
    let closed = simulation.close_loops();
    let after = simulation.state()?;
    if closed.is_err() && *after != case.state {
        numbers.broken = Some("a refused closing changed the state".to_owned());
        return Ok(numbers);
    }
    closed?;
    let after = simulation.state()?;
    numbers.see("a closed position", after.q.iter().copied());
    numbers.see("a closed rate", after.qd.iter().copied());
    read(&mut simulation, &mut numbers);
    Ok(numbers)
}
