//! URDF files of robots that exist, whose dynamics another program (Pinocchio 4.1, f64) has computed from the
//! same files: what an importer makes of mimics, missing and impossible inertias, joints without end, fixed links
//! and floating bases.

use super::{Figure, Outcome, relative_error, solver::Solver};
use anyhow::Context;
use serde::Deserialize;
use vertebra::urdf::{self, Options, Robot};
use vertebra::{
    BodyId, Forces, Joint, JointKind, Model, Precision, Simulation, State, Workspace, rnea,
};

/// Each file, and what Pinocchio computes from it.
const FILES: [[&str; 2]; 7] = [
    [
        include_str!("../../gold/urdf/panda.urdf"),
        include_str!("../../gold/urdf/panda.json"),
    ],
    [
        include_str!("../../gold/urdf/baxter.urdf"),
        include_str!("../../gold/urdf/baxter.json"),
    ],
    [
        include_str!("../../gold/urdf/kinova.urdf"),
        include_str!("../../gold/urdf/kinova.json"),
    ],
    [
        include_str!("../../gold/urdf/ur5.urdf"),
        include_str!("../../gold/urdf/ur5.json"),
    ],
    [
        include_str!("../../gold/urdf/human.urdf"),
        include_str!("../../gold/urdf/human.json"),
    ],
    [
        include_str!("../../gold/urdf/hyq.urdf"),
        include_str!("../../gold/urdf/hyq.json"),
    ],
    [
        include_str!("../../gold/urdf/tiago.urdf"),
        include_str!("../../gold/urdf/tiago.json"),
    ],
];

/// What an independent f64 program agrees to, relative.
const TOLERANCE: f64 = 1e-9;

#[derive(Deserialize)]
struct Gold {
    name: String,
    floating: bool,
    /// The joints of the arrays in their order; of a floating robot the root's seven positions and six rates
    /// stand before them, as ours.
    joints: Vec<String>,
    cases: Vec<Case>,
    /// The joints that follow no other.
    #[serde(default)]
    leaders: Vec<String>,
    /// Accelerations of leaders whose followers follow.
    #[serde(default)]
    coupled: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    q: Vec<f64>,
    qd: Vec<f64>,
    tau: Vec<f64>,
    qdd: Vec<f64>,
    #[serde(default)]
    bias_torque: Vec<f64>,
}

/// A robot, and where the freedoms of some of its joints are.
struct Read {
    robot: Robot,
    gold: Gold,
}

fn read([text, gold]: [&str; 2]) -> anyhow::Result<Read> {
    let gold: Gold = serde_json::from_str(gold)?;
    let options = match gold.floating {
        true => Options::default().floating_base(),
        false => Options::default(),
    };
    let robot = urdf::parse(text, &options)?;
    Ok(Read { robot, gold })
}

impl Read {
    /// The bodies that carry these joints, the floating root first.
    fn bodies(&self, joints: &[String]) -> anyhow::Result<Vec<BodyId>> {
        let model = &self.robot.model;
        let is_free = |id: &BodyId| model.bodies()[id.index()].joint.kind == JointKind::Free;
        let mut bodies: Vec<BodyId> = model.body_ids().filter(is_free).collect();
        for joint in joints {
            let body = self.robot.joints.get(joint);
            bodies.push(*body.with_context(|| format!("{}: no joint {joint}", self.gold.name))?);
        }
        Ok(bodies)
    }

    fn inputs(&self, model: &Model, bodies: &[BodyId], case: &Case) -> (State, Forces) {
        let (mut state, mut forces) = (State::neutral(model), Forces::none(model));
        let (mut at, mut dof) = (0, 0);
        for body in bodies.iter().map(|id| &model.bodies()[id.index()]) {
            for k in body.position_range() {
                state.q[k] = case.q[at];
                at += 1;
            }
            for k in body.dof_range() {
                state.qd[k] = case.qd[dof];
                forces.joint[k] = case.tau[dof];
                dof += 1;
            }
        }
        (state, forces)
    }
}

/// Entries of the freedoms of these bodies, in this order.
fn picked(model: &Model, bodies: &[BodyId], values: &[f64]) -> Vec<f64> {
    let ranges = bodies
        .iter()
        .map(|id| model.bodies()[id.index()].dof_range());
    ranges.flat_map(|range| values[range].to_vec()).collect()
}

/// Joint accelerations to 1e-9, followers moving freely.
///
/// # Errors
/// If a file is refused or a robot cannot be solved.
pub fn joint_accelerations(solver: &dyn Solver) -> Outcome {
    let mut figures = Vec::new();
    for file in FILES {
        let read = read(file)?;
        let (model, bodies) = (
            tree(&read.robot.model, false)?,
            read.bodies(&read.gold.joints)?,
        );
        for (number, case) in read.gold.cases.iter().enumerate() {
            let (state, forces) = read.inputs(&model, &bodies, case);
            let qdd = picked(&model, &bodies, &solver.solve(&model, &state, &forces)?);
            let name = format!("{} case {number}", read.gold.name);
            figures.push(Figure::new(
                name,
                relative_error(&qdd, &case.qdd),
                TOLERANCE,
            ));
        }
    }
    Ok(figures)
}

/// Bias torques, and accelerations with followers that follow: Pinocchio takes their freedoms out, we add the
/// couplings' forces.
///
/// # Errors
/// If a file is refused or a robot cannot be solved.
pub fn quantities() -> Outcome {
    let mut figures = Vec::new();
    for file in FILES {
        let read = read(file)?;
        let (model, bodies) = (
            tree(&read.robot.model, false)?,
            read.bodies(&read.gold.joints)?,
        );
        let mut workspace = Workspace::new(&model, Precision::F64);
        let still = vec![0.0; model.dof_count()];
        for (number, case) in read.gold.cases.iter().enumerate() {
            let (state, _) = read.inputs(&model, &bodies, case);
            let bias = rnea(
                &model,
                &state,
                &still,
                &Forces::none(&model),
                &mut workspace,
            )?;
            let error = relative_error(&picked(&model, &bodies, bias), &case.bias_torque);
            let name = format!("{} case {number} bias torque", read.gold.name);
            figures.push(Figure::new(name, error, TOLERANCE));
        }
        let (model, leaders) = (
            tree(&read.robot.model, true)?,
            read.bodies(&read.gold.leaders)?,
        );
        for (number, case) in read.gold.coupled.iter().enumerate() {
            let (mut state, forces) = read.inputs(&model, &leaders, case);
            for coupling in model.couplings() {
                let [body, other] =
                    [coupling.body, coupling.other].map(|id| &model.bodies()[id.index()]);
                state.q[body.position_start] =
                    coupling.ratio * state.q[other.position_start] + coupling.offset;
                state.qd[body.dof_start] = coupling.ratio * state.qd[other.dof_start];
            }
            let mut simulation = Simulation::new(model.clone())?;
            simulation.set_state(state)?;
            *simulation.forces_mut() = forces;
            let qdd = simulation.solve()?.joint_accelerations()?;
            let error = relative_error(&picked(&model, &leaders, qdd), &case.qdd);
            let name = format!("{} case {number} with followers", read.gold.name);
            figures.push(Figure::new(name, error, TOLERANCE));
        }
    }
    Ok(figures)
}

/// The bodies and the motions of their joints, with or without followers.
fn tree(model: &Model, coupled: bool) -> anyhow::Result<Model> {
    let mut description = model.bare().describe();
    for (body, read) in description.bodies.iter_mut().zip(model.bodies()) {
        body.joint = Joint {
            mimic: read.joint.mimic.clone().filter(|_| coupled),
            ..body.joint.clone()
        };
    }
    Ok(description.build()?)
}
