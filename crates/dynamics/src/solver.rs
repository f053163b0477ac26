//! One door to forward dynamics: the algorithm is chosen from the model, or by its user.

use crate::choice::{Choice, rounds};
use crate::dca::check_precisions;
use crate::loops::{LoopForces, LoopViolation, Loops};
use crate::refine::Loads;
use crate::tolerance::{Achieved, Asked, Ladder, Method};
use crate::{
    DcaOptions, DcaWorkspace, Error, Forces, Integrator, Precision, Refinement, Workspace,
};
use core::fmt;
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{Model, State};

/// An algorithm of forward dynamics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Algorithm {
    /// The articulated-body algorithm, [`aba`](crate::aba): least work, body after body.
    Aba,
    /// Divide and conquer, [`dca`](crate::dca): more work, in O(log n) rounds for many threads.
    Dca,
}

impl fmt::Display for Algorithm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Aba => "aba",
            Self::Dca => "dca",
        })
    }
}

/// Corrections of a solution at most: what has not all the digits of its precision by then is had more cheaply from more precise
/// joins.
pub(crate) const MOST_SWEEPS: usize = 3;

/// What a [`Solver`] is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// The algorithm; none for the one that is expected to be faster.
    pub algorithm: Option<Algorithm>,
    /// Precision of the bodies' own computations. A `tolerance` does not ask for it: it takes whatever meets it.
    pub precision: Precision,
    /// Precision of the joins of divide and conquer, at most `precision`; none for the same, or what a `tolerance`
    /// takes.
    pub tree: Option<Precision>,
    /// How divide and conquer gathers bodies into chunks; none for what suits the precision.
    pub schedule: Option<ScheduleOptions>,
    /// Whether the threads of the current rayon pool may be used.
    pub parallel: bool,
    /// Corrections of every solution by what it leaves of the bodies' equations, each about 36 % of it, 3 at most. They are those of
    /// [`refine`](crate::refine), but that none takes the drift of places out; on a GPU of chunks in f64 alone. Of models with closed loops the
    /// tree's solution is corrected, to which the loops respond.
    pub sweeps: usize,
    /// Largest forward error wanted, max |qdd - exact| / max |exact| by no less than loads cause ([`forward_error`](crate::forward_error)),
    /// from `f64::EPSILON` to less than 1; the solver then
    /// picks precisions and corrections itself, and refuses what it cannot have so exactly. None for solutions as they come.
    pub tolerance: Option<f64>,
}

impl SolverOptions {
    /// Whatever is expected to meet a tolerance first ([`tolerance`](Self::tolerance)).
    #[must_use]
    pub fn to_tolerance(tolerance: f64) -> Self {
        Self {
            tolerance: Some(tolerance),
            ..Self::default()
        }
    }

    /// Refuses what a tolerance decides, unless that goes without saying.
    pub(crate) fn check_decided(&self) -> Result<(), Error> {
        let Some(tolerance) = self.tolerance else {
            return Ok(());
        };
        let what = match self {
            Self { tree: Some(_), .. } => "a precision of joins",
            Self { sweeps: 1.., .. } => "a number of corrections",
            _ => return Ok(()),
        };
        Err(Error::DecidedByTolerance { what, tolerance })
    }
}

impl Default for SolverOptions {
    /// Whatever is faster, in f64, on all threads.
    fn default() -> Self {
        Self {
            algorithm: None,
            precision: Precision::F64,
            tree: None,
            schedule: None,
            parallel: true,
            sweeps: 0,
            tolerance: None,
        }
    }
}

/// Forward dynamics of one model by the algorithm that suits it.
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::{Algorithm, Forces, Solver, SolverOptions};
///
/// let model = generate::random_chain(64, &generate::Rod::default(), 7)?;
/// let mut solver = Solver::new(&model, &SolverOptions::default())?;
/// assert_eq!(solver.choice().algorithm, Algorithm::Aba);
/// println!("{}", solver.choice());
/// let (state, forces) = (State::random(&model, 8), Forces::none(&model));
/// let qdd = solver.forward_dynamics(&model, &state, &forces)?;
/// assert_eq!(qdd.len(), 64);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
///
/// To a tolerance, with an account of how it was met:
///
/// ```
/// # use vertebra_assembly::{State, generate};
/// # use vertebra_dynamics::{Forces, Solver, SolverOptions};
/// # let model = generate::random_chain(64, &generate::Rod::default(), 7)?;
/// # let (state, forces) = (State::random(&model, 8), Forces::none(&model));
/// let mut solver = Solver::new(&model, &SolverOptions::to_tolerance(1e-9))?;
/// solver.forward_dynamics(&model, &state, &forces)?;
/// let achieved = solver.achieved().ok_or("nothing solved")?;
/// assert!(achieved.error <= 1e-9 && achieved.sweeps >= 1);
/// println!("{achieved}"); // aba in f64, 1 correction: error 2e-16, residual 8e-16
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solver {
    choice: Choice,
    /// Corrections of a solution.
    sweeps: usize,
    memory: Memory,
    loops: Option<Box<Loops>>,
}

/// How often factors are refreshed on the way to closed loops: from far away each time is a step of Newton's
/// method.
const CLOSING_ATTEMPTS: usize = 100;

#[derive(Clone, Debug)]
enum Memory {
    Chosen(Chosen),
    ToTolerance(Box<Ladder>),
}

/// The algorithm that was chosen.
#[derive(Clone, Debug)]
struct Chosen {
    method: Method,
    /// Where a tree once could not be joined.
    otherwise: Option<Method>,
    /// Whether that has the last solution.
    by_other: bool,
}

impl Chosen {
    /// Solves, and gives the method that did.
    fn solve(
        &mut self,
        choice: &Choice,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<&mut Method, Error> {
        self.by_other = false;
        let Err(refused) = self.method.solve(model, state, forces) else {
            return Ok(&mut self.method);
        };
        let ours = matches!(
            refused,
            Error::Unjoined { .. } | Error::SingularJoint { .. }
        );
        if choice.algorithm == Algorithm::Aba || choice.forced || !ours {
            return Err(refused);
        }
        let other = self.otherwise.get_or_insert_with(|| {
            Method::Aba(Box::new(Workspace::of_tree(model, choice.precision)))
        });
        other.solve(model, state, forces)?;
        self.by_other = true;
        Ok(other)
    }

    /// The method that has the last solution and its factors.
    fn last(&mut self) -> &mut Method {
        match &mut self.otherwise {
            Some(other) if self.by_other => other,
            _ => &mut self.method,
        }
    }
}

impl Memory {
    /// The method that has the last solution and its factors.
    fn last(&mut self) -> Option<&mut Method> {
        match self {
            Self::Chosen(chosen) => Some(chosen.last()),
            Self::ToTolerance(ladder) => ladder.method(),
        }
    }
}

impl Solver {
    /// Chooses the algorithm and takes its memory.
    ///
    /// # Errors
    /// As [`DcaWorkspace::new`]'s; [`Error::Sweeps`]; [`Error::ToleranceRange`], and [`Error::DecidedByTolerance`] of what else was asked for.
    pub fn new(model: &Model, options: &SolverOptions) -> Result<Self, Error> {
        options.check_decided()?;
        let bodies = model.bodies().len();
        let mut choice = Choice::on_host(bodies, options);
        let loops = Loops::of_model(model);
        // Each row of a loop costs the recursion a path, but divide and conquer a solution.
        if loops.is_some() && options.algorithm.is_none() {
            choice.algorithm = Algorithm::Aba;
        }
        check_precisions(options.precision, choice.tree)?;
        if options.sweeps > MOST_SWEEPS {
            return Err(Error::Sweeps {
                sweeps: options.sweeps,
                chunks: options.precision,
            });
        }
        let dca_options = DcaOptions {
            chunks: options.precision,
            tree: choice.tree,
            schedule: options.schedule,
            parallel: choice.threads > 1,
        };
        let (memory, precisions) = match options.tolerance {
            Some(tolerance) => {
                let asked = Asked {
                    tolerance,
                    algorithm: choice.algorithm,
                    schedule: options.schedule,
                    rounds: rounds(bodies),
                    threads: choice.threads,
                };
                let ladder = Ladder::new(model, &asked)?;
                let precisions = ladder.precisions();
                (Memory::ToTolerance(Box::new(ladder)), precisions)
            }
            None => {
                let method = match choice.algorithm {
                    Algorithm::Aba => {
                        Method::Aba(Box::new(Workspace::of_tree(model, options.precision)))
                    }
                    Algorithm::Dca => {
                        Method::Dca(Box::new(DcaWorkspace::of_tree(model, &dca_options)?))
                    }
                };
                let chosen = Chosen {
                    method,
                    otherwise: None,
                    by_other: false,
                };
                (Memory::Chosen(chosen), (options.precision, choice.tree))
            }
        };
        Ok(Self {
            choice: Choice {
                precision: precisions.0,
                tree: precisions.1,
                ..choice
            },
            sweeps: options.sweeps,
            memory,
            loops,
        })
    }

    /// What was chosen, and why.
    #[must_use]
    pub const fn choice(&self) -> &Choice {
        &self.choice
    }

    /// The joint accelerations [rad/s^2 or m/s^2], shape [`Model::dof_count`].
    ///
    /// Where divide and conquer was not asked for and refuses ([`Error::Unjoined`],
    /// [`Error::SingularJoint`]), the articulated-body algorithm has the last word, so that what can
    /// be computed does not depend on the number of threads. Loops and couplings of the model are kept.
    ///
    /// # Errors
    /// As [`aba`](crate::aba) and [`dca`](crate::dca); with a tolerance, [`Error::ToleranceMissed`].
    pub fn forward_dynamics(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<&[f64], Error> {
        match (&mut self.memory, &mut self.loops) {
            (Memory::Chosen(chosen), loops) => {
                let solved = chosen.solve(&self.choice, model, state, forces)?;
                for _ in 0..self.sweeps {
                    solved.correct(forces, Loads::Left)?;
                }
                match loops {
                    None => solved.accelerations(),
                    Some(loops) => loops.constrain(model, state, solved),
                }
            }
            (Memory::ToTolerance(ladder), None) => ladder.solve(model, state, forces),
            (Memory::ToTolerance(ladder), Some(loops)) => {
                loops.constrain_to_tolerance(model, state, forces, ladder)
            }
        }
    }

    /// Forward dynamics, and how exact they are: the error estimated by one correction, which is not
    /// kept. About half as much work again. Of a model with loops, those of its tree under the loops' forces, which
    /// are found first: about two and a half solutions of the tree and one of the loops. Under a tolerance nothing
    /// beside the solution, which has estimated its error.
    ///
    /// # Errors
    /// As [`forward_dynamics`](Self::forward_dynamics).
    pub fn check(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<Refinement, Error> {
        if self.has_loops() || matches!(self.memory, Memory::ToTolerance(_)) {
            self.forward_dynamics(model, state, forces)?;
        }
        match &mut self.memory {
            Memory::Chosen(chosen) => {
                let all = with_loops(&mut self.loops, model, forces);
                let solved = chosen.solve(&self.choice, model, state, all)?;
                for _ in 0..self.sweeps {
                    solved.correct(all, Loads::Left)?;
                }
                solved.correct(all, Loads::Left)
            }
            Memory::ToTolerance(ladder) => {
                let achieved = ladder.achieved();
                Ok(
                    achieved.map_or_else(Refinement::default, |achieved| Refinement {
                        residual: achieved.residual,
                        change: achieved.error,
                    }),
                )
            }
        }
    }

    /// Moves a state until its loops are closed and stay so; `forces` act where new factors are needed.
    pub(crate) fn close(
        &mut self,
        model: &Model,
        state: &mut State,
        forces: &Forces,
    ) -> Result<(), Error> {
        let closed = self.close_from(model, state, forces);
        if let Some(loops) = &mut self.loops {
            loops.end_closing();
        }
        closed
    }

    fn close_from(
        &mut self,
        model: &Model,
        state: &mut State,
        forces: &Forces,
    ) -> Result<(), Error> {
        let mut open = (0, 0.0);
        for attempt in 0..CLOSING_ATTEMPTS {
            let (Some(loops), Some(method)) = (&mut self.loops, self.memory.last()) else {
                return Ok(());
            };
            match loops.close(model, state, method, attempt > 0) {
                None => return Ok(()),
                Some(found) => open = found,
            }
            if open.1.is_infinite() {
                break;
            }
            self.refresh(model, state, forces)?;
        }
        Err(Error::LoopNotClosed {
            name: (self.loops.as_ref())
                .map_or(String::new(), |loops| loops.name(open.0).to_owned()),
            violation: open.1,
            time: state.time,
        })
    }

    /// Factors of a state, as they come.
    fn refresh(&mut self, model: &Model, state: &State, forces: &Forces) -> Result<(), Error> {
        let solved = match &mut self.memory {
            Memory::Chosen(chosen) => chosen.solve(&self.choice, model, state, forces)?,
            Memory::ToTolerance(ladder) => match ladder.method() {
                Some(method) => {
                    method.solve(model, state, forces)?;
                    method
                }
                None => return Ok(()),
            },
        };
        if let Some(loops) = &mut self.loops {
            loops.refresh(model, state, solved);
        }
        Ok(())
    }

    /// Begins a step of a model with loops.
    pub(crate) fn begin_step(&mut self, integrator: Integrator) {
        if let Some(loops) = &mut self.loops {
            loops.begin_step(integrator.turning());
        }
    }

    /// Ends a step: what is solved from here on is a state's dynamics.
    pub(crate) fn end_step(&mut self) {
        if let Some(loops) = &mut self.loops {
            loops.end_step();
        }
    }

    /// Whether the model has loops or couplings.
    pub(crate) const fn has_loops(&self) -> bool {
        self.loops.is_some()
    }

    /// How far a state is from closed; none without loops.
    pub(crate) fn loop_violation(&mut self, model: &Model, state: &State) -> Option<LoopViolation> {
        Some(self.loops.as_mut()?.violation(model, state))
    }

    /// Name of the loop or coupling that is nearest to a singular position in the last solution.
    pub(crate) fn nearest_singular(&self) -> Option<String> {
        let loops = self.loops.as_ref()?;
        Some(loops.nearest_singular().to_owned())
    }

    /// Work of the loops' forces in a step of `h` \[s\] under those of the last solution, before its end is closed \[J\].
    pub(crate) fn loop_work(&mut self, model: &Model, ends: [&State; 2], h: f64) -> f64 {
        (self.loops.as_mut()).map_or(0.0, |loops| loops.work(model, ends, h))
    }

    /// Kinetic and potential energy \[J\], in f64, of a model with loops.
    pub(crate) fn energy(&mut self, model: &Model, state: &State) -> f64 {
        (self.loops.as_mut()).map_or(0.0, |loops| loops.energy(model, state))
    }

    /// The forces of loops in the last solution.
    pub(crate) fn loop_forces(&mut self, model: &Model) -> LoopForces {
        match (&mut self.loops, self.memory.last()) {
            (Some(loops), Some(method)) => loops.forces(model, method),
            _ => LoopForces::default(),
        }
    }

    /// Adds the forces of loops in the last solution to those that act.
    pub(crate) fn add_loop_forces(&mut self, model: &Model, forces: &mut Forces) {
        if let (Some(loops), Some(method)) = (&mut self.loops, self.memory.last()) {
            loops.act(model, method, forces);
        }
    }

    /// What acts with the forces of loops in the last solution.
    #[cfg(feature = "gpu")]
    pub(crate) fn acting<'a>(&'a mut self, model: &Model, forces: &'a Forces) -> &'a Forces {
        with_loops(&mut self.loops, model, forces)
    }

    /// How far off accelerations are because of the forces of loops under which the tree has them, which are those of the last
    /// solution: as part of the largest.
    #[cfg(feature = "gpu")]
    pub(crate) fn error_of_loops(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
        qdd: &[f64],
    ) -> f64 {
        match (&mut self.loops, self.memory.last()) {
            (Some(loops), Some(method)) => loops.error(model, state, forces, (qdd, method)),
            _ => 0.0,
        }
    }

    /// How the tolerance was met the last time; none without one, or if it was not met.
    #[must_use]
    pub fn achieved(&self) -> Option<&Achieved> {
        match &self.memory {
            Memory::Chosen(_) => None,
            Memory::ToTolerance(ladder) => ladder.achieved(),
        }
    }

    /// The workspace of the articulated-body algorithm, if that was chosen.
    pub(crate) fn workspace_mut(&mut self) -> Option<&mut Workspace> {
        match &mut self.memory {
            Memory::Chosen(Chosen {
                method: Method::Aba(workspace),
                ..
            }) => Some(workspace),
            _ => None,
        }
    }
}

/// What acts with the forces of loops in their last solution.
fn with_loops<'a>(
    loops: &'a mut Option<Box<Loops>>,
    model: &Model,
    forces: &'a Forces,
) -> &'a Forces {
    match loops {
        None => forces,
        Some(loops) => loops.with_own(model, forces),
    }
}

#[cfg(test)]
mod tests;
