//! Things that belong elsewhere or are not what they are declared to be: each is refused by name.

use super::faults::{DOUBLE, refused};
use super::holds;
use crate::suite::Outcome;
use vertebra_gpu::{Binding, Device, Error, Failure, Kernel, Problem, Recording, STATUS, Shared};

/// Buffers of another device, of another recording, and the same one twice.
pub(super) fn wrong_sharing(device: &Device) -> Outcome {
    let other = device.reopen()?;
    let mut recording = Recording::new("sharing");
    let first = recording.shared::<u32>("first", 4);
    let second = recording.shared::<u32>("second", 4);
    recording.dispatch(&DOUBLE, &[first.any()], [1, 1, 1]);
    recording.dispatch(&DOUBLE, &[second.any()], [1, 1, 1]);
    recording.download(first);
    recording.download(second);
    let mut elsewhere = Recording::new("elsewhere");
    let foreign = elsewhere.shared::<u32>("foreign", 4);
    let memory = device.buffer_from("memory", &[1_u32, 2, 3, 4])?;
    let more = device.buffer::<u32>("more", 4)?;
    let strange = other.buffer::<u32>("strange", 4)?;
    let cases: [(&str, &[Shared], &str); 4] = [
        (
            "another device's",
            &[first.is(&memory), second.is(&strange)],
            "shared buffer `second`: the buffer given belongs to another device",
        ),
        (
            "the same in two slots",
            &[first.is(&memory), second.is(&memory.clone())],
            "shared buffer `second`: the buffer given is in another slot already",
        ),
        (
            "two in one slot",
            &[first.is(&memory), second.is(&more), first.is(&more)],
            "shared buffer `first`: two buffers are given for it",
        ),
        (
            "for another recording",
            &[first.is(&memory), second.is(&more), foreign.is(&more)],
            "shared buffer `more`: the slot it is given for belongs to another recording",
        ),
    ];
    let mut figures = Vec::new();
    for (what, given, expected) in cases {
        let prepared = device.prepare_with(&recording, given);
        figures.extend(refused(device, what, prepared, |error| {
            matches!(error, Error::Recording { problems, .. }
                if problems.iter().map(Problem::to_string).eq([expected]))
        })?);
    }
    let program = device.prepare_with(&recording, &[first.is(&memory), second.is(&more)])?;
    let found = program.run()?.wait()?.read(first)?;
    figures.push(holds("the right ones", found == [2, 4, 6, 8]));
    Ok(figures)
}

/// Slots of a clone and of another recording, where those of this one are expected.
pub(super) fn wrong_slots(device: &Device) -> Outcome {
    let mut recording = Recording::new("original");
    let common = recording.buffer_from("common", &[1_u32, 2, 3]);
    recording.download(common);
    let mut clone = recording.clone();
    let narrow = recording.buffer_from("narrow", &[4_u32, 5, 6]);
    recording.download(narrow);
    let wide = clone.buffer::<[u32; 2]>("wide", 4);
    clone.download(wide);
    let program = device.prepare(&recording)?;
    let output = program.run()?.wait()?;
    let is_wrong = |error: &Error| matches!(error, Error::WrongBuffer { .. });
    let mut figures = refused(device, "reading", output.read(wide), is_wrong)?;
    let read = output.read_into(wide, &mut [[0; 2]; 4]);
    figures.extend(refused(device, "reading into", read, is_wrong)?);
    let written = program.write(wide, &[[0; 2]; 4]);
    figures.extend(refused(device, "writing", written, is_wrong)?);
    let found = (output.read(common)?, output.read(narrow)?);
    figures.push(holds("its own", found == (vec![1, 2, 3], vec![4, 5, 6])));
    drop(output);
    let found = program.run()?.wait()?.read(narrow)?;
    figures.push(holds("nothing was written", found == [4, 5, 6]));
    let found = device.prepare(&clone)?.run()?.wait()?.read(common)?;
    figures.push(holds("the clone has it too", found == [1, 2, 3]));
    Ok(figures)
}

/// Kernels that report a failure to nobody are refused; one that writes the status word itself is
/// heard.
pub(super) fn unheard_failures(device: &Device) -> Outcome {
    const ALWAYS: Kernel = Kernel::new(
        "always",
        &[
            "
        @group(0) @binding(0) var<storage, read_write> status: array<atomic<u32>>;
        @compute @workgroup_size(1)
        fn main() { fail(7u); }",
            STATUS,
        ],
        &[Binding::read_write::<u32>("status")],
        [1, 1, 1],
    );
    const ITSELF: Kernel = Kernel::new(
        "itself",
        &["
        @group(0) @binding(0) var<storage, read_write> status: array<atomic<u32>>;
        @compute @workgroup_size(1)
        fn main() {
            atomicOr(&status[0], 8u);
            atomicMax(&status[4], ~5u);
        }"],
        &[Binding::read_write::<u32>("status")],
        [1, 1, 1],
    );
    let record = |kernel: &Kernel, stages: &[&str]| {
        let mut recording = Recording::new("failing");
        let given = stages.iter().map(|name| recording.stage(name)).last();
        let status = recording.status();
        let kernel = given.map_or_else(|| kernel.clone(), |s| kernel.clone().constant("STAGE", s));
        recording.dispatch(&kernel, &[status.any()], [1, 1, 1]);
        recording
    };
    let is_stage = |error: &Error| {
        matches!(error, Error::Recording { problems, .. }
            if matches!(problems[..], [Problem::Stage { .. }]))
    };
    let prepared = device.prepare(&record(&ALWAYS, &[]));
    let mut figures = refused(device, "no stage", prepared, is_stage)?;
    let failed = |recording: &Recording, stage: &str, element: u32, repetitions| {
        let expected = Failure {
            stage: stage.to_owned(),
            element,
        };
        let result = device.prepare(recording)?.run_times(repetitions)?.wait();
        let as_expected =
            matches!(&result, Err(Error::Failed { failures, .. }) if *failures == [expected]);
        Ok::<_, Error>(holds(
            format!("{:?}", result.err().map(|error| error.to_string())),
            as_expected,
        ))
    };
    let declared = record(&ALWAYS, &["first", "second"]);
    figures.push(failed(&declared, "second", 7, 1)?);
    figures.push(failed(&declared, "second", 7, 3)?);
    let itself = record(&ITSELF, &[]);
    figures.push(failed(&itself, "3, which is not declared", 5, 1)?);
    Ok(figures)
}

/// A failure of an early repetition is not forgotten by the later ones.
pub(super) fn failures_of_repetitions(device: &Device) -> Outcome {
    const ONCE: Kernel = Kernel::new(
        "once",
        &[
            "
        @group(0) @binding(0) var<storage, read_write> round: array<u32>;
        @group(0) @binding(1) var<storage, read_write> status: array<atomic<u32>>;
        @compute @workgroup_size(1)
        fn main() {
            if round[0] == 1u { fail(3u); }
            round[0] += 1u;
        }",
            STATUS,
        ],
        &[
            Binding::read_write::<u32>("round"),
            Binding::read_write::<u32>("status"),
        ],
        [1, 1, 1],
    );
    let mut recording = Recording::new("once");
    let round = recording.buffer::<u32>("round", 1);
    let stage = recording.stage("second round");
    let status = recording.status();
    let kernel = ONCE.constant("STAGE", stage);
    recording.dispatch(&kernel, &[round.any(), status.any()], [1, 1, 1]);
    recording.download(round);
    let program = device.prepare(&recording)?;
    let (output, failures) = program.run_times(5)?.wait_for_all()?;
    let after = output.read(round)?;
    drop(output);
    Ok(vec![
        holds("all five", after == [5]),
        holds("heard", failures.len() == 1 && failures[0].element == 3),
        holds("the next are fine", program.run_times(5)?.wait().is_ok()),
    ])
}

/// What a kernel declares is compared with its shader.
pub(super) fn kernel_differs(device: &Device) -> Outcome {
    const SHADER: &str = "
        @group(0) @binding(1) var<storage, read_write> data: array<u32>;
        @compute @workgroup_size(32)
        fn main() { data[0] = 1u; }";
    const BINDINGS: &[Binding] = &[Binding::read_write::<u32>("data")];
    // The binding has another number; the workgroup another size.
    const OTHER: Kernel = Kernel::new("other", &[SHADER], BINDINGS, [64, 1, 1]);
    let mut recording = Recording::new("differs");
    let data = recording.buffer::<u32>("data", 1);
    recording.dispatch(&OTHER, &[data.any()], [1, 1, 1]);
    let prepared = device.prepare(&recording);
    let expected = OTHER.differences();
    let figures = refused(device, "a kernel that differs", prepared, |error| {
        matches!(error, Error::Recording { problems, .. }
            if *problems == expected && problems.len() == 3)
    })?;
    Ok(figures)
}
