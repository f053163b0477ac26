// Places the bodies of the first round's chunks, and assembles these.

const LANES = 32u;

fn run_chunk(chunk: u32) {
    if is_first_attempt() {
        place_chunk(chunk);
    }
    assemble_chunk(chunk);
}
