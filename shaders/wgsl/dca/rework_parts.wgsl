// Rounds of any kind in a correction.

const LANES = 128u;

fn go_up(kind: u32, index: u32) {
    if kind == CHUNK {
        reassemble_chunk(index);
    } else {
        resum_rakes(index);
    }
}

fn go_down(kind: u32, index: u32) {
    if kind == CHUNK {
        respond_chunk(index);
    }
}
