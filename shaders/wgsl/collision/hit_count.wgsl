// The number of pairs of each job.
fn wanted(a: u32, b: u32, job: u32) -> bool {
    return true;
}

fn hit(a: u32, b: u32, job: u32) {
    atomicAdd(&found[ANSWER + job], 1u);
}
