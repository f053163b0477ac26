//! Robots whose dynamics another program (Pinocchio 4.1, f64) has computed.

use super::{Figure, Outcome, relative_error, solver::Solver};
use serde::Deserialize;
use vertebra::glam::{DMat3, DQuat, DVec3};
use vertebra::{
    BodyId, Forces, Joint, JointKind, MassProperties, Model, ModelDescription, Pose, Precision,
    State, Workspace, Wrench, crba, forward_kinematics, mechanics, rnea,
};

/// The reference files; humanoid27 has massless intermediate links.
const FILES: [&str; 5] = [
    include_str!("../../gold/robots/panda7.json"),
    include_str!("../../gold/robots/solo12.json"),
    include_str!("../../gold/robots/simple_humanoid.json"),
    include_str!("../../gold/robots/g1_29dof.json"),
    include_str!("../../gold/robots/humanoid27.json"),
];

/// What an independent f64 program agrees to, relative.
const TOLERANCE: f64 = 1e-9;

#[derive(Deserialize)]
struct RobotFile {
    name: String,
    gravity: [f64; 3],
    bodies: Vec<RobotBody>,
    cases: Vec<RobotCase>,
}

#[derive(Deserialize)]
struct RobotBody {
    name: String,
    parent: i64,
    joint: RobotJoint,
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
    mass: f64,
    com: [f64; 3],
    inertia_com: [[f64; 3]; 3],
}

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum RobotJoint {
    Fixed,
    Revolute { axis: [f64; 3] },
    Prismatic { axis: [f64; 3] },
    Free,
}

#[derive(Deserialize)]
struct RobotPlacement {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

#[derive(Deserialize)]
struct RobotCase {
    q: Vec<f64>,
    qd: Vec<f64>,
    tau: Vec<f64>,
    #[serde(default)]
    external_force_on_last_body_local: [f64; 6],
    qdd: Vec<f64>,
    bias_torque: Vec<f64>,
    mass_matrix: Vec<Vec<f64>>,
    kinetic_energy: f64,
    potential_energy: f64,
    com: [f64; 3],
    momentum_linear: Option<[f64; 3]>,
    momentum_angular_about_com: Option<[f64; 3]>,
    placements: Option<Vec<RobotPlacement>>,
}

fn rows(m: &[[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(m).transpose()
}

/// The reference robots as models, by name.
///
/// # Errors
/// If a file is not what it should be.
pub fn models() -> anyhow::Result<Vec<Model>> {
    FILES
        .iter()
        .map(|text| robot(&serde_json::from_str(text)?))
        .collect()
}

fn robot(file: &RobotFile) -> anyhow::Result<Model> {
    let mut description =
        ModelDescription::new(&file.name).gravity(DVec3::from_array(file.gravity));
    for body in &file.bodies {
        let kind = match body.joint {
            RobotJoint::Fixed => JointKind::Fixed,
            RobotJoint::Revolute { axis } => JointKind::Revolute { axis: axis.into() },
            RobotJoint::Prismatic { axis } => JointKind::Prismatic { axis: axis.into() },
            RobotJoint::Free => JointKind::Free,
        };
        let placement = Pose::new(
            DQuat::from_mat3(&rows(&body.rotation)).normalize(),
            body.translation.into(),
        );
        let mass = MassProperties {
            mass: body.mass,
            center: body.com.into(),
            inertia: rows(&body.inertia_com),
        };
        let parent = usize::try_from(body.parent).ok();
        let parent = parent.and_then(|index| file.bodies.get(index));
        description = description.body(
            &body.name,
            parent.map(|parent| parent.name.as_str()),
            Joint::new(kind).at(placement),
            mass,
        );
    }
    Ok(description.build()?)
}

/// The reference puts linear before angular in the rates of free joints: where our entry of index
/// `dof` stands there.
fn reference_order(model: &Model) -> Vec<usize> {
    let mut order: Vec<usize> = (0..model.dof_count()).collect();
    for body in model.bodies() {
        if body.joint.kind == JointKind::Free {
            let start = body.dof_start;
            for k in 0..6 {
                order[start + k] = start + (k + 3) % 6;
            }
        }
    }
    order
}

fn reordered(values: &[f64], order: &[usize]) -> Vec<f64> {
    order.iter().map(|&index| values[index]).collect()
}

fn inputs(model: &Model, case: &RobotCase, order: &[usize]) -> (State, Forces) {
    let mut state = State::neutral(model);
    state.q.clone_from(&case.q);
    state.qd = reordered(&case.qd, order);
    let mut forces = Forces::none(model);
    forces.joint = reordered(&case.tau, order);
    let [fx, fy, fz, nx, ny, nz] = case.external_force_on_last_body_local;
    let wrench = Wrench::at_point([fx, fy, fz], DVec3::ZERO)
        .with_torque([nx, ny, nz])
        .in_body_axes();
    forces.push(model.last_body(), wrench);
    (state, forces)
}

fn for_each_case(
    mut check: impl FnMut(&str, &Model, &RobotCase, &State, &Forces, &[usize]) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    for text in FILES {
        let file: RobotFile = serde_json::from_str(text)?;
        let model = robot(&file)?;
        let order = reference_order(&model);
        for (number, case) in file.cases.iter().enumerate() {
            // All files but one have all figures: none may go missing unnoticed.
            let complete = case.momentum_linear.is_some()
                && case.momentum_angular_about_com.is_some()
                && case.placements.as_ref().map(Vec::len) == Some(file.bodies.len());
            anyhow::ensure!(
                complete || file.name == "humanoid27",
                "{}: momenta or placements are missing",
                file.name
            );
            let (state, forces) = inputs(&model, case, &order);
            let name = format!("{} case {number}", file.name);
            check(&name, &model, case, &state, &forces, &order)?;
        }
    }
    Ok(())
}

/// Joint accelerations: 1e-9 in f64 and more; in f32 16 eps a degree of freedom.
///
/// # Errors
/// If a robot cannot be solved.
pub fn joint_accelerations(solver: &dyn Solver) -> Outcome {
    let mut figures = Vec::new();
    for_each_case(|name, model, case, state, forces, order| {
        #[expect(clippy::cast_precision_loss, reason = "a size in a bound")]
        let bound = match solver.precision() {
            Precision::F64 | Precision::Reference => TOLERANCE,
            Precision::F32 => 16.0 * model.dof_count() as f64 * Precision::F32.epsilon(),
        };
        let qdd = solver.solve(model, state, forces)?;
        let reference = reordered(&case.qdd, order);
        figures.push(Figure::new(name, relative_error(&qdd, &reference), bound));
        Ok(())
    })?;
    Ok(figures)
}

/// Bias torques, mass matrix, energies, momenta, centre of mass and placements, in f64.
///
/// # Errors
/// If a robot cannot be computed.
pub fn quantities() -> Outcome {
    let mut figures = Vec::new();
    for_each_case(|name, model, case, state, _, order| {
        let mut record = |what: &str, found: &[f64], reference: &[f64]| {
            let error = relative_error(found, reference);
            figures.push(Figure::new(format!("{name} {what}"), error, TOLERANCE));
        };
        let mut workspace = Workspace::of_tree(model, Precision::F64);
        let still = vec![0.0; model.dof_count()];
        let bias = rnea(model, state, &still, &Forces::none(model), &mut workspace)?;
        record("bias torque", bias, &reordered(&case.bias_torque, order));

        let mass = crba(model, state, &mut workspace)?;
        let mut found = Vec::new();
        let mut reference = Vec::new();
        for (i, &row) in order.iter().enumerate() {
            for (j, &column) in order.iter().enumerate() {
                found.push(mass[(i, j)]);
                reference.push(case.mass_matrix[row][column]);
            }
        }
        record("mass matrix", &found, &reference);

        let sums = mechanics(model, state, &mut workspace)?;
        record(
            "kinetic energy",
            &[sums.kinetic_energy],
            &[case.kinetic_energy],
        );
        record(
            "potential energy",
            &[sums.potential_energy],
            &[case.potential_energy],
        );
        record("centre of mass", &sums.center.to_array(), &case.com);
        if let Some(momentum) = &case.momentum_linear {
            record(
                "linear momentum",
                &sums.linear_momentum.to_array(),
                momentum,
            );
        }
        if let Some(momentum) = &case.momentum_angular_about_com {
            record(
                "angular momentum",
                &sums.angular_momentum.to_array(),
                momentum,
            );
        }
        forward_kinematics(model, state, &mut workspace)?;
        let placements = case.placements.iter().flatten();
        for (id, placement) in model.body_ids().zip(placements) {
            let pose = workspace.pose(id)?;
            record_placement(&mut record, id, &pose, placement);
        }
        Ok(())
    })?;
    Ok(figures)
}

fn record_placement(
    record: &mut impl FnMut(&str, &[f64], &[f64]),
    id: BodyId,
    pose: &Pose,
    placement: &RobotPlacement,
) {
    let rotation = pose.matrix().transpose().to_cols_array();
    let reference = placement.rotation.concat();
    record(&format!("rotation of body {}", id.0), &rotation, &reference);
    record(
        &format!("position of body {}", id.0),
        &pose.translation.to_array(),
        &placement.translation,
    );
}
