// A bit for each pair of some rows of the matrix of A's and B's triangles, `answer` words a row.
fn wanted(a: u32, b: u32, job: u32) -> bool {
    return a >= places.row && a - places.row < places.rows;
}

fn hit(a: u32, b: u32, job: u32) {
    atomicOr(&found[ANSWER + (a - places.row) * places.answer + b / 32u], 1u << (b & 31u));
}
