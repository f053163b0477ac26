// What a correction changes on its way up: of each node b1 and b2, of each rake its bias force.

const CHANGE_SIZE = 3u;

fn change_at(node: u32) -> u32 { return acting_at(sizes.joins) + CHANGE_SIZE * node; }

// A path of several chunks, of which the force is known that it exerted beyond what was counted on; and from
// here on is.
fn add_to_rake(rake: u32, change: Force) {
    let to = added_at() + rake;
    let n = sizes.rakes;
    let angular: vec4<chunk_real> = scratch[to]
        + vec4<chunk_real>(vec4<real>(change.angular, 0.0));
    let linear: vec4<chunk_real> = scratch[to + n]
        + vec4<chunk_real>(vec4<real>(change.linear, 0.0));
    scratch[to] = angular;
    scratch[to + n] = linear;
    let at = rakes_at() + rake;
    for (var i = 0u; i < 3u; i++) {
        let old = scratch[at + (3u + i) * n];
        scratch[at + (3u + i) * n] = vec4<chunk_real>(old.xyz, old.w + angular[i]);
    }
    scratch[at + 6u * n] += linear;
}
