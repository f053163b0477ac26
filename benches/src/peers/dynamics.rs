//! Forward dynamics of chains and robots in many random states: accelerations from positions, rates
//! and joint forces.

use super::Problem;
use super::contender::{Answer, Method, Own, OwnMethod};
use crate::results::write_atomically;
use crate::row::Row;
use crate::suite::{gold_robots, worst_of};
use std::fmt::Write;
use std::path::Path;
use vertebra::generate::{self, Rod};
use vertebra::{
    Forces, JointKind, Model, Pose, Precision, Random, State, Workspace, aba,
    crba_forward_dynamics, forward_error,
};

/// Name on the command line.
pub const NAME: &str = "dynamics";

/// Bodies of the chains. Pinocchio's workspace takes memory with the cube of the number of freedoms,
/// 9 GB at 512.
const CHAINS: [usize; 3] = [128, 256, 512];
/// Robots of the reference results that everyone can express.
const ROBOTS: [&str; 4] = ["panda7", "solo12", "simple_humanoid", "g1_29dof"];
/// States solved in turn, so that none is in the caches for having been solved just before.
const STATES: u64 = 64;
/// Bodies that a sample solves, over as many states as that takes: a
/// sample should be long for the clock and short for the scheduler.
const BODIES_PER_SAMPLE: usize = 1024;
/// Freedoms beyond which a dense factorisation is not timed.
const DENSE_LIMIT: usize = 64;

/// A model and its states.
struct Articulated {
    scenario: String,
    model: Model,
    inputs: Vec<(State, Forces)>,
    /// Solutions in the reference precision, one an input.
    references: Vec<Workspace>,
}

/// The problems.
///
/// # Errors
/// If a reference file is not what it should be, or a state cannot be solved.
pub fn problems(quick: bool, seed: u64) -> anyhow::Result<Vec<Box<dyn Problem>>> {
    let mut models = Vec::new();
    for model in gold_robots::models()? {
        if ROBOTS.contains(&model.name()) {
            models.push((model.name().to_owned(), model));
        }
    }
    let chains = if quick { &CHAINS[..1] } else { &CHAINS[..] };
    for &count in chains {
        let model = generate::random_chain(count, &Rod::default(), seed)?;
        models.push(("chain".to_owned(), model));
    }
    models
        .into_iter()
        .map(|(scenario, model)| {
            let problem = Articulated::new(scenario, model, seed)?;
            Ok(Box::new(problem) as Box<dyn Problem>)
        })
        .collect()
}

impl Articulated {
    fn new(scenario: String, model: Model, seed: u64) -> anyhow::Result<Self> {
        let mut random = Random::new(seed);
        let inputs: Vec<_> = (0..STATES)
            .map(|case| {
                let state = State::random(&model, seed.wrapping_add(1 + case));
                let mut forces = Forces::none(&model);
                forces.joint.fill_with(|| random.symmetric());
                (state, forces)
            })
            .collect();
        let references = inputs
            .iter()
            .map(|(state, forces)| {
                let mut exact = Workspace::of_tree(&model, Precision::Reference);
                aba(&model, state, forces, &mut exact)?;
                Ok(exact)
            })
            .collect::<anyhow::Result<_>>()?;
        Ok(Self {
            scenario,
            model,
            inputs,
            references,
        })
    }

    /// States that make a sample.
    fn group(&self) -> usize {
        (BODIES_PER_SAMPLE / self.model.bodies().len()).clamp(1, self.inputs.len())
    }

    fn own_method(&self, name: &str, precision: Precision, solve: Solve) -> OwnMethod<'_> {
        let mut workspace = Workspace::of_tree(&self.model, precision);
        let mut another = Workspace::of_tree(&self.model, precision);
        let group = self.group();
        let mut turns = self.inputs.iter().cycle();
        OwnMethod {
            method: Method {
                name: name.to_owned(),
                precision: precision.to_string(),
                stage: "forward dynamics".to_owned(),
                note: "one thread".to_owned(),
            },
            problems: group,
            call: Box::new(move || {
                for (state, forces) in turns.by_ref().take(group) {
                    solve(&self.model, state, forces, &mut workspace, &mut |_| ())?;
                }
                Ok(())
            }),
            answer: Box::new(move || {
                let mut rows = Vec::new();
                for (state, forces) in &self.inputs {
                    let mut keep = |qdd: &[f64]| rows.push(qdd.to_vec());
                    solve(&self.model, state, forces, &mut another, &mut keep)?;
                }
                Ok(Answer::Accelerations(rows))
            }),
        }
    }
}

/// Solves a state and shows the accelerations.
type Solve = fn(
    &Model,
    &State,
    &Forces,
    &mut Workspace,
    &mut dyn FnMut(&[f64]),
) -> Result<(), vertebra::Error>;

impl Problem for Articulated {
    fn scenario(&self) -> &str {
        &self.scenario
    }

    fn size(&self) -> (u64, &'static str) {
        (self.model.bodies().len() as u64, "bodies")
    }

    fn export(&self, folder: &Path) -> anyhow::Result<()> {
        let text = problem_text(&self.model, &self.inputs, self.group())?;
        Ok(write_atomically(
            &folder.join("problem.txt"),
            text.as_bytes(),
        )?)
    }

    fn own(&self) -> anyhow::Result<Own<'_>> {
        let by_aba: Solve =
            |model, state, forces, workspace, show| aba(model, state, forces, workspace).map(show);
        let by_crba: Solve = |model, state, forces, workspace, show| {
            crba_forward_dynamics(model, state, forces, workspace).map(|qdd| show(&qdd))
        };
        let mut methods = vec![
            self.own_method("aba", Precision::F64, by_aba),
            self.own_method("aba", Precision::F32, by_aba),
        ];
        if self.model.dof_count() <= DENSE_LIMIT {
            methods.push(self.own_method("crba", Precision::F64, by_crba));
        }
        Ok(Own::new(methods))
    }

    fn judge(&self, answer: &Answer, row: Row) -> anyhow::Result<Row> {
        let Answer::Accelerations(rows) = answer else {
            anyhow::bail!("it answered with something else than accelerations");
        };
        anyhow::ensure!(
            rows.len() == self.references.len(),
            "it solved {} of {} states",
            rows.len(),
            self.references.len()
        );
        let mut worst = 0.0_f64;
        for (qdd, exact) in rows.iter().zip(&self.references) {
            worst = worst_of(worst, forward_error(qdd, exact)?);
        }
        Ok(Row {
            error_forward: Some(worst),
            ..row
        })
    }
}

/// The model and its states as `benches/peers/harness.hpp` reads them: plain numbers that come back
/// to the last bit. (URDF has rotations as three angles, whose rounding makes another model.)
fn problem_text(model: &Model, inputs: &[(State, Forces)], group: usize) -> anyhow::Result<String> {
    let mut text = String::new();
    numbers(&mut text, &model.gravity().to_array())?;
    writeln!(text, "{}", model.bodies().len())?;
    for body in model.bodies() {
        let (kind, axis) = match body.joint.kind {
            JointKind::Revolute { axis } => ("revolute", axis.to_array()),
            JointKind::Free => ("free", [0.0; 3]),
            other => anyhow::bail!("{}: {other:?} is not exported", body.name),
        };
        anyhow::ensure!(
            body.joint.child_placement == Pose::IDENTITY,
            "{}: its joint is not at its origin",
            body.name
        );
        let parent = body.parent.map_or(-1, |parent| i64::from(parent.0));
        let place = &body.joint.parent_placement;
        write!(text, "{parent} {kind} ")?;
        let m = &body.mass.inertia;
        let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
        let mut line = axis.to_vec();
        line.extend(place.translation.to_array());
        line.extend(place.rotation.to_array());
        line.push(body.mass.mass);
        line.extend(body.mass.center.to_array());
        line.extend([x.x, y.y, z.z, y.x, z.x, z.y]);
        numbers(&mut text, &line)?;
    }
    writeln!(
        text,
        "{} {} {} {group}",
        inputs.len(),
        model.position_count(),
        model.dof_count()
    )?;
    for (state, forces) in inputs {
        for list in [&state.q, &state.qd, &forces.joint] {
            numbers(&mut text, list)?;
        }
    }
    Ok(text)
}

fn numbers(text: &mut String, list: &[f64]) -> std::fmt::Result {
    for number in list {
        // The shortest text that reads back to the same number.
        write!(text, "{number:e} ")?;
    }
    writeln!(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::contender::Contender;
    use crate::row::tests::row;

    #[test]
    fn ours_are_right_and_a_planted_error_is_measured() {
        for problem in problems(true, 1).unwrap() {
            let mut own = problem.own().unwrap();
            let Answer::Accelerations(mut rows) = own.answer(0).unwrap() else {
                panic!("no accelerations");
            };
            let judge = |rows: &[Vec<f64>]| {
                let row = row(problem.scenario(), "m", "f64", 1, 1e-3);
                problem.judge(&Answer::Accelerations(rows.to_vec()), row)
            };
            assert!(judge(&rows).unwrap().error_forward.unwrap() < 1e-11);
            let largest = rows[7].iter().fold(0.0_f64, |m, a| m.max(a.abs()));
            let mut planted = |size: f64| {
                let kept = rows[7][3];
                rows[7][3] += size * largest;
                let error = judge(&rows).unwrap().error_forward.unwrap();
                rows[7][3] = kept;
                error
            };
            // Over the largest acceleration, or over what the loads cause alone where that is more.
            let (once, twice) = (planted(1e-3), planted(2e-3));
            assert!(once > 1e-4 && once <= 1e-3 + 1e-9, "{once:e}");
            assert!((twice - 2.0 * once).abs() < 1e-9, "{once:e}, {twice:e}");
            rows.pop();
            assert!(judge(&rows).is_err());
        }
    }

    /// Read by words, as `harness.hpp` does.
    #[test]
    fn exported_numbers_come_back_to_the_last_bit() {
        let model = generate::random_chain(3, &Rod::default(), 5).unwrap();
        let problem = Articulated::new("chain".to_owned(), model.clone(), 5).unwrap();
        let text = problem_text(&model, &problem.inputs, 9).unwrap();
        let mut words = text.split_whitespace();
        let mut number = || words.next().unwrap().parse::<f64>();
        let gravity = [(); 3].map(|()| number().unwrap());
        assert_eq!(gravity, model.gravity().to_array());
        assert_eq!(number(), Ok(3.0));
        for (index, body) in model.bodies().iter().enumerate() {
            assert_eq!(number(), Ok(index as f64 - 1.0));
            assert!(number().is_err(), "the kind of joint");
            let JointKind::Revolute { axis } = body.joint.kind else {
                panic!("{:?}", body.joint.kind);
            };
            let found: Vec<f64> = (0..20).map(|_| number().unwrap()).collect();
            assert_eq!(found[..3], axis.to_array());
            assert_eq!(found[6..10], [0.0, 0.0, 0.0, 1.0]);
            assert_eq!(found[10], body.mass.mass);
            assert_eq!(found[14], body.mass.inertia.x_axis.x);
        }
        assert_eq!([(); 4].map(|()| number().unwrap()), [64.0, 3.0, 3.0, 9.0]);
        for (state, forces) in &problem.inputs {
            for list in [&state.q, &state.qd, &forces.joint] {
                for expected in list {
                    assert_eq!(number(), Ok(*expected));
                }
            }
        }
        assert_eq!(words.next(), None);
    }
}
