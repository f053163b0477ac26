// The list of pairs.
fn wanted(a: u32, b: u32, job: u32) -> bool {
    return true;
}

fn hit(a: u32, b: u32, job: u32) {
    let place = atomicAdd(&found[HITS], 1u);
    if place < places.hits {
        let at = ANSWER + 3u * place;
        atomicStore(&found[at], a);
        atomicStore(&found[at + 1u], b);
        atomicStore(&found[at + 2u], job);
    }
}
