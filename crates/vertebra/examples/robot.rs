//! A robot from URDF: what is read but not simulated, its mass matrix, and the torques that hold it
//! up against gravity, which forward dynamics then confirms.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

use vertebra::assembly::urdf::{self, Options};
use vertebra::{Forces, Precision, State, Workspace, aba, crba, joint_wrenches, residual, rnea};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // From a file: `urdf::read(path, &options)`.
    let robot = urdf::parse(include_str!("gripper.urdf"), &Options::default())?;
    let model = &robot.model;
    println!("robot `{}`:", model.name());
    for (joint, id) in &robot.joints {
        if let Some(body) = model.body(*id) {
            println!(
                "  joint `{joint}` carries `{}`: {:?}",
                body.name, body.joint.kind
            );
        }
    }
    for frame in model.frames() {
        let carrier = frame.body.and_then(|id| model.body(id));
        let carrier = carrier.map_or("the world", |body| body.name.as_str());
        println!("  link `{}` is fixed to {carrier}", frame.name);
    }
    for element in &robot.ignored {
        println!("  {element}");
    }
    for property in model.not_simulated() {
        println!("  {property}");
    }

    // The fingers mimic each other; mass matrix and forces are those of the tree without that.
    let mut workspace = Workspace::of_tree(model, Precision::F64);
    let mut state = State::neutral(model);
    state.q.fill(0.05); // [rad, m]
    println!("mass matrix:");
    let mass = crba(model, &state, &mut workspace)?;
    for row in mass.row_iter() {
        let row: Vec<String> = row.iter().map(|entry| format!("{entry:8.4}")).collect();
        println!("  {}", row.join(" "));
    }

    let mut forces = Forces::none(model);
    let still = vec![0.0; model.dof_count()];
    forces.joint = rnea(model, &state, &still, &forces, &mut workspace)?.to_vec();
    println!("joint forces at rest [N m, N]: {:.4?}", forces.joint);
    let qdd = aba(model, &state, &forces, &mut workspace)?;
    let largest = qdd.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    println!("with these it accelerates by {largest:.1e} rad/s^2 at most");
    joint_wrenches(&mut workspace)?;
    let residual = residual(model, &state, &forces, &workspace)?;
    println!("residual of the equations: {:.1e}", residual.max());
    Ok(())
}
