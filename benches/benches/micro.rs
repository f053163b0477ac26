//! Times of single functions, to find which one got slower between two commits.
//!
//! These say nothing of accuracy: for speed beside error, run `cargo xtask bench`.

#![expect(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use vertebra::collision::{RelativePose, exact::triangles_intersect};
use vertebra::glam::{DQuat, DVec3, Vec3};
use vertebra::{
    Batch, Forces, Model, Pose, Precision, State, Workspace, aba, aba_batch, crba, generate, rnea,
};

/// A chain, as long as the source's shortest or as a robot arm.
fn chain(count: usize) -> (Model, State, Forces) {
    let model = generate::random_chain(count, &generate::Rod::default(), 1).unwrap();
    let state = State::random(&model, 2);
    let forces = Forces::none(&model);
    (model, state, forces)
}

fn dynamics(c: &mut Criterion) {
    let (model, state, forces) = chain(128);
    for precision in [Precision::F64, Precision::F32] {
        let mut workspace = Workspace::new(&model, precision);
        c.bench_function(&format!("aba/chain 128/{precision}"), |b| {
            b.iter(|| aba(&model, &state, &forces, &mut workspace).map(|qdd| qdd[0]));
        });
    }
    let (arm, ..) = chain(7);
    let states: Vec<_> = (0..64).map(|seed| State::random(&arm, seed)).collect();
    let none = vec![Forces::none(&arm); states.len()];
    for precision in [Precision::F64, Precision::F32] {
        let mut batch = Batch::with_threads(&arm, precision, 1);
        c.bench_function(&format!("aba_batch/64 chains 7/{precision}"), |b| {
            b.iter(|| aba_batch(&arm, &states, &none, &mut batch).map(|qdd| qdd[0]));
        });
    }
    let mut workspace = Workspace::new(&model, Precision::F64);
    let qdd = State::random(&model, 3).qd;
    c.bench_function("rnea/chain 128/f64", |b| {
        b.iter(|| rnea(&model, &state, &qdd, &forces, &mut workspace).map(|tau| tau[0]));
    });
    let (model, state, _) = chain(7);
    let mut workspace = Workspace::new(&model, Precision::F64);
    c.bench_function("crba/chain 7/f64", |b| {
        b.iter(|| crba(&model, &state, &mut workspace).map(|mass| mass[(0, 0)]));
    });
}

/// Pairs that the exact test decides at different stages, each with its answer.
fn pairs() -> [(&'static str, [DVec3; 3], bool); 5] {
    let v = DVec3::new;
    [
        (
            "far",
            [v(9.1, 9.0, 9.3), v(9.7, 9.2, 9.1), v(9.3, 9.8, 9.9)],
            false,
        ),
        (
            "plane between",
            [v(0.2, 0.1, 0.3), v(0.9, 0.3, 0.1), v(0.1, 0.8, 0.2)],
            false,
        ),
        (
            "crossing",
            [v(0.2, 0.1, -0.3), v(0.4, 0.3, 0.7), v(0.1, 0.8, 0.6)],
            true,
        ),
        (
            "touching",
            [v(0.25, 0.25, 0.0), v(0.4, 0.3, 0.7), v(0.1, 0.8, 0.6)],
            true,
        ),
        (
            "coplanar",
            [v(0.2, 0.2, 0.0), v(0.9, 0.3, 0.0), v(0.3, 0.8, 0.0)],
            true,
        ),
    ]
}

fn collision(c: &mut Criterion) {
    let a = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let mut group = c.benchmark_group("exact::triangles_intersect");
    for (name, b, expected) in pairs() {
        assert_eq!(triangles_intersect(&a, &b), expected, "{name}");
        group.bench_with_input(BenchmarkId::from_parameter(name), &b, |bench, b| {
            bench.iter(|| triangles_intersect(black_box(&a), black_box(b)));
        });
    }
    group.finish();
    let pose = Pose::new(DQuat::from_rotation_z(0.3), DVec3::new(0.1, 0.2, 0.3));
    let pose = RelativePose::between(&Pose::IDENTITY, &pose).unwrap();
    c.bench_function("RelativePose::apply", |b| {
        b.iter(|| pose.apply(black_box(Vec3::new(1.0, 2.0, 3.0))));
    });
}

criterion_group!(benches, dynamics, collision);
criterion_main!(benches);
