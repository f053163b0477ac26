// What a correction changes on its way up: of each node b1 and b2, of each rake its bias force.

// A number of the bias force of a path of several chunks.
fn add_to_rake(rake: u32, own: u32, change: real) {
    scratch[added_at() + rake + own / 3u * sizes.rakes][own % 3u] = chunk_real(change);
}
