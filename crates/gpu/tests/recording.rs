//! Recordings are built, checked and printed without a GPU.

use vertebra_gpu::wgpu::{Features, Limits};
use vertebra_gpu::{Binding, Error, Kernel, Problem, Recording, STATUS, Shortfall, workgroups};

/// Never compiled here.
const BLEND: Kernel = Kernel::new(
    "blend",
    &[""],
    &[
        Binding::uniform::<[f32; 4]>("weights"),
        Binding::read::<f32>("source"),
        Binding::read_write::<f32>("target"),
    ],
    [64, 2, 2],
)
.workgroup_memory_of(1024);

fn problems(recording: &Recording, limits: &Limits, features: Features) -> Vec<Problem> {
    match recording.check(limits, features) {
        Ok(()) => Vec::new(),
        Err(Error::Recording { problems, .. }) => problems,
        Err(other) => unreachable!("{other}"),
    }
}

fn blend(len: usize) -> Recording {
    let mut recording = Recording::new("blend twice");
    let weights = recording.buffer_from("weights", &[[0.5_f32, 0.25, 0.125, 0.125]]);
    let source = recording.shared::<f32>("source", len);
    let target = recording.buffer::<f32>("target", len);
    let groups = recording.buffer::<u32>("groups", 3);
    recording.upload(groups, &[4, 1, 1]);
    recording.clear(target);
    recording.scope("first", |recording| {
        let buffers = [weights.any(), source.any(), target.any()];
        recording.dispatch(&BLEND, &buffers, [4, 1, 1]);
    });
    let buffers = [weights.any(), source.any(), target.any()];
    recording.dispatch_indirect(&BLEND, &buffers, groups, 0);
    recording.download(target);
    recording
}

#[test]
fn a_recording_is_printed_line_by_line() {
    assert_eq!(
        blend(1000).to_string(),
        "\
recording `blend twice`: 4 buffers, 5 commands, 2 of them dispatches
  weights: [[f32; 4]; 1], with content
  source: [f32; 1000], shared
  target: [f32; 1000]
  groups: [u32; 3]
    0 upload 12 bytes to groups
    1 clear target
    2 dispatch first.blend 4 x 1 x 1: weights, source, *target
    3 dispatch blend as groups says at word 0: weights, source, *target
    4 download target
"
    );
}

#[test]
fn what_fits_has_no_problem() {
    let limits = Limits::downlevel_defaults();
    assert_eq!(problems(&blend(1000), &limits, Features::empty()), []);
}

/// Each limit by itself, one below what is needed and at it.
#[test]
fn each_limit_is_checked_to_the_unit() {
    type Lower = fn(&mut Limits, u32);
    let cases: [(&str, u32, Lower); 11] = [
        ("max_buffer_size", 4000, |l, x| l.max_buffer_size = x.into()),
        ("max_storage_buffer_binding_size", 4000, |l, x| {
            l.max_storage_buffer_binding_size = x.into();
        }),
        ("max_uniform_buffer_binding_size", 16, |l, x| {
            l.max_uniform_buffer_binding_size = x.into();
        }),
        ("max_storage_buffers_per_shader_stage", 2, |l, x| {
            l.max_storage_buffers_per_shader_stage = x;
        }),
        ("max_uniform_buffers_per_shader_stage", 1, |l, x| {
            l.max_uniform_buffers_per_shader_stage = x;
        }),
        ("max_compute_workgroup_size_x", 64, |l, x| {
            l.max_compute_workgroup_size_x = x;
        }),
        ("max_compute_workgroup_size_y", 2, |l, x| {
            l.max_compute_workgroup_size_y = x;
        }),
        ("max_compute_workgroup_size_z", 2, |l, x| {
            l.max_compute_workgroup_size_z = x;
        }),
        ("max_compute_invocations_per_workgroup", 256, |l, x| {
            l.max_compute_invocations_per_workgroup = x;
        }),
        ("max_compute_workgroup_storage_size", 1024, |l, x| {
            l.max_compute_workgroup_storage_size = x;
        }),
        ("max_compute_workgroups_per_dimension", 4, |l, x| {
            l.max_compute_workgroups_per_dimension = x;
        }),
    ];
    let recording = blend(1000);
    for (name, needed, lower) in cases {
        let mut limits = Limits::downlevel_defaults();
        lower(&mut limits, needed);
        assert_eq!(
            problems(&recording, &limits, Features::empty()),
            [],
            "{name}"
        );
        lower(&mut limits, needed - 1);
        let found = problems(&recording, &limits, Features::empty());
        assert!(!found.is_empty(), "{name} is not checked");
        for problem in found {
            let expected = Shortfall::Limit {
                limit: name,
                needed: needed.into(),
                available: u64::from(needed) - 1,
            };
            assert!(
                matches!(&problem, Problem::Limit { shortfall, .. } if *shortfall == expected),
                "{problem}"
            );
        }
    }
}

/// Of a part of a buffer the part counts, which has to be within it.
#[test]
fn parts_are_downloaded_by_themselves() {
    let mut recording = Recording::new("parts");
    let values = recording.buffer::<u32>("values", 100);
    let others = recording.buffer::<u32>("others", 100);
    recording.download_part(values, 90..100);
    recording.download_part(others, 0..5);
    let limits = Limits {
        max_buffer_size: 400,
        ..Limits::default()
    };
    assert!(recording.check(&limits, Features::empty()).is_ok());
    assert!(
        recording
            .to_string()
            .contains("download bytes 360 to 400 of values")
    );
    recording.download_part(values, 90..101);
    let refused = problems(&recording, &limits, Features::empty());
    let texts: Vec<String> = refused.iter().map(Problem::to_string).collect();
    assert_eq!(texts, ["download 2: `values` has 400 bytes, not 404"]);
}

/// Downloads share one buffer, and the status word is among them; a second download of a buffer
/// replaces the first.
#[test]
fn downloads_fit_one_buffer_together() {
    let mut recording = Recording::new("downloads");
    let first = recording.buffer::<u32>("first", 100);
    let second = recording.buffer::<u32>("second", 100);
    recording.status();
    recording.download(first);
    recording.download(second);
    recording.download(first);
    let mut limits = Limits::downlevel_defaults();
    limits.max_buffer_size = 400 + 400 + 4 * 33;
    assert_eq!(problems(&recording, &limits, Features::empty()), []);
    limits.max_buffer_size -= 1;
    let found = problems(&recording, &limits, Features::empty());
    let texts: Vec<String> = found.iter().map(Problem::to_string).collect();
    assert_eq!(
        texts,
        ["what is downloaded, together, needs max_buffer_size = 932 (it has 931)"]
    );
}

/// Sizes that no machine has are named, not wrapped.
#[test]
fn sizes_do_not_wrap() {
    let mut recording = Recording::new("huge");
    let most = usize::MAX;
    let huge = recording.buffer::<[u32; 4]>("huge", most / 8);
    let groups = recording.buffer::<u32>("groups", 3);
    let data = recording.buffer::<f32>("data", 4);
    const WIDE: Kernel = Kernel::new(
        "wide",
        &[""],
        &[Binding::read::<f32>("data")],
        [u32::MAX; 3],
    );
    recording.dispatch_indirect(&WIDE, &[data.any()], groups, most);
    recording.download(huge);
    let mut limits = Limits::downlevel_defaults();
    limits.max_buffer_size = u64::MAX;
    let found = problems(&recording, &limits, Features::empty());
    let overflows = |p: &Problem| matches!(p, Problem::Overflow { stride: 16, .. });
    assert_eq!(
        found.iter().filter(|p| overflows(p)).count(),
        1,
        "{found:?}"
    );
    let invocations = found.iter().any(|problem| {
        matches!(problem, Problem::Limit { shortfall: Shortfall::Limit { limit, needed, .. }, .. }
            if *limit == "max_compute_invocations_per_workgroup" && *needed == u64::MAX)
    });
    assert!(invocations, "{found:?}");
    let beyond = |p: &Problem| {
        matches!(
            p,
            Problem::Size {
                needed: u64::MAX,
                ..
            }
        )
    };
    assert!(found.iter().any(beyond), "{found:?}");
}

/// A kernel that calls `fail` is refused where nobody would hear of it.
#[test]
fn failures_are_not_lost() {
    const FAILS: Kernel = Kernel::new(
        "fails",
        &["", STATUS],
        &[Binding::read_write::<u32>("status")],
        [1, 1, 1],
    );
    let find = |recording: &Recording| {
        let limits = Limits::downlevel_defaults();
        let found = problems(recording, &limits, Features::empty());
        found.iter().map(Problem::to_string).collect::<Vec<_>>()
    };
    let mut other = Recording::new("other");
    let foreign = other.stage("first of another");
    let mut recording = Recording::new("stages");
    let stage = recording.stage("first");
    let plain = recording.buffer::<u32>("plain", 33);
    let status = recording.status();
    let with = |kernel: Kernel, buffer: vertebra_gpu::Slot<u32>| {
        let mut recording = recording.clone();
        recording.dispatch(&kernel, &[buffer.any()], [1, 1, 1]);
        find(&recording)
    };
    assert_eq!(with(FAILS.constant("STAGE", stage), status), [""; 0]);
    let prefix = "dispatch 0 `fails` can fail, but ";
    assert_eq!(
        with(FAILS, status),
        [format!(
            "{prefix}has no stage: give it `.constant(\"STAGE\", stage)` with `recording.stage(name)`"
        )]
    );
    // A bare number is no stage, and replaces one.
    let numbered = FAILS.constant("STAGE", stage).constant("STAGE", 0_u32);
    assert_eq!(with(numbered, status).len(), 1);
    assert_eq!(
        with(FAILS.constant("STAGE", foreign), status),
        [format!("{prefix}its stage is one of another recording")]
    );
    assert_eq!(
        with(FAILS.constant("STAGE", stage), plain),
        [format!(
            "{prefix}its last buffer is not `recording.status()`"
        )]
    );
}

/// The text of the part in a longer one asks for a stage all the same.
#[test]
fn failures_of_a_longer_part_are_not_lost() {
    const FAILS: Kernel = Kernel::new(
        "fails",
        &[""],
        &[Binding::read_write::<u32>("status")],
        [1, 1, 1],
    );
    let mut recording = Recording::new("longer");
    let status = recording.status();
    let kernel = FAILS.with_text(format!("// Before.\n{STATUS}\n// After."));
    recording.dispatch(&kernel, &[status.any()], [1, 1, 1]);
    let found = problems(&recording, &Limits::downlevel_defaults(), Features::empty());
    assert!(matches!(found[..], [Problem::Stage { .. }]), "{found:?}");
}

/// What would wipe failures out is refused.
#[test]
fn only_kernels_write_the_status_word() {
    let mut recording = Recording::new("wiped");
    let plain = recording.buffer::<u32>("plain", 33);
    let status = recording.status();
    recording.copy(status, plain);
    recording.download(status);
    let limits = Limits::downlevel_defaults();
    assert_eq!(problems(&recording, &limits, Features::empty()), []);
    recording.clear(status);
    recording.upload(status, &[0]);
    recording.copy(plain, status);
    let found = problems(&recording, &limits, Features::empty());
    let commands: Vec<&str> = found
        .iter()
        .map(|problem| match problem {
            Problem::Status { command, .. } => command.as_str(),
            _ => "",
        })
        .collect();
    assert_eq!(commands, ["clear 2", "upload 3", "copy 4"], "{found:?}");
}

#[test]
fn copies_are_of_equal_length() {
    let mut recording = Recording::new("copies");
    let [short, long] = [("short", 3), ("long", 4)].map(|(n, len)| recording.buffer::<u32>(n, len));
    recording.copy(short, long);
    recording.copy(long, short);
    let found = problems(&recording, &Limits::downlevel_defaults(), Features::empty());
    let texts: Vec<String> = found.iter().map(Problem::to_string).collect();
    assert_eq!(
        texts,
        [
            "copy 0: `short` has 3 elements and `long` has 4; they must have equally many",
            "copy 1: `long` has 4 elements and `short` has 3; they must have equally many",
        ]
    );
}

/// A clone has the buffers of its original; what either declares later is its own.
#[test]
fn slots_of_a_clone_are_told_apart() {
    let mut first = Recording::new("first");
    let common = first.buffer::<u32>("common", 4);
    let mut second = first.clone();
    let in_first = first.buffer::<[u32; 2]>("in first", 4);
    let in_second = second.buffer::<u32>("in second", 5);
    assert_eq!((first.len(common), second.len(common)), (Some(4), Some(4)));
    assert_eq!((first.len(in_second), second.len(in_first)), (None, None));
    second.download(in_first);
    let found = problems(&second, &Limits::downlevel_defaults(), Features::empty());
    assert!(matches!(found[..], [Problem::Foreign { .. }]), "{found:?}");
}

#[test]
fn a_feature_the_device_lacks_is_named() {
    let mut recording = Recording::new("features");
    let data = recording.buffer::<f32>("data", 4);
    let kernel = BLEND.requires(Features::SHADER_F64);
    recording.dispatch(&kernel, &[data.any()], [1, 1, 1]);
    let found = problems(&recording, &Limits::downlevel_defaults(), Features::empty());
    let texts: Vec<String> = found.iter().map(Problem::to_string).collect();
    assert_eq!(
        texts,
        [
            "dispatch 0 `blend` uses SHADER_F64, with which the device was not opened",
            "dispatch 0 `blend` has 3 bindings, 1 buffers were given",
        ]
    );
}

#[test]
fn elements_are_whole_words_and_stages_fit_a_word() {
    let mut recording = Recording::new("odd");
    recording.buffer::<u16>("halves", 8);
    recording.buffer::<[u32; 0]>("nothing", 8);
    for number in 0..33 {
        recording.stage(&format!("stage {number}"));
    }
    let found = problems(&recording, &Limits::downlevel_defaults(), Features::empty());
    assert!(
        matches!(
            found[..],
            [
                Problem::Element { bytes: 2, .. },
                Problem::Element { bytes: 0, .. },
                Problem::Stages { stages: 33 }
            ]
        ),
        "{found:?}"
    );
}

#[test]
fn workgroups_cover_all_items_within_the_limit() {
    for items in [
        0,
        1,
        255,
        256,
        257,
        65_535 * 256,
        65_535 * 256 + 1,
        u32::MAX,
    ] {
        for per_group in [64, 256] {
            let [x, y, z] = workgroups(items, per_group);
            let covered = u64::from(x) * u64::from(y) * u64::from(per_group);
            assert!(
                x <= 65_535 && y <= 65_535 && z == 1,
                "{items} by {per_group}"
            );
            assert!(covered >= u64::from(items), "{items} by {per_group}");
        }
    }
}

#[test]
fn kernels_with_other_parts_or_constants_are_others() {
    assert_eq!(BLEND, BLEND.clone());
    assert_ne!(BLEND, BLEND.with("fn f() {}"));
    assert_ne!(BLEND.constant("K", 1.0_f32), BLEND.constant("K", 2.0_f32));
    assert_ne!(BLEND.stride("source", 8), BLEND);
    // Made at run time.
    let part = format!("const N: u32 = {};", 3);
    let made = BLEND.named("blend of 3".to_owned()).with_text(part);
    assert_eq!(made.name(), "blend of 3");
    assert_eq!(made.source(), "\nconst N: u32 = 3;");
}
