//! The primitives of `vertebra_shaders`, each against its twin on the CPU.

use super::compare::{Computation, capture, compare, compare_own};
use super::{holds, is_software};
use crate::suite::Outcome;
use anyhow::bail;
use bytemuck::Pod;
use oorandom::Rand32;
use vertebra_gpu::twin::{Comparison, Named, Twin, Values};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Error, Recording};
use vertebra_shaders::{Operator, Precision, Reduce, Scan, ScanKind, Sort, twins};

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

/// Compares a twin of words on all lengths and patterns.
pub(super) fn on_words(
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
    let mut rng = Rand32::new(11);
    let mut sign = |up: f32| if rng.rand_float() < up { 1_i8 } else { -1 };
    let mut figures = Vec::new();
    for len in lengths(device) {
        let maps: Vec<i8> = (0..len).flat_map(|_| [sign(0.9), sign(0.5)]).collect();
        let mut cases = vec![Values::F32(maps.iter().map(|&x| x.into()).collect())];
        if device.features().contains(Features::SHADER_F64) {
            cases.push(Values::F64(maps.iter().map(|&x| x.into()).collect()));
        }
        for (values, precision) in cases.into_iter().zip(["f32", "f64"]) {
            let inputs = [Named::new("maps", values)];
            let label = format!("{precision} {len}");
            figures.extend(compare_own(device, &OWN_OPERATOR, &label, &inputs)?);
        }
    }
    Ok(figures)
}

/// Compositions of `maps`, a and b in turn: stages `before`, `all`.
pub(super) const OWN_OPERATOR: Computation = Computation {
    name: "own_operator",
    compare: |device, inputs| {
        let comparisons = match inputs {
            [
                Named {
                    values: Values::F32(maps),
                    ..
                },
            ] => compose(device, Precision::F32, maps, [1.0, 0.0], |f, g| {
                [g[0] * f[0], g[0] * f[1] + g[1]]
            }),
            [
                Named {
                    values: Values::F64(maps),
                    ..
                },
            ] => compose(device, Precision::F64, maps, [1.0, 0.0], |f, g| {
                [g[0] * f[0], g[0] * f[1] + g[1]]
            }),
            _ => bail!("own_operator takes `maps` in f32 or f64"),
        };
        Ok((comparisons?, Vec::new()))
    },
};

fn compose<T: Pod>(
    device: &Device,
    precision: Precision,
    maps: &[T],
    identity: [T; 2],
    then: fn([T; 2], [T; 2]) -> [T; 2],
) -> anyhow::Result<Vec<Comparison>>
where
    Values: From<Vec<T>>,
{
    const MAPS: &str = "
        alias Element = vec2<real>;
        fn identity() -> Element { return Element(1, 0); }
        fn combine(f: Element, g: Element) -> Element {
            return Element(g.x * f.x, g.x * f.y + g.y);
        }";
    let (maps, _) = maps.as_chunks::<2>();
    let operator = Operator::new::<[T; 2]>(MAPS).in_precision(precision);
    let mut recording = Recording::new("own operator");
    let data = recording.buffer_from("maps", maps);
    let before = recording.buffer::<[T; 2]>("before", maps.len());
    let all = recording.buffer::<[T; 2]>("all", 1);
    let kind = ScanKind::Exclusive;
    Scan::new(&operator).record(&mut recording, data, before, kind);
    Reduce::new(&operator).record(&mut recording, data, all);
    recording.download(before);
    recording.download(all);
    let output = device.prepare(&recording)?.run()?.wait()?;
    let mut running = identity;
    let mut expected = Vec::with_capacity(maps.len());
    for &map in maps {
        expected.push(running);
        running = then(running, map);
    }
    let flat = |maps: &[[T; 2]]| Values::from(maps.as_flattened().to_vec());
    let (found, found_all) = (flat(&output.read(before)?), flat(&output.read(all)?));
    Ok(vec![
        Comparison::new("before", flat(&expected), found, 0.0),
        Comparison::new("all", flat(&[running]), found_all, 0.0),
    ])
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
        (
            &twins::SORT,
            super::sorts::pairs(keys.clone(), &Sort::on(device)),
        ),
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
        let reason = match first_other_bits(&[device, &again], twin, &inputs) {
            Ok(None) => {
                figures.push(holds(twin.name, true));
                continue;
            }
            Ok(Some(run)) => format!("the bits of run {run} are not those of the first"),
            Err(error) => error.to_string(),
        };
        return Err(capture(device, twin.name, "again", &inputs, reason));
    }
    Ok(figures)
}

/// The first of some runs on devices in turn whose bits are not those of the run before them all.
fn first_other_bits(
    devices: &[&Device],
    twin: &Twin,
    inputs: &[Named],
) -> Result<Option<usize>, Error> {
    let (first, _) = twin.compare(devices[0], inputs)?;
    for run in 1..4 {
        let (other, _) = twin.compare(devices[run % devices.len()], inputs)?;
        let mut stages = first.iter().zip(&other);
        let alike = |(a, b): (&Comparison, &Comparison)| a.gpu.has_bits_of(&b.gpu);
        if first.len() != other.len() || !stages.all(alike) {
            return Ok(Some(run));
        }
    }
    Ok(None)
}
