//! What happens when things go wrong: a typed error, and the next call works.

use super::{holds, same_adapter};
use crate::suite::{Figure, Outcome};
use vertebra_gpu::wgpu::{self, Features};
use vertebra_gpu::{
    AdapterChoice, Binding, Device, Error, Failure, Kernel, Options, Problem, Recording, STATUS,
    Shortfall, workgroups,
};
use vertebra_shaders::{Number, Precision, finite, histogram};

const DOUBLE: Kernel = Kernel::new(
    "double",
    &["
    @group(0) @binding(0) var<storage, read_write> data: array<u32>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        if id.x < arrayLength(&data) { data[id.x] *= 2u; }
    }"],
    &[Binding::read_write::<u32>("data")],
    [64, 1, 1],
);

/// That a device computes.
fn works(device: &Device) -> Result<bool, Error> {
    let mut recording = Recording::new("works");
    let data = recording.buffer_from("data", &[1_u32, 2, 3, 4]);
    recording.dispatch(&DOUBLE, &[data.any()], [1, 1, 1]);
    recording.download(data);
    Ok(device.prepare(&recording)?.run()?.wait()?.read(data)? == [2, 4, 6, 8])
}

/// The figures of an error that was expected, and that the next call works.
fn refused<T>(
    device: &Device,
    what: &str,
    result: Result<T, Error>,
    expected: impl Fn(&Error) -> bool,
) -> Outcome {
    let name = match &result {
        Ok(_) => format!("{what}: was not refused"),
        Err(error) => format!("{what}: {error}"),
    };
    Ok(vec![
        holds(name, result.is_err_and(|error| expected(&error))),
        holds(format!("works after {what}"), works(device)?),
    ])
}

pub(super) fn no_adapter(device: &Device) -> Outcome {
    let options = Options {
        adapter: AdapterChoice::Named("no such adapter".to_owned()),
        ..Options::default()
    };
    let name = device.info().name.clone();
    refused(
        device,
        "no adapter",
        Device::open(options),
        |error| matches!(error, Error::NoAdapter { found, .. } if found.contains(&name)),
    )
}

pub(super) fn missing_feature(device: &Device) -> Outcome {
    // Some feature is always missing: no adapter has the formats of every vendor.
    let options = Options {
        required: Features::all_webgpu_mask() | Features::SHADER_F64,
        limits: wgpu::Limits {
            max_bind_groups: u32::MAX,
            max_compute_workgroup_size_x: u32::MAX,
            ..wgpu::Limits::downlevel_defaults()
        },
        ..same_adapter(device)
    };
    refused(device, "missing feature", Device::open(options), |error| {
        let Error::Unsupported { missing, .. } = error else {
            return false;
        };
        let limits = missing
            .iter()
            .filter(|m| matches!(m, Shortfall::Limit { .. }));
        let features = missing
            .iter()
            .filter(|m| matches!(m, Shortfall::Feature(_)));
        limits.count() == 2 && features.count() >= 1
    })
}

/// A device opened with small limits refuses what goes beyond them, by name and number.
pub(super) fn limits_too_low(device: &Device) -> Outcome {
    let small = Device::open(Options {
        limits: wgpu::Limits {
            max_storage_buffer_binding_size: 1 << 16,
            ..wgpu::Limits::downlevel_defaults()
        },
        exact_limits: true,
        ..same_adapter(device)
    })?;
    let mut recording = Recording::new("too much");
    let data = recording.buffer::<u32>("data", 1 << 15);
    recording.dispatch(&DOUBLE, &[data.any()], [70_000, 1, 1]);
    refused(&small, "low limits", small.prepare(&recording), |error| {
        let Error::Recording { problems, .. } = error else {
            return false;
        };
        let limits = problems.iter().map(|problem| match problem {
            Problem::Limit {
                shortfall: Shortfall::Limit { limit, .. },
                ..
            } => *limit,
            _ => "",
        });
        limits.eq([
            "max_compute_workgroups_per_dimension",
            "max_storage_buffer_binding_size",
        ])
    })
}

pub(super) fn buffer_too_large(device: &Device) -> Outcome {
    let words = usize::try_from(device.limits().max_buffer_size / 4 + 1)?;
    let is_limit = |error: &Error| {
        matches!(error, Error::Recording { problems, .. }
            if matches!(&problems[..], [Problem::Limit { .. }]))
    };
    let mut figures = refused(
        device,
        "large buffer",
        device.buffer::<u32>("large", words),
        is_limit,
    )?;
    let mut recording = Recording::new("large");
    recording.buffer::<u32>("large", words);
    let prepared = device.prepare(&recording);
    figures.extend(refused(device, "large recording", prepared, is_limit)?);
    Ok(figures)
}

/// A budget of nothing makes every allocation one too many, where the driver tells budgets;
/// elsewhere the memory is filled by a buffer as large as the limits allow.
pub(super) fn out_of_memory(device: &Device) -> Outcome {
    let empty = Device::open(Options {
        memory_percent: Some(0),
        ..same_adapter(device)
    })?;
    let result = empty.buffer::<u32>("one too many", 1 << 20);
    let name = match &result {
        Ok(_) => "the driver tells no budget".to_owned(),
        Err(error) => error.to_string(),
    };
    let as_expected = match result {
        // Without a budget nothing can be forced without harm to the machine.
        Ok(_) => true,
        Err(error) => matches!(error, Error::OutOfMemory { bytes, .. } if bytes == 4 << 20),
    };
    Ok(vec![
        holds(name, as_expected),
        holds("works after a full memory", works(device)?),
    ])
}

pub(super) fn device_lost(device: &Device) -> Outcome {
    let lost = device.reopen()?;
    let mut recording = Recording::new("lost");
    let data = recording.buffer::<u32>("data", 1 << 20);
    for _ in 0..50 {
        recording.dispatch(&DOUBLE, &[data.any()], workgroups(1 << 20, 64));
    }
    recording.download(data);
    let program = lost.prepare(&recording)?;
    let under_way = program.run()?;
    lost.raw().0.destroy();
    let is_lost = |error: &Error| matches!(error, Error::DeviceLost { .. });
    let mut figures: Vec<Figure> = Vec::new();
    let mut note = |what: &str, result: Result<(), Error>| {
        let text = result.as_ref().err().map(Error::to_string);
        let name = format!("{what}: {}", text.unwrap_or_default());
        figures.push(holds(name, result.is_err_and(|error| is_lost(&error))));
    };
    note("the run under way", under_way.wait().map(drop));
    note("the next run", program.run().map(drop));
    note("a write", program.write(data, &vec![0; 1 << 20]));
    note("a buffer", lost.buffer::<u32>("buffer", 1).map(drop));
    note("a program", lost.prepare(&recording).map(drop));
    figures.push(holds("opened again", works(&lost.reopen()?)?));
    figures.push(holds("the other device", works(device)?));
    Ok(figures)
}

pub(super) fn invalid_shader(device: &Device) -> Outcome {
    const BROKEN: Kernel = Kernel::new("broken", &["fn main( {"], &[], [1, 1, 1]);
    // Declares one binding, the shader has another.
    const OTHER: Kernel = Kernel::new(
        "other",
        &["
        @group(0) @binding(1) var<storage, read_write> data: array<u32>;
        @compute @workgroup_size(1)
        fn main() { data[0] = 1u; }"],
        &[Binding::read_write::<u32>("data")],
        [1, 1, 1],
    );
    let mut figures = Vec::new();
    for kernel in [BROKEN, OTHER] {
        let mut recording = Recording::new("invalid");
        let data = recording.buffer::<u32>("data", 1);
        let buffers = [data.any()];
        recording.dispatch(&kernel, &buffers[..kernel.bindings().len()], [1, 1, 1]);
        let prepared = device.prepare(&recording);
        figures.extend(refused(
            device,
            kernel.name(),
            prepared,
            |error| matches!(error, Error::Shader { kernel: name, .. } if name == kernel.name()),
        )?);
    }
    Ok(figures)
}

pub(super) fn wrong_recordings(device: &Device) -> Outcome {
    let mut other = Recording::new("other");
    let foreign = other.buffer::<u32>("foreign", 4);
    let mut recording = Recording::new("wrong");
    let data = recording.buffer::<u32>("data", 4);
    let wide = recording.buffer::<[u32; 2]>("wide", 4);
    recording.upload(data, &[0; 5]);
    recording.copy(data, data);
    recording.dispatch(&DOUBLE, &[foreign.any()], [1, 1, 1]);
    recording.dispatch(&DOUBLE, &[wide.any()], [1, 1, 1]);
    recording.dispatch(&DOUBLE, &[], [1, 1, 1]);
    recording.dispatch_indirect(&DOUBLE, &[data.any()], data, 2);
    let prepared = device.prepare(&recording);
    let mut figures = refused(device, "wrong recording", prepared, |error| {
        let Error::Recording { problems, .. } = error else {
            return false;
        };
        matches!(
            &problems[..],
            [
                Problem::Size { .. },
                Problem::Alias { .. },
                Problem::Foreign { .. },
                Problem::Stride { .. },
                Problem::BindingCount { .. },
                Problem::Size { .. },
                Problem::Alias { .. },
            ]
        )
    })?;
    let mut recording = Recording::new("right");
    let data = recording.buffer::<u32>("data", 4);
    let hidden = recording.buffer::<u32>("hidden", 4);
    recording.download(data);
    let program = device.prepare(&recording)?;
    let short = program.write(data, &[1, 2]);
    figures.push(holds(
        "short data",
        matches!(short, Err(Error::Length { .. })),
    ));
    let output = program.run()?.wait()?;
    let unread = output.read(hidden);
    figures.push(holds(
        "not downloaded",
        matches!(unread, Err(Error::WrongBuffer { .. })),
    ));
    figures.push(holds("downloaded", output.read(data)? == [0; 4]));
    Ok(figures)
}

pub(super) fn nan_in_data(device: &Device) -> Outcome {
    fn planted<T: Number>(device: &Device, good: T, bad: &[T]) -> Outcome {
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
    fn run<T: Number>(
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
    histogram(&mut recording, keys, counts);
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
