//! Parts of WGSL on a device, against the CPU.
#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use bytemuck::Pod;
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Binding, Device, Kernel, Recording, workgroups};
use vertebra_shaders::{Precision, parts};

/// Each lane turns numbers of `given` into numbers of `found`.
const MAP: &str = "
    @group(0) @binding(0) var<storage, read> given: array<real>;
    @group(0) @binding(1) var<storage, read_write> found: array<real>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        compute(id.x);
    }";

const SINES: &str = "
    fn compute(i: u32) {
        if i < arrayLength(&given) {
            let turn = sin_cos(given[i]);
            found[2u * i] = turn.x;
            found[2u * i + 1u] = turn.y;
        }
    }";

/// A symmetric matrix [A H'; H C], a force, and an offset: the force's acceleration, the inertia times
/// that, and both about the other point.
const ALGEBRA: &str = "
    fn triple(at: u32) -> vec3<real> {
        return vec3<real>(given[at], given[at + 1u], given[at + 2u]);
    }
    fn put(at: u32, v: vec3<real>) {
        found[at] = v.x;
        found[at + 1u] = v.y;
        found[at + 2u] = v.z;
    }
    fn compute(i: u32) {
        if 30u * i >= arrayLength(&given) {
            return;
        }
        let at = 30u * i;
        let inertia = Inertia(
            Sym3(triple(at), triple(at + 3u)),
            mat3x3<real>(triple(at + 6u), triple(at + 9u), triple(at + 12u)),
            Sym3(triple(at + 15u), triple(at + 18u)),
        );
        let force = Force(triple(at + 21u), triple(at + 24u));
        let r = triple(at + 27u);
        let factor = cholesky6(inertia, 0.0, 0.0);
        let a = cholesky6_solve(factor, force);
        let again = inertia_mul(inertia, a);
        // The inertia elsewhere, of the motion that is `a` here, is the force there.
        let there = inertia_mul(
            inertia_shifted_back(inertia, r),
            motion_shifted(a, -r),
        );
        let moved = force_shifted_back(force, r);
        // The same in other axes.
        let q = quaternion_exp(r);
        let axes = quaternion_matrix(q);
        let turned = inertia_mul(
            inertia_rotated(inertia, axes),
            Motion(axes * a.angular, axes * a.linear),
        );
        let to = 18u * i;
        put(to, again.angular - force.angular);
        put(to + 3u, again.linear - force.linear);
        put(to + 6u, there.angular - moved.angular);
        put(to + 9u, there.linear - moved.linear);
        put(to + 12u, turned.angular - quaternion_turned(q, force.angular));
        put(to + 15u, turned.linear - quaternion_turned(q, force.linear));
    }";

fn compute<T: Pod>(
    device: &Device,
    precision: Precision,
    body: &'static str,
    given: &[T],
    lanes: usize,
    each: usize,
) -> Vec<T> {
    const BINDINGS: &[Binding] = &[
        Binding::read::<f32>("given"),
        Binding::read_write::<f32>("found"),
    ];
    let mut kernel =
        Kernel::new("map", &[MAP], BINDINGS, [64, 1, 1]).requires(precision.features());
    for part in [
        precision.part(),
        precision.trigonometry(),
        parts::SPATIAL,
        parts::CHOLESKY,
        parts::ROTATION,
        parts::JOINT,
        body,
    ] {
        kernel = kernel.with(part);
    }
    for binding in ["given", "found"] {
        kernel = kernel.stride(binding, precision.bytes());
    }
    assert!(kernel.loops_end());
    let mut recording = Recording::new("map");
    let given = recording.buffer_from("given", given);
    let found = recording.buffer::<T>("found", lanes * each);
    let groups = workgroups(u32::try_from(lanes).unwrap(), 64);
    recording.dispatch(&kernel, &[given.any(), found.any()], groups);
    recording.download(found);
    let output = device.prepare(&recording).unwrap().run().unwrap().wait();
    output.unwrap().read(found).unwrap()
}

fn precisions(device: &Device) -> impl Iterator<Item = Precision> {
    let double = device.features().contains(Features::SHADER_F64);
    [Precision::F32, Precision::F64]
        .into_iter()
        .filter(move |&precision| double || precision == Precision::F32)
}

#[expect(clippy::cast_possible_truncation, reason = "rounded to the precision")]
fn rounded(x: f64) -> f32 {
    x as f32
}

/// The same numbers in both precisions.
fn map(
    device: &Device,
    precision: Precision,
    body: &'static str,
    given: &[f64],
    lanes: usize,
    each: usize,
) -> Vec<f64> {
    match precision {
        Precision::F32 => {
            let given: Vec<f32> = given.iter().map(|&x| rounded(x)).collect();
            let found = compute(device, precision, body, &given, lanes, each);
            found.into_iter().map(f64::from).collect()
        }
        Precision::F64 => compute(device, precision, body, given, lanes, each),
    }
}

#[test]
fn sines_and_cosines_are_those_of_the_host() {
    let device = Device::auto().unwrap();
    let mut angles = vec![0.0];
    for k in 0..20_000_u32 {
        let x = f64::from(k);
        let quarter = x.min(41_000.0) * std::f64::consts::FRAC_PI_2;
        for angle in [
            x * 1e-4 - 1.0,
            x * 3.2767 + 0.1,
            quarter,
            quarter + 1e-3,
            x * 1e-9,
        ] {
            angles.extend([angle, -angle].map(|angle| f64::from(rounded(angle))));
        }
    }
    for precision in precisions(&device) {
        let found = map(&device, precision, SINES, &angles, angles.len(), 2);
        let bound = match precision {
            Precision::F32 => 1.5e-7,
            Precision::F64 => 3e-16,
        };
        for (&angle, found) in angles.iter().zip(found.chunks_exact(2)) {
            let (sin, cos) = angle.sin_cos();
            let error = (found[0] - sin).abs().max((found[1] - cos).abs());
            assert!(error <= bound, "{precision:?}, {angle}: {error:e}");
        }
    }
}

/// The identities of the algebra on random symmetric positive definite matrices.
#[test]
fn spatial_algebra_obeys_its_identities() {
    const LANES: usize = 200;
    let device = Device::auto().unwrap();
    let mut random = oorandom::Rand64::new(7);
    let mut given = Vec::new();
    for _ in 0..LANES {
        // B B' + 1 of random B: well conditioned.
        let b: Vec<f64> = (0..36).map(|_| random.rand_float() - 0.5).collect();
        let entry = |i: usize, j: usize| {
            let sum: f64 = (0..6).map(|k| b[6 * i + k] * b[6 * j + k]).sum();
            sum + if i == j { 1.0 } else { 0.0 }
        };
        for at in [0, 3] {
            if at == 3 {
                for column in 0..3 {
                    given.extend((0..3).map(|row| entry(3 + row, column)));
                }
            }
            given.extend((0..3).map(|k| entry(at + k, at + k)));
            given.extend([(1, 2), (0, 2), (0, 1)].map(|(i, j)| entry(at + i, at + j)));
        }
        given.extend((0..9).map(|_| 2.0 * random.rand_float() - 1.0));
    }
    for precision in precisions(&device) {
        let found = map(&device, precision, ALGEBRA, &given, LANES, 18);
        let eps = match precision {
            Precision::F32 => f64::from(f32::EPSILON),
            Precision::F64 => f64::EPSILON,
        };
        let worst = found.iter().fold(0.0_f64, |worst, x| worst.max(x.abs()));
        // Entries below 3, some ten terms each, and two changes of origin.
        assert!(worst <= 200.0 * eps, "{precision:?}: {worst:e}");
        assert!(worst > 0.0 && found.len() == 18 * LANES);
    }
}
