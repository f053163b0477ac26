//! What recordings promise: order, indirect dispatches, overlapping runs, sharing, times.

use super::holds;
use crate::suite::Outcome;
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Binding, Device, Error, Kernel, Recording, Timing, workgroups};

/// data[i] <- 3 data[i] + i: order shows.
pub(crate) const STEP: Kernel = Kernel::new(
    "step",
    &["
    @group(0) @binding(0) var<storage, read_write> data: array<u32>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        if id.x < arrayLength(&data) {
            data[id.x] = 3u * data[id.x] + id.x;
        }
    }"],
    &[Binding::read_write::<u32>("data")],
    [64, 1, 1],
);

/// What [`STEP`] does.
pub(crate) fn step(data: &mut [u32]) {
    for (i, word) in (0_u32..).zip(data) {
        *word = word.wrapping_mul(3).wrapping_add(i);
    }
}

pub(super) fn commands_in_order(device: &Device) -> Outcome {
    let len = 1000;
    let mut recording = Recording::new("commands in order");
    let data = recording.buffer_from("data", &vec![7_u32; len]);
    let copy = recording.buffer::<u32>("copy", len);
    let groups = workgroups(1000, 64);
    let mut expected = vec![7; len];
    for _ in 0..20 {
        recording.dispatch(&STEP, &[data.any()], groups);
        step(&mut expected);
    }
    recording.copy(data, copy);
    // An upload between dispatches takes effect between them.
    recording.upload(data, &[1, 2, 3]);
    recording.dispatch(&STEP, &[data.any()], groups);
    let mut second = expected.clone();
    second[..3].copy_from_slice(&[1, 2, 3]);
    step(&mut second);
    recording.download(data);
    recording.download(copy);
    let program = device.prepare(&recording)?;
    let output = program.run()?.wait()?;
    let mut figures = vec![
        holds("copy before the upload", output.read(copy)? == expected),
        holds("data after the upload", output.read(data)? == second),
    ];
    drop(output);
    program.write(data, &vec![0; len])?;
    let mut expected = vec![0; len];
    (0..20).for_each(|_| step(&mut expected));
    let output = program.run()?.wait()?;
    figures.push(holds("written content", output.read(copy)? == expected));
    let mut cleared = Recording::new("clear");
    let data = cleared.buffer_from("data", &[1_u32, 2]);
    cleared.clear(data);
    cleared.download(data);
    let output = device.prepare(&cleared)?.run()?.wait()?;
    figures.push(holds("cleared", output.read(data)? == [0, 0]));
    Ok(figures)
}

pub(super) fn indirect_dispatch(device: &Device) -> Outcome {
    // The number of workgroups is made on the device.
    const COUNT: Kernel = Kernel::new(
        "count_groups",
        &["
        @group(0) @binding(0) var<storage, read_write> groups: array<u32>;
        @compute @workgroup_size(1)
        fn main() {
            groups[4] = 2u;
            groups[5] = 1u;
            groups[6] = 1u;
        }"],
        &[Binding::read_write::<u32>("groups")],
        [1, 1, 1],
    );
    let mut recording = Recording::new("indirect");
    let groups = recording.buffer::<u32>("groups", 7);
    let data = recording.buffer_from("data", &[1_u32; 200]);
    recording.dispatch(&COUNT, &[groups.any()], [1, 1, 1]);
    recording.dispatch_indirect(&STEP, &[data.any()], groups, 4);
    recording.download(data);
    let found = device.prepare(&recording)?.run()?.wait()?.read(data)?;
    let mut expected = vec![1; 200];
    step(&mut expected[..128]);
    Ok(vec![holds("two workgroups of four", found == expected)])
}

pub(super) fn runs_overlap(device: &Device) -> Outcome {
    let mut recording = Recording::new("overlapping runs");
    let data = recording.buffer_from("data", &[1_u32; 100]);
    recording.dispatch(&STEP, &[data.any()], workgroups(100, 64));
    recording.download(data);
    let program = device.prepare(&recording)?;
    let runs = (0..8).map(|_| program.run());
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    let mut expected = vec![1; 100];
    let mut figures = Vec::new();
    for (number, run) in runs.into_iter().enumerate() {
        step(&mut expected);
        let output = run.wait()?;
        figures.push(holds(
            format!("run {number}"),
            output.read(data)? == expected,
        ));
    }
    // A run that nobody waits for costs the next nothing.
    drop(program.run()?);
    step(&mut expected);
    step(&mut expected);
    let run = program.run()?;
    while !run.is_done()? {
        std::thread::yield_now();
    }
    let mut found = vec![0; 100];
    run.wait()?.read_into(data, &mut found)?;
    figures.push(holds("after an abandoned run", found == expected));
    Ok(figures)
}

pub(super) fn shared_buffers(device: &Device) -> Outcome {
    let memory = device.buffer_from("memory", &[5_u32; 64])?;
    let make = |name| {
        let mut recording = Recording::new(name);
        let data = recording.shared::<u32>("data", 64);
        recording.dispatch(&STEP, &[data.any()], [1, 1, 1]);
        recording.download(data);
        (recording, data)
    };
    let ((first, in_first), (second, in_second)) = (make("first"), make("second"));
    let writer = device.prepare_with(&first, &[in_first.is(&memory)])?;
    let reader = device.prepare_with(&second, &[in_second.is(&memory)])?;
    drop(writer.run()?);
    let found = reader.run()?.wait()?.read(in_second)?;
    let mut expected = vec![5; 64];
    step(&mut expected);
    step(&mut expected);
    let refused = device.prepare(&first);
    Ok(vec![
        holds("one program reads what another wrote", found == expected),
        holds(
            "a shared buffer must be given",
            matches!(refused, Err(Error::Recording { .. })),
        ),
    ])
}

pub(super) fn times(device: &Device) -> Outcome {
    let mut recording = Recording::new("times");
    let data = recording.buffer::<u32>("data", 100_000);
    recording.scope("outer", |recording| {
        for _ in 0..5 {
            recording.dispatch(&STEP, &[data.any()], workgroups(100_000, 64));
        }
    });
    let mut program = device.prepare(&recording)?;
    if !device.features().contains(Features::TIMESTAMP_QUERY) {
        let refused = program.take_times(Timing::Whole);
        return Ok(vec![holds(
            "refused by name",
            matches!(refused, Err(Error::NoTimestamps { .. })),
        )]);
    }
    let none = program.run()?.wait()?.gpu_time();
    program.take_times(Timing::Whole)?;
    let whole = program.run()?.wait()?.gpu_time();
    program.take_times(Timing::Dispatches)?;
    let output = program.run()?.wait()?;
    let each = output.dispatch_times();
    let sum: f64 = each.iter().map(|(_, seconds)| seconds).sum();
    Ok(vec![
        holds("none unless asked for", none.is_none()),
        holds(
            "the whole takes time",
            whole.is_some_and(|s| s > 0.0 && s < 10.0),
        ),
        holds("each of five", each.len() == 5),
        holds(
            "labels",
            each.iter().all(|(label, _)| *label == "outer.step"),
        ),
        holds(
            "the parts fill no more than the whole",
            output
                .gpu_time()
                .is_some_and(|all| sum > 0.0 && sum <= 1.01 * all + 1e-6),
        ),
    ])
}
