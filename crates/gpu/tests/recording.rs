//! Recordings are built, checked and printed without a GPU.

use vertebra_gpu::wgpu::{Features, Limits};
use vertebra_gpu::{Binding, Error, Kernel, Problem, Recording, Shortfall, workgroups};

/// Never compiled here.
const BLEND: Kernel = Kernel::new(
    "blend",
    &[""],
    &[
        Binding::uniform::<[f32; 4]>("weights"),
        Binding::read::<f32>("source"),
        Binding::read_write::<f32>("target"),
    ],
    [256, 1, 1],
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
    let cases: [(&str, u32, Lower); 9] = [
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
        ("max_compute_workgroup_size_x", 256, |l, x| {
            l.max_compute_workgroup_size_x = x;
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
    for number in 0..33 {
        recording.stage(&format!("stage {number}"));
    }
    let found = problems(&recording, &Limits::downlevel_defaults(), Features::empty());
    assert!(
        matches!(
            found[..],
            [
                Problem::Element { bytes: 2, .. },
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
}
