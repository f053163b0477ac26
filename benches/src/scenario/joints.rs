//! The scenario `joints`: steps of a chain with nothing, with springs and dampers, and with friction and stops in its
//! joints, and changes of a large model while it moves (`edits.rs`).

use super::edits::Edits;
use super::{Measurement, Meter, Selection};
use crate::row::Row;
use vertebra::generate::{self, Rod};
use vertebra::{
    Elements, Forces, JointLimits, Model, Precision, Simulation, Spring, State, Workspace, aba,
    forward_error,
};

/// Name of the scenario on the command line.
pub const NAME: &str = "joints";

/// Bodies of the chain that takes steps.
pub(super) const CHAIN: usize = 2048;

/// Time step \[s\].
pub(super) const STEP: f64 = 1e-4;

/// Steps after which a run starts anew: without damping a chain of random rates is soon too fast.
const STEPS: u32 = 100;

/// The models.
#[derive(Clone, Debug)]
pub struct Subject {
    bare: Model,
    sprung: Model,
    rough: Model,
    edits: Edits,
    seed: u64,
}

impl Subject {
    /// A chain, the same with elements in all joints, and models to be changed.
    ///
    /// # Errors
    /// None in practice: the models can be built.
    pub fn new(seed: u64) -> anyhow::Result<Self> {
        let rod = Rod::default();
        let bare = generate::random_chain(CHAIN, &rod, seed)?;
        let mut description = bare.describe();
        for body in &mut description.bodies {
            body.joint.damping = 0.1;
            body.joint.spring = Some(Spring::at(10.0, 0.0));
        }
        let sprung = description.clone().build()?;
        for body in &mut description.bodies {
            body.joint.friction = 0.05;
            body.joint.limits = Some(JointLimits {
                position: Some([-3.0, 3.0]),
                ..JointLimits::default()
            });
        }
        Ok(Self {
            sprung,
            rough: description.build()?,
            edits: Edits::new(seed)?,
            bare,
            seed,
        })
    }

    /// The chains that take steps.
    pub(super) fn chains(&self) -> [(&'static str, &Model); 3] {
        [
            ("step-bare", &self.bare),
            ("step-elements", &self.sprung),
            ("step-rough", &self.rough),
        ]
    }

    pub(super) const fn seed(&self) -> u64 {
        self.seed
    }

    /// The rows asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        for (method, model) in self.chains() {
            if selection.wants(method) {
                let label = format!("chain of {CHAIN}: {method}");
                list.push(Measurement::new(label, move |meter| {
                    self.steps(meter, method, model)
                }));
            }
        }
        list.extend(self.edits.measurements(selection));
        list
    }

    /// Semi-implicit Euler steps; the error is that of the first one's accelerations.
    fn steps(&self, meter: &Meter, method: &str, model: &Model) -> anyhow::Result<Option<Row>> {
        let state = State::random(model, self.seed);
        let mut elements = Elements::new(model);
        let loaded = elements.load(&state, &Forces::none(model), STEP)?;
        let mut workspace = Workspace::new(model, Precision::F64);
        let mut reference = Workspace::new(model, Precision::Reference);
        let qdd = aba(model, &state, loaded, &mut workspace)?.to_vec();
        aba(model, &state, loaded, &mut reference)?;
        let error = forward_error(&qdd, &reference)?;

        let mut simulation = Simulation::new(model.clone())?;
        let mut taken = STEPS;
        let timing = meter.time(|| {
            if taken == STEPS {
                simulation.set_state(state.clone())?;
                taken = 0;
            }
            taken += 1;
            simulation.step(STEP)
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(error),
            note: "one state copied in a hundred steps".to_owned(),
            ..Row::new(NAME, method, "f64", CHAIN as u64, "bodies", &timing)
        }))
    }
}
