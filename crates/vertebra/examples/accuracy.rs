//! Speed beside error: forward dynamics of one chain in f32 and in f64. The forward error compares
//! with the reference precision; the residual needs none: it says how well a solution solves its own
//! equations.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

use std::time::Instant;
use vertebra::{
    Forces, Precision, State, Workspace, Wrench, aba, forward_error, generate, joint_wrenches,
    residual,
};

const LINKS: usize = 256;
const REPETITIONS: u32 = 500;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = generate::random_chain(LINKS, &generate::Rod::default(), 1)?;
    let state = State::random(&model, 2);
    let mut forces = Forces::none(&model);
    forces.push(model.last_body(), Wrench::at_center([0.0, 10.0, 0.0]));

    let mut exact = Workspace::new(&model, Precision::Reference);
    aba(&model, &state, &forces, &mut exact)?;

    println!("articulated-body algorithm, {LINKS} links, mean of {REPETITIONS} calls");
    println!("precision   time of a call   forward error   residual");
    for precision in [Precision::F64, Precision::F32] {
        let mut workspace = Workspace::new(&model, precision);
        let start = Instant::now();
        for _ in 0..REPETITIONS {
            aba(&model, &state, &forces, &mut workspace)?;
        }
        let time = start.elapsed().as_secs_f64() / f64::from(REPETITIONS);
        joint_wrenches(&mut workspace)?;
        let residual = residual(&model, &state, &forces, &workspace)?.max();
        let forward = forward_error(workspace.joint_accelerations()?, &exact)?;
        println!(
            "{precision:<9} {:>13.1} us {forward:>15.1e} {residual:>10.1e}",
            1e6 * time
        );
    }
    Ok(())
}
