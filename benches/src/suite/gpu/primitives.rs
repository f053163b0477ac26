//! The primitives of `vertebra_shaders`, each against its twin on the CPU.

use super::{holds, is_software};
use crate::replay::{Replay, write_failure};
use crate::suite::{Figure, Outcome};
use anyhow::bail;
use oorandom::Rand32;
use vertebra_gpu::Device;
use vertebra_gpu::twin::{Named, Twin, Values};
use vertebra_gpu::wgpu::Features;
use vertebra_shaders::{Rows, Sort, twins};

/// Lengths around the sizes of workgroups and tiles, and beyond one and two levels of tiles.
fn lengths(device: &Device) -> Vec<usize> {
    let mut lengths = vec![
        0, 1, 2, 31, 255, 256, 257, 1023, 1024, 1025, 3071, 3073, 4097, 100_003, 1_048_577,
    ];
    if !is_software(device) {
        lengths.push(10_000_000);
    }
    lengths
}

/// Words that are hard on something: all alike, in order, in reverse, few of them, only high bits.
fn patterns(len: usize, rng: &mut Rand32) -> Vec<(&'static str, Vec<u32>)> {
    let index = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
    let mut fill = |value: &mut dyn FnMut(usize, &mut Rand32) -> u32| {
        (0..len).map(|i| value(i, rng)).collect::<Vec<u32>>()
    };
    vec![
        ("random", fill(&mut |_, rng| rng.rand_u32())),
        ("equal", fill(&mut |_, _| 0xffff_ffff)),
        ("in order", fill(&mut |i, _| index(i))),
        ("in reverse", fill(&mut |i, _| u32::MAX - index(i))),
        ("few", fill(&mut |_, rng| rng.rand_range(0..3))),
        ("high bits", fill(&mut |_, rng| rng.rand_u32() << 28)),
    ]
}

/// Compares a twin on one input; a failure is written to a file that `replay` reads.
fn compare(device: &Device, twin: &Twin, label: &str, inputs: Vec<Named>) -> Outcome {
    let (comparisons, failures) = twin.compare(device, &inputs)?;
    if failures.is_empty() && comparisons.iter().all(|c| c.passes()) {
        let figure = |c: vertebra_gpu::twin::Comparison| {
            Figure::new(format!("{} {label}", c.stage), c.error, c.tolerance)
        };
        return Ok(comparisons.into_iter().map(figure).collect());
    }
    let path = write_failure(&Replay::new(twin, device, inputs))?;
    let wrong = comparisons.iter().find(|c| !c.passes());
    bail!(
        "{} {label} differs from the CPU ({}); see `vertebra-bench replay {} --dump {}`",
        twin.name,
        wrong.map_or_else(
            || failures[0].to_string(),
            |c| format!(
                "stage {} is off by {:e}, first at element {}",
                c.stage,
                c.error,
                c.first_difference.unwrap_or(0)
            )
        ),
        path.display(),
        wrong.map_or("STAGE", |c| &c.stage)
    )
}

/// Compares a twin of words on all lengths and patterns.
fn on_words(
    device: &Device,
    twin: &Twin,
    inputs: impl Fn(Vec<u32>, &mut Rand32) -> Vec<Named>,
) -> Outcome {
    let mut rng = Rand32::new(5);
    let mut figures = Vec::new();
    for len in lengths(device) {
        // Of large inputs, the first is enough.
        let count = if len > 5000 { 1 } else { usize::MAX };
        for (name, words) in patterns(len, &mut rng).into_iter().take(count) {
            let inputs = inputs(words, &mut rng);
            figures.extend(compare(device, twin, &format!("{len} {name}"), inputs)?);
        }
    }
    Ok(figures)
}

pub(super) fn scan(device: &Device) -> Outcome {
    on_words(device, &twins::SCAN, |words, _| {
        vec![Named::new("data", words)]
    })
}

pub(super) fn affine_scan(device: &Device) -> Outcome {
    on_words(device, &twins::AFFINE_SCAN, |words, _| {
        vec![Named::new("data", words)]
    })
}

pub(super) fn reduce(device: &Device) -> Outcome {
    let mut rng = Rand32::new(6);
    let mut figures = Vec::new();
    let mut twins = vec![&twins::REDUCE_F32];
    if device.features().contains(Features::SHADER_F64) {
        twins.push(&twins::REDUCE_F64);
    }
    for twin in twins {
        for len in lengths(device) {
            let data: Vec<f32> = (0..len).map(|_| rng.rand_float() - 0.3).collect();
            let data = if twin.features.is_empty() {
                Values::F32(data)
            } else {
                Values::F64(data.into_iter().map(|x| f64::from(x) * 1e200).collect())
            };
            let inputs = vec![Named::new("data", data)];
            let label = format!("{} {len}", twin.name);
            figures.extend(compare(device, twin, &label, inputs)?);
        }
    }
    Ok(figures)
}

/// Pairs whose values tell equal keys apart.
fn pairs(keys: Vec<u32>) -> Vec<Named> {
    let values: Vec<u32> = (0..).take(keys.len()).collect();
    vec![Named::new("keys", keys), Named::new("values", values)]
}

pub(super) fn sort(device: &Device) -> Outcome {
    let mut figures = on_words(device, &twins::SORT, |keys, _| pairs(keys))?;
    let mut rng = Rand32::new(7);
    for bits in [0, 1, 5, 8, 9, 24, 30] {
        let mut inputs = pairs((0..5000).map(|_| rng.rand_u32()).collect());
        inputs.push(Named::new("bits", vec![bits]));
        figures.extend(compare(
            device,
            &twins::SORT,
            &format!("{bits} bits"),
            inputs,
        )?);
    }
    Ok(figures)
}

/// Every shape of the sort that the device can run, not only the one it is fastest with.
pub(super) fn sort_shapes(device: &Device) -> Outcome {
    let mut rng = Rand32::new(8);
    let mut figures = Vec::new();
    for (number, rows) in (0..).zip(Rows::ALL) {
        for items in Sort::ITEMS {
            if !Sort::new(rows, items).fits(device) {
                continue;
            }
            for len in [2, 1000, 20_011] {
                let mut inputs = pairs((0..len).map(|_| rng.rand_u32() >> 7).collect());
                inputs.push(Named::new("shape", vec![number, items]));
                let label = format!("{len} {rows:?} {items}");
                figures.extend(compare(device, &twins::SORT, &label, inputs)?);
            }
        }
    }
    Ok(figures)
}

pub(super) fn compact(device: &Device) -> Outcome {
    on_words(device, &twins::COMPACT, |values, rng| {
        // Flags are any word that is not zero.
        let flag = |_: &u32| rng.rand_u32() * rng.rand_range(0..2);
        let flags: Vec<u32> = values.iter().map(flag).collect();
        vec![Named::new("flags", flags), Named::new("values", values)]
    })
}

pub(super) fn histogram(device: &Device) -> Outcome {
    let mut figures = Vec::new();
    // On chip, at the most that is, and beyond it.
    for bins in [1, 100, 2048, 2049, 70_000] {
        figures.extend(on_words(device, &twins::HISTOGRAM, |words, _| {
            let keys: Vec<u32> = words.iter().map(|word| word % bins).collect();
            vec![Named::new("keys", keys), Named::new("bins", vec![bins])]
        })?);
    }
    Ok(figures)
}

/// Two devices, the same bits: nothing depends on which workgroup comes first.
pub(super) fn same_bits(device: &Device) -> Outcome {
    let mut rng = Rand32::new(9);
    let data: Vec<f32> = (0..200_003).map(|_| rng.rand_float() - 0.5).collect();
    let keys: Vec<u32> = (0..200_003).map(|_| rng.rand_u32()).collect();
    let again = device.reopen()?;
    let mut figures = Vec::new();
    let cases = [
        (&twins::REDUCE_F32, vec![Named::new("data", data)]),
        (&twins::SORT, pairs(keys)),
    ];
    for (twin, inputs) in cases {
        let (first, _) = twin.compare(device, &inputs)?;
        for run in 1..4 {
            let (other, _) = twin.compare(if run % 2 == 0 { device } else { &again }, &inputs)?;
            figures.push(holds(
                format!("{} run {run}", twin.name),
                first.iter().zip(&other).all(|(a, b)| a.gpu == b.gpu),
            ));
        }
    }
    Ok(figures)
}
