// Several rounds of an assembly tree in one dispatch. Each workgroup takes parts of the tree that hang
// together within these rounds, so that it need wait for no other. A team of lanes takes a join, a single lane
// anything else.

const CHUNK = 0u;
const JOIN = 1u;
const SUM = 2u;

fn run_round(start: u32, lane: u32, is_up: bool) {
    let first = words[start];
    let first_join = words[start + 1u];
    let end = words[start + 2u];
    let passes = (first_join - first + LANES - 1u) / LANES;
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let at = first + pass_ * LANES + lane;
        if at < first_join {
            let word = words[at];
            if is_up {
                go_up(word & 3u, word >> 2u);
            } else {
                go_down(word & 3u, word >> 2u);
            }
        }
    }
    let join_passes = (end - first_join + JOINS - 1u) / JOINS;
    for (var pass_ = 0u; pass_ < join_passes; pass_++) {
        let at = first_join + pass_ * JOINS + lane / TEAM;
        let word = words[min(at, end - 1u)];
        if is_up {
            join_parts(word >> 2u, at < end, lane);
        } else {
            part_parts(word >> 2u, at < end, lane);
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
    if group >= layer.count {
        return;
    }
    let starts = layer.starts + group * (2u * layer.rounds + 1u);
    if (layer.ways & 1u) != 0u {
        for (var round = 0u; round < layer.rounds; round++) {
            run_round(starts + 2u * round, lane, true);
            storageBarrier();
        }
    }
    if (layer.ways & 2u) != 0u {
        for (var round = 0u; round < layer.rounds; round++) {
            run_round(starts + 2u * (layer.rounds - 1u - round), lane, false);
            storageBarrier();
        }
    }
}
