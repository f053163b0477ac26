//! Failures that kernels report: numbers that are none, and what becomes of the results.

use super::holds;
use crate::suite::Outcome;
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Binding, Device, Error, Failure, Kernel, Recording, STATUS, workgroups};
use vertebra_shaders::{Float, Precision, finite, histogram};

pub(super) fn nan_in_data(device: &Device) -> Outcome {
    fn planted<T: Float>(device: &Device, good: T, bad: &[T]) -> Outcome {
        let mut figures = Vec::new();
        let width = 8 * size_of::<T>();
        for (number, &bad) in bad.iter().enumerate() {
            let mut data = vec![good; 1000];
            // The last one too: the first of several is named.
            data[700 + number] = bad;
            data[999] = bad;
            let mut recording = Recording::new("planted");
            let data = recording.buffer_from("data", &data);
            let stage = recording.stage("input");
            finite(&mut recording, stage, data);
            let result = device.prepare(&recording)?.run()?.wait();
            let element = u32::try_from(700 + number)?;
            figures.push(holds(
                format!("f{width} number {number}"),
                failed_at(&result, "input", element),
            ));
        }
        let mut recording = Recording::new("fine");
        let data = recording.buffer_from("data", &[good; 1000]);
        let stage = recording.stage("input");
        finite(&mut recording, stage, data);
        let fine = device.prepare(&recording)?.run()?.wait().is_ok();
        figures.push(holds(format!("f{width} without"), fine));
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
    let mut recording = Recording::new("many");
    let data = recording.buffer_from("data", &numbers);
    let stage = recording.stage("input");
    finite(&mut recording, stage, data);
    let result = device.prepare(&recording)?.run()?.wait();
    let last = u32::try_from(len - 1)?;
    Ok(vec![holds(
        "the last of many",
        failed_at(&result, "input", last),
    )])
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
    const QUOTIENTS: Kernel = Kernel::new(
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
    fn run<T: Float>(
        device: &Device,
        precision: Precision,
        good: [T; 2],
        bad: &[[T; 2]],
    ) -> Outcome {
        let kernel = QUOTIENTS
            .with(precision.part())
            .requires(precision.features())
            .stride("above", precision.bytes())
            .stride("below", precision.bytes());
        let mut figures = Vec::new();
        for (number, bad) in bad.iter().chain([&good]).enumerate() {
            let mut pairs = [good; 100];
            pairs[40] = *bad;
            let mut recording = Recording::new("quotients");
            let above = recording.buffer_from("above", &pairs.map(|[above, _]| above));
            let below = recording.buffer_from("below", &pairs.map(|[_, below]| below));
            let stage = recording.stage("quotient");
            let status = recording.status();
            let kernel = kernel.clone().constant("STAGE", stage);
            let buffers = [above.any(), below.any(), status.any()];
            recording.dispatch(&kernel, &buffers, workgroups(100, 64));
            let result = device.prepare(&recording)?.run()?.wait();
            let planted = number < 3;
            figures.push(holds(
                format!("{precision:?} quotient {number}"),
                failed_at(&result, "quotient", 40) == planted && result.is_err() == planted,
            ));
        }
        Ok(figures)
    }
    let bad = [[0.0_f32, 0.0], [1.0, 0.0], [-3e38, 1e-10]];
    let mut figures = run(device, Precision::F32, [3e38, 1.0], &bad)?;
    if device.features().contains(Features::SHADER_F64) {
        let bad = [[0.0_f64, 0.0], [1.0, 0.0], [-1e308, 1e-10]];
        figures.extend(run(device, Precision::F64, [1e308, 1.0], &bad)?);
    }
    Ok(figures)
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
