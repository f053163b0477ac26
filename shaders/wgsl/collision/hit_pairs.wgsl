// The list of pairs.
fn wanted(a: u32, b: u32, job: u32) -> bool {
    return true;
}

fn hit(a: u32, b: u32, job: u32) {
    let place = atomicAdd(&counts[HITS], 1u);
    if place < places.hits {
        put(3u * place, vec3<u32>(a, b, job));
    }
}
