// Rounds in which there is nothing but joins, one a team at most: what is read of a join is read a round ahead,
// but for what others of the workgroup hand it.

const LANES = 256u;

struct Ahead {
    seam: Seam,
    has_join: bool,
}

fn look(start: u32, lane: u32) -> Ahead {
    let first = words[start + 1u];
    let end = words[start + 2u];
    let at = first + RECORD * (lane / TEAM);
    return Ahead(seam_at(at), at < end);
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
        let first = look(starts, lane);
        var next = known_up(first.seam, first.has_join, lane);
        var ahead = look(min(starts + 2u, last), lane);
        for (var round = 0u; round < layer.rounds; round++) {
            let known = next;
            next = known_up(ahead.seam, ahead.has_join, lane);
            ahead = look(min(starts + 2u * (round + 2u), last), lane);
            go_up_join(known, lane);
            end_round_up();
        }
        end_up();
    }
    if (layer.ways & 2u) != 0u {
        let first = look(last, lane);
        var next = known_down(first.seam, first.has_join, lane);
        var ahead = look(max(last - 2u, starts), lane);
        for (var round = 0u; round < layer.rounds; round++) {
            let known = next;
            next = known_down(ahead.seam, ahead.has_join, lane);
            ahead = look(max(last - 2u * (round + 2u), starts), lane);
            go_down_join(known, lane);
            workgroupBarrier();
        }
    }
}
