// What kernels of loops have beside the others: what groups keep, of each body and freedom a record, of each row a
// record, then J, Y and A.
@group(0) @binding(9) var<storage, read_write> loops: array<chunk_real>;
