// Rounds in which there is nothing but joins, one a team at most. What tables say of the workgroup's joins is fetched
// once, onto the chip: reads that wait for each other would make up a round. On the way down, and up in a correction,
// what else is read of a join is read two rounds ahead, but for what others of the workgroup hand it; two rounds take
// turns at that, because a lane that moves what it has read waits for it. Up in a solution nothing is: nodes go
// through memory.

const LANES = 256u;

// What tables say of the workgroup's joins, by places, and the first places of its rounds.
var<workgroup> table: array<u32, RECORD * PLACES>;
var<workgroup> firsts: array<u32, PLACES + 1u>;

fn fetch_table(starts: u32, lane: u32) {
    let begin = words[starts];
    let end = words[starts + 2u * layer.rounds];
    if lane <= layer.rounds {
        firsts[lane] = (words[starts + 2u * lane] - begin) / RECORD;
    }
    let passes = (end - begin + LANES - 1u) / LANES;
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let i = pass_ * LANES + lane;
        if begin + i < end {
            table[i] = words[begin + i];
        }
    }
    workgroupBarrier();
}

struct Listed {
    seam: Seam,
    has_join: bool,
}

// A team's join in a round, if there is one.
fn listed(round: u32, lane: u32) -> Listed {
    if round >= layer.rounds {
        return Listed();
    }
    let place = firsts[round] + lane / TEAM;
    if place >= firsts[round + 1u] {
        return Listed();
    }
    let at = RECORD * place;
    return Listed(
        Seam(
            table[at],
            table[at + 1u],
            table[at + 2u],
            table[at + 3u],
            table[at + 4u],
            table[at + 5u],
            table[at + 6u],
            table[at + 7u],
            table[at + 8u],
            table[at + 9u],
        ),
        true,
    );
}

fn up_ahead(round: u32, lane: u32) -> Up {
    let next = listed(round, lane);
    return known_up(next.seam, next.has_join, lane);
}

// Rounds are counted from the last one.
fn down_ahead(round: u32, lane: u32) -> Down {
    let next = listed(layer.rounds - 1u - round, lane);
    return known_down(next.seam, next.has_join, lane);
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
    fetch_table(layer.starts + group * (2u * layer.rounds + 1u), lane);
    if (layer.ways & 1u) != 0u {
        go_up_rounds(lane);
    }
    if (layer.ways & 2u) != 0u {
        var even = down_ahead(0u, lane);
        var odd = down_ahead(1u, lane);
        let pairs = (layer.rounds + 1u) / 2u;
        for (var pair = 0u; pair < pairs; pair++) {
            let round = 2u * pair;
            go_down_join(even, lane);
            even = down_ahead(round + 2u, lane);
            workgroupBarrier();
            if round + 1u < layer.rounds {
                go_down_join(odd, lane);
                odd = down_ahead(round + 3u, lane);
                workgroupBarrier();
            }
        }
    }
}
