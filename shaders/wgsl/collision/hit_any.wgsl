// Whether a job has a pair; then no more is looked for.
fn wanted(a: u32, b: u32, job: u32) -> bool {
    return atomicLoad(&found[ANSWER + job]) == 0u;
}

fn hit(a: u32, b: u32, job: u32) {
    atomicStore(&found[ANSWER + job], 1u);
}
