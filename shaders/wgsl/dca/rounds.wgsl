// Several rounds of an assembly tree in one dispatch. Each workgroup takes parts of the tree that hang
// together within these rounds, so that it need wait for no other.

const CHUNK = 0u;
const JOIN = 1u;
const SUM = 2u;

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
