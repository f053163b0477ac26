//! What forward dynamics are expected to cost: constants measured by the benchmark, never at run time,
//! so that the same choice is made every time. Chains of 2048 to 2^20 bodies, Intel Xeon, 16 cores: ABA takes 145
//! to 205 ns a body in f64, divide and conquer 325 to 475 ns on one thread and 47 ns on 16 beyond 200 us.

use crate::{Algorithm, Precision};

/// Time of the articulated-body algorithm a body \[s\].
const ABA: [f64; 3] = [155e-9, 175e-9, 8e-6];

/// Time of divide and conquer a body on one thread \[s\].
const DCA: [f64; 3] = [360e-9, 400e-9, 20e-6];

/// Part of that which only one thread can do: checks, external forces, results in the model's order.
const SERIAL: f64 = 0.06;

/// Time to hand a round to several threads and wait for them \[s\].
const ROUND: f64 = 2.2e-6;

/// Time of a correction as part of a solution's: \[first, others\].
const CORRECTION: [[f64; 2]; 2] = [[0.36, 0.36], [0.36, 0.35]];

/// Time of a solution and so many corrections, as a multiple of the solution's.
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
pub(crate) fn corrected(algorithm: Algorithm, sweeps: usize) -> f64 {
    let [first, others] = CORRECTION[usize::from(algorithm == Algorithm::Dca)];
    match sweeps.checked_sub(1) {
        None => 1.0,
        Some(more) => 1.0 + first + others * more as f64,
    }
}

fn of(costs: [f64; 3], precision: Precision) -> f64 {
    match precision {
        Precision::F32 => costs[0],
        Precision::F64 => costs[1],
        Precision::Reference => costs[2],
    }
}

/// Time of the articulated-body algorithm \[s\].
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
pub(crate) fn aba(bodies: usize, precision: Precision) -> f64 {
    bodies as f64 * of(ABA, precision)
}

/// Time of divide and conquer \[s\] on so many threads, in an assembly tree of so many rounds.
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
pub(crate) fn dca(bodies: usize, rounds: usize, threads: usize, precision: Precision) -> f64 {
    let alone = bodies as f64 * of(DCA, precision);
    if threads <= 1 {
        return alone;
    }
    // Every round is gone through four times: rotations and forces, up and down.
    alone * (SERIAL + (1.0 - SERIAL) / threads as f64) + 4.0 * rounds as f64 * ROUND
}

/// Time of accelerations of a batch on a GPU \[s\]: a dispatch, then either the latency of each level or
/// the traffic of all bodies. An H100, f64: 23.7 us for 4096 of 7 bodies, 65.2 us for 8192 of 22 and 244 us for
/// 32 768 of these.
#[cfg(feature = "gpu")]
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
pub(crate) fn gpu_batch_time(items: usize, bodies: usize, levels: usize) -> f64 {
    13e-6 + (1.5e-6 * levels as f64).max(0.32e-9 * items as f64 * bodies as f64)
}

/// Time of a step of so many copies of a model on a GPU by divide and conquer \[s\]: rounds of one, memory of
/// all.
#[cfg(feature = "gpu")]
pub(crate) fn gpu_forest(items: usize, bodies: usize, precision: Precision) -> f64 {
    let one = gpu_step(bodies, precision, precision);
    one + gpu_memory(items.saturating_sub(1) * bodies, precision, precision)
}

/// Time of a batch on a GPU, in units of a body's: a lane does a body a level, and while there are
/// fewer warps of 32 lanes than hide each other's latency, more of them cost nothing. An H100 has 528 schedulers of warps,
/// about two and a half for each hide it.
#[cfg(feature = "gpu")]
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
pub(crate) fn gpu_batch(items: usize, levels: usize, lanes: u32, handoffs: usize) -> f64 {
    const WARPS: f64 = 1300.0;
    const HANDOFF: f64 = 0.2;
    let warps = (items as f64 / 32.0) * f64::from(lanes);
    (warps / WARPS).max(1.0) * (levels as f64 + HANDOFF * handoffs as f64 / f64::from(lanes))
}

/// Time of a step on a GPU by divide and conquer \[s\]: dispatches and the latency of each halving, then
/// memory of each body. An H100, chains of 128 to 2^20 bodies, one of 16 steps in a submission.
#[cfg(feature = "gpu")]
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
pub(crate) fn gpu_step(bodies: usize, chunks: Precision, tree: Precision) -> f64 {
    let [first, halving] = match (chunks, tree) {
        (Precision::F32, _) => [7.6e-6, 7.5e-6],
        (_, Precision::F32) => [16e-6, 8.3e-6],
        _ => [13e-6, 10.2e-6],
    };
    first + halving * (bodies.max(1) as f64).log2() + gpu_memory(bodies, chunks, tree)
}

#[cfg(feature = "gpu")]
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
fn gpu_memory(bodies: usize, chunks: Precision, tree: Precision) -> f64 {
    bodies as f64
        * match (chunks, tree) {
            (Precision::F32, _) => 0.6e-9,
            (_, Precision::F32) => 1.05e-9,
            _ => 1.4e-9,
        }
}

/// Time of a step on a GPU with so many corrections \[s\]. An H100, 128, 2048 and 65 536 bodies: the first takes 47 %, 45 % and
/// 51 % of a step; over joins in f32, where chunks are longer then, 111 %, 89 % and 68 %, and each further 58 %, 53 % and 41 %.
#[cfg(feature = "gpu")]
#[expect(clippy::cast_precision_loss, reason = "an estimate")]
pub(crate) fn gpu_refined_step(
    bodies: usize,
    chunks: Precision,
    tree: Precision,
    sweeps: usize,
) -> f64 {
    let [first, further] = if tree == chunks {
        [0.47, 0.47]
    } else {
        [0.9, 0.5]
    };
    let corrections = match sweeps.checked_sub(1) {
        None => 0.0,
        Some(more) => first + further * more as f64,
    };
    gpu_step(bodies, chunks, tree) * (1.0 + corrections)
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;

    /// Within a fifth of what was measured of steps on an H100, of batches within a third (`docs/gpu.md`).
    #[test]
    fn estimates_are_near_what_was_measured() {
        let (f32, f64) = (Precision::F32, Precision::F64);
        for (estimate, measured) in [
            (gpu_step(128, f32, f32), 60.1e-6),
            (gpu_step(2048, f32, f32), 90.0e-6),
            (gpu_step(65_536, f32, f32), 148e-6),
            (gpu_step(1 << 20, f32, f32), 0.84e-3),
            (gpu_step(128, f64, f32), 74.0e-6),
            (gpu_step(2048, f64, f32), 107e-6),
            (gpu_step(65_536, f64, f32), 217e-6),
            (gpu_step(1 << 20, f64, f32), 1.30e-3),
            (gpu_step(128, f64, f64), 84.2e-6),
            (gpu_step(2048, f64, f64), 125e-6),
            (gpu_step(65_536, f64, f64), 276e-6),
            (gpu_step(1 << 20, f64, f64), 1.98e-3),
            (gpu_refined_step(2048, f64, f32, 1), 206e-6),
            (gpu_refined_step(2048, f64, f32, 2), 264e-6),
            (gpu_refined_step(65_536, f64, f32, 2), 455e-6),
            (gpu_refined_step(128, f64, f64, 1), 126e-6),
            (gpu_refined_step(2048, f64, f64, 1), 183e-6),
            (gpu_refined_step(65_536, f64, f64, 1), 416e-6),
        ] {
            let ratio: f64 = estimate / measured;
            assert!((0.83..1.2).contains(&ratio), "{estimate:e} {measured:e}");
        }
        for (estimate, measured) in [
            (gpu_batch_time(8192, 22, 10), 65.2e-6),
            (gpu_batch_time(32_768, 22, 12), 244e-6),
            (gpu_batch_time(4096, 7, 7), 23.7e-6),
        ] {
            let ratio: f64 = estimate / measured;
            assert!((0.75..1.33).contains(&ratio), "{estimate:e} {measured:e}");
        }
        assert!(gpu_forest(1, 300, f64) == gpu_step(300, f64, f64));
        assert!(gpu_forest(8, 300, f64) < 1.1 * gpu_forest(1, 300, f64));
    }
}
