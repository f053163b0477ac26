// The integrator, where accelerations have passed through the memory: a lane a body.

const LANES = 64u;

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let slot = (id.y * groups.x + id.x) * LANES + lane;
    if slot >= layer.count || control[HALTED] != 0u || !is_needed() {
        return;
    }
    let spot = spot_of(slot);
    let kind = kind_of(spot.flags);
    advance(slot, kind, joint_motion(accelerations_at() + spot.v, kind), begun_at(spot));
}
