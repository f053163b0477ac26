// Joint accelerations of one state, by freedoms.

const STAGES: u32 = 1u;

fn put(slot: u32, row: u32, qdd: real) {
    if !is_finite(qdd) {
        fail(slot, WILD_ACCELERATION);
    }
    result[row * plan.stride + item] = qdd;
}

fn finish_one(slot: u32, link: BatchLink, qdd: real) {
    put(slot, link.dof, qdd);
}

fn finish_several(slot: u32, link: BatchLink, qdd: Motion) {
    put(slot, link.dof, qdd.angular.x);
    put(slot, link.dof + 1u, qdd.angular.y);
    put(slot, link.dof + 2u, qdd.angular.z);
    if link.kind == FREE {
        put(slot, link.dof + 3u, qdd.linear.x);
        put(slot, link.dof + 4u, qdd.linear.y);
        put(slot, link.dof + 5u, qdd.linear.z);
    }
}

fn commit(link: BatchLink) {
}
