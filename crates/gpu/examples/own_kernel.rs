//! A kernel of one's own: the sum of the squares of all differences of neighbours, with a failure
//! that names the first number that is none. `cargo run --example own_kernel -p vertebra-gpu`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use vertebra_gpu::{
    Binding, Device, ELEMENTS, Error, Kernel, Recording, STATUS, Timing, workgroups,
};

const ROUGHNESS: Kernel = Kernel::new(
    "roughness",
    &[
        "
    @group(0) @binding(0) var<storage, read> height: array<f32>;
    @group(0) @binding(1) var<storage, read_write> squares: array<f32>;
    @group(0) @binding(2) var<storage, read_write> status: array<atomic<u32>>;

    @compute @workgroup_size(64)
    fn main(
        @builtin(global_invocation_id) id: vec3<u32>,
        @builtin(num_workgroups) groups: vec3<u32>,
    ) {
        let i = element(id, groups, 64u);
        if i >= arrayLength(&squares) { return; }
        let difference = height[i + 1u] - height[i];
        squares[i] = difference * difference;
        if (bitcast<u32>(difference) & 0x7f800000u) == 0x7f800000u { fail(i); }
    }",
        ELEMENTS,
        STATUS,
    ],
    &[
        Binding::read::<f32>("height"),
        Binding::read_write::<f32>("squares"),
        Binding::read_write::<u32>("status"),
    ],
    [64, 1, 1],
);

fn main() -> Result<(), Error> {
    let heights: Vec<f32> = (0..1000_u16).map(|i| (0.01 * f32::from(i)).sin()).collect();
    let mut recording = Recording::new("roughness");
    let height = recording.buffer::<f32>("height", 1000);
    let squares = recording.buffer::<f32>("squares", 999);
    let stage = recording.stage("differences");
    let status = recording.status();
    recording.dispatch(
        &ROUGHNESS.constant("STAGE", stage),
        &[height.any(), squares.any(), status.any()],
        workgroups(999, 64),
    );
    recording.download(squares);

    let device = Device::auto()?;
    println!("{}\n{recording}", device.description());
    let mut program = device.prepare(&recording)?;
    if program.take_times(Timing::Whole).is_err() {
        println!("this device takes no times");
    }
    program.write(height, &heights)?;
    let output = program.run()?.wait()?;
    let sum: f32 = output.read(squares)?.iter().sum();
    println!("sum of squares {sum}, in {:?} s", output.gpu_time());
    drop(output);

    let mut broken = heights;
    broken[700] = f32::NAN;
    program.write(height, &broken)?;
    if let Err(error) = program.run()?.wait() {
        println!("refused: {error}"); // stage `differences` at element 699
    }
    Ok(())
}
