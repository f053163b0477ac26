//! What a GPU has computed, held against the processor's own equations.
//!
//! Accelerations are corrected by the articulated-body algorithm in f64, whose factors have nothing to do with the
//! device's. How much that changes is their error, but for that of the correction, which a second one shows; and neither is less
//! than what the rounding of the bodies' equations leaves (`tolerance.rs`).
//!
//! **Loops.** Their forces are the processor's too, found for the same state with a solver of its own, and then forces like any other. How far off
//! accelerations are because these are is what a correction of them changes (`loops/exact.rs`).
//!
//! **Elements** come with the forces given, as force and inertia of freedoms' own: those of the step in question, with
//! laws on the parts that the device takes them on. Whether these are the right ones is no question of rounding: the solutions of
//! a step itself ask for it.

use crate::loops::has_loops;
use crate::tolerance::NOISE;
use crate::{
    Error, Forces, Precision, Refinement, Solver, SolverOptions, Workspace, check_accelerations,
    refine,
};
use vertebra_assembly::{Model, State};

/// A model's equations on the processor.
#[derive(Debug)]
pub(super) struct Judge {
    workspace: Workspace,
    /// What finds the forces of loops, if there are any.
    solver: Option<Solver>,
}

impl Judge {
    pub(super) fn new(model: &Model) -> Result<Self, Error> {
        let solver = || Solver::new(model, &SolverOptions::default());
        Ok(Self {
            workspace: Workspace::of_tree(model, Precision::F64),
            solver: has_loops(model).then(solver).transpose()?,
        })
    }

    /// What accelerations leave of the equations, and the error that one correction shows.
    pub(super) fn check(
        &mut self,
        problem: (&Model, &State, &Forces),
        qdd: &[f64],
    ) -> Result<Refinement, Error> {
        let (model, state, _) = problem;
        let acting = acting(&mut self.solver, problem)?;
        check_accelerations(model, state, acting, qdd, &mut self.workspace)
    }

    /// The same with the most that the error may be.
    pub(super) fn measure(
        &mut self,
        problem: (&Model, &State, &Forces),
        qdd: &[f64],
    ) -> Result<Refinement, Error> {
        let (model, state, forces) = problem;
        let workspace = &mut self.workspace;
        let acting = acting(&mut self.solver, problem)?;
        let found = check_accelerations(model, state, acting, qdd, workspace)?;
        let beyond = refine(acting, workspace)?.change;
        let rounding = NOISE * workspace.response_to_rounding(acting)?;
        let of_loops = match &mut self.solver {
            None => 0.0,
            Some(solver) => {
                let corrected = workspace.joint_accelerations()?;
                solver.error_of_loops(model, state, forces, corrected)
            }
        };
        let error = (found.change + beyond + of_loops).max(rounding);
        Ok(Refinement {
            residual: found.residual,
            change: error.max(f64::EPSILON),
        })
    }
}

/// What acts, forces of loops included.
fn acting<'a>(
    solver: &'a mut Option<Solver>,
    (model, state, forces): (&Model, &State, &'a Forces),
) -> Result<&'a Forces, Error> {
    let Some(solver) = solver else {
        return Ok(forces);
    };
    solver.forward_dynamics(model, state, forces)?;
    Ok(solver.acting(model, forces))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balance::{largest_push, least_acceleration};
    use crate::link::Scales;
    use vertebra_assembly::{Random, mechanism};

    /// Errors planted in exact accelerations are found to be as large as they are, in mechanisms whose freedoms have inertia of
    /// their own, and are within what they are said to be at most.
    #[test]
    fn planted_errors_are_found() {
        let mechanisms = [
            mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4),
            mechanism::jansen_leg(),
            mechanism::stewart_platform(),
            mechanism::chain_mail(3, 3),
        ];
        for (made, seed) in mechanisms.into_iter().zip(1..) {
            let (model, state) = made.unwrap();
            let mut random = Random::new(seed);
            let mut forces = Forces::none(&model);
            forces.joint.fill_with(|| random.symmetric());
            forces.joint_inertia = (0..model.dof_count()).map(|dof| (dof % 2) as f64).collect();
            let options = SolverOptions::to_tolerance(1e-13);
            let mut solver = Solver::new(&model, &options).unwrap();
            let exact = solver.forward_dynamics(&model, &state, &forces).unwrap();
            let push = largest_push(&model, &forces);
            let least = least_acceleration(&model, &Scales::of_model(&model), &state.qd, push);
            let mut judge = Judge::new(&model).unwrap();
            for size in [0.0, 1e-9, 1e-5, 1e-2] {
                let largest = exact.iter().fold(least, |m, x| m.max(x.abs()));
                let planted: Vec<f64> = (exact.iter())
                    .map(|x| x + size * largest * random.symmetric())
                    .collect();
                let off = exact.iter().zip(&planted).map(|(x, y)| (x - y).abs());
                let error = off.fold(0.0, f64::max) / largest;
                let problem = (&model, &state, &forces);
                let found = judge.check(problem, &planted).unwrap().change;
                let most = judge.measure(problem, &planted).unwrap().change;
                let rounding = 1e-11;
                let name = model.name();
                assert!(
                    (found - error).abs() <= 0.02 * error + rounding,
                    "{name}, {size:e}: {found:e} of {error:e}"
                );
                assert!(
                    error <= most * 1.02 + 1e-13 && most <= 1.02 * error + rounding,
                    "{name}, {size:e}: {error:e}, at most {most:e}"
                );
            }
        }
    }
}
