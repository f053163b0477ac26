//! A model in motion on a GPU.

use super::engine::{self, Engine, PUSHED_SLOTS, STEP_SIZE, STEPS, Task};
use super::limits;
use super::loops::LoopTables;
use super::options::Options;
use super::poses::{PendingPoses, PoseBuffer, Reading};
use super::scalar::Scalar;
use super::tables::Tables;
use super::transfer::Transfer;
use crate::dca::plan::{self, Plan};
use crate::gpu::Explicit;
use crate::link::Scales;
use crate::loops::{self, Loops};
use crate::{Elements, Error, Forces, Integrator, Precision};
use std::collections::VecDeque;
use vertebra_assembly::schedule::Schedule;
use vertebra_assembly::{Model, State};
use vertebra_gpu::{Device, Output, Pending, Timing};
use vertebra_spatial::Pose;

/// Steps of a program, so that their number does not decide how often one is submitted.
const BLOCK: usize = 16;

/// Runs under way before the oldest is waited for.
const UNDER_WAY: usize = 4;

#[derive(Debug)]
enum Engines {
    F32(Engine<f32, f32>),
    Mixed(Engine<f64, f32>),
    F64(Engine<f64, f64>),
}

/// Runs a generic expression on an engine of whichever precisions.
macro_rules! in_engine {
    ($engines:expr, $engine:ident => $body:expr) => {
        match $engines {
            Engines::F32($engine) => $body,
            Engines::Mixed($engine) => $body,
            Engines::F64($engine) => $body,
        }
    };
}

mod elements;

/// A model, its state and the forces on it, on a GPU.
///
/// A step that fails leaves the state as it was before that step; the error names the body, and
/// [`Error::Step`] the step.
#[derive(Debug)]
pub struct Simulation {
    model: Model,
    options: Options,
    integrator: Explicit,
    precisions: (Precision, Precision),
    tables: Tables,
    scales: Scales,
    engines: Engines,
    forces: Forces,
    /// What `forces` came to on the device.
    force_numbers: Vec<f64>,
    /// What acts in the joints; none where nothing ever did.
    elements: Option<Box<Elements>>,
    /// Whether the device's motors are older.
    motors_changed: bool,
    /// Whether steps were taken since the work of elements and loops was collected, the device's sums of it then, and
    /// the loops' so far \[J\].
    has_worked: bool,
    works: Vec<f64>,
    loop_work: f64,
    control: Vec<u32>,
    time: f64,
    step: f64,
    /// Whether kinematics and poses are those of the state.
    turned: bool,
    /// Steps since the device's count was last reset.
    taken: u32,
    gpu_time: Option<f64>,
    dispatch_times: Vec<(String, f64)>,
}

impl Simulation {
    /// Uploads a model, in the neutral state.
    ///
    /// # Errors
    /// [`Error::PrecisionUnavailable`] where the adapter lacks f64 or the reference precision is
    /// asked for; [`Error::IntegratorUnavailable`]; [`Error::TreePrecision`]; [`Error::Sweeps`];
    /// [`Error::Model`] for a bad schedule; [`Error::ModelTooLarge`] with the limit and how many bodies
    /// fit; [`Error::TooManyLoops`]; [`Error::Gpu`].
    pub fn on(device: &Device, model: &Model, options: &Options) -> Result<Self, Error> {
        let elements = model.first_element().map(|_| Elements::new(model).into());
        Self::with_elements(device, model, options, elements, false)
    }

    /// The same with what acts in the joints; `has_balls` if spherical ones are given more than is alike in all
    /// directions.
    fn with_elements(
        device: &Device,
        model: &Model,
        options: &Options,
        elements: Option<Box<Elements>>,
        has_balls: bool,
    ) -> Result<Self, Error> {
        let precisions = options.precisions(device)?;
        let integrator = options.integrator.try_into()?;
        let (chunks, tree) = precisions;
        let weights = plan::weights(model, tree.epsilon());
        let parents: Vec<_> = model.bodies().iter().map(|body| body.parent).collect();
        let cuts = plan::cut_weights(model, &weights, tree.epsilon());
        let gathering = options.gathering(model, &weights, precisions);
        let schedule = Schedule::of_tree(&parents, &cuts, &gathering)?;
        let plan = Plan::new(model, schedule, &weights);
        let scales = Scales::of_model(model);
        let rows = elements.as_ref().map(|elements| elements.rows(&scales));
        let of_elements = elements.as_ref().is_some_and(|own| own.has_ball_laws());
        let has_balls = has_balls || of_elements;
        let mut tables = Tables::new(model, &plan, options.sweeps, rows.as_deref(), has_balls);
        tables.loops = LoopTables::add_to(&mut tables, model)?;
        let engines = match (chunks, tree) {
            (Precision::F32, _) => Engines::F32(engine(device, &tables)?),
            (_, Precision::F32) => Engines::Mixed(engine(device, &tables)?),
            _ => Engines::F64(engine(device, &tables)?),
        };
        let bodies = model.bodies().len();
        let mut simulation = Self {
            options: *options,
            integrator,
            precisions,
            scales,
            engines,
            forces: Forces::none(model),
            force_numbers: Vec::new(),
            elements,
            motors_changed: false,
            has_worked: false,
            works: Vec::new(),
            loop_work: 0.0,
            control: vec![0; PUSHED_SLOTS + bodies],
            time: 0.0,
            step: 0.0,
            turned: false,
            taken: 0,
            gpu_time: None,
            dispatch_times: Vec::new(),
            model: model.clone(),
            tables,
        };
        simulation.set_state(&State::neutral(model))?;
        simulation.set_forces(&Forces::none(model))?;
        Ok(simulation)
    }

    /// The model.
    #[must_use]
    pub const fn model(&self) -> &Model {
        &self.model
    }

    /// The options it was made with.
    #[must_use]
    pub const fn options(&self) -> &Options {
        &self.options
    }

    /// Takes further steps by another integrator.
    ///
    /// # Errors
    /// [`Error::IntegratorUnavailable`]; then the old one is kept.
    pub fn set_integrator(&mut self, integrator: Integrator) -> Result<(), Error> {
        self.integrator = integrator.try_into()?;
        self.options.integrator = integrator;
        Ok(())
    }

    /// Precisions of chunks and of joins.
    #[must_use]
    pub const fn precisions(&self) -> (Precision, Precision) {
        self.precisions
    }

    /// Time of the state \[s\].
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.time
    }

    /// Replaces the state.
    ///
    /// # Errors
    /// [`Error::Model`] if it does not fit the model, [`Error::Overflow`] if it does not fit the
    /// precision; then the old one is kept. [`Error::Gpu`].
    pub fn set_state(&mut self, state: &State) -> Result<(), Error> {
        state.check(&self.model)?;
        let numbers = self.transfer().to_device(state)?;
        self.collect_work()?;
        // The device begins anew.
        self.works.clear();
        in_engine!(&self.engines, engine => engine.write_state(&numbers))?;
        self.time = state.time;
        self.turned = false;
        Ok(())
    }

    /// Reads the state back.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn state(&mut self) -> Result<State, Error> {
        let numbers = self.read_state()?;
        Ok(self.transfer().state_of(&numbers, self.time))
    }

    /// The forces that act in the coming steps.
    #[must_use]
    pub const fn forces(&self) -> &Forces {
        &self.forces
    }

    /// Replaces the forces that act in the coming steps.
    ///
    /// # Errors
    /// [`Error`] if they do not fit the model; then the old ones are kept. [`Error::Gpu`].
    pub fn set_forces(&mut self, forces: &Forces) -> Result<(), Error> {
        forces.check(&self.model)?;
        let is_given = |inertias: &[f64]| inertias.iter().any(|&own| own != 0.0);
        let has_across = is_given(forces.inertias_across());
        let lacks_balls = has_across && self.tables.balls.is_none();
        if lacks_balls || (self.elements.is_none() && is_given(&forces.joint_inertia)) {
            self.collect_work()?;
            let elements = self.elements.clone();
            let elements = elements.unwrap_or_else(|| Elements::new(&self.model).into());
            self.take_elements(elements, has_across)?;
        }
        let mut control = vec![0; self.control.len()];
        let pushes = self.transfer().pushes(forces, &mut control);
        let units = self.model.units();
        let gravity = -self.model.gravity() / units.acceleration();
        let mut numbers = gravity.to_array().to_vec();
        numbers.push(self.step / units.time);
        let taus = (self.tables.dofs.iter())
            .map(|&dof| forces.joint[dof as usize] / self.scales.force[dof as usize]);
        numbers.extend(taus);
        self.put_elements(forces, &mut numbers);
        numbers.extend(pushes.into_iter().flatten());
        in_engine!(&mut self.engines, engine => {
            engine.write_forces(&numbers)?;
            engine.write_control(&control)
        })?;
        self.force_numbers = numbers;
        self.control = control;
        self.motors_changed = false;
        self.taken = 0;
        if *forces != self.forces {
            self.forces = forces.clone();
        }
        Ok(())
    }

    /// Moves on by `h` \[s\]; a negative step goes back in time, unless there are elements in joints.
    ///
    /// # Errors
    /// As [`steps`](Self::steps).
    pub fn step(&mut self, h: f64) -> Result<(), Error> {
        self.steps(h, 1)
    }

    /// Takes `count` steps of `h` \[s\] each, without the host between them.
    ///
    /// # Errors
    /// [`Error::Step`], naming the step and why it failed: the state is the one before it.
    /// [`Error::NonFiniteInput`], [`Error::Gpu`]; of elements [`Error::RoughElement`], [`Error::StepBack`].
    pub fn steps(&mut self, h: f64, count: usize) -> Result<(), Error> {
        let attempts = self.attempts(h)?;
        self.set_step(h)?;
        self.upload_motors()?;
        self.has_worked = true;
        self.turn()?;
        let tables = &self.tables;
        let mut under_way: VecDeque<Pending> = VecDeque::new();
        let (mut failure, mut left) = (None, count);
        // What the device refused: as steps before it may be done, time goes with them all the same.
        let mut broken: Option<Error> = None;
        while left > 0 || !under_way.is_empty() {
            if left > 0 && under_way.len() < UNDER_WAY {
                let steps = if left >= BLOCK { BLOCK } else { 1 };
                let task = Task::Steps(self.integrator, steps, attempts);
                match in_engine!(&mut self.engines, engine => engine.run(tables, task)) {
                    Ok(pending) => under_way.push_back(pending),
                    Err(error) => {
                        broken = Some(error.into());
                        break;
                    }
                }
                left -= steps;
                continue;
            }
            let Some(pending) = under_way.pop_front() else {
                break;
            };
            match pending.wait() {
                Ok(output) => {
                    self.gpu_time = output.gpu_time();
                    self.dispatch_times = times_of(&output);
                }
                Err(error) => {
                    match engine::gravest(error) {
                        Ok(gravest) => failure = Some(gravest),
                        Err(error) => broken = Some(error.into()),
                    }
                    break;
                }
            }
        }
        // After a failure those that follow change nothing.
        for pending in under_way {
            if let Err(error) = pending.wait_for_all() {
                broken.get_or_insert_with(|| error.into());
            }
        }
        let done = if failure.is_none() && broken.is_none() {
            count
        } else {
            match in_engine!(&mut self.engines, engine => engine.read_control(tables)) {
                Ok(control) => control[STEPS].wrapping_sub(self.taken) as usize,
                Err(error) => return Err(broken.unwrap_or_else(|| error.into())),
            }
        };
        for _ in 0..done {
            self.time += h;
        }
        self.taken = self.taken.wrapping_add(engine::number(done));
        if let Some(error) = broken {
            return Err(error);
        }
        let Some((stage, body)) = failure else {
            return Ok(());
        };
        let source = if stage == engine::OPEN {
            self.open_loop()?
        } else {
            self.error(&stage, body)
        };
        self.reset()?;
        Err(Error::Step {
            step: done,
            count,
            source: Box::new(source),
        })
    }

    /// Computes the joint accelerations in the present state [rad/s^2 or m/s^2], shape
    /// [`Model::dof_count`].
    ///
    /// # Errors
    /// [`Error::SingularJoint`], [`Error::Unjoined`], [`Error::Overflow`]; [`Error::Gpu`].
    pub fn accelerations(&mut self) -> Result<Vec<f64>, Error> {
        self.solve()?;
        self.read_accelerations()
    }

    /// Reads those that were computed last.
    pub(crate) fn read_accelerations(&mut self) -> Result<Vec<f64>, Error> {
        let numbers = self.read_state()?;
        Ok(self.accelerations_of(&numbers))
    }

    /// The state and the joint accelerations in it, read at once: those of a step of `h` \[s\] whose laws are on the parts on which
    /// the last one ended, or without one as [`accelerations`](Self::accelerations).
    pub(crate) fn solved(&mut self, h: Option<f64>) -> Result<(State, Vec<f64>), Error> {
        self.solve_in(h)?;
        let numbers = self.read_state()?;
        let state = self.transfer().state_of(&numbers, self.time);
        Ok((state, self.accelerations_of(&numbers)))
    }

    fn read_state(&mut self) -> Result<Vec<f64>, Error> {
        let tables = &self.tables;
        Ok(in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadState))?)
    }

    fn accelerations_of(&self, numbers: &[f64]) -> Vec<f64> {
        let tables = &self.tables;
        let mut qdd = vec![0.0; self.model.dof_count()];
        for (&dof, number) in tables
            .dofs
            .iter()
            .zip(&numbers[tables.accelerations_at()..])
        {
            let dof = dof as usize;
            qdd[dof] = number * self.scales.acceleration[dof];
        }
        qdd
    }

    /// Computes the joint accelerations and leaves them on the device.
    ///
    /// # Errors
    /// As [`accelerations`](Self::accelerations).
    pub fn solve(&mut self) -> Result<(), Error> {
        self.solve_in(None)
    }

    /// The same in a step.
    fn solve_in(&mut self, step: Option<f64>) -> Result<(), Error> {
        let task = Task::Accelerations(self.implicit_in(step)?);
        if let Some(h) = step {
            self.set_step(h)?;
        }
        self.upload_motors()?;
        self.turn()?;
        let tables = &self.tables;
        let pending = in_engine!(&mut self.engines, engine => engine.run(tables, task))?;
        match pending.wait() {
            Ok(output) => {
                self.gpu_time = output.gpu_time();
                self.dispatch_times = times_of(&output);
                Ok(())
            }
            Err(error) => {
                let (stage, body) = engine::gravest(error)?;
                Err(self.error(&stage, body))
            }
        }
    }

    /// Reads where all bodies' own frames are in the world.
    ///
    /// # Errors
    /// [`Error::Gpu`]; [`Error::Overflow`].
    pub fn poses(&mut self) -> Result<Vec<Pose>, Error> {
        self.begin_poses()?.wait()
    }

    /// Begins to read where all bodies' own frames are now, and returns at once: what is asked for
    /// next runs while the poses are on their way.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn begin_poses(&mut self) -> Result<PendingPoses, Error> {
        self.turn()?;
        let (tables, task) = (&self.tables, Task::ReadPoses);
        let reading = match &mut self.engines {
            Engines::F32(engine) => Reading::F32(engine.begin(tables, task)?),
            Engines::Mixed(engine) => Reading::F64(engine.begin(tables, task)?),
            Engines::F64(engine) => Reading::F64(engine.begin(tables, task)?),
        };
        Ok(PendingPoses::new(reading, &self.model, self.time))
    }

    /// The buffer with all poses, up to date after [`step`](Self::step), [`steps`](Self::steps) and
    /// [`poses`](Self::poses), for other programs on the device to read.
    #[must_use]
    pub fn pose_buffer(&self) -> PoseBuffer {
        match &self.engines {
            Engines::F32(engine) => PoseBuffer::F32(engine.pose_buffer().clone()),
            Engines::Mixed(engine) => PoseBuffer::F64(engine.pose_buffer().clone()),
            Engines::F64(engine) => PoseBuffer::F64(engine.pose_buffer().clone()),
        }
    }

    /// Takes the time of runs on the device from now on.
    ///
    /// # Errors
    /// [`Error::Gpu`] where the adapter has no timestamps.
    pub fn take_times(&mut self, timing: Timing) -> Result<(), Error> {
        in_engine!(&mut self.engines, engine => engine.take_times(timing))?;
        Ok(())
    }

    /// The time that the latest run took on the device \[s\], if it was taken.
    #[must_use]
    pub const fn gpu_time(&self) -> Option<f64> {
        self.gpu_time
    }

    /// Kernel and time \[s\] of each dispatch of the latest run, if they were taken one by one.
    #[must_use]
    pub fn dispatch_times(&self) -> Vec<(&str, f64)> {
        let times = self.dispatch_times.iter();
        times.map(|(label, time)| (label.as_str(), *time)).collect()
    }

    /// Dispatches of a single step, poses included.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn dispatches(&mut self) -> Result<usize, Error> {
        let task = Task::Steps(self.integrator, 1, u32::from(self.elements.is_some()));
        let tables = &self.tables;
        Ok(in_engine!(&mut self.engines, engine => engine.dispatches(tables, task))?)
    }

    fn transfer(&self) -> Transfer<'_> {
        Transfer {
            model: &self.model,
            tables: &self.tables,
            scales: &self.scales,
            precision: self.precisions.0,
        }
    }

    fn set_step(&mut self, h: f64) -> Result<(), Error> {
        if h.to_bits() != self.step.to_bits() {
            self.force_numbers[STEP_SIZE] = h / self.model.units().time;
            let numbers = &self.force_numbers;
            in_engine!(&mut self.engines, engine => engine.write_forces(numbers))?;
            self.step = h;
        }
        Ok(())
    }

    /// Kinematics and poses of the state, unless they are there.
    pub(crate) fn turn(&mut self) -> Result<(), Error> {
        if self.turned {
            return Ok(());
        }
        let tables = &self.tables;
        let pending = in_engine!(&mut self.engines, engine => engine.run(tables, Task::Restore))?;
        pending.wait_for_all()?;
        self.turned = true;
        Ok(())
    }

    /// After a failed step: counts from here, and starts from the state.
    fn reset(&mut self) -> Result<(), Error> {
        let control = &self.control;
        in_engine!(&self.engines, engine => engine.write_control(control))?;
        self.taken = 0;
        self.turned = false;
        Ok(())
    }

    /// The loop that is furthest from closed: in the state, if it is too far for a step, else in the one worked on.
    fn open_loop(&mut self) -> Result<Error, Error> {
        let tables = &self.tables;
        let numbers =
            in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadState))?;
        let work = tables.positions.len() + tables.dofs.len();
        let mut loops = Loops::of_model(&self.model);
        let mut violation = |numbers: &[f64]| {
            let state = self.transfer().state_of(numbers, self.time);
            let found = loops
                .as_mut()
                .map(|loops| loops.violation(&self.model, &state));
            found.map_or_else(Default::default, |found| (found.name, found.position))
        };
        let (time, limit) = (self.time, loops::OPEN);
        let (name, open) = violation(&numbers);
        if open > limit {
            let violation = open;
            return Ok(Error::LoopOpen {
                name,
                violation,
                limit,
                time,
            });
        }
        let (name, violation) = violation(&numbers[work..]);
        Ok(Error::LoopNotClosed {
            name,
            violation,
            time,
        })
    }

    fn error(&self, stage: &str, body: usize) -> Error {
        let body = self.model.bodies()[body].name.clone();
        match stage {
            engine::SINGULAR => Error::SingularJoint { body },
            engine::UNJOINED => Error::Unjoined {
                body,
                precision: self.precisions.1,
            },
            _ => Error::Overflow {
                quantity: "state or acceleration",
                body,
                time: self.time,
            },
        }
    }
}

/// Kernel and time of each dispatch of a run.
fn times_of(output: &Output) -> Vec<(String, f64)> {
    let times = output.dispatch_times().into_iter();
    times
        .map(|(label, time)| (label.to_owned(), time))
        .collect()
}

fn engine<T: Scalar, L: Scalar>(device: &Device, tables: &Tables) -> Result<Engine<T, L>, Error> {
    limits::check::<T, L>(tables, &device.limits())?;
    Ok(Engine::new(device, tables)?)
}
