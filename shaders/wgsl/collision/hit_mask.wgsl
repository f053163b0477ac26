// A bit for each triangle that is in a pair: those of A, then those of B, for each job.
fn word_a(a: u32, job: u32) -> u32 {
    return ANSWER + job * places.answer + a / 32u;
}

fn word_b(b: u32, job: u32) -> u32 {
    return ANSWER + job * places.answer + places.answer_a + b / 32u;
}

fn wanted(a: u32, b: u32, job: u32) -> bool {
    return (atomicLoad(&found[word_a(a, job)]) >> (a & 31u)
        & atomicLoad(&found[word_b(b, job)]) >> (b & 31u)
        & 1u) == 0u;
}

fn hit(a: u32, b: u32, job: u32) {
    atomicOr(&found[word_a(a, job)], 1u << (a & 31u));
    atomicOr(&found[word_b(b, job)], 1u << (b & 31u));
}
