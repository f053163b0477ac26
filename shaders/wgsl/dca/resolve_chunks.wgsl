// Solves the first round's chunks, and gathers what is left of their bodies' equations for a correction.

const LANES = 32u;

fn run_chunk(chunk: u32) {
    respond_chunk(chunk);
    reassemble_chunk(chunk);
}
