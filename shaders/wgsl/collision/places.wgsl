// What there is room for.

struct Places {
    // Places in the queue, for hits, for undecided pairs, and for those of them that are left to the host.
    queue: u32,
    hits: u32,
    undecided: u32,
    left: u32,
    // Words of an answer for one job, and of the part of it that is about A.
    answer: u32,
    answer_a: u32,
    // Rows of the matrix of pairs: the first, and how many.
    row: u32,
    rows: u32,
}
