//! The rows.

use super::bare::Bare;
use super::{Meter, row, sample};
use crate::row::Row;
use crate::suite::gpu::runtime::{STEP, step};
use crate::suite::relative_error;
use anyhow::Context;
use oorandom::Rand32;
use std::time::Instant;
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Recording, Slot, Timing, workgroups};
use vertebra_shaders::{Operator, Precision, Reduce, Scan, ScanKind, Sort, compact, histogram};

const DISPATCHES: usize = 20;
const WORDS: usize = 64;

/// Measures a primitive on so many elements.
pub(super) type Measure = fn(&Device, &Meter, usize) -> anyhow::Result<Option<Row>>;

/// The primitives by name.
pub(super) const PRIMITIVES: [(&str, Measure); 8] = [
    ("copy", copy),
    ("reduce-f32", reduce),
    ("scan-u32", scan),
    ("compact", compaction),
    ("histogram", histograms),
    ("sort-pairs", |device, meter, len| {
        sort(device, meter, len, "sort-pairs", &Sort::on(device))
    }),
    ("sort-pairs-portable", |device, meter, len| {
        sort(device, meter, len, "sort-pairs-portable", &Sort::portable())
    }),
    ("sort-pairs-counted", |device, meter, len| {
        let sort = Sort::on(device);
        sort_first(device, meter, [len, len / 16], "sort-pairs-counted", &sort)
    }),
];

/// Twenty small dependent dispatches, recorded or bare; on the device, or with submitting and
/// waiting.
pub(super) fn dispatches(
    device: &Device,
    meter: &Meter,
    method: &str,
    wall: bool,
) -> anyhow::Result<Option<Row>> {
    let mut recording = Recording::new("dispatches");
    let data = recording.buffer::<u32>("data", WORDS);
    for _ in 0..DISPATCHES {
        recording.dispatch(&STEP, &[data.any()], [1, 1, 1]);
    }
    let mut expected = vec![0_u32; WORDS];
    for _ in 0..DISPATCHES {
        step(&mut expected);
    }
    let (found, timing) = if method.ends_with("bare") {
        let bare = Bare::new(device, WORDS as u64, !wall);
        bare.run(DISPATCHES)?;
        let found = bare.result()?;
        (found, sample(meter, || bare.run(DISPATCHES))?)
    } else {
        let mut checked = recording.clone();
        checked.download(data);
        let found = device.prepare(&checked)?.run()?.wait()?.read(data)?;
        let mut program = device.prepare(&recording)?;
        let timing = if wall {
            sample(meter, || {
                let start = Instant::now();
                program.run()?.wait()?;
                Ok(start.elapsed().as_secs_f64())
            })?
        } else {
            program.take_times(Timing::Whole)?;
            sample(meter, || gpu_time(&program))?
        };
        (found, timing)
    };
    let method = format!("{method}{}", if wall { "-wall" } else { "" });
    Ok(timing.map(|timing| Row {
        error_forward: Some(mismatch(&found, &expected)),
        note: format!(
            "{:.2} us a dispatch",
            1e6 * timing.median_s / DISPATCHES as f64
        ),
        ..row(device, &method, DISPATCHES, "dispatches", &timing)
    }))
}

/// The part of a recording that is measured, and where its result is.
struct Recorded<T> {
    result: Slot<T>,
    /// How many elements of it mean something.
    len: usize,
}

/// Measures what `record` records, after checking its result. `bytes` are those it must move at
/// least, for a note.
fn measure<T: bytemuck::Pod>(
    device: &Device,
    meter: &Meter,
    (method, len, bytes): (&str, usize, usize),
    record: impl Fn(&mut Recording) -> Recorded<T>,
    error: impl FnOnce(&[T]) -> f64,
) -> anyhow::Result<Option<Row>> {
    let mut checked = Recording::new(method);
    let Recorded { result, len: used } = record(&mut checked);
    checked.download(result);
    let mut found = device.prepare(&checked)?.run()?.wait()?.read(result)?;
    found.truncate(used);
    let error_forward = Some(error(&found));
    let mut recording = Recording::new(method);
    record(&mut recording);
    let mut program = device.prepare(&recording)?;
    let has_times = device.features().contains(Features::TIMESTAMP_QUERY);
    if has_times {
        program.take_times(Timing::Whole)?;
    }
    let timing = sample(meter, || gpu_time(&program))?;
    let profile = if has_times {
        program.take_times(Timing::Dispatches)?;
        shares(&program.run()?.wait()?.dispatch_times())
    } else {
        String::new()
    };
    Ok(timing.map(|timing| Row {
        error_forward,
        note: format!(
            "{:.1} GB/s of {} bytes an element; {} dispatches{profile}",
            1e-9 * bytes as f64 / timing.median_s,
            bytes / len.max(1),
            recording.dispatches(),
        ),
        ..row(device, method, len, "elements", &timing)
    }))
}

/// Time of a run on the device \[s\], or of submitting and waiting where it takes no times.
fn gpu_time(program: &vertebra_gpu::Program) -> anyhow::Result<f64> {
    let start = Instant::now();
    let time = program.run()?.wait()?.gpu_time();
    Ok(time.unwrap_or_else(|| start.elapsed().as_secs_f64()))
}

/// The share of each kernel in the time of all.
pub(super) fn shares(times: &[(&str, f64)]) -> String {
    let mut kernels: Vec<(&str, f64)> = Vec::new();
    for (label, seconds) in times {
        let kernel = label.rsplit('.').next().unwrap_or(label);
        match kernels.iter_mut().find(|(name, _)| *name == kernel) {
            Some((_, sum)) => *sum += seconds,
            None => kernels.push((kernel, *seconds)),
        }
    }
    let parts = kernels
        .iter()
        .map(|(kernel, seconds)| format!(", {kernel} {:.0} us", 1e6 * seconds));
    parts.collect()
}

/// Share of elements that differ.
fn mismatch<T: PartialEq>(found: &[T], expected: &[T]) -> f64 {
    if found.len() != expected.len() {
        return 1.0;
    }
    let wrong = found.iter().zip(expected).filter(|(a, b)| a != b).count();
    wrong as f64 / found.len().max(1) as f64
}

fn words(len: usize) -> Vec<u32> {
    let mut rng = Rand32::new(1);
    (0..len).map(|_| rng.rand_u32()).collect()
}

/// The bandwidth of the device: what the others are held against. Dispatches around the copies take
/// the time.
fn copy(device: &Device, meter: &Meter, len: usize) -> anyhow::Result<Option<Row>> {
    const TIMES: usize = 10;
    let data = words(len);
    let record = |recording: &mut Recording| {
        let from = recording.buffer_from("from", &data);
        let to = recording.buffer::<u32>("to", len);
        let small = recording.buffer::<u32>("small", WORDS);
        recording.dispatch(&STEP, &[small.any()], [1, 1, 1]);
        for _ in 0..TIMES {
            recording.copy(from, to);
        }
        recording.dispatch(&STEP, &[small.any()], workgroups(64, 64));
        Recorded { result: to, len }
    };
    let moved = TIMES * 8 * len;
    measure(device, meter, ("copy-10", len, moved), record, |found| {
        mismatch(found, &data)
    })
}

fn reduce(device: &Device, meter: &Meter, len: usize) -> anyhow::Result<Option<Row>> {
    let mut rng = Rand32::new(2);
    let data: Vec<f32> = (0..len).map(|_| rng.rand_float()).collect();
    let sum: f64 = data.iter().map(|&x| f64::from(x)).sum();
    let record = |recording: &mut Recording| {
        let data = recording.buffer_from("data", &data);
        let result = recording.buffer::<f32>("sum", 1);
        Reduce::new(&Operator::add(Precision::F32)).record(recording, data, result);
        Recorded { result, len: 1 }
    };
    measure(
        device,
        meter,
        ("reduce-f32", len, 4 * len),
        record,
        |found| {
            let found: Vec<f64> = found.iter().map(|&x| x.into()).collect();
            relative_error(&found, &[sum])
        },
    )
}

fn scan(device: &Device, meter: &Meter, len: usize) -> anyhow::Result<Option<Row>> {
    let data = words(len);
    let record = |recording: &mut Recording| {
        let data = recording.buffer_from("data", &data);
        let result = recording.buffer::<u32>("sums", len);
        let scan = Scan::new(&Operator::add_u32());
        scan.record(recording, data, result, ScanKind::Inclusive);
        Recorded { result, len }
    };
    let mut sum = 0_u32;
    let expected = data.iter().map(|word| {
        sum = sum.wrapping_add(*word);
        sum
    });
    let expected: Vec<u32> = expected.collect();
    measure(device, meter, ("scan-u32", len, 8 * len), record, |found| {
        mismatch(found, &expected)
    })
}

fn compaction(device: &Device, meter: &Meter, len: usize) -> anyhow::Result<Option<Row>> {
    let data = words(len);
    let flags: Vec<u32> = data.iter().map(|word| word >> 31).collect();
    let pairs = data.iter().zip(&flags).filter(|(_, flag)| **flag != 0);
    let expected: Vec<u32> = pairs.map(|(word, _)| *word).collect();
    let record = |recording: &mut Recording| {
        let flags = recording.buffer_from("flags", &flags);
        let values = recording.buffer_from("values", &data);
        let kept = recording.buffer::<u32>("kept", len);
        let count = recording.buffer::<u32>("count", 1);
        compact(recording, flags, values, kept, count);
        Recorded {
            result: kept,
            len: expected.len(),
        }
    };
    measure(device, meter, ("compact", len, 10 * len), record, |found| {
        mismatch(found, &expected)
    })
}

fn histograms(device: &Device, meter: &Meter, len: usize) -> anyhow::Result<Option<Row>> {
    const BINS: usize = 256;
    let keys: Vec<u32> = words(len).iter().map(|word| word >> 24).collect();
    let mut expected = vec![0_u32; BINS];
    for &key in &keys {
        let place = expected.get_mut(key as usize);
        *place.context("a key of 8 bits")? += 1;
    }
    let record = |recording: &mut Recording| {
        let keys = recording.buffer_from("keys", &keys);
        let result = recording.buffer::<u32>("counts", BINS);
        let stage = recording.stage("keys");
        histogram(recording, stage, keys, result);
        Recorded { result, len: BINS }
    };
    measure(
        device,
        meter,
        ("histogram", len, 4 * len),
        record,
        |found| mismatch(found, &expected),
    )
}

/// Measures a sort in one of its shapes.
pub(super) fn sort(
    device: &Device,
    meter: &Meter,
    len: usize,
    method: &str,
    sort: &Sort,
) -> anyhow::Result<Option<Row>> {
    sort_first(device, meter, [len, len], method, sort)
}

/// Measures a sort of the first of `len` pairs; of fewer than all, only the device knows how many.
fn sort_first(
    device: &Device,
    meter: &Meter,
    [len, first]: [usize; 2],
    method: &str,
    sort: &Sort,
) -> anyhow::Result<Option<Row>> {
    let keys = words(len);
    let values: Vec<u32> = (0..).take(len).collect();
    let mut expected = values.clone();
    expected[..first].sort_by_key(|&value| keys[value as usize]);
    let count = u32::try_from(first)?;
    let record = |recording: &mut Recording| {
        // Each run sorts the same keys; copying them is before the first dispatch and not timed.
        let [given_keys, given_values] = [("given keys", &keys), ("given values", &values)]
            .map(|(n, d)| recording.buffer_from(n, d));
        let [keys, result] = ["keys", "values"].map(|name| recording.buffer::<u32>(name, len));
        recording.copy(given_keys, keys);
        recording.copy(given_values, result);
        if first == len {
            sort.record(recording, keys, result, 32);
        } else {
            let count = recording.buffer_from("count", &[count]);
            sort.record_counted(recording, keys, result, 32, count);
        }
        Recorded { result, len }
    };
    // Reading and writing keys and values once.
    measure(device, meter, (method, len, 16 * first), record, |found| {
        mismatch(found, &expected)
    })
}
