//! The order of triangles in a tree, on a device.

use vertebra_gpu::{Device, Recording, workgroups};
use vertebra_shaders::collision::{HILBERT, HILBERT_BITS, Mesh, SCALE};

/// Cells along each side.
const SIDE: u32 = 16;

/// The curve goes through every cell once, and from each to a neighbour of it.
#[test]
fn the_curve_never_leaps() {
    if vertebra_gpu::tests_are_left_out() {
        return;
    }
    let device = Device::auto().unwrap();
    let cells = SIDE * SIDE * SIDE;
    let cell = |i: u32| [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE];
    // A triangle that is a point in each cell.
    let at = |k: u32| f32::from(u16::try_from(k).unwrap());
    let vertices: Vec<u32> = (0..cells)
        .flat_map(|i| cell(i).map(|k| at(k).to_bits()))
        .collect();
    let triangles: Vec<[u32; 4]> = (0..cells).map(|i| [i, i, i, i]).collect();
    let high = at(SIDE - 1) * SCALE;
    let mut recording = Recording::new("order");
    let mesh = Mesh {
        triangles: cells,
        root: 0,
    };
    let mesh = recording.buffer_from("mesh", &[mesh]);
    let vertices = recording.buffer_from("vertices", &vertices);
    let triangles = recording.buffer_from("triangles", &triangles);
    let boxes = recording.buffer_from("boxes", &[[0.0_f32; 4], [high, high, high, 0.0]]);
    let [keys, values] =
        ["keys", "values"].map(|name| recording.buffer::<u32>(name, cells as usize));
    let buffers = [
        mesh.any(),
        vertices.any(),
        triangles.any(),
        boxes.any(),
        keys.any(),
        values.any(),
    ];
    recording.dispatch(&HILBERT, &buffers, workgroups(cells, 256));
    recording.download(keys);
    let output = device.prepare(&recording).unwrap().run().unwrap().wait();
    let keys: Vec<u32> = output.unwrap().read(keys).unwrap();
    let mut order: Vec<(u32, u32)> = keys.into_iter().zip(0..).collect();
    order.sort_unstable();
    assert!(order.iter().all(|(key, _)| key >> HILBERT_BITS == 0));
    for pair in order.windows(2) {
        let [(one_key, one), (other_key, other)] = [pair[0], pair[1]];
        assert!(one_key < other_key);
        let steps: u32 = cell(one)
            .into_iter()
            .zip(cell(other))
            .map(|(one, other)| one.abs_diff(other))
            .sum();
        assert_eq!(steps, 1, "from {:?} to {:?}", cell(one), cell(other));
    }
}
