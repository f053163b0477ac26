// What a correction changes on its way up: of each node b1 and b2, of each rake its bias force.

// A number of a path of several chunks, of which the force is known that it exerted beyond what was counted on;
// and from here on is.
fn add_to_rake(rake: u32, own: u32, change: real) {
    let n = sizes.rakes;
    let part = own % 3u;
    let to = added_at() + rake + own / 3u * n;
    let added = scratch[to][part] + chunk_real(change);
    scratch[to][part] = added;
    let at = rakes_at() + rake;
    if own < 3u {
        scratch[at + (3u + part) * n].w += added;
    } else {
        scratch[at + 6u * n][part] += added;
    }
}
