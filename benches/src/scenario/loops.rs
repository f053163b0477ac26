//! The scenario `loops`: steps of mechanisms with closed loops.

use super::{Measurement, Meter, Selection};
use crate::row::Row;
use crate::suite::{relative_error, worst_of};
use vertebra::{
    Builder, Error, JointKind, Model, Pose, Precision, Rest, Simulation, Spring, State, mechanism,
};

/// Name of the group of scenarios.
pub const NAME: &str = "loops";

/// Time step \[s\].
pub const STEP: f64 = 1e-3;

/// Steps after which the violation is measured, taken before the clock starts.
pub(super) const STEPS: usize = 2000;

/// Steps from the first state before a timed run begins there again.
pub(super) const RUN: usize = 512;

/// Linkages that have nothing to do with each other.
const MANY: usize = 512;

/// A mechanism and the state it starts from.
#[derive(Clone, Debug)]
pub struct Subject {
    pub(super) model: Model,
    pub(super) start: State,
}

/// Mechanisms of every kind: planar, spatial, overconstrained, one that passes positions in which it may become another,
/// parallel, with many loops.
///
/// # Errors
/// None in practice: the mechanisms are valid.
pub fn mechanisms() -> Result<Vec<(Model, State)>, Error> {
    Ok(vec![
        mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4)?,
        mechanism::five_bar()?,
        mechanism::bennett()?,
        mechanism::bricard()?,
        mechanism::jansen_leg()?,
        parallelogram()?,
        stewart_on_springs()?,
        bulging_mail(3, 4)?,
    ])
}

/// A parallelogram on its way through the positions in which it is flat.
fn parallelogram() -> Result<(Model, State), Error> {
    let (model, mut state) = mechanism::four_bar(1.0, 0.4, 1.0, 0.4, 1.0)?;
    state.qd = vec![3.0, -3.0, 3.0];
    let mut description = model.describe();
    description.name = "parallelogram".to_owned();
    Ok((description.build()?, state))
}

/// The Stewart platform on six springs, pushed aside.
///
/// # Errors
/// None in practice: it is valid.
pub fn stewart_on_springs() -> Result<(Model, State), Error> {
    let (model, mut state) = mechanism::stewart_platform()?;
    let mut description = model.describe();
    for body in &mut description.bodies {
        if matches!(body.joint.kind, JointKind::Prismatic { .. }) {
            body.joint.spring = Some(Spring {
                stiffness: 4e3,
                rest: Rest::Position(0.0),
            });
        }
    }
    let model = description.build()?;
    state.qd[..6].copy_from_slice(&[0.3, -0.2, 0.5, 0.4, 0.1, -0.2]);
    closed(model, state)
}

/// A state with its loops closed.
fn closed(model: Model, state: State) -> Result<(Model, State), Error> {
    let mut simulation = Simulation::new(model.clone())?;
    simulation.set_state(state)?;
    simulation.close_loops()?;
    Ok((model, simulation.state()?.clone()))
}

/// Chain mail from a bulge: flat it is singular.
fn bulging_mail(rows: u32, columns: u32) -> Result<(Model, State), Error> {
    let (model, mut state) = mechanism::chain_mail(rows as usize, columns as usize)?;
    for (ring, q) in (0..rows * columns).zip(state.q.chunks_mut(7)) {
        q[1] = 0.03 * (1.0 + f64::from(ring)).sin();
    }
    closed(model, state)
}

/// A mechanism many times over, each by itself.
///
/// # Errors
/// None in practice: if the mechanism is valid, so are several.
pub fn side_by_side(model: &Model, start: &State, count: usize) -> Result<(Model, State), Error> {
    let one = Builder::of_description(model.describe());
    let mut all = Builder::new(format!("{count} {}", model.name())).gravity(model.gravity());
    for copy in 0..count {
        all = all.attach(&copy.to_string(), &one, Pose::IDENTITY);
    }
    let model = all.describe().build()?;
    let mut state = State::neutral(&model);
    state.q = start.q.repeat(count);
    state.qd = start.qd.repeat(count);
    Ok((model, state))
}

/// The mechanisms, and a large patch of chain mail and many linkages unless it is to be quick.
///
/// # Errors
/// None in practice: the mechanisms are valid.
pub fn subjects(selection: &Selection) -> Result<Vec<Subject>, Error> {
    let mut all = mechanisms()?;
    if !selection.quick {
        all.push(bulging_mail(8, 8)?);
        let (model, start) = &all[0];
        all.push(side_by_side(model, start, MANY)?);
    }
    let subject = |(model, start)| Subject { model, start };
    Ok(all.into_iter().map(subject).collect())
}

impl Subject {
    /// A step in each precision asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        if selection.wants("step") {
            for precision in selection.precisions() {
                let (name, bodies) = (self.model.name(), self.model.bodies().len());
                let label = format!("{NAME} {name} {bodies} bodies: step {precision}");
                list.push(Measurement::new(label, move |m| self.step(m, precision)));
            }
        }
        list
    }

    /// A step of semi-implicit Euler that keeps the loops closed. Errors: accelerations at the start against those with
    /// the tree in the reference precision; the largest violation over the size of its loop after 2000 steps
    /// (`error_residual`).
    fn step(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut exact =
            Simulation::new(self.model.clone())?.with_precision(Precision::Reference)?;
        let mut simulation = Simulation::new(self.model.clone())?.with_precision(precision)?;
        for simulation in [&mut exact, &mut simulation] {
            simulation.set_state(self.start.clone())?;
        }
        let forward = relative_error(&simulation.accelerations()?, &exact.accelerations()?);
        let mut violation = 0.0_f64;
        for _ in 0..STEPS {
            simulation.step(STEP)?;
        }
        if let Some(found) = simulation.loop_violation()? {
            violation = worst_of(violation, found.position);
        }
        let mut turn = 0;
        let timing = meter.time(|| {
            if turn % RUN == 0 {
                simulation.set_state(self.start.clone())?;
            }
            turn += 1;
            simulation.step(STEP)
        })?;
        let loops = self.model.loops().len();
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(violation),
            note: format!("{loops} loops, in f64 whatever the tree is in; the residual is the violation over the loop's size after {STEPS} steps"),
            ..Row::new(
                &format!("{NAME} {}", self.model.name()),
                "step",
                &precision.to_string(),
                self.model.bodies().len() as u64,
                "bodies",
                &timing,
            )
        }))
    }
}
