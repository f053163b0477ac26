//! Failures that kernels report: numbers that are none, and what becomes of the results.

use super::compare::{Compared, Computation, compare_own};
use super::holds;
use crate::suite::Outcome;
use anyhow::bail;
use vertebra_gpu::twin::{Comparison, Named, Values};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Binding, Device, Error, Failure, Kernel, Recording, STATUS, workgroups};
use vertebra_shaders::{Float, Precision, finite, histogram};

pub(super) fn nan_in_data(device: &Device) -> Outcome {
    fn planted<T: Float>(device: &Device, good: T, bad: &[T]) -> Outcome
    where
        Values: From<Vec<T>>,
    {
        let mut figures = Vec::new();
        let width = 8 * size_of::<T>();
        let mut run = |label: &str, data: Vec<T>| {
            let (label, inputs) = (format!("f{width} {label}"), [Named::new("data", data)]);
            figures.extend(compare_own(device, &FINITE, &label, &inputs)?);
            anyhow::Ok(())
        };
        for (number, &bad) in bad.iter().enumerate() {
            let mut data = vec![good; 1000];
            // The last one too: the first of several is named.
            data[700 + number] = bad;
            data[999] = bad;
            run(&format!("number {number}"), data)?;
        }
        run("without", vec![good; 1000])?;
        Ok(figures)
    }
    let signalling = f32::from_bits(0x7f80_0001);
    let mut figures = planted(
        device,
        f32::MAX,
        &[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, signalling],
    )?;
    let signalling = f64::from_bits(0xfff0_0000_0000_0001);
    figures.extend(planted(
        device,
        f64::MIN,
        &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, signalling],
    )?);
    Ok(figures)
}

/// More workgroups than one dimension holds: the last element is reached all the same.
pub(super) fn many_workgroups(device: &Device) -> Outcome {
    let len = 65_535 * 256 + 300;
    let mut numbers = vec![1.0_f32; len];
    numbers[len - 1] = f32::NAN;
    let inputs = [Named::new("data", numbers)];
    compare_own(device, &FINITE, "the last of many", &inputs)
}

/// The first number of `data` that is none, if there is one: stage `first`.
pub(super) const FINITE: Computation = Computation {
    name: "finite",
    compare: |device, inputs| {
        fn run<T: Float>(device: &Device, data: &[T]) -> anyhow::Result<Vec<Failure>> {
            let mut recording = Recording::new("finite");
            let data = recording.buffer_from("data", data);
            let stage = recording.stage("first");
            finite(&mut recording, stage, data);
            Ok(device.prepare(&recording)?.run()?.wait_for_all()?.1)
        }
        let (failures, expected) = match inputs {
            [
                Named {
                    values: Values::F32(data),
                    ..
                },
            ] => (run(device, data)?, data.iter().position(|x| !x.is_finite())),
            [
                Named {
                    values: Values::F64(data),
                    ..
                },
            ] => (run(device, data)?, data.iter().position(|x| !x.is_finite())),
            _ => bail!("finite takes `data` in f32 or f64"),
        };
        first_failure(failures, expected)
    },
};

/// The elements that failed, of which there is one or none, beside the one that should.
fn first_failure(failures: Vec<Failure>, expected: Option<usize>) -> Compared {
    let expected = expected.map(u32::try_from).transpose()?;
    let expected: Vec<u32> = expected.into_iter().collect();
    let found: Vec<u32> = failures.iter().map(|failure| failure.element).collect();
    let others = failures
        .into_iter()
        .filter(|failure| failure.stage != "first");
    let comparison = Comparison::new("first", expected.into(), found.into(), 0.0);
    Ok((vec![comparison], others.collect()))
}

fn failed_at<T>(result: &Result<T, Error>, stage: &str, element: u32) -> bool {
    let expected = Failure {
        stage: stage.to_owned(),
        element,
    };
    matches!(result, Err(Error::Failed { failures, .. }) if *failures == [expected])
}

/// `is_finite` in a kernel, on numbers that the kernel makes: compilers may take it for granted that
/// they are numbers.
pub(super) fn nan_made_on_the_device(device: &Device) -> Outcome {
    fn run<T: Float>(device: &Device, good: [T; 2], bad: &[[T; 2]]) -> Outcome
    where
        Values: From<Vec<T>>,
    {
        let mut figures = Vec::new();
        let width = 8 * size_of::<T>();
        for (number, bad) in bad.iter().chain([&good]).enumerate() {
            let mut pairs = [good; 100];
            pairs[40] = *bad;
            let inputs = [
                Named::new("above", pairs.map(|[above, _]| above).to_vec()),
                Named::new("below", pairs.map(|[_, below]| below).to_vec()),
            ];
            let label = format!("f{width} quotient {number}");
            figures.extend(compare_own(device, &QUOTIENTS, &label, &inputs)?);
        }
        Ok(figures)
    }
    let bad = [[0.0_f32, 0.0], [1.0, 0.0], [-3e38, 1e-10]];
    let mut figures = run(device, [3e38, 1.0], &bad)?;
    if device.features().contains(Features::SHADER_F64) {
        let bad = [[0.0_f64, 0.0], [1.0, 0.0], [-1e308, 1e-10]];
        figures.extend(run(device, [1e308, 1.0], &bad)?);
    }
    Ok(figures)
}

/// The first quotient of `above` and `below` that is no number, if there is one: stage `first`.
pub(super) const QUOTIENTS: Computation = Computation {
    name: "quotients",
    compare: |device, inputs| {
        let [Named { values: above, .. }, Named { values: below, .. }] = inputs else {
            bail!("quotients takes `above` and `below`");
        };
        let (failures, expected) = match (above, below) {
            (Values::F32(above), Values::F32(below)) => (
                quotients(device, Precision::F32, above, below)?,
                (above.iter().zip(below)).position(|(a, b)| !(a / b).is_finite()),
            ),
            (Values::F64(above), Values::F64(below)) => (
                quotients(device, Precision::F64, above, below)?,
                (above.iter().zip(below)).position(|(a, b)| !(a / b).is_finite()),
            ),
            _ => bail!("quotients takes `above` and `below`, both in f32 or in f64"),
        };
        first_failure(failures, expected)
    },
};

fn quotients<T: Float>(
    device: &Device,
    precision: Precision,
    above: &[T],
    below: &[T],
) -> anyhow::Result<Vec<Failure>> {
    const KERNEL: Kernel = Kernel::new(
        "quotients",
        &[
            "
    @group(0) @binding(0) var<storage, read> above: array<real>;
    @group(0) @binding(1) var<storage, read> below: array<real>;
    @group(0) @binding(2) var<storage, read_write> status: array<atomic<u32>>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        if id.x < arrayLength(&above) {
            let quotient = above[id.x] / below[id.x];
            if !is_finite(quotient) { fail(id.x); }
        }
    }",
            STATUS,
        ],
        &[
            Binding::read::<f32>("above"),
            Binding::read::<f32>("below"),
            Binding::read_write::<u32>("status"),
        ],
        [64, 1, 1],
    );
    let mut recording = Recording::new("quotients");
    let len = u32::try_from(above.len())?;
    let [above, below] =
        [("above", above), ("below", below)].map(|(name, data)| recording.buffer_from(name, data));
    let stage = recording.stage("first");
    let status = recording.status();
    let kernel = KERNEL
        .with(precision.part())
        .requires(precision.features())
        .stride("above", precision.bytes())
        .stride("below", precision.bytes())
        .constant("STAGE", stage);
    let buffers = [above.any(), below.any(), status.any()];
    recording.dispatch(&kernel, &buffers, workgroups(len, 64));
    Ok(device.prepare(&recording)?.run()?.wait_for_all()?.1)
}

/// A failing stage is named with its first element, keeps the results back, and the next run works.
pub(super) fn failed_stage(device: &Device) -> Outcome {
    let mut recording = Recording::new("stages");
    let other = recording.stage("other");
    let numbers = recording.buffer_from("numbers", &[1.0_f32; 10]);
    finite(&mut recording, other, numbers);
    let keys = recording.buffer::<u32>("keys", 5000);
    let counts = recording.buffer::<u32>("counts", 10);
    let stage = recording.stage("histogram");
    histogram(&mut recording, stage, keys, counts);
    recording.download(counts);
    let program = device.prepare(&recording)?;
    let mut words: Vec<u32> = (0..5000).map(|i| i % 10).collect();
    words[4321] = 10;
    words[1234] = u32::MAX;
    program.write(keys, &words)?;
    let wrong = program.run()?.wait();
    let mut figures = vec![holds("named", failed_at(&wrong, "histogram", 1234))];
    let (output, failures) = program.run()?.wait_for_all()?;
    figures.push(holds("a second time", failures.len() == 1));
    figures.push(holds(
        "results to look at",
        output.read(counts)?.len() == 10,
    ));
    drop(output);
    words[4321] = 1;
    words[1234] = 4;
    program.write(keys, &words)?;
    let counts = program.run()?.wait()?.read(counts)?;
    figures.push(holds(
        "the next run",
        counts.iter().all(|count| *count == 500),
    ));
    Ok(figures)
}
