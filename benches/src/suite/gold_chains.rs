//! Chains whose accelerations are known from 50-digit arithmetic.

use super::{Figure, Outcome, relative_error, solver::Solver};
use serde::Deserialize;
use vertebra::glam::{DMat3, DVec3};
use vertebra::{
    Forces, Joint, MassProperties, Model, ModelDescription, Pose, Precision, State, Wrench,
};

/// The reference files, as they were made.
const FILES: [&str; 10] = [
    include_str!("../../gold/chains/chain-16-length-1.json"),
    include_str!("../../gold/chains/chain-16-length-0.1.json"),
    include_str!("../../gold/chains/chain-64-length-1.json"),
    include_str!("../../gold/chains/chain-64-length-0.1.json"),
    include_str!("../../gold/chains/chain-128-length-1.json"),
    include_str!("../../gold/chains/chain-128-length-0.1.json"),
    include_str!("../../gold/chains/chain-512-length-1.json"),
    include_str!("../../gold/chains/chain-512-length-0.1.json"),
    include_str!("../../gold/chains/chain-2048-length-1.json"),
    include_str!("../../gold/chains/chain-2048-length-0.1.json"),
];

/// A chain of rods with one wrench on one body; each file states its conventions.
#[derive(Deserialize)]
struct ChainFile {
    name: String,
    gravity: [f64; 3],
    bodies: usize,
    length: f64,
    mass: f64,
    inertia_com_diagonal: [f64; 3],
    forced_body: usize,
    force: [f64; 3],
    torque: [f64; 3],
    axis: Vec<[f64; 3]>,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

/// A reference case ready to be solved.
pub struct Case {
    /// Name of the file.
    pub name: String,
    /// The chain.
    pub model: Model,
    /// Positions and rates.
    pub state: State,
    /// One wrench on one body.
    pub forces: Forces,
    /// Joint accelerations from 50-digit arithmetic [rad/s^2].
    pub qdd: Vec<f64>,
}

/// All reference chains.
///
/// # Errors
/// If a file is not what it should be.
pub fn cases() -> anyhow::Result<Vec<Case>> {
    FILES.iter().map(|text| case(text)).collect()
}

fn case(text: &str) -> anyhow::Result<Case> {
    let file: ChainFile = serde_json::from_str(text)?;
    let rod = MassProperties {
        mass: file.mass,
        center: DVec3::new(0.0, 0.0, 0.5 * file.length),
        inertia: DMat3::from_diagonal(DVec3::from_array(file.inertia_com_diagonal)),
    };
    let tip = Pose::from_translation(DVec3::new(0.0, 0.0, file.length));
    let mut description =
        ModelDescription::new(&file.name).gravity(DVec3::from_array(file.gravity));
    for (index, axis) in file.axis.iter().enumerate() {
        let placement = if index == 0 { Pose::IDENTITY } else { tip };
        let parent = index.checked_sub(1).map(|above| above.to_string());
        let joint = Joint::revolute(DVec3::from_array(*axis)).at(placement);
        description = description.body(index.to_string(), parent.as_deref(), joint, rod);
    }
    let model = description.build()?;
    anyhow::ensure!(model.bodies().len() == file.bodies, "{}: bodies", file.name);
    let mut forces = Forces::none(&model);
    let forced = model
        .body_ids()
        .nth(file.forced_body)
        .ok_or_else(|| anyhow::anyhow!("{}: forced body", file.name))?;
    let wrench = Wrench::at_center(file.force)
        .with_torque(file.torque)
        .in_body_axes();
    forces.push(forced, wrench);
    let mut state = State::neutral(&model);
    state.q = file.q;
    state.qd = file.qd;
    Ok(Case {
        name: file.name,
        model,
        state,
        forces,
        qdd: file.qdd,
    })
}

/// In f64 every chain within 1e-10; in the reference precision all numbers agree to the last bit of
/// f64, and one rounding is allowed for. In f32 rounding errors add up along the chain like a random
/// walk: 64 sqrt(n) eps.
///
/// # Errors
/// If a chain cannot be solved.
pub fn joint_accelerations(solver: &dyn Solver) -> Outcome {
    let mut figures = Vec::new();
    for case in cases()? {
        let n = case.model.bodies().len();
        #[expect(clippy::cast_precision_loss, reason = "a size in a bound")]
        let bound = match solver.precision() {
            Precision::F64 => 1e-10,
            Precision::Reference => f64::EPSILON,
            Precision::F32 => 64.0 * (n as f64).sqrt() * Precision::F32.epsilon(),
        };
        // The condition of the mass matrix grows too fast for longer ones.
        if solver.is_dense() && n > 64 {
            continue;
        }
        let qdd = solver.solve(&case.model, &case.state, &case.forces)?;
        figures.push(Figure::new(
            case.name,
            relative_error(&qdd, &case.qdd),
            bound,
        ));
    }
    Ok(figures)
}
