// What kernels that fill the queue of pairs of blocks have in common.

@group(0) @binding(0) var<uniform> sizes: Sizes;
@group(0) @binding(1) var<storage, read> jobs: array<Job>;
@group(0) @binding(2) var<storage, read> boxes_a: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> boxes_b: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> queue: array<u32>;
@group(0) @binding(5) var<storage, read_write> counts: array<atomic<u32>>;

fn enqueue(place: u32, a_block: u32, b_block: u32, job: u32) {
    if place < sizes.queue {
        queue[3u * place] = a_block;
        queue[3u * place + 1u] = b_block;
        queue[3u * place + 2u] = job;
    }
}
