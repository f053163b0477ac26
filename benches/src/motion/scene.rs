//! The scenes of long runs.

use vertebra::generate::{self, Rod};
use vertebra::glam::DVec3;
use vertebra::{Error, Integrator, Joint, MassProperties, Model, Simulation, State, mechanism};

use crate::scenario::loops::stewart_on_springs;

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

/// Every scene: one that recurs, two that are chaotic, one on which nothing acts, and four with closed loops.
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
        linkage("four-bar", mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4)?),
        bennett_adrift()?,
        linkage("Jansen's leg", mechanism::jansen_leg()?),
        linkage("Stewart platform on springs", stewart_on_springs()?),
    ])
}

fn linkage(name: &'static str, (model, state): (Model, State)) -> Scene {
    Scene {
        name,
        model,
        state,
        conserves_momentum: false,
    }
}

/// Bennett's linkage on a body that floats where nothing acts, tumbling and moving in itself.
fn bennett_adrift() -> Result<Scene, Error> {
    let (fixed, start) = mechanism::bennett()?;
    let mut description = fixed.describe().gravity(DVec3::ZERO);
    for body in &mut description.bodies {
        body.parent.get_or_insert_with(|| "ground".to_owned());
    }
    for end in description
        .loops
        .iter_mut()
        .flat_map(|closed| &mut closed.bodies)
    {
        end.get_or_insert_with(|| "ground".to_owned());
    }
    let ground = MassProperties::rod(1.0, 0.5, 0.2);
    let description = description.body("ground", None, Joint::free(), ground);
    let model = description.build()?;
    // The ground comes first, and the links in their order.
    let mut state = State::neutral(&model);
    let first = model.position_count() - start.q.len();
    state.q[first..].copy_from_slice(&start.q);
    state.qd = vec![0.7, -0.4, 1.1, 0.0, 0.2, 0.0, 3.0, 0.0, 0.0];
    let mut simulation = Simulation::new(model.clone())?;
    simulation.set_state(state)?;
    simulation.close_loops()?;
    let state = simulation.state()?.clone();
    Ok(Scene {
        name: "Bennett's linkage adrift",
        model,
        state,
        conserves_momentum: true,
    })
}
