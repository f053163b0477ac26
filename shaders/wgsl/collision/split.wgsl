// The list of pairs, three words each, and its two columns.

struct Split {
    // Places in the list.
    pairs: u32,
    // 1 if the lesser triangle of a pair comes first.
    ordered: u32,
}

@group(0) @binding(0) var<uniform> split: Split;
@group(0) @binding(1) var<storage, read_write> first: array<u32>;
@group(0) @binding(2) var<storage, read_write> second: array<u32>;
@group(0) @binding(3) var<storage, read_write> found: array<u32>;
