//! Touching triangles on the device, and who computes.

use super::collision::{compare, pose, soup};
use super::{holds, is_software};
use crate::scenario::tableware;
use crate::suite::{Figure, Outcome, gold_meshes};
use oorandom::Rand32;
use vertebra::collision::gpu::{Collider, MeshPair, Processor, Query};
use vertebra::glam::Vec3;
use vertebra::{Pose, TriangleMesh};
use vertebra_gpu::Device;

/// Pairs that touch in a corner, in a point of a side, or nearly, each in a cell of its own; scales of y differ by 2^40.
fn touching(count: usize, unit: f32) -> anyhow::Result<[TriangleMesh; 2]> {
    let mut rng = Rand32::new(8);
    let mut corners = [Vec::new(), Vec::new()];
    for i in 0..count {
        let cell = Vec3::new((i % 256) as f32, 0.0, (i / 256) as f32) * 16.0;
        let scale = 2.0_f32.powi(i32::try_from(i % 40)? - 20);
        let mut corner = || {
            let mut step = || rng.rand_range(0..13) as f32;
            (cell + Vec3::new(step(), step() * scale, step())) * unit
        };
        let [p, q, r, s, t] = [(); 5].map(|()| corner());
        corners[0].push([p, q, r]);
        corners[1].push(match i % 3 {
            0 => [0.5 * (p + q), s, t],
            1 => [s, q, t],
            _ => [t, s, 0.5 * (q + r)],
        });
    }
    let [mut a, mut b] = corners.map(Vec::into_iter);
    Ok([
        soup(count, || a.next().unwrap_or_default())?,
        soup(count, || b.next().unwrap_or_default())?,
    ])
}

/// So many pairs that single precision cannot tell that the device settles them in integers.
pub(super) fn contacts(device: &Device) -> Outcome {
    // In software one unit does: the collision crate's own tests have both.
    let (count, units): (_, &[f32]) = if is_software(device) {
        (6000, &[1.1e-3])
    } else {
        (100_000, &[1.0, 1.1e-3])
    };
    let mut figures = Vec::new();
    for &unit in units {
        let [a, b] = touching(count, unit)?;
        let name = format!("contacts in units of {unit:e}");
        figures.extend(compare(device, &name, [&a, &b], Pose::IDENTITY)?);
        let (on_a, on_b) = (Collider::new(device, a)?, Collider::new(device, b)?);
        let query = Query::new(&on_a, &on_b)?;
        // The first question finds out how many there are.
        query.count()?;
        let statistics = query.statistics()?;
        let name = format!("on the host, of {} undecided", statistics.undecided);
        let most = 0.5 * statistics.undecided as f64;
        figures.push(Figure::new(name, statistics.on_host as f64, most));
    }
    Ok(figures)
}

/// The same answers by whichever processor.
pub(super) fn choice(device: &Device) -> Outcome {
    let mut rng = Rand32::new(9);
    let (a, b) = (tableware::sphere()?, tableware::cylinder()?);
    let pair = |asked| MeshPair::new(Some(device), a.clone(), b.clone(), asked);
    let mut pairs = [
        pair(Some(Processor::Cpu))?,
        pair(Some(Processor::Gpu))?,
        pair(None)?,
    ];
    let mut figures = Vec::new();
    for turn in 0..5 {
        let at = pose(&mut rng, 0.5);
        for pair in &mut pairs {
            pair.set_pose_b(at)?;
        }
        let [cpu, gpu, chosen] = &pairs;
        let expected = cpu.pairs()?;
        for pair in [gpu, chosen] {
            let (too_many, too_few) = gold_meshes::wrong_pairs(&pair.pairs()?, &expected);
            let name = format!("pose {turn}, {} pairs {}", expected.len(), pair.choice());
            figures.push(Figure::new(name, (too_many + too_few) as f64, 0.0));
        }
    }
    let [_, gpu, _] = &pairs;
    let forced = gpu.choice().processor == Processor::Gpu;
    figures.push(holds("the GPU as asked", forced));
    Ok(figures)
}
