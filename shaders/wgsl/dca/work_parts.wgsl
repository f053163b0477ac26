// Rounds of any kind.

const LANES = 128u;

fn go_up(kind: u32, index: u32) {
    if kind == CHUNK {
        assemble_chunk(index);
    } else {
        sum_rakes(index);
    }
}

fn go_down(kind: u32, index: u32) {
    if kind == CHUNK {
        respond_chunk(index);
    }
}
