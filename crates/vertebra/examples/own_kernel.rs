//! A kernel of one's own and a primitive behind it: the length of a curve.

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use vertebra::gpu::{Binding, Device, ELEMENTS, Error, Kernel, Recording, workgroups};
use vertebra::shaders::{Operator, Precision, Reduce};

const SEGMENTS: Kernel = Kernel::new(
    "segments",
    &[
        "
    @group(0) @binding(0) var<storage, read> points: array<vec2<f32>>;
    @group(0) @binding(1) var<storage, read_write> segments: array<f32>;

    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>) {
        let i = element(id, n, 64u);
        if i < arrayLength(&segments) {
            segments[i] = distance(points[i], points[i + 1u]);
        }
    }",
        ELEMENTS,
    ],
    &[
        Binding::read::<[f32; 2]>("points"),
        Binding::read_write::<f32>("segments"),
    ],
    [64, 1, 1],
);

fn main() -> Result<(), Error> {
    let angles = (0..=1000_u16).map(|i| f32::from(i) * std::f32::consts::TAU / 1000.0);
    let circle: Vec<[f32; 2]> = angles.map(|angle| angle.sin_cos().into()).collect();
    let mut recording = Recording::new("length of a curve");
    let points = recording.buffer_from("points", &circle);
    let segments = recording.buffer::<f32>("segments", circle.len() - 1);
    let length = recording.buffer::<f32>("length", 1);
    recording.dispatch(
        &SEGMENTS,
        &[points.any(), segments.any()],
        workgroups(1000, 64),
    );
    Reduce::new(&Operator::add(Precision::F32)).record(&mut recording, segments, length);
    recording.download(length);
    println!("{recording}");

    let device = Device::auto()?;
    let output = device.prepare(&recording)?.run()?.wait()?;
    let length = output.read(length)?[0];
    println!("{length} on {}", device.description());
    // A thousand sides, each rounded.
    let sides = 2000.0 * (std::f32::consts::PI / 1000.0).sin();
    assert!((length - sides).abs() < 1000.0 * f32::EPSILON);
    Ok(())
}
