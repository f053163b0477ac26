// Several rounds of an assembly tree in one dispatch. Each workgroup takes parts of the tree that hang
// together within these rounds, so that it need wait for no other. What tables say of a round is looked up a
// round ahead.

const CHUNK = 0u;
const SUM = 1u;
// A chunk of the first round, in kinematics.
const LEADING = 2u;

// Where a round's chunks and sums, its joins and the next round start.
struct Bounds {
    first: u32,
    joins: u32,
    end: u32,
}

fn bounds_at(start: u32) -> Bounds {
    return Bounds(words[start], words[start + 1u], words[start + 2u]);
}

// A lane for each item but joins.
fn run_items(bounds: Bounds, lane: u32, is_up: bool) {
    let items = bounds.joins - bounds.first;
    let passes = (items + LANES - 1u) / LANES;
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let item = pass_ * LANES + lane;
        if item < items {
            let word = words[bounds.first + item];
            if is_up {
                go_up(word & 3u, word >> 2u);
            } else {
                go_down(word & 3u, word >> 2u);
            }
        }
    }
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let group = id.y * groups.x + id.x;
    if group >= layer.count || !is_group_needed(lane) {
        return;
    }
    let starts = layer.starts + group * (2u * layer.rounds + 1u);
    let last = starts + 2u * (layer.rounds - 1u);
    if (layer.ways & 1u) != 0u {
        var next = look(bounds_at(starts), lane);
        for (var round = 0u; round < layer.rounds; round++) {
            let own = next;
            next = look(bounds_at(min(starts + 2u * (round + 1u), last)), lane);
            run_round(own, lane, true);
            storageBarrier();
        }
    }
    if (layer.ways & 2u) != 0u {
        var next = look(bounds_at(last), lane);
        for (var round = 0u; round < layer.rounds; round++) {
            let own = next;
            next = look(bounds_at(max(last - 2u * (round + 1u), starts)), lane);
            run_round(own, lane, false);
            storageBarrier();
        }
    }
}
