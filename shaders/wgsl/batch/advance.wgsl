// What integrators share: writing the end of a step, and taking it back where the item failed.

fn time_step() -> real {
    return constants[0].w;
}

// Writes a number of the state at the end of the step.
fn put(slot: u32, row: u32, value: real) {
    if !is_finite(value) {
        fail(slot, WILD_STATE);
    }
    set_state(next + row, value);
}

fn put3(slot: u32, row: u32, v: vec3<real>) {
    put(slot, row, v.x);
    put(slot, row + 1u, v.y);
    put(slot, row + 2u, v.z);
}

// q at the end: that at the start turned by `angular`, in the child's axes, and moved by `linear`, in the
// parent's.
fn displace(slot: u32, link: BatchLink, angular: vec3<real>, linear: vec3<real>) {
    var row = link.position;
    if link.kind == FREE {
        put3(slot, row, state3(start + row) + linear);
        row += 3u;
    }
    let q = quaternion_integrated(quaternion_at(start + row), angular);
    put3(slot, row, q.xyz);
    put(slot, row + 3u, q.w);
}

// Rates with the linear part of a free joint turned from the child's axes to the parent's.
fn displacement_axes(link: BatchLink, linear: vec3<real>) -> vec3<real> {
    if link.kind != FREE {
        return zero3();
    }
    return quaternion_turned(quaternion_normalized(quaternion_at(source + link.position + 3u)), linear);
}

fn copy_rows(row: u32, count: u32) {
    for (var k = 0u; k < count; k++) {
        set_state(next + row + k, state_at(start + row + k));
    }
}

// An item that failed stays where it was.
fn commit(link: BatchLink) {
    if halted {
        var positions = 1u;
        var dofs = 1u;
        if link.kind == SPHERICAL {
            positions = 4u;
            dofs = 3u;
        } else if link.kind == FREE {
            positions = 7u;
            dofs = 6u;
        }
        copy_rows(link.position, positions);
        copy_rows(plan.positions + link.dof, dofs);
    }
}
