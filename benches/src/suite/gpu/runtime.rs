//! What recordings promise: order, indirect dispatches, overlapping runs, sharing, times.

use super::holds;
use crate::suite::Outcome;
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Binding, Device, ELEMENTS, Error, Kernel, Recording, Timing, workgroups};

/// data[i] <- 3 data[i] + i: order shows.
pub(crate) const STEP: Kernel = Kernel::new(
    "step",
    &[
        "
    @group(0) @binding(0) var<storage, read_write> data: array<u32>;
    @compute @workgroup_size(64)
    fn main(
        @builtin(global_invocation_id) id: vec3<u32>,
        @builtin(num_workgroups) groups: vec3<u32>,
    ) {
        let i = element(id, groups, 64u);
        if i < arrayLength(&data) {
            data[i] = 3u * data[i] + i;
        }
    }",
        ELEMENTS,
    ],
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

/// More workgroups of 64 than one dimension holds, from the host and from the device: each element
/// is reached once.
pub(super) fn elements_in_two_dimensions(device: &Device) -> Outcome {
    const LENGTHS: [u32; 9] = [
        0,
        1,
        63,
        64,
        65,
        65_535 * 64,
        65_535 * 64 + 1,
        1 << 30,
        1 << 31,
    ];
    const COUNT: Kernel = Kernel::new(
        "count_groups",
        &[
            "
        @group(0) @binding(0) var<storage, read> lengths: array<u32>;
        @group(0) @binding(1) var<storage, read_write> groups: array<u32>;
        @compute @workgroup_size(1)
        fn main(@builtin(workgroup_id) id: vec3<u32>) {
            let counts = workgroups(lengths[id.x], 64u);
            for (var axis = 0u; axis < 3u; axis++) {
                groups[3u * id.x + axis] = counts[axis];
            }
        }",
            ELEMENTS,
        ],
        &[
            Binding::read::<u32>("lengths"),
            Binding::read_write::<u32>("groups"),
        ],
        [1, 1, 1],
    );
    let mut recording = Recording::new("groups");
    let lengths = recording.buffer_from("lengths", &LENGTHS);
    let groups = recording.buffer::<u32>("groups", 3 * LENGTHS.len());
    recording.dispatch(&COUNT, &[lengths.any(), groups.any()], [9, 1, 1]);
    recording.download(groups);
    let found = device.prepare(&recording)?.run()?.wait()?.read(groups)?;
    let counted = LENGTHS.map(|len| workgroups(len, 64));
    let mut figures = vec![holds("counted alike", found == counted.as_flattened())];

    let len = LENGTHS[6];
    let mut expected = vec![1; usize::try_from(len)?];
    step(&mut expected);
    let mut direct = Recording::new("direct");
    let data = direct.buffer_from("data", &vec![1_u32; expected.len()]);
    direct.dispatch(&STEP, &[data.any()], workgroups(len, 64));
    direct.download(data);
    let found = device.prepare(&direct)?.run()?.wait()?.read(data)?;
    figures.push(holds("each element once", found == expected));
    let mut indirect = Recording::new("indirect");
    let data = indirect.buffer_from("data", &vec![1_u32; expected.len()]);
    let lengths = indirect.buffer_from("lengths", &LENGTHS);
    let groups = indirect.buffer::<u32>("groups", 3 * LENGTHS.len());
    indirect.dispatch(&COUNT, &[lengths.any(), groups.any()], [9, 1, 1]);
    indirect.dispatch_indirect(&STEP, &[data.any()], groups, 18);
    indirect.download(data);
    let found = device.prepare(&indirect)?.run()?.wait()?.read(data)?;
    figures.push(holds("each element once, indirectly", found == expected));
    Ok(figures)
}

/// `arrayLength` is the number of elements, and of none it is one, which is zero.
pub(super) fn lengths(device: &Device) -> Outcome {
    const LENGTH: Kernel = Kernel::new(
        "length",
        &["
        @group(0) @binding(0) var<storage, read> data: array<u32>;
        @group(0) @binding(1) var<storage, read_write> found: array<u32>;
        @compute @workgroup_size(1)
        fn main() {
            found[0] = arrayLength(&data);
            found[1] = arrayLength(&found);
            found[2] = data[0];
        }"],
        &[
            Binding::read::<u32>("data"),
            Binding::read_write::<u32>("found"),
        ],
        [1, 1, 1],
    );
    let mut figures = Vec::new();
    for len in 0..6 {
        let content = vec![7_u32; len];
        let expected = [u32::try_from(len.max(1))?, 3, if len == 0 { 0 } else { 7 }];
        let mut own = Recording::new("own");
        let data = own.buffer_from("data", &content);
        let found = own.buffer::<u32>("found", 3);
        own.dispatch(&LENGTH, &[data.any(), found.any()], [1, 1, 1]);
        own.download(found);
        let output = device.prepare(&own)?.run()?.wait()?;
        figures.push(holds(format!("{len}"), output.read(found)? == expected));
        let memory = device.buffer_from("memory", &content)?;
        let mut given = Recording::new("given");
        let data = given.shared::<u32>("data", len);
        let found = given.buffer::<u32>("found", 3);
        given.dispatch(&LENGTH, &[data.any(), found.any()], [1, 1, 1]);
        given.download(found);
        let program = device.prepare_with(&given, &[data.is(&memory)])?;
        let found = program.run()?.wait()?.read(found)?;
        figures.push(holds(format!("{len}, shared"), found == expected));
    }
    Ok(figures)
}

/// Repetitions in one submission are runs one after the other, read once.
pub(super) fn repetitions(device: &Device) -> Outcome {
    let len = 100;
    let repeated = |count| {
        let mut data = vec![1; len];
        (0..count).for_each(|_| step(&mut data));
        data
    };
    let mut alone = Recording::new("dispatches alone");
    let data = alone.buffer_from("data", &vec![1_u32; len]);
    alone.dispatch(&STEP, &[data.any()], workgroups(100, 64));
    alone.download(data);
    let mut program = device.prepare(&alone)?;
    let mut figures = Vec::new();
    let mut sum = 0;
    // Times must not change what is computed.
    let timed = device.features().contains(Features::TIMESTAMP_QUERY);
    for timing in [
        Timing::Off,
        Timing::Whole,
        Timing::Commands,
        Timing::Dispatches,
    ] {
        if timing != Timing::Off && !timed {
            continue;
        }
        program.take_times(timing)?;
        for count in [3, 0, 1, 7] {
            sum += count;
            let output = program.run_times(count)?.wait()?;
            let name = format!("{count} repetitions, {timing:?}");
            let has_time = output.gpu_time().is_some_and(|seconds| seconds > 0.0);
            let right = has_time == (timing != Timing::Off && count > 0)
                && output.read(data)? == repeated(sum);
            figures.push(holds(name, right));
        }
    }
    // A dispatch and a download each.
    let endless = program.run_times(u32::MAX);
    figures.push(holds(
        "more than a submission holds",
        matches!(
            endless,
            Err(Error::Repetitions {
                most: 2_097_152,
                ..
            })
        ),
    ));
    // Commands between the passes, and a download in the middle.
    let mut mixed = Recording::new("mixed");
    let data = mixed.buffer_from("data", &vec![1_u32; len]);
    let before = mixed.buffer::<u32>("before", len);
    mixed.download(data);
    mixed.copy(data, before);
    mixed.dispatch(&STEP, &[data.any()], workgroups(100, 64));
    mixed.download(before);
    let output = device.prepare(&mixed)?.run_times(4)?.wait()?;
    let found = (output.read(data)?, output.read(before)?);
    figures.push(holds("mixed", found == (repeated(3), repeated(3))));
    Ok(figures)
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
    // Copies alone count with the commands only.
    let mut copies = Recording::new("copies");
    let from = copies.buffer::<u32>("from", 1 << 20);
    let to = copies.buffer::<u32>("to", 1 << 20);
    copies.copy(from, to);
    let mut copying = device.prepare(&copies)?;
    copying.take_times(Timing::Whole)?;
    let dispatches = copying.run()?.wait()?.gpu_time();
    copying.take_times(Timing::Commands)?;
    let commands = copying.run()?.wait()?.gpu_time();
    // More than one set of timestamps holds.
    let many = 2 * 2048 + 10;
    let mut long = Recording::new("long");
    let data = long.buffer::<u32>("data", 64);
    for number in 0..many {
        let name = format!("{number}");
        long.scope(&name, |long| long.dispatch(&STEP, &[data.any()], [1, 1, 1]));
    }
    let mut long = device.prepare(&long)?;
    long.take_times(Timing::Dispatches)?;
    let long_output = long.run()?.wait()?;
    let long_times = long_output.dispatch_times();
    let long_sum: f64 = long_times.iter().map(|(_, seconds)| seconds).sum();
    let last = format!("{}.step", many - 1);
    Ok(vec![
        holds(
            "copies count with commands",
            dispatches.is_none() && commands.is_some_and(|s| s > 0.0),
        ),
        holds(
            "each of many dispatches",
            long_times.len() == many
                && long_times.last().is_some_and(|(label, _)| *label == last)
                && long_output
                    .gpu_time()
                    .is_some_and(|all| long_sum <= 1.01 * all + 1e-6),
        ),
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
