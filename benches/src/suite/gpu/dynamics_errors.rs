//! Errors of divide and conquer on a device over sizes, seeds and shapes, and whether it loses digits that
//! the same algorithm has on the CPU.

use super::dynamics::{inputs, options, precisions};
use super::is_software;
use crate::suite::{Figure, Outcome, relative_error, worst_of};
use vertebra::dynamics::gpu::{Options, Simulation};
use vertebra::generate::{self, Masses, RandomTree, Rod};
use vertebra::glam::DVec3;
use vertebra::{
    DcaOptions, DcaWorkspace, Error, Forces, Joint, MassProperties, Model, ModelDescription, Pose,
    Precision, Random, State, Workspace, aba, dca,
};
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::Features;

/// Sizes of the table of errors, and how many seeds of each: one and two bodies, odd numbers, chains of
/// many rounds. Those beyond a thousand are for hardware.
const SIZES: [(usize, u64); 10] = [
    (1, 16),
    (2, 16),
    (3, 16),
    (5, 16),
    (33, 16),
    (127, 16),
    (1000, 8),
    (2047, 16),
    (10_000, 8),
    (65_536, 4),
];

/// Seeds of the comparison with the CPU, and bodies of its chains.
const SEEDS: u64 = 64;
const BODIES: usize = 2048;

/// Joints of a chunk of that comparison, on both sides.
const WINDOW: usize = 4;

/// A bound for a thousand bodies, for chains of so many: errors walk at random. The default stays below
/// 1e-4 up to 65 536.
fn bound_for(bound: f64, bodies: usize) -> f64 {
    let grown = bound * (bodies as f64 / 1000.0).sqrt().max(1.0);
    if bodies <= 65_536 && (1e-6..1e-4).contains(&bound) {
        return grown.min(1e-4);
    }
    grown
}

fn exact(model: &Model, state: &State, forces: &Forces) -> Result<Vec<f64>, Error> {
    let mut reference = Workspace::new(model, Precision::Reference);
    Ok(aba(model, state, forces, &mut reference)?.to_vec())
}

/// The largest error over seeds for each size, by precisions.
pub(super) fn seeds(device: &Device) -> Outcome {
    let largest = if is_software(device) {
        1000
    } else {
        usize::MAX
    };
    let mut figures = Vec::new();
    for (count, seeds) in SIZES.into_iter().filter(|&(count, _)| count <= largest) {
        let list = precisions(device);
        let mut worst = vec![0.0_f64; list.len()];
        for seed in 0..seeds {
            let model = generate::random_chain(count, &Rod::default(), 100 * seed)?;
            let (state, forces) = inputs(&model, 100 * seed + 1)?;
            let exact = exact(&model, &state, &forces)?;
            for (&(chunks, tree, _), worst) in list.iter().zip(&mut worst) {
                let mut simulation = Simulation::on(device, &model, &options(chunks, tree, 8))?;
                simulation.set_state(&state)?;
                simulation.set_forces(&forces)?;
                let error = relative_error(&simulation.accelerations()?, &exact);
                *worst = worst_of(*worst, error);
            }
        }
        for ((chunks, tree, bound), worst) in list.into_iter().zip(worst) {
            let name = format!("{count} bodies, {seeds} seeds, {chunks} over {tree}");
            figures.push(Figure::new(name, worst, bound_for(bound, count)));
        }
    }
    Ok(figures)
}

/// Errors in f32 over many seeds beside those of the CPU in the same precision and chunks: a device whose
/// driver approximates an operation shows in the median.
pub(super) fn f32_seeds(device: &Device) -> Outcome {
    let mut errors = [Vec::new(), Vec::new()];
    let single = Precision::F32;
    for seed in 0..SEEDS {
        let model = generate::random_chain(BODIES, &Rod::default(), seed)?;
        let (state, forces) = (State::random(&model, seed + 1), Forces::none(&model));
        let exact = exact(&model, &state, &forces)?;
        let options = options(single, single, WINDOW);
        let mut simulation = Simulation::on(device, &model, &options)?;
        simulation.set_state(&state)?;
        errors[0].push(relative_error(&simulation.accelerations()?, &exact));
        let mut twin = DcaWorkspace::new(
            &model,
            &DcaOptions {
                chunks: single,
                tree: single,
                schedule: options.schedule,
                parallel: false,
            },
        )?;
        errors[1].push(relative_error(
            dca(&model, &state, &forces, &mut twin)?,
            &exact,
        ));
    }
    for errors in &mut errors {
        errors.sort_by(f64::total_cmp);
    }
    let [device, cpu] = errors;
    let at = |errors: &[f64], percent: usize| errors[(errors.len() - 1) * percent / 100];
    // The largest of 64 is a matter of luck; half of them are not.
    let ratios = [
        ("median", 50, 2.0),
        ("90 %", 90, 3.0),
        ("largest", 100, 8.0),
    ];
    let figure = |(name, percent, ratio): (&str, usize, f64)| {
        let (found, expected) = (at(&device, percent), at(&cpu, percent));
        let name = format!("{name} of {SEEDS} seeds, {expected:.1e} on the CPU");
        Figure::new(name, found, ratio * expected)
    };
    Ok(ratios.map(figure).into())
}

/// Stars, bushes, combs, bodies that carry two each, and forests of chains of all lengths.
pub(super) fn shapes(device: &Device) -> Outcome {
    let software = is_software(device);
    let count = if software { 200 } else { 20_000 };
    let bush = RandomTree {
        reach: count,
        mixed: false,
        ..RandomTree::mixed(count)
    };
    let models = [
        ("star", generate::tree(count, count - 1, &Rod::default())?),
        (
            "bodies that carry two",
            generate::tree(count, 2, &Rod::default())?,
        ),
        ("bush", generate::random_tree(&bush, 1)?),
        ("comb", comb(count)?),
        (
            "forest",
            forest(&[1, 2, 3, count / 2, 1, 7, count / 4, 20])?,
        ),
    ];
    let mut list = precisions(device);
    if software && list.len() > 1 {
        // Each precision is half a minute of compiling there, and other checks have them all.
        list.truncate(2);
        list.swap_remove(0);
    }
    let mut figures = Vec::new();
    for (name, model) in models {
        let (state, forces) = inputs(&model, 5)?;
        let exact = exact(&model, &state, &forces)?;
        for &(chunks, tree, bound) in &list {
            let mut simulation = Simulation::on(device, &model, &options(chunks, tree, 8))?;
            simulation.set_state(&state)?;
            simulation.set_forces(&forces)?;
            let error = relative_error(&simulation.accelerations()?, &exact);
            let name = format!("{name} of {count}, {chunks} over {tree}");
            figures.push(Figure::new(name, error, bound_for(bound, count)));
        }
    }
    Ok(figures)
}

/// A spine of which every body carries another.
fn comb(count: usize) -> anyhow::Result<Model> {
    let parent = |index: usize| match index {
        0 => None,
        _ if index % 2 == 1 => Some(index - 1),
        _ => Some(index - 2),
    };
    grown(count, parent)
}

/// Chains of these lengths side by side.
fn forest(lengths: &[usize]) -> anyhow::Result<Model> {
    let mut starts = vec![0];
    for length in lengths {
        starts.push(starts[starts.len() - 1] + length);
    }
    let parent = |index: usize| (!starts.contains(&index)).then(|| index - 1);
    grown(lengths.iter().sum(), parent)
}

/// Rods on joints about random axes, each carried by the one that `parent` says.
fn grown(count: usize, parent: impl Fn(usize) -> Option<usize>) -> anyhow::Result<Model> {
    let mut random = Random::new(9);
    let mut description = ModelDescription::new("rods");
    let (name, rod) = (|index| format!("rod-{index}"), Rod::default());
    for index in 0..count {
        let joint = Joint::revolute(random.direction());
        let mass = MassProperties::rod(rod.mass, rod.length, rod.radius);
        let parent = parent(index).map(name);
        let joint = if parent.is_some() {
            joint.at(Pose::from_translation(DVec3::Z * rod.length))
        } else {
            joint
        };
        description = description.body(name(index), parent.as_deref(), joint, mass);
    }
    Ok(description.build()?)
}

/// Many levels in many workgroups: chains up to a million bodies on hardware. Where the device has no
/// place for one, it says how many bodies would fit, and those do.
pub(super) fn long_chain(device: &Device) -> Outcome {
    let counts: &[usize] = if is_software(device) {
        &[2000]
    } else {
        &[65_536, 1 << 20]
    };
    let mut figures = Vec::new();
    for &count in counts {
        let model = generate::random_chain(count, &Rod::default(), 1)?;
        let (state, forces) = inputs(&model, 2)?;
        let exact = exact(&model, &state, &forces)?;
        for (chunks, tree, bound) in precisions(device) {
            let mut simulation = Simulation::on(device, &model, &options(chunks, tree, 8))?;
            simulation.set_state(&state)?;
            simulation.set_forces(&forces)?;
            let error = relative_error(&simulation.accelerations()?, &exact);
            let name = format!("{count} bodies, {chunks} over {tree}");
            figures.push(Figure::new(name, error, bound_for(bound, count)));
        }
    }
    Ok(figures)
}

/// Corrected solutions: chains, uneven masses, trees of all joints, a long chain.
pub(super) fn refined(device: &Device) -> Outcome {
    if !device.features().contains(Features::SHADER_F64) {
        return Ok(vec![]);
    }
    let rod = Rod::default();
    let mut models = vec![("chain of 300", generate::random_chain(300, &rod, 1)?)];
    let masses = Masses::HeavyTips(1e8);
    models.push((
        "heavy tip",
        generate::uneven_tree(200, 1, &rod, &masses, 5)?,
    ));
    let masses = Masses::Decades(4.0);
    models.push((
        "4 decades",
        generate::uneven_tree(200, 4, &rod, &masses, 5)?,
    ));
    models.push((
        "tree of 500",
        generate::random_tree(&RandomTree::mixed(500), 3)?,
    ));
    let count = if is_software(device) { 2000 } else { 65_536 };
    models.push(("long chain", generate::random_chain(count, &rod, 1)?));
    let mut figures = Vec::new();
    for (name, model) in models {
        let (state, forces) = inputs(&model, 7)?;
        let mut reference = Workspace::new(&model, Precision::Reference);
        let exact = aba(&model, &state, &forces, &mut reference)?;
        for (sweeps, bound) in [(1, 1e-9), (2, 1e-10)] {
            let options = Options {
                sweeps,
                schedule: None,
                ..options(Precision::F64, Precision::F32, 8)
            };
            let mut simulation = Simulation::on(device, &model, &options)?;
            simulation.set_state(&state)?;
            simulation.set_forces(&forces)?;
            let error = relative_error(&simulation.accelerations()?, exact);
            let name = format!("{name}, {sweeps} of 2 corrections");
            figures.push(Figure::new(name, error, bound));
        }
    }
    Ok(figures)
}
