// Meshes as kernels read them. Triangles stand in the order of the tree, eight in a row a block.
//
// Lengths are multiplied by 2^-5, so that no difference of posed coordinates overflows. What is then
// below 2^-126 may be flushed to zero: two coordinates and their difference are off by less than FLUSH.

const SCALE: f32 = 0.03125;
const FLUSH: f32 = 9.4039548e-38; // 2^-123
// Bounds of an empty box: beyond every coordinate, and far from overflowing when rotated.
const BEYOND: f32 = 3e37;
// Triangles of a block, and children of a node.
const WIDTH: u32 = 8u;
// The index of a triangle that fills up the last block.
const NONE: u32 = 0xffffffffu;

// A question about two meshes: where B stands, seen from A, and which blocks they have.
struct Job {
    // Row k: the matrix entries of coordinate k, and the translation.
    rows: array<vec4<f32>, 3>,
    // Errors of a posed coordinate and of a rotated edge, in units of the sums of magnitudes.
    coordinate_error: f32,
    edge_error: f32,
    // The first workgroup of this job in a dispatch over the blocks of all.
    first_group: u32,
    // 1 if the meshes are one, and a triangle is paired with those behind it.
    itself: u32,
    a_first: u32,
    a_blocks: u32,
    b_first: u32,
    b_blocks: u32,
    // The poses of A and B, where they come from a buffer.
    a_pose: u32,
    b_pose: u32,
}

struct Box {
    low: vec3<f32>,
    high: vec3<f32>,
}

fn empty_box() -> Box {
    return Box(vec3<f32>(BEYOND), vec3<f32>(-BEYOND));
}

fn around(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Box {
    return Box(min(min(a, b), c), max(max(a, b), c));
}

fn overlap(a: Box, b: Box) -> bool {
    return all(a.low <= b.high) && all(b.low <= a.high);
}

fn rotated(job: Job, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(job.rows[0].xyz, v),
        dot(job.rows[1].xyz, v),
        dot(job.rows[2].xyz, v),
    );
}

fn translation(job: Job) -> vec3<f32> {
    return vec3<f32>(job.rows[0].w, job.rows[1].w, job.rows[2].w);
}

// Sums of magnitudes, of which the rounding errors of a posed point are a fraction.
fn magnitudes(job: Job, v: vec3<f32>) -> vec3<f32> {
    let size = abs(v);
    return vec3<f32>(
        dot(abs(job.rows[0].xyz), size),
        dot(abs(job.rows[1].xyz), size),
        dot(abs(job.rows[2].xyz), size),
    );
}
