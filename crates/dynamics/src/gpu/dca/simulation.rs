//! A model in motion on a GPU.

use super::engine::{self, Engine, PUSH, PUSHED, PUSHED_SLOTS, STEP_SIZE, STEPS, Task};
use super::tables::Tables;
use crate::dca::check_precisions;
use crate::dca::plan::{self, Plan};
use crate::gpu::Explicit;
use crate::link::{BodyFrame, Scales};
use crate::{Error, Forces, Integrator, Precision, Wrench};
use glam::{DQuat, DVec3};
use std::collections::VecDeque;
use vertebra_assembly::schedule::{Schedule, ScheduleOptions};
use vertebra_assembly::{JointKind, Model, State};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Buffer, Device, Pending, Timing};
use vertebra_spatial::{Pose, Vec3};

/// Steps of a program, so that their number does not decide how often one is submitted.
const BLOCK: usize = 16;

/// Runs under way before the oldest is waited for.
const UNDER_WAY: usize = 4;

/// Joints of a chunk on average: where a device has lanes to spare, a chunk's length is time, and
/// beyond these many bodies its joins are memory.
const SHORT_WINDOW: usize = 4;
const WINDOW: usize = 8;
const LONG_CHAIN: usize = 8192;

/// Angle up to which f32 has digits left for sines \[rad\].
const LARGEST_F32_ANGLE: f64 = 131_072.0;

/// How a model is simulated on a GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Precision of kinematics, chunks and the state; none for f64 where the adapter has it, else f32.
    pub chunks: Option<Precision>,
    /// Precision of the joins, at most that of the chunks; none for f32.
    pub tree: Option<Precision>,
    /// How bodies are gathered into chunks; none for 4 joints each, or 8 of
    /// 8192 and more.
    pub schedule: Option<ScheduleOptions>,
    /// How steps are taken.
    pub integrator: Integrator,
}

/// The buffer with all poses: for each body, in the model's order, orientation x, y, z, w, then
/// position x, y, z \[m\] and 0, those of the body's own frame in the world.
#[derive(Clone, Debug)]
pub enum PoseBuffer {
    /// In f32.
    F32(Buffer<[f32; 4]>),
    /// In f64.
    F64(Buffer<[f64; 4]>),
}

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
    /// [`Error::LoopsUnavailable`] for a model with loops or couplings; [`Error::PrecisionUnavailable`] where the adapter lacks f64 or the reference precision is
    /// asked for; [`Error::IntegratorUnavailable`]; [`Error::TreePrecision`]; [`Error::Model`] for a bad schedule; [`Error::Gpu`], among
    /// others where a buffer exceeds the adapter's limits.
    pub fn on(device: &Device, model: &Model, options: &Options) -> Result<Self, Error> {
        crate::loops::refuse_loops(model, "a GPU")?;
        let precisions = precisions(device, options)?;
        let integrator = options.integrator.try_into()?;
        let (chunks, tree) = precisions;
        let weights = plan::weights(model, tree.epsilon());
        let parents: Vec<_> = model.bodies().iter().map(|body| body.parent).collect();
        let window = if parents.len() < LONG_CHAIN {
            SHORT_WINDOW
        } else {
            WINDOW
        };
        let gathering = options
            .schedule
            .unwrap_or(ScheduleOptions::with_window(window));
        let cuts = plan::cut_weights(model, &weights, tree.epsilon());
        let schedule = Schedule::of_tree(&parents, &cuts, &gathering)?;
        let tables = Tables::new(model, &Plan::new(model, schedule, &weights));
        let engines = match (chunks, tree) {
            (Precision::F32, _) => Engines::F32(Engine::new(device, &tables)?),
            (_, Precision::F32) => Engines::Mixed(Engine::new(device, &tables)?),
            _ => Engines::F64(Engine::new(device, &tables)?),
        };
        let bodies = model.bodies().len();
        let mut simulation = Self {
            options: *options,
            integrator,
            precisions,
            scales: Scales::of_model(model),
            engines,
            forces: Forces::none(model),
            force_numbers: Vec::new(),
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
        let numbers = self.to_device(state)?;
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
        let tables = &self.tables;
        let numbers =
            in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadState))?;
        let (q, qd) = numbers.split_at(tables.positions.len());
        let mut state = State::neutral(&self.model);
        for (&at, &number) in tables.positions.iter().zip(q) {
            state.q[at as usize] = number;
        }
        for (&at, &number) in tables.dofs.iter().zip(qd) {
            state.qd[at as usize] = number / self.scales.rate[at as usize];
        }
        scale_lengths(&self.model, &mut state.q, self.model.units().length);
        state.time = self.time;
        Ok(state)
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
        let mut control = vec![0; self.control.len()];
        let pushes = self.pushes(forces, &mut control);
        let units = self.model.units();
        let gravity = -self.model.gravity() / units.acceleration();
        let mut numbers = gravity.to_array().to_vec();
        numbers.push(self.step / units.time);
        let taus = (self.tables.dofs.iter())
            .map(|&dof| forces.joint[dof as usize] / self.scales.force[dof as usize]);
        numbers.extend(taus);
        numbers.extend(pushes.into_iter().flatten());
        in_engine!(&mut self.engines, engine => {
            engine.write_forces(&numbers)?;
            engine.write_control(&control)
        })?;
        self.force_numbers = numbers;
        self.control = control;
        self.taken = 0;
        if *forces != self.forces {
            self.forces = forces.clone();
        }
        Ok(())
    }

    /// Moves on by `h` \[s\]; a negative step goes back in time.
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
    /// [`Error::NonFiniteInput`], [`Error::Gpu`].
    pub fn steps(&mut self, h: f64, count: usize) -> Result<(), Error> {
        self.set_step(h)?;
        self.turn()?;
        let tables = &self.tables;
        let mut under_way: VecDeque<(usize, Pending)> = VecDeque::new();
        let (mut failure, mut left) = (None, count);
        while left > 0 || !under_way.is_empty() {
            if left > 0 && under_way.len() < UNDER_WAY {
                let steps = if left >= BLOCK { BLOCK } else { 1 };
                let task = Task::Steps(self.integrator, steps);
                let pending = in_engine!(&mut self.engines, engine => engine.run(tables, task))?;
                under_way.push_back((steps, pending));
                left -= steps;
                continue;
            }
            let Some((_, pending)) = under_way.pop_front() else {
                break;
            };
            match pending.wait() {
                Ok(output) => {
                    self.gpu_time = output.gpu_time();
                    self.dispatch_times.clear();
                    let times = output.dispatch_times();
                    let times = times
                        .into_iter()
                        .map(|(label, time)| (label.to_owned(), time));
                    self.dispatch_times.extend(times);
                }
                Err(error) => {
                    failure = Some(engine::gravest(error)?);
                    break;
                }
            }
        }
        // After a failure those that follow change nothing.
        for (_, pending) in under_way {
            pending.wait_for_all()?;
        }
        let done = match &failure {
            None => count,
            Some(_) => {
                let control = in_engine!(&mut self.engines, engine => engine.read_control(tables))?;
                control[STEPS].wrapping_sub(self.taken) as usize
            }
        };
        for _ in 0..done {
            self.time += h;
        }
        self.taken = self.taken.wrapping_add(engine::number(done));
        let Some((stage, body)) = failure else {
            return Ok(());
        };
        self.reset()?;
        Err(Error::Step {
            step: done,
            count,
            source: Box::new(self.error(&stage, body)),
        })
    }

    /// Computes the joint accelerations in the present state [rad/s^2 or m/s^2], shape
    /// [`Model::dof_count`].
    ///
    /// # Errors
    /// [`Error::SingularJoint`], [`Error::Unjoined`], [`Error::Overflow`]; [`Error::Gpu`].
    pub fn accelerations(&mut self) -> Result<Vec<f64>, Error> {
        self.solve()?;
        let tables = &self.tables;
        let numbers =
            in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadState))?;
        let mut qdd = vec![0.0; self.model.dof_count()];
        for (&dof, number) in tables
            .dofs
            .iter()
            .zip(&numbers[tables.accelerations_at()..])
        {
            let dof = dof as usize;
            qdd[dof] = number * self.scales.acceleration[dof];
        }
        Ok(qdd)
    }

    /// Computes the joint accelerations and leaves them on the device.
    ///
    /// # Errors
    /// As [`accelerations`](Self::accelerations).
    pub fn solve(&mut self) -> Result<(), Error> {
        self.turn()?;
        let tables = &self.tables;
        let task = Task::Accelerations;
        let pending = in_engine!(&mut self.engines, engine => engine.run(tables, task))?;
        match pending.wait() {
            Ok(output) => {
                self.gpu_time = output.gpu_time();
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
        self.turn()?;
        let tables = &self.tables;
        let numbers =
            in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadPoses))?;
        let poses = numbers.chunks_exact(8).enumerate().map(|(body, n)| {
            let rotation = DQuat::from_xyzw(n[0], n[1], n[2], n[3]).normalize();
            let pose = Pose::new(rotation, DVec3::new(n[4], n[5], n[6]));
            if pose.is_valid() {
                return Ok(pose);
            }
            Err(Error::Overflow {
                quantity: "pose",
                body: self.model.bodies()[body].name.clone(),
                time: self.time,
            })
        });
        poses.collect()
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

    /// Kernel and time \[s\] of each dispatch of the latest run of steps, if they were taken one by
    /// one.
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
        let task = Task::Steps(self.integrator, 1);
        let tables = &self.tables;
        Ok(in_engine!(&mut self.engines, engine => engine.dispatches(tables, task))?)
    }

    fn set_step(&mut self, h: f64) -> Result<(), Error> {
        if !h.is_finite() {
            return Err(Error::NonFiniteInput {
                quantity: "step",
                element: "simulation".to_owned(),
                value: h,
            });
        }
        if h.to_bits() != self.step.to_bits() {
            self.force_numbers[STEP_SIZE] = h / self.model.units().time;
            let numbers = &self.force_numbers;
            in_engine!(&mut self.engines, engine => engine.write_forces(numbers))?;
            self.step = h;
        }
        Ok(())
    }

    /// Kinematics and poses of the state, unless they are there.
    fn turn(&mut self) -> Result<(), Error> {
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

    /// A state as the kernels have it: twice, as it is and to be worked on.
    fn to_device(&self, state: &State) -> Result<Vec<f64>, Error> {
        let mut q = state.q.clone();
        scale_lengths(&self.model, &mut q, 1.0 / self.model.units().length);
        if self.precisions.0 == Precision::F32 {
            self.check_angles(state)?;
        }
        let positions = self.tables.positions.iter().map(|&at| q[at as usize]);
        let mut numbers: Vec<f64> = positions.collect();
        let rates = (self.tables.dofs.iter())
            .map(|&at| state.qd[at as usize] * self.scales.rate[at as usize]);
        numbers.extend(rates);
        if self.precisions.0 == Precision::F32
            && let Some(at) = numbers.iter().position(|x| x.abs() > f64::from(f32::MAX))
        {
            let counts = self.tables.positions.len();
            let body = self.model.bodies().iter().find(|body| {
                let (positions, dofs) = (body.position_range(), body.dof_range());
                match at.checked_sub(counts) {
                    None => positions.contains(&(self.tables.positions[at] as usize)),
                    Some(at) => dofs.contains(&(self.tables.dofs[at] as usize)),
                }
            });
            return Err(Error::Overflow {
                quantity: "position or rate",
                body: body.map_or_else(String::new, |body| body.name.clone()),
                time: state.time,
            });
        }
        numbers.extend_from_within(..);
        Ok(numbers)
    }

    fn check_angles(&self, state: &State) -> Result<(), Error> {
        let large = self.model.bodies().iter().find(|body| {
            let turns = matches!(body.joint.kind, JointKind::Revolute { .. });
            turns && state.q[body.position_start].abs() > LARGEST_F32_ANGLE
        });
        large.map_or(Ok(()), |body| {
            Err(Error::Overflow {
                quantity: "angle",
                body: body.name.clone(),
                time: state.time,
            })
        })
    }

    /// What pushes each body that is pushed; `control` is given the number of each slot.
    fn pushes(&self, forces: &Forces, control: &mut [u32]) -> Vec<[f64; PUSH]> {
        let mut pushes: Vec<[f64; PUSH]> = Vec::new();
        let units = self.model.units();
        for (id, wrench) in forces.external() {
            let slot = self.tables.slots[id.index()] as usize;
            let number = &mut control[PUSHED_SLOTS + slot];
            if *number == 0 {
                pushes.push([0.0; PUSH]);
                *number = engine::number(pushes.len());
            }
            let frame = BodyFrame::<f64>::new(&self.model.bodies()[id.index()], units);
            let origin = if self.tables.at_center[slot] {
                frame.center
            } else {
                Vec3::ZERO
            };
            add_push(
                &mut pushes[*number as usize - 1],
                &frame,
                origin,
                wrench,
                units,
            );
        }
        control[PUSHED] = engine::number(pushes.len());
        pushes
    }
}

/// Adds a wrench to what pushes a body, about the handle point `origin`: world axes first, a force, a
/// moment, and the columns of f a' with its point a in joint axes; then in joint axes force and moment.
fn add_push(
    push: &mut [f64; PUSH],
    frame: &BodyFrame<f64>,
    origin: Vec3<f64>,
    wrench: &Wrench,
    units: &vertebra_assembly::Units,
) {
    let force = Vec3::from_glam(wrench.force / units.force());
    let torque = Vec3::from_glam(wrench.torque / units.energy());
    let at = match wrench.point {
        None => frame.center,
        Some(point) => frame.placement.point(Vec3::from_glam(point / units.length)),
    };
    let arm = at - origin;
    let mut add = |part: usize, v: Vec3<f64>| {
        for (sum, term) in push[3 * part..].iter_mut().zip(v.to_array()) {
            *sum += term;
        }
    };
    if wrench.body_axes {
        let axes = frame.placement.rotation;
        let (force, torque) = (axes * force, axes * torque);
        add(5, force);
        add(6, torque + arm.cross(force));
    } else {
        add(0, force);
        add(1, torque);
        for (column, along) in arm.to_array().into_iter().enumerate() {
            add(2 + column, force * along);
        }
    }
}

/// Multiplies those positions that are lengths.
fn scale_lengths(model: &Model, q: &mut [f64], factor: f64) {
    for body in model.bodies() {
        let lengths = match body.joint.kind {
            JointKind::Prismatic { .. } => 1,
            JointKind::Free => 3,
            _ => 0,
        };
        for position in &mut q[body.position_start..][..lengths] {
            *position *= factor;
        }
    }
}

fn precisions(device: &Device, options: &Options) -> Result<(Precision, Precision), Error> {
    let has_f64 = device.features().contains(Features::SHADER_F64);
    let best = if has_f64 {
        Precision::F64
    } else {
        Precision::F32
    };
    let chunks = options.chunks.unwrap_or(best);
    let tree = options.tree.unwrap_or(Precision::F32);
    for asked in [chunks, tree] {
        if asked == Precision::Reference || asked == Precision::F64 && !has_f64 {
            return Err(Error::PrecisionUnavailable {
                adapter: device.info().name.clone(),
                precision: asked,
            });
        }
    }
    check_precisions(chunks, tree)?;
    Ok((chunks, tree))
}
