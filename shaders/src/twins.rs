//! The primitives as [twins](vertebra_gpu::twin): with what each is compared on the CPU.

use bytemuck::Pod;
use vertebra_gpu::twin::{Named, RecordedStage, StageSlot, Twin, Values};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Recording, Slot};

use crate::operator::{Operator, Precision};
use crate::reduce::Reduce;
use crate::scan::{Scan, ScanKind};
use crate::sort::{Rows, Sort};
use crate::{compact, compact_counted, histogram};

mod tree;

/// All of them.
pub const ALL: &[Twin] = &[
    SCAN,
    AFFINE_SCAN,
    SCAN_F32,
    SCAN_F64,
    REDUCE_F32,
    REDUCE_F64,
    SORT,
    COMPACT,
    HISTOGRAM,
];

/// Sums of the first `count[0]` words of `data`, or of all: stages `exclusive`, `inclusive`.
pub const SCAN: Twin = Twin {
    name: "scan",
    features: Features::empty(),
    cpu: |inputs| scan_cpu(inputs, 0, u32::wrapping_add),
    gpu: |recording, inputs, _| scan_gpu(recording, inputs, &Operator::add_u32()),
    tolerance: exact,
};

/// Compositions of maps modulo 2^16, which do not commute: stages `exclusive`, `inclusive`.
pub const AFFINE_SCAN: Twin = Twin {
    name: "affine_scan",
    features: Features::empty(),
    cpu: |inputs| scan_cpu(inputs, 1, affine),
    gpu: |recording, inputs, _| scan_gpu(recording, inputs, &affine_operator()),
    tolerance: exact,
};

/// Sums of f32 `data` in the order of the shaders, which rounds alike: stages `exclusive`,
/// `inclusive`.
pub const SCAN_F32: Twin = Twin {
    name: "scan_f32",
    features: Features::empty(),
    cpu: |inputs| both_scans(tree::scan(singles(inputs), 0.0, |a, b| a + b)),
    gpu: |recording, inputs, _| {
        let operator = Operator::add(Precision::F32);
        let len = singles(inputs).len();
        let slots = scans(recording, singles(inputs), &operator, None);
        slots
            .map(|(name, slot)| stage(name, StageSlot::F32(slot), len))
            .into()
    },
    tolerance: exact,
};

/// [`SCAN_F32`] in f64.
pub const SCAN_F64: Twin = Twin {
    name: "scan_f64",
    features: Features::SHADER_F64,
    cpu: |inputs| both_scans(tree::scan(doubles(inputs), 0.0, |a, b| a + b)),
    gpu: |recording, inputs, _| {
        let operator = Operator::add(Precision::F64);
        let len = doubles(inputs).len();
        let slots = scans(recording, doubles(inputs), &operator, None);
        slots
            .map(|(name, slot)| stage(name, StageSlot::F64(slot), len))
            .into()
    },
    tolerance: exact,
};

/// The sum of the first `count[0]` numbers of f32 `data`, or of all, in the order of the shaders, which
/// rounds alike: stage `sum`.
pub const REDUCE_F32: Twin = Twin {
    name: "reduce_f32",
    features: Features::empty(),
    cpu: |inputs| {
        let sum = tree::reduce(counted(singles(inputs), inputs), 0.0, |a, b| a + b);
        vec![Named::new("sum", vec![sum])]
    },
    gpu: |recording, inputs, _| {
        let sum = sum_gpu(recording, inputs, singles(inputs), Precision::F32);
        vec![stage("sum", StageSlot::F32(sum), 1)]
    },
    tolerance: exact,
};

/// [`REDUCE_F32`] in f64.
pub const REDUCE_F64: Twin = Twin {
    name: "reduce_f64",
    features: Features::SHADER_F64,
    cpu: |inputs| {
        let sum = tree::reduce(counted(doubles(inputs), inputs), 0.0, |a, b| a + b);
        vec![Named::new("sum", vec![sum])]
    },
    gpu: |recording, inputs, _| {
        let sum = sum_gpu(recording, inputs, doubles(inputs), Precision::F64);
        vec![stage("sum", StageSlot::F64(sum), 1)]
    },
    tolerance: exact,
};

/// The first `count[0]` pairs of `keys` and `values`, or all, by the lowest `bits[0]` bits of the key:
/// stages `keys`, `values`.
///
/// The input [`shape`] says in which shape; without it, in the one that is fastest on the device.
pub const SORT: Twin = Twin {
    name: "sort",
    features: Features::empty(),
    cpu: sort_cpu,
    gpu: |recording, inputs, device| {
        let sort = match words(inputs, "shape") {
            &[rows, items] if (rows as usize) < Rows::ALL.len() => {
                Sort::new(Rows::ALL[rows as usize], items)
            }
            _ => Sort::on(device),
        };
        sort_gpu(recording, inputs, &sort)
    },
    tolerance: exact,
};

/// The first `count[0]` of `values`, or all, whose flag in `flags` is not zero: stages `kept`,
/// `kept_count`.
pub const COMPACT: Twin = Twin {
    name: "compact",
    features: Features::empty(),
    cpu: |inputs| {
        let pairs = words(inputs, "values").iter().zip(words(inputs, "flags"));
        let kept: Vec<u32> = pairs
            .take(count(inputs))
            .filter(|(_, flag)| **flag != 0)
            .map(|(v, _)| *v)
            .collect();
        let count = u32::try_from(kept.len()).unwrap_or(u32::MAX);
        vec![
            Named::new("kept", kept),
            Named::new("kept_count", vec![count]),
        ]
    },
    gpu: |recording, inputs, _| {
        let flags = recording.buffer_from("flags", words(inputs, "flags"));
        let values = recording.buffer_from("values", words(inputs, "values"));
        let kept = recording.buffer::<u32>("kept", words(inputs, "values").len());
        let kept_count = match count_slot(recording, inputs) {
            None => {
                let kept_count = recording.buffer::<u32>("kept_count", 1);
                compact(recording, flags, values, kept, kept_count);
                kept_count
            }
            Some(count) => {
                // In place, as a queue is thinned out.
                compact_counted(recording, flags, values, kept, count, count);
                count
            }
        };
        let set = words(inputs, "flags").iter().take(count(inputs));
        let set = set.filter(|flag| **flag != 0).count();
        vec![
            stage("kept", StageSlot::U32(kept), set),
            stage("kept_count", StageSlot::U32(kept_count), 1),
        ]
    },
    tolerance: exact,
};

/// How often each of `bins[0]` keys occurs in `keys`; larger keys fail: stage `counts`.
pub const HISTOGRAM: Twin = Twin {
    name: "histogram",
    features: Features::empty(),
    cpu: |inputs| {
        let mut counts = vec![0_u32; number(inputs, "bins")];
        for &key in words(inputs, "keys") {
            if let Some(count) = counts.get_mut(key as usize) {
                *count += 1;
            }
        }
        vec![Named::new("counts", counts)]
    },
    gpu: |recording, inputs, _| {
        let keys = recording.buffer_from("keys", words(inputs, "keys"));
        let bins = number(inputs, "bins");
        let counts = recording.buffer::<u32>("counts", bins);
        let stage_of_keys = recording.stage("keys");
        histogram(recording, stage_of_keys, keys, counts);
        vec![stage("counts", StageSlot::U32(counts), bins)]
    },
    tolerance: exact,
};

fn exact(_: &str, _: &[Named]) -> f64 {
    0.0
}

fn stage(name: &'static str, slot: StageSlot, len: usize) -> RecordedStage {
    RecordedStage { name, slot, len }
}

/// Composition of the maps x -> a x + b of integers modulo 2^16, a in the lower half of a word and b
/// in the upper; the first map first.
pub(crate) fn affine_operator() -> Operator {
    Operator::new::<u32>(include_str!("../wgsl/shared/affine.wgsl"))
}

/// The same on the CPU.
fn affine(f: u32, g: u32) -> u32 {
    let a = f.wrapping_mul(g) & 0xffff;
    let b = (g & 0xffff).wrapping_mul(f >> 16).wrapping_add(g >> 16);
    a | b << 16
}

fn scan_cpu(inputs: &[Named], identity: u32, combine: fn(u32, u32) -> u32) -> Vec<Named> {
    let data = words(inputs, "data");
    let mut running = identity;
    let [mut exclusive, mut inclusive] = [vec![0; data.len()], vec![0; data.len()]];
    for (i, &element) in data.iter().enumerate().take(count(inputs)) {
        exclusive[i] = running;
        running = combine(running, element);
        inclusive[i] = running;
    }
    both_scans([exclusive, inclusive])
}

fn both_scans<T>([exclusive, inclusive]: [Vec<T>; 2]) -> Vec<Named>
where
    Values: From<Vec<T>>,
{
    vec![
        Named::new("exclusive", exclusive),
        Named::new("inclusive", inclusive),
    ]
}

fn scan_gpu(
    recording: &mut Recording,
    inputs: &[Named],
    operator: &Operator,
) -> Vec<RecordedStage> {
    let data = words(inputs, "data");
    let count = count_slot(recording, inputs);
    let slots = scans(recording, data, operator, count);
    slots
        .map(|(name, slot)| stage(name, StageSlot::U32(slot), data.len()))
        .into()
}

/// Records both kinds of scan.
fn scans<T: Pod>(
    recording: &mut Recording,
    data: &[T],
    operator: &Operator,
    count: Option<Slot<u32>>,
) -> [(&'static str, Slot<T>); 2] {
    let len = data.len();
    let data = recording.buffer_from("data", data);
    let scan = Scan::new(operator);
    let kinds = [
        ("exclusive", ScanKind::Exclusive),
        ("inclusive", ScanKind::Inclusive),
    ];
    kinds.map(|(name, kind)| {
        let result = recording.buffer(name, len);
        match count {
            None => scan.record(recording, data, result, kind),
            Some(count) => scan.record_counted(recording, data, result, kind, count),
        }
        (name, result)
    })
}

fn sort_cpu(inputs: &[Named]) -> Vec<Named> {
    let (keys, values) = (words(inputs, "keys"), words(inputs, "values"));
    let mask = 1_u64
        .checked_shl(bits(inputs))
        .map_or(u64::MAX, |bit| bit - 1);
    let mut pairs: Vec<_> = keys.iter().copied().zip(values.iter().copied()).collect();
    let count = count(inputs).min(pairs.len());
    pairs[..count].sort_by_key(|(key, _)| u64::from(*key) & mask);
    let (keys, values): (Vec<u32>, Vec<u32>) = pairs.into_iter().unzip();
    vec![Named::new("keys", keys), Named::new("values", values)]
}

fn sort_gpu(recording: &mut Recording, inputs: &[Named], sort: &Sort) -> Vec<RecordedStage> {
    let (keys, values) = (words(inputs, "keys"), words(inputs, "values"));
    let len = keys.len();
    let keys = recording.buffer_from("keys", keys);
    let values = recording.buffer_from("values", values);
    match count_slot(recording, inputs) {
        None => sort.record(recording, keys, values, bits(inputs)),
        Some(count) => sort.record_counted(recording, keys, values, bits(inputs), count),
    }
    vec![
        stage("keys", StageSlot::U32(keys), len),
        stage("values", StageSlot::U32(values), len),
    ]
}

/// The shape of a sort as the input of [`SORT`]: its place in [`Rows::ALL`] and its number of items.
/// With it another device computes with the same kernels.
#[must_use]
pub fn shape(sort: &Sort) -> Named {
    let (rows, items) = sort.shape();
    let places = (0..).zip(Rows::ALL);
    let place = places
        .filter(|(_, other)| *other == rows)
        .map(|(place, _)| place);
    Named::new("shape", place.chain([items]).collect::<Vec<u32>>())
}

fn sum_gpu<T: Pod>(
    recording: &mut Recording,
    inputs: &[Named],
    data: &[T],
    precision: Precision,
) -> Slot<T> {
    let count = count_slot(recording, inputs);
    let data = recording.buffer_from("data", data);
    let sum = recording.buffer::<T>("sum", 1);
    let reduce = Reduce::new(&Operator::add(precision));
    match count {
        None => reduce.record(recording, data, sum),
        Some(count) => reduce.record_counted(recording, data, sum, count),
    }
    sum
}

fn find<'a>(inputs: &'a [Named], name: &str) -> Option<&'a Values> {
    let named = inputs.iter().find(|input| input.name == name)?;
    Some(&named.values)
}

fn words<'a>(inputs: &'a [Named], name: &str) -> &'a [u32] {
    find(inputs, name).map_or(&[], Values::words)
}

fn singles(inputs: &[Named]) -> &[f32] {
    match find(inputs, "data") {
        Some(Values::F32(values)) => values,
        _ => &[],
    }
}

fn doubles(inputs: &[Named]) -> &[f64] {
    match find(inputs, "data") {
        Some(Values::F64(values)) => values,
        _ => &[],
    }
}

/// A single number; 0 where it is missing.
fn number(inputs: &[Named], name: &str) -> usize {
    words(inputs, name).first().map_or(0, |&n| n as usize)
}

/// How many elements count; all where it is not said.
fn count(inputs: &[Named]) -> usize {
    let count = words(inputs, "count").first();
    count.map_or(usize::MAX, |&count| count as usize)
}

/// The same where the device reads it.
fn count_slot(recording: &mut Recording, inputs: &[Named]) -> Option<Slot<u32>> {
    let count = words(inputs, "count");
    (!count.is_empty()).then(|| recording.buffer_from("count", count))
}

/// The elements that count.
fn counted<'a, T>(data: &'a [T], inputs: &[Named]) -> &'a [T] {
    &data[..count(inputs).min(data.len())]
}

/// Bits to sort by; all where none are given.
fn bits(inputs: &[Named]) -> u32 {
    words(inputs, "bits")
        .first()
        .map_or(32, |&bits| bits.min(32))
}
