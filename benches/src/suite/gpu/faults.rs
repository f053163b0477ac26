//! What happens when things go wrong: a typed error, and the next call works.

use super::{holds, is_software};
use crate::suite::{Figure, Outcome};
use anyhow::Context;
use vertebra_gpu::wgpu::{self, Features};
use vertebra_gpu::{
    AdapterChoice, Binding, Device, ELEMENTS, Error, Kernel, Options, Problem, Recording,
    Shortfall, workgroups,
};

pub(super) const DOUBLE: Kernel = Kernel::new(
    "double",
    &[
        "
    @group(0) @binding(0) var<storage, read_write> data: array<u32>;
    @compute @workgroup_size(64)
    fn main(
        @builtin(global_invocation_id) id: vec3<u32>,
        @builtin(num_workgroups) groups: vec3<u32>,
    ) {
        let i = element(id, groups, 64u);
        if i < arrayLength(&data) { data[i] *= 2u; }
    }",
        ELEMENTS,
    ],
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
pub(super) fn refused<T>(
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
        ..Options::default()
    };
    let opened = device.reopen_with(options);
    refused(device, "missing feature", opened, |error| {
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
    let small = device.reopen_with(Options {
        limits: wgpu::Limits {
            max_storage_buffer_binding_size: 1 << 16,
            ..wgpu::Limits::downlevel_defaults()
        },
        exact_limits: true,
        ..Options::default()
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

/// Fills a small part of the memory and writes when it is full. A software driver need not tell how
/// much is used: there nothing can be forced without harm to the machine, and the name of the figure
/// says so. Of hardware that does not tell, the first figure fails.
pub(super) fn out_of_memory(device: &Device) -> Outcome {
    const WORDS: usize = 1 << 26;
    // More than any device has of what is opened below.
    const COUNT: usize = 128;
    let open = |percent| {
        device.reopen_with(Options {
            memory_percent: Some(percent),
            ..Options::default()
        })
    };
    // Nothing at all is too little for a device, unless nobody counts.
    if is_software(device) && open(0).is_ok() {
        let name = "skipped: the driver does not tell how full its memory is";
        return Ok(vec![holds(name, true)]);
    }
    let small = [1, 2, 4, 8]
        .into_iter()
        .find_map(|percent| open(percent).ok());
    let small = small.context("no part of the memory is enough to open the device")?;
    let kept = small.buffer_from("kept", &[1_u32, 2, 3])?;
    let medium = small.buffer::<u32>("medium", 1 << 20)?;
    let mut buffers = Vec::new();
    let refused = (0..COUNT).find_map(|number| {
        let buffer = small.buffer::<u32>(&format!("number {number}"), WORDS);
        buffer.map(|buffer| buffers.push(buffer)).err()
    });
    let name = refused.as_ref().map_or_else(
        || format!("{COUNT} buffers were not refused"),
        Error::to_string,
    );
    let as_expected =
        matches!(refused, Some(Error::OutOfMemory { bytes, .. }) if bytes == 4 * WORDS as u64);
    // A recording for which there is no room either leaves nothing behind.
    let mut recording = Recording::new("too much");
    for number in 0..COUNT {
        recording.buffer::<u32>(&format!("number {number}"), WORDS);
    }
    let prepared = small.prepare(&recording);
    // Content takes memory too, of another kind on some devices: there it is written. Larger content
    // than any room that is left comes first.
    let mut written = Vec::new();
    if let Some(large) = buffers.first() {
        written.push(large.write(&vec![7; WORDS]));
    }
    written.push(medium.write(&vec![7; 1 << 20]));
    written.push(kept.write(&[4, 5, 6]));
    let full = |result: &Result<(), Error>| matches!(result, Err(Error::OutOfMemory { .. }));
    let as_it_should = written.iter().all(|result| result.is_ok() || full(result));
    let refusals = written.iter().filter(|result| full(result)).count();
    let expected = if written[2].is_ok() {
        [4, 5, 6]
    } else {
        [1, 2, 3]
    };
    drop(buffers);
    let mut reading = Recording::new("reading");
    let slot = reading.shared::<u32>("kept", 3);
    reading.download(slot);
    let program = small.prepare_with(&reading, &[slot.is(&kept)])?;
    let content = program.run()?.wait()?.read(slot)?;
    Ok(vec![
        holds(
            format!("{refusals} of 3 writes refused: {written:?}"),
            as_it_should,
        ),
        holds(
            "written once there is memory again",
            medium.write(&vec![8; 1 << 20]).is_ok(),
        ),
        holds(name, as_expected),
        holds(
            "a recording too",
            matches!(prepared, Err(Error::OutOfMemory { .. })),
        ),
        holds("what was there is intact", content == expected),
        holds("works once there is memory again", works(&small)?),
        holds("the other device works", works(device)?),
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
    // Nobody has looked at this one since.
    let unseen = device.reopen()?;
    let program = unseen.prepare(&recording)?;
    unseen.raw().0.destroy();
    let run = program.run().map(drop);
    figures.push(holds(
        format!("a run after which nobody looked: {run:?}"),
        run.is_err_and(|error| is_lost(&error)),
    ));
    let again = lost.reopen()?;
    let same = again.description() == lost.description();
    figures.push(holds("the same one opened again", same));
    figures.push(holds("opened again", works(&again)?));
    figures.push(holds("the other device", works(device)?));
    Ok(figures)
}

pub(super) fn invalid_shader(device: &Device) -> Outcome {
    // One does not parse, one is not valid.
    const BROKEN: Kernel = Kernel::new("broken", &["fn main( {"], &[], [1, 1, 1]);
    const INVALID: Kernel = Kernel::new(
        "invalid",
        &["@compute @workgroup_size(1) fn main() { let word: u32 = 1.5; }"],
        &[],
        [1, 1, 1],
    );
    let mut figures = Vec::new();
    for kernel in [BROKEN, INVALID] {
        let mut recording = Recording::new("invalid");
        recording.dispatch(&kernel, &[], [1, 1, 1]);
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
