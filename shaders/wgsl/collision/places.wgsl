// What is written to `found`.

struct Places {
    // Places in the queue, for hits, and for undecided pairs.
    queue: u32,
    hits: u32,
    undecided: u32,
    // The word at which undecided pairs begin.
    undecided_at: u32,
    // Words of an answer for one job, and of the part of it that is about A.
    answer: u32,
    answer_a: u32,
    // Rows of the matrix of pairs: the first, and how many.
    row: u32,
    rows: u32,
}

fn put(at: u32, words: vec3<u32>) {
    atomicStore(&found[at], words.x);
    atomicStore(&found[at + 1u], words.y);
    atomicStore(&found[at + 2u], words.z);
}
