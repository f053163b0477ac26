//! Random trees, forests and chains with all kinds of joints.

use super::{Figure, Outcome, relative_error, solver::Solver, worst_of};
use vertebra::generate::{self, RandomTree, Rod};
use vertebra::{
    Elements, Forces, Model, Precision, Random, State, Workspace, Wrench, aba, crba,
    crba_forward_dynamics, rnea,
};

/// A random problem.
struct Problem {
    name: String,
    model: Model,
    state: State,
    forces: Forces,
}

impl Problem {
    fn new(name: String, model: Model, seed: u64) -> anyhow::Result<Self> {
        let state = State::random(&model, seed);
        let mut random = Random::new(seed ^ 0x5eed);
        let mut forces = Forces::none(&model);
        // Joints without forces are the common case, and a hard one: what they transmit along their
        // freedoms must be zero and not nearly zero.
        if !seed.is_multiple_of(3) {
            forces.joint.fill_with(|| random.symmetric());
        }
        let bodies: Vec<_> = model.body_ids().collect();
        for _ in 0..3 {
            let wrench = Wrench::at_point(random.direction() * 5.0, random.direction())
                .with_torque(random.direction());
            forces.push(bodies[random.below(bodies.len())], wrench);
        }
        own_gravity(&model, &mut forces)?;
        Ok(Self {
            name,
            model,
            state,
            forces,
        })
    }

    /// The same with inertia of their own in two freedoms of three, over six decades, and all that the model's elements do in
    /// a step of a millisecond.
    fn with_elements(name: String, model: Model, seed: u64) -> anyhow::Result<Self> {
        let mut problem = Self::new(name, model, seed)?;
        let mut random = Random::new(seed ^ 0x0007_0705);
        let own = |_| match random.below(3) {
            0 => 0.0,
            _ => 1e-3 * 1e6_f64.powf(random.unit()),
        };
        problem.forces.joint_inertia = (0..problem.model.dof_count()).map(own).collect();
        let mut elements = Elements::new(&problem.model);
        problem.forces = (elements.load(&problem.state, &problem.forces, 1e-3)?).clone();
        Ok(problem)
    }

    /// Bodies and degrees of freedom, whichever are more.
    #[expect(clippy::cast_precision_loss, reason = "a size in a bound")]
    fn size(&self) -> f64 {
        self.model.dof_count().max(self.model.bodies().len()) as f64
    }

    #[expect(clippy::cast_precision_loss, reason = "a size in a bound")]
    fn depth(&self) -> f64 {
        self.model.depth() as f64
    }
}

/// Gravity of its own for the second tree of a forest.
pub(super) fn own_gravity(model: &Model, forces: &mut Forces) -> Result<(), vertebra::Error> {
    let bodies = model.body_ids().zip(model.bodies());
    let roots = bodies.filter(|(_, body)| body.parent.is_none());
    match roots.map(|(id, _)| id).nth(1) {
        None => Ok(()),
        Some(root) => forces.set_gravity(model, root, [0.4, -0.3, -1.62]),
    }
}

/// Mixed trees and forests of up to 256 freedoms: chains, bushes, floating and fixed bases.
fn small_problems() -> anyhow::Result<Vec<Problem>> {
    let mut problems = Vec::new();
    for (count, reach, articulations) in [
        (1, 1, 1),
        (2, 1, 1),
        (3, 2, 1),
        (8, 1, 1),
        (8, 8, 3),
        (30, 2, 1),
        (30, 30, 4),
        (80, 1, 1),
        (80, 4, 1),
        (80, 80, 7),
    ] {
        for seed in 0..4_u64 {
            let tree = RandomTree {
                count,
                reach,
                floating: seed % 2 == 1,
                mixed: true,
                articulations,
            };
            let model = generate::random_tree(&tree, seed * 1000 + count as u64)?;
            let name = format!("{count} bodies reach {reach} x {articulations} seed {seed}");
            if model.dof_count() <= 256 {
                problems.push(Problem::new(name, model, seed)?);
            }
        }
    }
    for seed in 0..12_u64 {
        for count in [1, 4, 20] {
            let model = generate::random_mechanism(count, true, seed)?;
            let name = format!("mechanism of {count} seed {seed}");
            problems.push(Problem::with_elements(name, model, seed)?);
        }
    }
    Ok(problems)
}

/// Chains and trees of up to 5000 bodies.
fn large_problems() -> anyhow::Result<Vec<Problem>> {
    let mut problems = Vec::new();
    for count in [1, 2, 3, 17, 100, 1000, 5000] {
        for seed in 0..6 {
            for reach in [1, 3, 30, count] {
                let tree = RandomTree {
                    reach,
                    floating: seed % 2 == 0,
                    ..RandomTree::mixed(count)
                };
                let model = generate::random_tree(&tree, seed)?;
                let name = format!("{count} mixed, reach {reach}, seed {seed}");
                problems.push(Problem::new(name, model, seed)?);
            }
        }
        for seed in 0..4 {
            let model = generate::random_mechanism(count, true, seed)?;
            let name = format!("mechanism of {count}, seed {seed}");
            problems.push(Problem::with_elements(name, model, seed)?);
        }
        let chain = generate::random_chain(count, &Rod::default(), 1)?;
        problems.push(Problem::new(format!("chain of {count}"), chain, 1)?);
    }
    Ok(problems)
}

/// |tau - RNEA(qdd)|_i over eps n (|M| |qdd| + |h|)_i, at most 8: the joint torques of the solution,
/// by inverse dynamics in f64, or in the reference precision for it; eps is that of the numbers
/// handed over, f64 at best.
///
/// # Errors
/// If a problem cannot be solved.
pub fn joint_torque_residual(solver: &dyn Solver) -> Outcome {
    let evaluation = match solver.precision() {
        Precision::Reference => Precision::Reference,
        _ => Precision::F64,
    };
    let mut figures = Vec::new();
    for problem in small_problems()? {
        let Problem {
            name,
            model,
            state,
            forces,
        } = &problem;
        let qdd = solver.solve(model, state, forces)?;
        let mut workspace = Workspace::new(model, evaluation);
        let still = vec![0.0; model.dof_count()];
        let bias = rnea(model, state, &still, forces, &mut workspace)?.to_vec();
        let tau = rnea(model, state, &qdd, forces, &mut workspace)?.to_vec();
        let mass = crba(model, state, &mut workspace)?;
        let unit = solver.precision().epsilon().max(f64::EPSILON) * problem.size();
        let mut worst = 0.0_f64;
        for i in 0..model.dof_count() {
            let moved: f64 = (0..qdd.len())
                .map(|j| mass[(i, j)].abs() * qdd[j].abs())
                .sum();
            let own = forces.joint_inertia.get(i).copied().unwrap_or(0.0);
            let scale = unit * (moved + own * qdd[i].abs() + bias[i].abs());
            worst = worst_of(worst, (forces.joint[i] - tau[i]).abs() / scale);
        }
        figures.push(Figure::new(name.clone(), worst, 8.0));
    }
    Ok(figures)
}

/// Residual of the bodies' own equations over eps depth, at most 64.
///
/// # Errors
/// If a problem cannot be solved.
pub fn own_equations(solver: &dyn Solver) -> Outcome {
    let mut figures = Vec::new();
    for problem in large_problems()? {
        let Problem {
            name,
            model,
            state,
            forces,
        } = &problem;
        if let Some(residual) = solver.residual(model, state, forces)? {
            let unit = solver.precision().epsilon() * problem.depth();
            // Between the joints of a compound one there is no mass, and rows that are rounding alone.
            let left = if forces.joint_inertia.is_empty() {
                residual.max()
            } else {
                residual.by_body
            };
            figures.push(Figure::new(name.clone(), left / unit, 64.0));
        }
    }
    Ok(figures)
}

/// A call after others, in the same workspace or in its own, gives the same bits.
///
/// # Errors
/// If a problem cannot be solved.
pub fn same_bits(solver: &dyn Solver) -> Outcome {
    let mut figures = Vec::new();
    for problem in small_problems()? {
        let input = (problem.state.clone(), problem.forces.clone());
        let other = (
            State::random(&problem.model, 77),
            Forces::none(&problem.model),
        );
        let together = solver.solve_all(&problem.model, &[input.clone(), other, input.clone()])?;
        let alone = solver.solve(&problem.model, &input.0, &input.1)?;
        let bits = |qdd: &[f64]| qdd.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let same = bits(&together[0]) == bits(&alone) && bits(&together[2]) == bits(&alone);
        let differs = f64::from(u8::from(!same));
        figures.push(Figure::new(problem.name.clone(), differs, 0.0));
    }
    Ok(figures)
}

/// |ABA - CRBA| over eps n cond(M) max|qdd|, at most 8, in f64.
///
/// # Errors
/// If a problem cannot be solved.
pub fn aba_against_crba() -> Outcome {
    let mut figures = Vec::new();
    for problem in small_problems()? {
        let Problem {
            name,
            model,
            state,
            forces,
        } = &problem;
        if model.dof_count() == 0 {
            continue;
        }
        let mut workspace = Workspace::new(model, Precision::F64);
        let recursive = aba(model, state, forces, &mut workspace)?.to_vec();
        let dense = crba_forward_dynamics(model, state, forces, &mut workspace)?;
        let mut mass = crba(model, state, &mut workspace)?.to_owned();
        for (dof, own) in forces.joint_inertia.iter().enumerate() {
            mass[(dof, dof)] += own;
        }
        let values = mass
            .self_adjoint_eigenvalues(faer::Side::Lower)
            .map_err(|error| anyhow::anyhow!("eigenvalues: {error:?}"))?;
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = values.iter().copied().fold(0.0, f64::max);
        let unit = f64::EPSILON * problem.size() * (largest / smallest);
        let error = relative_error(&recursive, &dense) / unit;
        figures.push(Figure::new(name.clone(), error, 8.0));
    }
    Ok(figures)
}
