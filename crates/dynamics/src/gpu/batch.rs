//! Many states of one model on a GPU.

mod choice;
mod engine;
mod forest;
mod memory;
mod poses;
mod schedule;
mod tree;

pub use choice::{BatchChoice, BatchOptions};

use crate::forces::check_step;
use crate::{Algorithm, Error, Forces, Motor, Precision, SphericalMotor, loops};
use engine::{Engine, Failure, Fixed, Why};
use forest::Forest;
use vertebra_assembly::{BodyId, Model, State};
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::Features;
use vertebra_spatial::Pose;

/// Many states of one model that live on a GPU: their accelerations, steps in time, poses.
///
/// States and forces are uploaded when they are set and come back when they are asked for; steps
/// in between stay on the device. An item that fails keeps the state before the step; the others go on, but
/// by divide and conquer, where all are one forest, they stop with it. Divide and conquer it is where joints are
/// screws, anything acts in them, or loops are closed.
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::gpu::{Batch, BatchOptions};
/// use vertebra_gpu::Device;
///
/// let model = generate::random_chain(7, &generate::Rod::default(), 7)?;
/// let states: Vec<_> = (0..100).map(|seed| State::random(&model, seed)).collect();
/// # if vertebra_gpu::tests_are_left_out() { return Ok(()); }
/// let mut batch = Batch::new(&Device::auto()?, &model, 100, &BatchOptions::default())?;
/// batch.set_states(&states)?;
/// batch.steps(1e-3, 10)?;
/// assert_eq!(batch.states()?.len(), 100);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
pub struct Batch {
    fixed: Fixed,
    engine: AnyEngine,
    choice: BatchChoice,
    precision: Precision,
    /// Time of each item when its state was set \[s\].
    start: Vec<f64>,
    /// Steps since: lengths \[s\], and how many there were of each in a row.
    steps: Vec<(f64, u32)>,
    time: Option<f64>,
}

enum AnyEngine {
    Single(Box<Engine<f32>>),
    Double(Box<Engine<f64>>),
    Forest(Box<Forest>),
}

macro_rules! in_engine {
    ($engine:expr, $name:ident => $body:expr, $forest:ident => $other:expr) => {
        match $engine {
            AnyEngine::Single($name) => $body,
            AnyEngine::Double($name) => $body,
            AnyEngine::Forest($forest) => $other,
        }
    };
}

impl AnyEngine {
    fn new(fixed: &Fixed, precision: Precision, pushed: Vec<usize>) -> Result<Self, Error> {
        Ok(match precision {
            Precision::F32 => Self::Single(Box::new(Engine::new(fixed, pushed)?)),
            _ => Self::Double(Box::new(Engine::new(fixed, pushed)?)),
        })
    }

    /// Makes place for forces on these bodies.
    fn push(&mut self, fixed: &Fixed, pushed: Vec<usize>) -> Result<(), Error> {
        match self {
            Self::Single(engine) => **engine = engine.with_pushed(fixed, pushed)?,
            Self::Double(engine) => **engine = engine.with_pushed(fixed, pushed)?,
            Self::Forest(_) => {}
        }
        Ok(())
    }
}

impl Batch {
    /// Takes memory for so many items, all in the neutral state at time 0, without forces but gravity.
    ///
    /// # Errors
    /// [`Error::BatchTooLarge`] with the limit and how many items fit; [`Error::PrecisionUnavailable`] of
    /// f64 where the device lacks it, and of the reference; [`Error::IntegratorUnavailable`];
    /// [`Error::TooManyLoops`]; [`Error::Gpu`]. If the articulated-body algorithm is asked for,
    /// [`Error::JointUnavailable`], [`Error::ElementUnavailable`], [`Error::LoopsUnavailable`].
    pub fn new(
        device: &Device,
        model: &Model,
        items: usize,
        options: &BatchOptions,
    ) -> Result<Self, Error> {
        let computes = match options.precision {
            Precision::F32 => true,
            Precision::F64 => device.features().contains(Features::SHADER_F64),
            Precision::Reference => false,
        };
        if !computes {
            return Err(Error::PrecisionUnavailable {
                adapter: device.info().name.clone(),
                precision: options.precision,
            });
        }
        let choice = BatchChoice::of(model, items, options);
        // Of no item nothing is computed.
        if choice.algorithm == Algorithm::Aba && items > 0 {
            super::check_bare(model)?;
        }
        let integrator = options.integrator.try_into()?;
        let fixed = Fixed::new(device, model, (items, choice.lanes as usize, integrator));
        let engine = match choice.algorithm {
            Algorithm::Aba => AnyEngine::new(&fixed, options.precision, Vec::new())?,
            Algorithm::Dca => {
                let how = (options.precision, options.integrator);
                AnyEngine::Forest(Box::new(Forest::new(device, model, items, how)?))
            }
        };
        let mut batch = Self {
            engine,
            choice,
            precision: options.precision,
            start: Vec::new(),
            steps: Vec::new(),
            time: None,
            fixed,
        };
        batch.set_states(&vec![State::neutral(model); items])?;
        Ok(batch)
    }

    /// Number of items.
    #[must_use]
    pub fn len(&self) -> usize {
        self.fixed.items
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.fixed.items == 0
    }

    /// The precision it works in.
    #[must_use]
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// The algorithm and the lanes of an item, and why these.
    #[must_use]
    pub fn choice(&self) -> &BatchChoice {
        &self.choice
    }

    /// Lanes among which the articulated-body algorithm shares the bodies of an item out.
    #[must_use]
    pub fn lanes(&self) -> usize {
        self.fixed.schedule.lanes
    }

    /// Replaces the states of all items.
    ///
    /// # Errors
    /// [`Error::ItemCount`]; [`Error::Item`] with the first that does not fit the model; then all are as they
    /// were. [`Error::Gpu`].
    pub fn set_states(&mut self, states: &[State]) -> Result<(), Error> {
        let model = &self.fixed.model;
        self.check(states, |state| Ok(state.check(model)?))?;
        let fixed = &self.fixed;
        in_engine!(
            &mut self.engine,
            engine => engine.set_states(fixed, states),
            forest => forest.set_states(fixed, states)
        )?;
        self.start = states.iter().map(|state| state.time).collect();
        self.steps.clear();
        Ok(())
    }

    /// Replaces the forces that act on the items from now on.
    ///
    /// # Errors
    /// [`Error::ItemCount`]; [`Error::Item`] with the first that do not fit the model, by the articulated-body algorithm
    /// also those with [`Error::JointInertiaUnavailable`]; then all are as they were. [`Error::Gpu`].
    pub fn set_forces(&mut self, forces: &[Forces]) -> Result<(), Error> {
        let model = &self.fixed.model;
        self.check(forces, |forces| {
            forces.check(model)?;
            match &self.engine {
                AnyEngine::Forest(_) => Ok(()),
                _ => super::check_forces(model, forces),
            }
        })?;
        let fixed = &self.fixed;
        let external = forces.iter().flat_map(Forces::acting);
        let mut pushed: Vec<usize> = external
            .filter_map(|(body, _)| fixed.tree.carrier(body.index()))
            .collect();
        pushed.sort_unstable();
        pushed.dedup();
        let current = in_engine!(
            &self.engine,
            engine => engine.pushed().to_vec(),
            _forest => pushed.clone()
        );
        if !pushed.iter().all(|node| current.contains(node)) {
            self.engine.push(&self.fixed, pushed)?;
        }
        let fixed = &self.fixed;
        in_engine!(
            &mut self.engine,
            engine => engine.set_forces(fixed, forces),
            forest => forest.set_forces(fixed, forces)
        )
    }

    /// Sets the motor of a body's joint in one item, from the next step on.
    ///
    /// # Errors
    /// [`Error::ItemCount`] for an item that there is not; [`Error::UnknownBody`], [`Error::NoMotor`],
    /// [`Error::BadMotor`]; [`Error::ElementUnavailable`] by the articulated-body algorithm. The motor is then as
    /// it was. [`Error::Gpu`].
    pub fn set_motor(&mut self, item: usize, body: BodyId, motor: Motor) -> Result<(), Error> {
        let (forest, fixed) = self.driven(item, body)?;
        forest.set_motor(fixed, (item, body), motor)
    }

    /// Sets the motor of a spherical joint in one item, as [`set_motor`](Self::set_motor) does of others.
    ///
    /// # Errors
    /// As there.
    pub fn set_spherical_motor(
        &mut self,
        item: usize,
        body: BodyId,
        motor: SphericalMotor,
    ) -> Result<(), Error> {
        let (forest, fixed) = self.driven(item, body)?;
        forest.set_spherical_motor(fixed, (item, body), motor)
    }

    /// What computes motors, if there is that body of that item.
    fn driven(&mut self, item: usize, body: BodyId) -> Result<(&mut Forest, &Fixed), Error> {
        let fixed = &self.fixed;
        if item >= fixed.items {
            return Err(Error::ItemCount {
                expected: fixed.items,
                given: item + 1,
            });
        }
        let Some(known) = fixed.model.body(body) else {
            return Err(Error::UnknownBody {
                model: fixed.model.name().to_owned(),
                body: body.index(),
            });
        };
        match &mut self.engine {
            AnyEngine::Forest(forest) => Ok((forest, fixed)),
            _ => Err(super::element_unavailable(&known.name)),
        }
    }

    fn check<T>(&self, given: &[T], check: impl Fn(&T) -> Result<(), Error>) -> Result<(), Error> {
        if given.len() != self.fixed.items {
            return Err(Error::ItemCount {
                expected: self.fixed.items,
                given: given.len(),
            });
        }
        for (item, one) in given.iter().enumerate() {
            check(one).map_err(|error| self.item_error(item, 1, error))?;
        }
        Ok(())
    }

    fn item_error(&self, item: usize, failed: usize, error: Error) -> Error {
        Error::Item {
            item,
            failed,
            count: self.fixed.items,
            source: Box::new(error),
        }
    }

    /// Computes the joint accelerations of all items [rad/s^2 or m/s^2]: item by item, shape
    /// [items, [`Model::dof_count`]].
    ///
    /// # Errors
    /// [`Error::Item`] with the first item that failed; [`Error::Gpu`].
    pub fn solve(&mut self) -> Result<Vec<f64>, Error> {
        self.solve_on_device()?;
        let failures = self.failures_of(false)?;
        if let Some(first) = failures.first() {
            let error = self.error(first);
            return Err(self.item_error(first.item, failures.len(), error));
        }
        self.read_accelerations()
    }

    /// Computes the joint accelerations without reading them or waiting for them, unless times are taken.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn solve_on_device(&mut self) -> Result<(), Error> {
        let fixed = &self.fixed;
        self.time = in_engine!(
            &mut self.engine,
            engine => engine.solve(fixed),
            forest => forest.solve(fixed)
        )?;
        Ok(())
    }

    /// The joint accelerations of the last [`solve`](Self::solve), those of each item or why it has none.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn accelerations_of_each(&mut self) -> Result<Vec<Result<Vec<f64>, Error>>, Error> {
        let failures = self.failures_of(false)?;
        if let (AnyEngine::Forest(_), Some(first)) = (&self.engine, failures.first()) {
            return Ok(vec![Err(self.error(first)); self.fixed.items]);
        }
        let found = self.read_accelerations()?;
        let dofs = self.fixed.model.dof_count();
        let of_item = |item: usize| Ok(found[item * dofs..(item + 1) * dofs].to_vec());
        let mut each: Vec<_> = (0..self.fixed.items).map(of_item).collect();
        for failure in failures {
            each[failure.item] = Err(self.error(&failure));
        }
        Ok(each)
    }

    fn read_accelerations(&mut self) -> Result<Vec<f64>, Error> {
        let fixed = &self.fixed;
        in_engine!(
            &mut self.engine,
            engine => engine.accelerations(fixed),
            forest => forest.read_accelerations()
        )
    }

    /// Moves all items on by `h` \[s\].
    ///
    /// # Errors
    /// As [`steps`](Self::steps).
    pub fn step(&mut self, h: f64) -> Result<(), Error> {
        self.steps(h, 1)
    }

    /// Moves all items on by `count` steps of `h` \[s\], without the host between them.
    ///
    /// # Errors
    /// [`Error::Item`] with the first item that failed, now or since states were set: it stands where it
    /// was before the step that failed, the others have gone on. [`Error::NonFiniteInput`],
    /// [`Error::Gpu`]; then nothing has moved.
    pub fn steps(&mut self, h: f64, count: u32) -> Result<(), Error> {
        self.steps_on_device(h, count)?;
        let failures = self.failures_of(true)?;
        match failures.first() {
            None => Ok(()),
            Some(first) => {
                let error = self.error(first);
                Err(self.item_error(first.item, failures.len(), error))
            }
        }
    }

    /// [`steps`](Self::steps) without waiting for them, unless times are taken;
    /// [`failures`](Self::failures) says afterwards what failed.
    ///
    /// # Errors
    /// [`Error::NonFiniteInput`], [`Error::Gpu`].
    pub fn steps_on_device(&mut self, h: f64, count: u32) -> Result<(), Error> {
        check_step("batch", h)?;
        let fixed = &self.fixed;
        let ran = in_engine!(
            &mut self.engine,
            engine => engine.steps(fixed, h, count),
            forest => forest.steps(fixed, h, count)
        )?;
        self.time = ran.time;
        match self.steps.last_mut() {
            Some((length, times)) if *length == h => *times += ran.steps,
            _ => self.steps.push((h, ran.steps)),
        }
        Ok(())
    }

    /// The states of all items, those that failed before their failing step.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn states(&mut self) -> Result<Vec<State>, Error> {
        let fixed = &self.fixed;
        let mut states = in_engine!(
            &mut self.engine,
            engine => engine.states(fixed),
            forest => forest.states(fixed)
        )?;
        let failures = self.failures_of(true)?;
        for (item, state) in states.iter_mut().enumerate() {
            state.time = self.time_after(item, u32::MAX);
        }
        for failure in failures {
            states[failure.item].time = self.time_after(failure.item, failure.step);
        }
        Ok(states)
    }

    /// The items that failed since states were set, in order, and why.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn failures(&self) -> Result<Vec<(usize, Error)>, Error> {
        let failures = self.failures_of(true)?;
        Ok(failures.iter().map(|f| (f.item, self.error(f))).collect())
    }

    fn failures_of(&self, steps: bool) -> Result<Vec<Failure>, Error> {
        let fixed = &self.fixed;
        in_engine!(
            &self.engine,
            engine => engine.failures(fixed, steps),
            forest => Ok(forest.failures(steps))
        )
    }

    /// Time of an item after so many steps, or all if there were fewer \[s\].
    fn time_after(&self, item: usize, mut steps: u32) -> f64 {
        let mut time = self.start[item];
        for &(length, times) in &self.steps {
            let taken = times.min(steps);
            time += length * f64::from(taken);
            steps -= taken;
        }
        time
    }

    fn error(&self, failure: &Failure) -> Error {
        let model = &self.fixed.model;
        let body = || model.bodies()[failure.body].name.clone();
        let name = || loops::names(model).nth(failure.body).unwrap_or_default();
        let time = self.time_after(failure.item, failure.step);
        match failure.why {
            Why::Singular => Error::SingularJoint { body: body() },
            Why::Unjoined(precision) => Error::Unjoined {
                body: body(),
                precision,
            },
            Why::Overflow(quantity) => Error::Overflow {
                quantity,
                body: body(),
                time,
            },
            Why::LoopOpen(violation) => Error::LoopOpen {
                name: name(),
                violation,
                limit: loops::OPEN,
                time,
            },
            Why::LoopNotClosed(violation) => Error::LoopNotClosed {
                name: name(),
                violation,
                time,
            },
        }
    }

    /// Poses of all bodies' frames in the world: item by item, shape [items, bodies].
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn poses(&mut self) -> Result<Vec<Pose>, Error> {
        let fixed = &self.fixed;
        in_engine!(&mut self.engine, engine => engine.poses(fixed), forest => forest.poses())
    }

    /// Computes the poses and gives the buffer they are in, for other kernels: quaternion x, y, z, w and
    /// position \[m\] as two vectors of four numbers, where [`pose_place`](Self::pose_place) says.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn pose_buffer(&mut self) -> Result<&vertebra_gpu::wgpu::Buffer, Error> {
        let fixed = &self.fixed;
        in_engine!(
            &mut self.engine,
            engine => Ok(engine.update_poses(fixed)?.raw()),
            forest => forest.pose_buffer()
        )
    }

    /// Where the pose of an item's body is in the buffer, in poses: by the articulated-body algorithm body by
    /// body, so that neighbouring items are neighbours, by divide and conquer item by item.
    #[must_use]
    pub fn pose_place(&self, item: usize, body: BodyId) -> usize {
        match self.engine {
            AnyEngine::Forest(_) => item * self.fixed.model.bodies().len() + body.index(),
            _ => body.index() * memory::stride(self.fixed.items) + item,
        }
    }

    /// Takes the time on the device of what follows; [`gpu_time`](Self::gpu_time) tells it.
    ///
    /// # Errors
    /// [`Error::Gpu`] where the device has no timestamps.
    pub fn take_times(&mut self) -> Result<(), Error> {
        in_engine!(&mut self.engine, engine => engine.take_times(), forest => forest.take_times())
    }

    /// Time on the device of the last solve or steps \[s\], if it was taken.
    #[must_use]
    pub fn gpu_time(&self) -> Option<f64> {
        self.time
    }
}
