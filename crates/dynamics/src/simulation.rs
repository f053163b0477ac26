//! A model in motion.

#[cfg(feature = "gpu")]
mod exact;
mod held;
mod host;
#[cfg(feature = "gpu")]
mod judge;
mod poses;
#[cfg(feature = "gpu")]
mod remote;
mod runs;

pub use poses::PendingPoses;

use crate::forces::check_step;
use crate::tolerance::check_tolerance;
use crate::{
    Achieved, BodyMotion, Choice, Device, Error, Forces, Integrator, Mechanics, Monitor, Precision,
    Solver, SolverOptions, Workspace, aba, body_poses, forward_kinematics, joint_wrenches,
    mechanics,
};
use core::ops::Range;
#[cfg(feature = "gpu")]
use host::Host;
use poses::Inner;
#[cfg(feature = "gpu")]
use remote::Problem;
use runs::Runs;
use vertebra_assembly::{BodyId, Model, State};
use vertebra_spatial::Pose;

/// A model, its state, the forces on it, and all memory that steps need: none is taken later.
///
/// On a GPU the state stays there from step to step, and comes back when it is asked for. What
/// is asked about one state - energies, velocities, one body's pose, [`solve`](Self::solve) - is then
/// computed by the processor.
///
/// A step that fails leaves the state as it was.
#[derive(Debug)]
pub struct Simulation {
    model: Model,
    /// On a GPU, as it was read last.
    state: State,
    forces: Forces,
    integrator: Integrator,
    /// What the solver was asked for last.
    options: SolverOptions,
    choice: Choice,
    runs: Runs,
    /// For kinematics and [`solve`](Self::solve), if the solver's own memory does not serve.
    workspace: Option<Workspace>,
    monitor: Option<Monitor>,
    /// Whether the workspace's poses are those of `state`.
    posed: bool,
    poses: Vec<Pose>,
}

impl Simulation {
    /// A simulation on the CPU in f64, from the neutral state, with semi-implicit Euler steps.
    ///
    /// # Errors
    /// None: a model that was built can be simulated there.
    pub fn new(model: Model) -> Result<Self, Error> {
        Self::on(&Device::cpu(), model)
    }

    /// A simulation on this device, from the neutral state, with semi-implicit Euler steps: on the CPU in
    /// f64, on a GPU by divide and conquer in f64, or in f32 where it has no f64.
    ///
    /// # Errors
    /// On a GPU, [`Error::ModelTooLarge`] and `Error::Gpu`; of models with closed loops also
    /// `Error::TooManyLoops`.
    pub fn on(device: &Device, model: Model) -> Result<Self, Error> {
        let (runs, choice) = Runs::on(device, &model)?;
        Ok(Self::from_parts(model, runs, choice))
    }

    /// A simulation on a GPU with options that are a GPU's alone.
    ///
    /// # Errors
    /// As [`gpu::Simulation::on`](crate::gpu::Simulation::on).
    #[cfg(feature = "gpu")]
    pub fn on_gpu(
        device: &vertebra_gpu::Device,
        model: Model,
        options: &crate::gpu::Options,
    ) -> Result<Self, Error> {
        let expected = Choice::with_gpu(&model, device, options)?;
        let (runs, choice) = Runs::on_gpu(device, &model, options, (expected, true))?;
        let mut simulation = Self::from_parts(model, runs, choice);
        simulation.options = SolverOptions {
            precision: simulation.choice.precision,
            tree: options.tree,
            schedule: options.schedule,
            sweeps: options.sweeps,
            ..SolverOptions::default()
        };
        Ok(simulation.with_integrator(options.integrator))
    }

    fn from_parts(model: Model, runs: Runs, choice: Choice) -> Self {
        Self {
            state: State::neutral(&model),
            forces: Forces::none(&model),
            integrator: Integrator::default(),
            options: SolverOptions::default(),
            choice,
            runs,
            workspace: None,
            monitor: None,
            posed: false,
            poses: Vec::new(),
            model,
        }
    }

    /// Chooses the integrator. Of one that a GPU does not have the first step tells.
    #[must_use]
    pub const fn with_integrator(mut self, integrator: Integrator) -> Self {
        self.integrator = integrator;
        self
    }

    /// Chooses how accelerations are computed; the state is kept, on the CPU in f64.
    ///
    /// Joins of which nothing is said have the same precision as all else, on a GPU too.
    ///
    /// To a tolerance, a GPU takes the cheapest of its precisions and corrections that meets it:
    /// its accelerations are held against the bodies' equations by the processor before the first step, after a
    /// state was set, and at every 64th step, under the forces of loops that the processor finds and with elements on the parts of
    /// their laws that the device is on. What no GPU can do so exactly is done by the processor from there on
    /// ([`choice`](Self::choice) tells). Hard stops are as firm as the precision of the joins allows: of the rate that a step would
    /// have beyond its bound they let about one part in 290 through with joins in f32, one in 6.7 million with joins in f64. The
    /// tolerance is that of accelerations under this law, which changes with the joins that are taken; whoever wants the same one
    /// throughout asks for precisions instead.
    ///
    /// # Errors
    /// As [`Solver::new`]'s; on a GPU also [`Error::PrecisionUnavailable`], [`Error::ModelTooLarge`], `Error::Gpu`, and
    /// [`Error::UnavailableOnGpu`] of the articulated-body algorithm.
    pub fn with_solver(mut self, options: &SolverOptions) -> Result<Self, Error> {
        self.options = *options;
        match &mut self.runs {
            Runs::Host(host) => {
                host.solver = Solver::new(&self.model, options)?;
                self.choice = Choice {
                    gpu_s: self.choice.gpu_s,
                    ..*host.solver.choice()
                };
            }
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => {
                if remote.is_ahead {
                    self.state = remote.simulation.state()?;
                }
                match remote.with_solver(&self.model, options)? {
                    Some(mut other) => {
                        other.set_state(&self.state)?;
                        other.forces_changed = true;
                        self.choice = other.choice(self.choice);
                        **remote = other;
                    }
                    None => self.leave_gpu()?,
                }
            }
        }
        self.workspace = None;
        self.posed = false;
        Ok(self)
    }

    /// Chooses the precision in which accelerations are computed. What else was asked for stays, joins in another precision too.
    ///
    /// # Errors
    /// As [`with_solver`](Self::with_solver)'s; [`Error::DecidedByTolerance`] where one was asked for.
    pub fn with_precision(self, precision: Precision) -> Result<Self, Error> {
        if let Some(tolerance) = self.options.tolerance {
            return Err(Error::DecidedByTolerance {
                what: "a precision",
                tolerance,
            });
        }
        let options = SolverOptions {
            precision,
            ..self.options
        };
        self.with_solver(&options)
    }

    /// Checks the accelerations of every so many steps, the first one's included
    /// ([`Solver::check`]): a step that is checked takes one and a half solutions more, of models with
    /// loops two and a half of their trees and one of the loops. [`monitor`](Self::monitor) has what was found.
    ///
    /// On a GPU the processor checks ([`check_accelerations`](crate::check_accelerations)) what is read back for it, which
    /// takes as long as some ten steps there.
    ///
    /// # Errors
    /// [`Error::ToleranceRange`].
    pub fn with_monitor(mut self, monitor: Monitor) -> Result<Self, Error> {
        check_tolerance(monitor.tolerance())?;
        self.monitor = Some(monitor);
        Ok(self)
    }

    /// What the checks have found; none without [`with_monitor`](Self::with_monitor).
    #[must_use]
    pub const fn monitor(&self) -> Option<&Monitor> {
        self.monitor.as_ref()
    }

    /// The solver, which says how a tolerance was met ([`Solver::achieved`]); none on a GPU.
    #[must_use]
    pub fn solver(&self) -> Option<&Solver> {
        match &self.runs {
            Runs::Host(host) => Some(&host.solver),
            #[cfg(feature = "gpu")]
            Runs::Gpu(_) => None,
        }
    }

    /// How a tolerance was met: on the CPU by the last solution, on a GPU by the last whose error was
    /// measured. None without one, or if it was not met.
    #[must_use]
    pub fn achieved(&self) -> Option<&Achieved> {
        match &self.runs {
            Runs::Host(host) => host.solver.achieved(),
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.achieved(),
        }
    }

    /// Where it runs, the algorithm that computes accelerations, and why these.
    #[must_use]
    pub const fn choice(&self) -> &Choice {
        &self.choice
    }

    /// The model.
    #[must_use]
    pub const fn model(&self) -> &Model {
        &self.model
    }

    /// Time of the state \[s\], which is not read back for it.
    #[must_use]
    pub fn time(&self) -> f64 {
        match &self.runs {
            Runs::Host(_) => self.state.time,
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.simulation.time(),
        }
    }

    /// The state, which is read back from a GPU if it has moved on.
    ///
    /// # Errors
    /// On a GPU, `Error::Gpu`.
    pub fn state(&mut self) -> Result<&State, Error> {
        self.fetch_state()?;
        Ok(&self.state)
    }

    /// The state as the host knows it, without asking a device: the current one on the CPU, on a GPU the one that was set or
    /// read last, which is what is left of a simulation whose device was lost.
    #[must_use]
    pub const fn last_state(&self) -> &State {
        &self.state
    }

    /// Replaces the state.
    ///
    /// # Errors
    /// [`Error::Model`] if it does not fit the model; on a GPU, [`Error::Overflow`] if it does not fit
    /// the precision, and `Error::Gpu`. Then the old one is kept.
    pub fn set_state(&mut self, state: State) -> Result<(), Error> {
        state.check(&self.model)?;
        #[cfg(feature = "gpu")]
        if let Runs::Gpu(remote) = &mut self.runs {
            remote.set_state(&state)?;
        }
        self.state = state;
        self.posed = false;
        Ok(())
    }

    /// The forces that act in the coming steps.
    #[must_use]
    pub const fn forces(&self) -> &Forces {
        &self.forces
    }

    /// The forces that act in the coming steps, to be changed; a GPU is given them with the next step.
    pub fn forces_mut(&mut self) -> &mut Forces {
        #[cfg(feature = "gpu")]
        if let Runs::Gpu(remote) = &mut self.runs {
            remote.forces_changed = true;
        }
        &mut self.forces
    }

    /// Moves on by `h` \[s\]; a negative step goes back in time, unless there are elements in joints.
    ///
    /// # Errors
    /// [`Error`]; the state is then as it was.
    pub fn step(&mut self, h: f64) -> Result<(), Error> {
        match self.steps(h, 1) {
            Err(Error::Step { source, .. }) => Err(*source),
            taken => taken,
        }
    }

    /// Takes `count` steps of `h` \[s\] each; on a GPU without the host between them.
    ///
    /// # Errors
    /// [`Error::Step`], naming the step and why it failed: the state is the one before it. Of what
    /// does not depend on the state (forces, `h`, the device) that error itself, and no step is taken.
    pub fn steps(&mut self, h: f64, count: usize) -> Result<(), Error> {
        check_step("simulation", h)?;
        self.forces.check(&self.model)?;
        self.posed = false;
        self.take(h, 0..count)
    }

    /// Takes those of so many steps that are left.
    fn take(&mut self, h: f64, steps: Range<usize>) -> Result<(), Error> {
        let (how, count) = ((h, self.integrator), steps.end);
        match &mut self.runs {
            Runs::Host(host) => {
                for step in steps {
                    let (model, state, forces) = (&self.model, &mut self.state, &self.forces);
                    host.step(model, state, forces, how, &mut self.monitor)
                        .map_err(|source| Error::Step {
                            step,
                            count,
                            source: Box::new(source),
                        })?;
                }
                Ok(())
            }
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => {
                let problem = Problem {
                    model: &self.model,
                    state: &self.state,
                    forces: &self.forces,
                };
                let taken = remote.steps(problem, how, steps.len(), &mut self.monitor);
                self.choice = remote.choice(self.choice);
                match taken {
                    Err(Error::Step { step, source, .. })
                        if matches!(*source, Error::ToleranceMissed { .. }) =>
                    {
                        self.leave_gpu()?;
                        self.take(h, step..count)
                    }
                    taken => taken,
                }
            }
        }
    }

    /// The joint accelerations in the present state under the present forces [rad/s^2 or m/s^2], shape
    /// [`Model::dof_count`], computed where and as those of steps are. Elements act as they do now, without a
    /// step.
    ///
    /// # Errors
    /// [`Error`] as for a step, open loops excepted.
    pub fn accelerations(&mut self) -> Result<Vec<f64>, Error> {
        self.forces.check(&self.model)?;
        self.posed = false;
        let (model, state, forces) = (&self.model, &self.state, &self.forces);
        match &mut self.runs {
            Runs::Host(host) => host.accelerations(model, state, forces),
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => {
                let solved = remote.accelerations(Problem {
                    model,
                    state,
                    forces,
                });
                self.choice = remote.choice(self.choice);
                match solved {
                    Err(Error::ToleranceMissed { .. }) => {
                        self.leave_gpu()?;
                        self.accelerations()
                    }
                    solved => solved,
                }
            }
        }
    }

    /// Goes on on the processor, from the state there is.
    #[cfg(feature = "gpu")]
    fn leave_gpu(&mut self) -> Result<(), Error> {
        self.fetch_state()?;
        let solver = Solver::new(&self.model, &self.options)?;
        let choice = Choice {
            gpu_s: self.choice.gpu_s,
            ..*solver.choice()
        };
        let mut host = Host::new(&self.model, solver);
        if let Runs::Gpu(remote) = &mut self.runs {
            // Brings what the device has summed up to the elements.
            host.loop_work = remote.simulation.work()?.loops;
            if let Some(elements) = remote.simulation.elements() {
                host.elements = Some(Box::new(elements.clone()));
            }
        }
        self.runs = Runs::Host(Box::new(host));
        self.choice = choice;
        Ok(())
    }

    /// Where a body is in the world.
    ///
    /// # Errors
    /// [`Error::UnknownBody`]; on a GPU, `Error::Gpu`.
    pub fn pose(&mut self, body: BodyId) -> Result<Pose, Error> {
        self.posed_workspace()?.pose(body)
    }

    /// Where all bodies are in the world, in the model's order.
    ///
    /// # Errors
    /// [`Error::Overflow`]; on a GPU, `Error::Gpu`.
    pub fn poses(&mut self) -> Result<&[Pose], Error> {
        #[cfg(feature = "gpu")]
        if let Runs::Gpu(remote) = &mut self.runs {
            self.poses = remote.simulation.poses()?;
            return Ok(&self.poses);
        }
        let mut poses = core::mem::take(&mut self.poses);
        poses.clear();
        let ids = self.model.body_ids();
        let workspace = self.posed_workspace()?;
        for body in ids {
            poses.push(workspace.pose(body)?);
        }
        self.poses = poses;
        Ok(&self.poses)
    }

    /// Begins to read where all bodies are now. On a GPU it returns at once, and the steps that are
    /// asked for next run while these poses are on their way.
    ///
    /// ```
    /// use vertebra_assembly::generate;
    /// use vertebra_dynamics::{Device, Simulation};
    ///
    /// # let device = Device::cpu();
    /// let model = generate::random_chain(64, &generate::Rod::default(), 7)?;
    /// let mut simulation = Simulation::on(&device, model)?;
    /// for _ in 0..10 {
    ///     let poses = simulation.begin_poses()?;
    ///     simulation.steps(1e-4, 16)?;
    ///     println!("{}", poses.wait()?[63].translation); // before those steps
    /// }
    /// # Ok::<(), vertebra_dynamics::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`poses`](Self::poses).
    pub fn begin_poses(&mut self) -> Result<PendingPoses, Error> {
        #[cfg(feature = "gpu")]
        if let Runs::Gpu(remote) = &mut self.runs {
            return Ok(PendingPoses(Inner::OnTheWay(
                remote.simulation.begin_poses()?,
            )));
        }
        Ok(PendingPoses(Inner::Here(self.poses()?.to_vec())))
    }

    /// The buffer on a GPU that has all poses after each call of [`steps`](Self::steps), for kernels of
    /// one's own; none on the CPU.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub fn pose_buffer(&self) -> Option<crate::gpu::PoseBuffer> {
        match &self.runs {
            Runs::Host(_) => None,
            Runs::Gpu(remote) => Some(remote.simulation.pose_buffer()),
        }
    }

    /// How fast a body moves.
    ///
    /// # Errors
    /// [`Error::UnknownBody`]; on a GPU, `Error::Gpu`.
    pub fn velocity(&mut self, body: BodyId) -> Result<BodyMotion, Error> {
        self.posed_workspace()?.velocity(body)
    }

    /// The workspace, with the kinematics of the current state.
    fn posed_workspace(&mut self) -> Result<&mut Workspace, Error> {
        self.fetch_state()?;
        let workspace = self.runs.workspace(&self.model, &mut self.workspace);
        if !self.posed {
            forward_kinematics(&self.model, &self.state, workspace)?;
            self.posed = true;
        }
        Ok(workspace)
    }

    /// Solves the dynamics of the current state under the current forces, always by the
    /// articulated-body algorithm on the CPU, and gives the workspace to read from: joint and body
    /// accelerations, joint wrenches, poses and velocities. Elements act as they do now, without a step; forces of
    /// loops and couplings as forces on the bodies and in the joints.
    ///
    /// # Errors
    /// [`Error`] as for a step, open loops excepted.
    pub fn solve(&mut self) -> Result<&Workspace, Error> {
        self.fetch_state()?;
        self.posed = false;
        let (forces, workspace) = match &mut self.runs {
            Runs::Host(host) => {
                let (forces, solver) = host.all_forces(&self.model, &self.state, &self.forces)?;
                let own = &mut self.workspace;
                (forces, host::workspace(solver, &self.model, own))
            }
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => {
                let host = remote.host(&self.model)?;
                let (forces, solver) = host.all_forces(&self.model, &self.state, &self.forces)?;
                let own = &mut self.workspace;
                (forces, host::workspace(solver, &self.model, own))
            }
        };
        aba(&self.model, &self.state, forces, workspace)?;
        joint_wrenches(workspace)?;
        body_poses(workspace)?;
        self.posed = true;
        Ok(workspace)
    }

    /// Energies, momenta and centre of mass.
    ///
    /// # Errors
    /// [`Error::Overflow`]; on a GPU, `Error::Gpu`.
    pub fn mechanics(&mut self) -> Result<Mechanics, Error> {
        self.fetch_state()?;
        self.posed = false;
        let workspace = self.runs.workspace(&self.model, &mut self.workspace);
        let sums = mechanics(&self.model, &self.state, workspace)?;
        // Its kinematics are those of the state.
        self.posed = true;
        Ok(sums)
    }

    /// Reads the state back from a GPU if it has moved on.
    #[cfg_attr(
        not(feature = "gpu"),
        expect(
            clippy::unnecessary_wraps,
            clippy::needless_pass_by_ref_mut,
            reason = "of a GPU it can fail"
        )
    )]
    fn fetch_state(&mut self) -> Result<(), Error> {
        #[cfg(feature = "gpu")]
        if let Runs::Gpu(remote) = &mut self.runs
            && remote.is_ahead
        {
            self.state = remote.simulation.state()?;
            remote.is_ahead = false;
        }
        Ok(())
    }
}
