// What kernels that fill a queue of pairs of nodes have in common.

@group(0) @binding(0) var<uniform> sizes: Sizes;
@group(0) @binding(1) var<storage, read> jobs: array<Job>;
@group(0) @binding(2) var<storage, read> boxes_a: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> boxes_b: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> queue: array<u32>;
@group(0) @binding(5) var<storage, read_write> counts: array<atomic<u32>>;

// The boxes of nodes of this level.
fn box_a(node: u32) -> Box {
    let at = 2u * (sizes.a_at + node);
    return Box(boxes_a[at].xyz, boxes_a[at + 1u].xyz);
}

fn box_b(node: u32) -> Box {
    let at = 2u * (sizes.b_at + node);
    return Box(boxes_b[at].xyz, boxes_b[at + 1u].xyz);
}

fn enqueue(place: u32, a_node: u32, b_node: u32, job: u32) {
    if place < sizes.queue {
        queue[3u * place] = a_node;
        queue[3u * place + 1u] = b_node;
        queue[3u * place + 2u] = job;
    }
}
