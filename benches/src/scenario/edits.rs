//! The time it takes to change a large model while it moves, part of the scenario `joints`: bodies added, removed, welded,
//! cut loose and attached elsewhere.

use super::{Measurement, Meter, Selection, joints::NAME};
use crate::row::Row;
use crate::suite::worst_of;
use vertebra::generate::{self, Rod};
use vertebra::schedule::{Schedule, ScheduleOptions};
use vertebra::{
    BodyId, Edit, Edited, Joint, MassProperties, Model, ModelError, Precision, Simulation, State,
    Workspace, forward_kinematics,
};

/// Bodies of the models.
const COUNT: u32 = 100_000;

/// A change; the number counts those made before it, so that none is made twice.
type Change = fn(&mut Edit<'_>, u32) -> Result<(), ModelError>;

/// Each kind of change, in or near the middle of the model, which is the farthest from what is at hand.
const CHANGES: [(&str, Change); 5] = [
    ("add", |edit, count| {
        let mass = MassProperties::sphere(1.0, 0.1);
        let name = format!("added {count}");
        edit.add(name, Some(BodyId(COUNT / 2)), Joint::spherical(), mass)?;
        Ok(())
    }),
    ("cut", |edit, count| edit.cut(BodyId(COUNT / 2 - count))),
    ("reattach", |edit, count| {
        let parent = BodyId(COUNT / 4);
        edit.reattach(BodyId(COUNT / 2 + count), Some(parent), Joint::spherical())
    }),
    ("remove", |edit, count| {
        edit.remove(BodyId(COUNT - 1 - count))
    }),
    ("weld", |edit, count| edit.weld(BodyId(COUNT / 2 - count))),
];

/// The models that are changed.
#[derive(Clone, Debug)]
pub(super) struct Edits {
    models: [(&'static str, Model); 2],
    seed: u64,
}

impl Edits {
    pub(super) fn new(seed: u64) -> anyhow::Result<Self> {
        let (rod, count) = (Rod::default(), COUNT as usize);
        Ok(Self {
            models: [
                ("chain", generate::random_chain(count, &rod, seed)?),
                ("tree", generate::tree(count, 2, &rod)?),
            ],
            seed,
        })
    }

    /// The rows asked for.
    pub(super) fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        for (shape, model) in &self.models {
            for (kind, change) in CHANGES {
                let method = format!("{kind}-{shape}");
                if selection.wants(&method) {
                    let label = format!("{shape} of {COUNT}: {kind}");
                    list.push(Measurement::new(label, move |meter| {
                        self.edits(meter, &method, model, change)
                    }));
                }
            }
            let method = format!("resume-{shape}");
            if selection.wants(&method) {
                let label = format!("{shape} of {COUNT}: resume");
                list.push(Measurement::new(label, move |meter| {
                    self.resumed(meter, &method, model)
                }));
            }
        }
        list
    }

    /// A new model, its state, and its assembly tree, on one thread, each of what the edit before it made. The error is
    /// what the first changes poses by, as part of the model's extent.
    fn edits(
        &self,
        meter: &Meter,
        method: &str,
        model: &Model,
        change: Change,
    ) -> anyhow::Result<Option<Row>> {
        let start = State::random(model, self.seed);
        let error = moved(model, &start, &edited(model, &start, change, 0)?)?;
        let (mut model, mut state) = (model.clone(), start);
        let mut count = 0;
        let timing = meter.time(|| {
            let edited = edited(&model, &state, change, count)?;
            (model, state) = (edited.model, edited.state);
            count += 1;
            Schedule::new(&model, &ScheduleOptions::default())
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(error),
            note: "a new model, its state and its assembly tree".to_owned(),
            ..Row::new(NAME, method, "f64", COUNT.into(), "bodies", &timing)
        }))
    }

    /// What comes after an edit: a simulation of the new model in its state, on one thread. The error is what the
    /// state changes by that is read back.
    fn resumed(&self, meter: &Meter, method: &str, model: &Model) -> anyhow::Result<Option<Row>> {
        let state = State::random(model, self.seed);
        let resume = || {
            let mut simulation = Simulation::new(model.clone())?;
            simulation.set_state(state.clone())?;
            Ok::<_, vertebra::Error>(simulation)
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let (timing, back) = pool.install(|| {
            let mut simulation = resume()?;
            let back = simulation.state()?.clone();
            meter.time(resume).map(|timing| (timing, back))
        })?;
        let off = |error, (a, b): (&f64, &f64)| worst_of(error, (a - b).abs());
        let error = back.q.iter().zip(&state.q).fold(0.0, off);
        Ok(timing.map(|timing| Row {
            error_forward: Some(error),
            note: "a simulation and its state, ready to step".to_owned(),
            ..Row::new(NAME, method, "f64", COUNT.into(), "bodies", &timing)
        }))
    }
}

fn edited(model: &Model, state: &State, change: Change, count: u32) -> Result<Edited, ModelError> {
    let mut edit = model.edit(state)?;
    change(&mut edit, count)?;
    edit.finish()
}

/// How far bodies that stay have moved, as part of the model's extent.
fn moved(model: &Model, state: &State, edited: &Edited) -> anyhow::Result<f64> {
    let mut before = Workspace::new(model, Precision::F64);
    forward_kinematics(model, state, &mut before)?;
    let mut after = Workspace::new(&edited.model, Precision::F64);
    forward_kinematics(&edited.model, &edited.state, &mut after)?;
    let (mut moved, mut extent) = (0.0_f64, 0.0_f64);
    for (old, new) in model.body_ids().zip(&edited.bodies) {
        let Some(new) = *new else { continue };
        let (a, b) = (before.pose(old)?.translation, after.pose(new)?.translation);
        moved = worst_of(moved, a.distance(b));
        extent = extent.max(a.length());
    }
    Ok(moved / extent)
}
