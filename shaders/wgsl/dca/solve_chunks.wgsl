// Solves the first round's chunks, the last to be solved.

const LANES = 32u;

fn run_chunk(chunk: u32) { respond_chunk(chunk); }
