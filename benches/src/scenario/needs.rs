//! What a scene does not have, and what that saves: one chain, with more and less of everything.

use super::gpu::chains;
use super::model::{Read, Subject};
use super::{Measurement, Meter, Selection};
use vertebra::generate::{self, RandomTree, Rod};
use vertebra::{Precision, Wrench};
use vertebra_gpu::Device;

/// Name of the scenario on the command line.
pub const NAME: &str = "needs";

/// Bodies of the chain.
const BODIES: usize = 2048;

/// A chain pushed once, and what differs from it by one thing each.
///
/// # Errors
/// If a model cannot be made.
pub fn subjects(selection: &Selection) -> anyhow::Result<Vec<Subject>> {
    let (seed, rod) = (selection.seed, Rod::default());
    let named = |name: &str, model| Subject::new(&format!("needs: {name}"), model, seed);
    let hinges = generate::random_chain(BODIES, &rod, seed)?;
    let plain = named("hinges, one push", hinges.clone());
    let mut free = named("hinges, no push", hinges.clone());
    let mut pushed = named("hinges, a push on each body", hinges.clone());
    let mut still = named("hinges, at rest", hinges.clone());
    for (_, forces) in &mut free.inputs {
        forces.clear_external();
    }
    for (_, forces) in &mut pushed.inputs {
        for body in hinges.body_ids() {
            forces.push(body, Wrench::at_center([0.0, 0.0, 1.0]));
        }
    }
    for (state, _) in &mut still.inputs {
        state.qd.fill(0.0);
    }
    let all_joints = RandomTree {
        reach: 1,
        ..RandomTree::mixed(BODIES)
    };
    let mixed = named(
        "all kinds of joints, one push",
        generate::random_tree(&all_joints, seed)?,
    );
    Ok(vec![plain, free, pushed, still, mixed])
}

/// Whole steps of each on a GPU, in the highest precision that it has unless others are asked for; it computes all poses at the end of sixteen.
#[must_use]
pub fn on_gpu<'a>(
    subjects: &'a [Subject],
    device: &'a Device,
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let wanted = subjects.iter().filter(|_| selection.wants("step-16"));
    wanted
        .flat_map(|subject| chains::steps(subject, device, selection))
        .collect()
}

/// The rows of the CPU, in f64 unless another precision is asked for: forward dynamics of each, and steps of the first after
/// which no pose is read, one, or all.
#[must_use]
pub fn measurements<'a>(subjects: &'a [Subject], selection: &Selection) -> Vec<Measurement<'a>> {
    let precisions = match selection.precisions.is_empty() {
        true => vec![Precision::F64],
        false => selection.precisions.clone(),
    };
    let mut list = Vec::new();
    for precision in precisions {
        for subject in subjects.iter().filter(|_| selection.wants("aba")) {
            let run = move |meter: &Meter| subject.aba(meter, precision);
            let label = format!("{}: aba {precision}", subject.scenario);
            list.push(Measurement::new(label, run));
        }
        for subject in subjects.iter().take(1).filter(|_| selection.wants("step")) {
            for read in [Read::Nothing, Read::Last, Read::All] {
                let run = move |meter: &Meter| subject.step(meter, precision, read);
                let label = format!("{}: {} {precision}", subject.scenario, read.method());
                list.push(Measurement::new(label, run));
            }
        }
    }
    list
}
