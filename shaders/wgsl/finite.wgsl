// Fails at each number that is infinite or NaN. Numbers are looked at as words: no compiler can take
// it for granted that there is no NaN, and f64 needs no feature.

struct Numbers {
    // How many.
    count: u32,
    // Words of a number: 1 for f32, 2 for f64, lower word first.
    words: u32,
}

@group(0) @binding(0) var<uniform> numbers: Numbers;
@group(0) @binding(1) var<storage, read> data: array<u32>;
@group(0) @binding(2) var<storage, read_write> status: array<atomic<u32>>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i >= numbers.count {
        return;
    }
    let exponent = select(0x7f800000u, 0x7ff00000u, numbers.words == 2u);
    if (data[i * numbers.words + numbers.words - 1u] & exponent) == exponent {
        fail(i);
    }
}
