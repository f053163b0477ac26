// Orientation x, y, z, w and position [m] of each body's own frame, in the model's order.
@group(0) @binding(8) var<storage, read_write> poses: array<vec4<chunk_real>>;

fn write_pose(slot: u32, rotation: vec4<real>, origin: vec3<real>) {
    let frame = vec4<real>(links[4u * sizes.slots + slot]).yzw;
    let at = (origin + quaternion_turned(rotation, frame)) * real(sizes.length);
    let turn = turned_by(rotation, vec4<real>(links[5u * sizes.slots + slot]));
    let body = body_of(slot);
    poses[2u * body] = vec4<chunk_real>(turn);
    poses[2u * body + 1u] = vec4<chunk_real>(vec4<real>(at, 0.0));
}
