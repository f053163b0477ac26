// Rounds of any kind.

const LANES = 32u;

fn go_up(kind: u32, index: u32) {
    switch kind {
        case CHUNK: { assemble_chunk(index); }
        case JOIN: { join_parts(index); }
        default: { sum_rakes(index); }
    }
}

fn go_down(kind: u32, index: u32) {
    switch kind {
        case CHUNK: { respond_chunk(index); }
        case JOIN: { part_parts(index); }
        default: {}
    }
}
