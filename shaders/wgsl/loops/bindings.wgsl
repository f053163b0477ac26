// What kernels of loops have beside the others.

@group(0) @binding(8) var<storage, read> forces: array<chunk_real>;
// What groups keep: of each body and freedom a record, of each row a record, then J, Y and A.
@group(0) @binding(9) var<storage, read_write> loops: array<chunk_real>;

// Where the step in time is in `forces`.
const STEP_SIZE = 3u;
