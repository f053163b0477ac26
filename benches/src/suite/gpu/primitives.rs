//! The primitives of `vertebra_shaders`, each against its twin on the CPU.

use super::{holds, is_software};
use crate::replay::{fault, replay};
use crate::suite::{Figure, Outcome};
use anyhow::{Context, bail};
use bytemuck::Pod;
use oorandom::Rand32;
use std::path::PathBuf;
use vertebra_gpu::capture::Capture;
use vertebra_gpu::twin::{Comparison, Named, Twin, Values};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Error, Recording};
use vertebra_shaders::{Operator, Precision, Reduce, Rows, Scan, ScanKind, Sort, twins};

/// Lengths around the sizes of workgroups and tiles, and beyond one and two levels of tiles.
fn lengths(device: &Device) -> Vec<usize> {
    let mut lengths = vec![
        0, 1, 2, 31, 255, 256, 257, 1023, 1024, 1025, 3072, 3073, 4095, 4096, 4097, 100_003,
        1_048_577,
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

/// Compares a twin on one input. Whatever goes wrong, a wrong result or none at all, the inputs are
/// written to a file that `replay` reads.
fn compare(device: &Device, twin: &Twin, label: &str, inputs: &[Named]) -> Outcome {
    let reason = match twin.compare(device, inputs) {
        Ok((comparisons, failures)) => match fault(&comparisons, &failures) {
            None => {
                let figure = |c: Comparison| {
                    Figure::new(format!("{} {label}", c.stage), c.error, c.tolerance)
                };
                return Ok(comparisons.into_iter().map(figure).collect());
            }
            Some(reason) => reason,
        },
        Err(error) => error.to_string(),
    };
    let path = twin
        .capture(device, inputs, &reason)?
        .write(&std::env::temp_dir())?;
    Err(Captured {
        what: format!("{} {label}", twin.name),
        reason,
        path,
    }
    .into())
}

/// What went wrong, and where its inputs are.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {reason}; see `vertebra-bench replay {} --dump STAGE`", .path.display())]
struct Captured {
    what: String,
    reason: String,
    path: PathBuf,
}

/// Stages that fail and recordings that are refused leave a file, which replays as it happened.
pub(super) fn failures_are_captured(device: &Device) -> Outcome {
    let keys = Named::new("keys", vec![1_u32, 9, 2]);
    let bins = Named::new("bins", vec![4_u32]);
    let values = Named::new("values", vec![1_u32, 2]);
    let flags = Named::new("flags", vec![1_u32]);
    let mut figures = Vec::new();
    for (twin, inputs, reason, runs) in [
        (&twins::HISTOGRAM, [keys, bins], "`keys` at element 1", true),
        (&twins::COMPACT, [flags, values], "equally many", false),
    ] {
        let Err(error) = compare(device, twin, "planted", &inputs) else {
            bail!("{} found nothing wrong", twin.name);
        };
        let Captured { path, .. } = error.downcast_ref().context("no file was written")?;
        let capture = Capture::read(path)?;
        figures.push(holds(
            format!("inputs of {}", twin.name),
            capture.inputs::<Vec<Named>>()? == inputs && capture.reason.contains(reason),
        ));
        let replayed = replay(path, None, 1);
        figures.push(holds(
            format!("replay of {}", twin.name),
            if runs {
                matches!(replayed, Ok(false))
            } else {
                replayed.is_err()
            },
        ));
        std::fs::remove_file(path)?;
    }
    Ok(figures)
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
            figures.extend(compare(device, twin, &format!("{len} {name}"), &inputs)?);
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

/// Sums of numbers, which the CPU rounds in the same order.
pub(super) fn float_scan(device: &Device) -> Outcome {
    on_numbers(device, [&twins::SCAN_F32, &twins::SCAN_F64])
}

pub(super) fn reduce(device: &Device) -> Outcome {
    on_numbers(device, [&twins::REDUCE_F32, &twins::REDUCE_F64])
}

/// Compares a twin of numbers on all lengths, and the one of f64 where the device has it: there of
/// numbers that f32 could not hold.
fn on_numbers(device: &Device, [single, double]: [&Twin; 2]) -> Outcome {
    let mut rng = Rand32::new(6);
    let mut figures = Vec::new();
    for len in lengths(device) {
        let data: Vec<f32> = (0..len).map(|_| rng.rand_float() - 0.3).collect();
        let large: Vec<f64> = data.iter().map(|&x| f64::from(x) * 1e200).collect();
        let mut cases = vec![(single, Values::F32(data))];
        if device.features().contains(double.features) {
            cases.push((double, Values::F64(large)));
        }
        for (twin, data) in cases {
            let label = format!("{} {len}", twin.name);
            figures.extend(compare(device, twin, &label, &[Named::new("data", data)])?);
        }
    }
    Ok(figures)
}

/// An operator of one's own, by composition: maps x -> a x + b with a = 1 or -1, which do not commute
/// and are exact in either precision.
pub(super) fn own_operator(device: &Device) -> Outcome {
    const MAPS: &str = "
        alias Element = vec2<real>;
        fn identity() -> Element { return Element(1, 0); }
        fn combine(f: Element, g: Element) -> Element {
            return Element(g.x * f.x, g.x * f.y + g.y);
        }";
    fn run<T: Pod + PartialEq>(
        device: &Device,
        precision: Precision,
        from: fn(i8) -> T,
        then: fn([T; 2], [T; 2]) -> [T; 2],
    ) -> Outcome {
        let operator = Operator::new::<[T; 2]>(MAPS).in_precision(precision);
        let mut rng = Rand32::new(11);
        let mut sign = |up: f32| if rng.rand_float() < up { 1 } else { -1 };
        let mut figures = Vec::new();
        for len in lengths(device) {
            let maps: Vec<[T; 2]> = (0..len)
                .map(|_| [from(sign(0.9)), from(sign(0.5))])
                .collect();
            let mut recording = Recording::new("own operator");
            let data = recording.buffer_from("maps", &maps);
            let result = recording.buffer::<[T; 2]>("before", len);
            let all = recording.buffer::<[T; 2]>("all", 1);
            let kind = ScanKind::Exclusive;
            Scan::new(&operator).record(&mut recording, data, result, kind);
            Reduce::new(&operator).record(&mut recording, data, all);
            recording.download(result);
            recording.download(all);
            let output = device.prepare(&recording)?.run()?.wait()?;
            let mut running = [from(1), from(0)];
            let mut expected = Vec::with_capacity(len);
            for &map in &maps {
                expected.push(running);
                running = then(running, map);
            }
            let label = |what: &str| format!("{what} {precision:?} {len}");
            figures.push(holds(label("scan"), output.read(result)? == expected));
            figures.push(holds(label("reduction"), output.read(all)? == [running]));
        }
        Ok(figures)
    }
    let mut figures = run(device, Precision::F32, f32::from, |f, g| {
        [g[0] * f[0], g[0] * f[1] + g[1]]
    })?;
    if device.features().contains(Features::SHADER_F64) {
        figures.extend(run(device, Precision::F64, f64::from, |f, g| {
            [g[0] * f[0], g[0] * f[1] + g[1]]
        })?);
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
            &inputs,
        )?);
    }
    Ok(figures)
}

/// Numbers of elements that only the device knows: none, tile edges, all, more than there are.
pub(super) fn counts_on_the_device(device: &Device) -> Outcome {
    let mut rng = Rand32::new(10);
    let mut figures = Vec::new();
    for len in [0_u32, 1, 1000, 5000, 300_000] {
        let near = [1, 1023, 1024, 1025, 3073, 4096, len.saturating_sub(1)];
        let mut counts = vec![0, len, len.saturating_add(7), u32::MAX];
        counts.extend(near.into_iter().filter(|count| *count < len));
        // One pass more or less leaves the result in the other buffer.
        let bits = 24 + 8 * (len % 2);
        for count in counts {
            let words: Vec<u32> = (0..len).map(|_| rng.rand_u32()).collect();
            let flags: Vec<u32> = words.iter().map(|word| word >> 31).collect();
            let count = Named::new("count", vec![count]);
            let data = || vec![Named::new("data", words.clone()), count.clone()];
            let mut sorted = pairs(words.clone());
            sorted.extend([count.clone(), Named::new("bits", vec![bits])]);
            let mut all_bits = pairs(words.clone());
            all_bits.push(count.clone());
            let kept = vec![
                Named::new("flags", flags),
                Named::new("values", words.clone()),
                count.clone(),
            ];
            let cases = [
                (&twins::SCAN, data()),
                (&twins::AFFINE_SCAN, data()),
                (&twins::SORT, sorted),
                (&twins::SORT, all_bits),
                (&twins::COMPACT, kept),
            ];
            for (twin, inputs) in cases {
                let label = format!("{} of {len}, count {:?}", twin.name, count.values);
                figures.extend(compare(device, twin, &label, &inputs)?);
            }
        }
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
                figures.extend(compare(device, &twins::SORT, &label, &inputs)?);
            }
        }
    }
    Ok(figures)
}

/// Where subgroups do not fill the rows of a shape, the sort says so instead of sorting wrongly.
pub(super) fn sort_in_a_wrong_shape(device: &Device) -> Outcome {
    let mut rng = Rand32::new(12);
    let keys: Vec<u32> = (0..5000).map(|_| rng.rand_u32()).collect();
    let mut expected = keys.clone();
    expected.sort_unstable();
    let mut figures = Vec::new();
    for rows in Rows::ALL {
        let sort = Sort::new(rows, 4);
        let mut recording = Recording::new("shape");
        let slots = ["keys", "values"].map(|name| recording.buffer_from(name, &keys));
        sort.record(&mut recording, slots[0], slots[1], 32);
        recording.download(slots[0]);
        if recording
            .check(&device.limits(), device.features())
            .is_err()
        {
            continue;
        }
        let result = device.prepare(&recording)?.run()?.wait();
        let holds_true = match result {
            Ok(output) => output.read(slots[0])? == expected,
            Err(Error::Failed { failures, .. }) => {
                !sort.fits(device) && failures.iter().all(|failure| failure.stage == "sort")
            }
            Err(error) => return Err(error.into()),
        };
        figures.push(holds(format!("{rows:?}"), holds_true));
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
    const LEN: usize = 200_003;
    let mut rng = Rand32::new(9);
    let data: Vec<f32> = (0..LEN).map(|_| rng.rand_float() - 0.5).collect();
    let words: Vec<u32> = (0..LEN).map(|_| rng.rand_u32()).collect();
    let flags: Vec<u32> = words.iter().map(|word| word & 1).collect();
    let again = device.reopen()?;
    let mut figures = Vec::new();
    let numbers = vec![Named::new("data", data)];
    let keys = words.iter().map(|word| word % 5000).collect::<Vec<u32>>();
    let cases = [
        (&twins::REDUCE_F32, numbers.clone()),
        (&twins::SCAN_F32, numbers),
        (&twins::SORT, pairs(keys.clone())),
        (
            &twins::COMPACT,
            vec![Named::new("flags", flags), Named::new("values", words)],
        ),
        (
            &twins::HISTOGRAM,
            vec![Named::new("keys", keys), Named::new("bins", vec![5000_u32])],
        ),
    ];
    for (twin, inputs) in cases {
        let (first, _) = twin.compare(device, &inputs)?;
        for run in 1..4 {
            let (other, _) = twin.compare(if run % 2 == 0 { device } else { &again }, &inputs)?;
            let mut stages = first.iter().zip(&other);
            figures.push(holds(
                format!("{} run {run}", twin.name),
                first.len() == other.len() && stages.all(|(a, b)| a.gpu.has_bits_of(&b.gpu)),
            ));
        }
    }
    Ok(figures)
}
