// Places the bodies of each job as their poses in a buffer say, so that poses need not come from the host.
//
// Quaternions (x, y, z, w) that are of unit length to rounding, and translations, eight words a body. As the
// host defines it: with q = conj(q_A) q_B and s = 2 / |q|^2 the usual matrix, and the translation turned
// back by q_A. An entry of the matrix is off by less than 48 roundings of 2^-23, so a coordinate or an edge
// by less than 64 of them, in units of the sum of its terms' magnitudes without the matrix: at most three
// times the largest with it.

const ENTRY_ERROR: f32 = 7.7e-6;
const BODY: u32 = 8u;

struct Bodies {
    // Number of jobs.
    jobs: u32,
}

@group(0) @binding(0) var<uniform> bodies: Bodies;
@group(0) @binding(1) var<storage, read> poses: array<f32>;
@group(0) @binding(2) var<storage, read_write> jobs: array<Job>;

fn quaternion(body: u32) -> vec4<f32> {
    let at = BODY * body;
    return vec4<f32>(poses[at], poses[at + 1u], poses[at + 2u], poses[at + 3u]);
}

fn origin(body: u32) -> vec3<f32> {
    let at = BODY * body + 4u;
    return vec3<f32>(poses[at], poses[at + 1u], poses[at + 2u]) * SCALE;
}

// The rows of the matrix of a quaternion.
fn matrix_rows(q: vec4<f32>) -> array<vec3<f32>, 3> {
    let s: f32 = 2.0 / dot(q, q);
    let v = q.xyz * s;
    return array<vec3<f32>, 3>(
        vec3<f32>(1.0 - (q.y * v.y + q.z * v.z), q.x * v.y - q.w * v.z, q.x * v.z + q.w * v.y),
        vec3<f32>(q.x * v.y + q.w * v.z, 1.0 - (q.x * v.x + q.z * v.z), q.y * v.z - q.w * v.x),
        vec3<f32>(q.x * v.z - q.w * v.y, q.y * v.z + q.w * v.x, 1.0 - (q.x * v.x + q.y * v.y)),
    );
}

@compute @workgroup_size(64)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if i >= bodies.jobs {
        return;
    }
    let a = jobs[i].a_pose;
    let b = jobs[i].b_pose;
    let back: vec4<f32> = quaternion(a) * vec4<f32>(-1.0, -1.0, -1.0, 1.0);
    let onward = quaternion(b);
    let turn = vec4<f32>(
        back.w * onward.xyz + onward.w * back.xyz + cross(back.xyz, onward.xyz),
        back.w * onward.w - dot(back.xyz, onward.xyz),
    );
    let rows = matrix_rows(turn);
    let inverse = matrix_rows(back);
    let way = origin(b) - origin(a);
    for (var k = 0u; k < 3u; k++) {
        jobs[i].rows[k] = vec4<f32>(rows[k], dot(inverse[k], way));
    }
    jobs[i].coordinate_error = 3.0 * ENTRY_ERROR;
    jobs[i].edge_error = ENTRY_ERROR;
}
