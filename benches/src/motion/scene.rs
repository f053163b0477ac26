//! The scenes of long runs.

use vertebra::generate::{self, Rod};
use vertebra::glam::DVec3;
use vertebra::{Error, Integrator, Joint, Model, Simulation, State};

/// A model and where it starts.
pub(super) struct Scene {
    /// Name, which says what it is.
    pub(super) name: &'static str,
    /// The model.
    pub(super) model: Model,
    /// The start.
    pub(super) state: State,
    /// Whether nothing acts from outside.
    pub(super) conserves_momentum: bool,
}

impl Scene {
    /// At its start.
    pub(super) fn simulation(&self, integrator: Integrator) -> Result<Simulation, Error> {
        let mut simulation = Simulation::new(self.model.clone())?.with_integrator(integrator);
        simulation.set_state(self.state.clone())?;
        Ok(simulation)
    }
}

/// Every scene: one that recurs, two that are chaotic, and one on which nothing acts.
pub(super) fn all() -> Result<Vec<Scene>, Error> {
    let rod = Rod::default();
    let hinges = |count| generate::chain(count, &Joint::revolute(DVec3::X), &rod);
    // All rods point up at zero: hanging, one radian from rest; and stretched out sideways.
    let from = |model: &Model, first: f64| {
        let mut state = State::neutral(model);
        state.q[0] = first;
        state
    };
    let pendulum = hinges(1)?;
    let four = hinges(4)?;
    let long = generate::random_chain(64, &rod, 4)?;
    let tumbling = {
        let mut description = generate::tree(15, 2, &rod)?.describe().gravity(DVec3::ZERO);
        description.bodies[0].joint = Joint::free();
        description.build()?
    };
    Ok(vec![
        Scene {
            name: "pendulum",
            state: from(&pendulum, core::f64::consts::PI - 1.0),
            model: pendulum,
            conserves_momentum: false,
        },
        Scene {
            name: "chain of 4",
            state: from(&four, core::f64::consts::FRAC_PI_2),
            model: four,
            conserves_momentum: false,
        },
        Scene {
            name: "random chain of 64",
            state: State {
                qd: vec![0.0; long.dof_count()],
                ..State::random(&long, 5)
            },
            model: long,
            conserves_momentum: false,
        },
        Scene {
            name: "tumbling tree of 15",
            state: State::random(&tumbling, 6),
            model: tumbling,
            conserves_momentum: true,
        },
    ])
}
