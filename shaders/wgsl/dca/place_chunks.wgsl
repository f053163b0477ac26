// Places the bodies of the first round's chunks.

const LANES = 64u;

fn run_chunk(chunk: u32) { place_chunk(chunk); }
