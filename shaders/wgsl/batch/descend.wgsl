// Down the tree: where joints put their bodies, and how these turn.

// Where a joint's child is against its parent: its axes by columns, and its origin.
struct Placement {
    axes: mat3x3<real>,
    origin: vec3<real>,
}

fn placement(seen: Seen, turn: vec2<real>) -> Placement {
    let link = seen.link;
    let x = seen.x;
    let y = seen.y;
    let z = seen.z;
    let axes = mat3x3<real>(x.xyz, y.xyz, z.xyz);
    let origin = vec3<real>(x.w, y.w, z.w);
    let row = source + link.position;
    if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        return Placement(axes, origin + z.xyz * state_at(row));
    }
    if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        return Placement(axes * quaternion_matrix(quaternion_normalized(quaternion_at(row))), origin);
    }
    if HAS_FREE != 0u && link.kind == FREE {
        return Placement(
            axes * quaternion_matrix(quaternion_normalized(quaternion_at(row + 3u))),
            origin + axes * state3(row),
        );
    }
    return Placement(turned_about_z(axes, turn.x, turn.y), origin);
}

// Velocity across a joint, in the child's axes.
fn joint_velocity(seen: Seen) -> Motion {
    let link = seen.link;
    let row = rates(link);
    if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        return Motion(zero3(), vec3<real>(0.0, 0.0, seen.rate));
    }
    if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        return Motion(state3(row), zero3());
    }
    if HAS_FREE != 0u && link.kind == FREE {
        return Motion(state3(row), state3(row + 3u));
    }
    return Motion(vec3<real>(0.0, 0.0, seen.rate), zero3());
}

// Angular velocity and, where forces act, axes in the world.
struct Turning {
    w: vec3<real>,
    axes: mat3x3<real>,
}

// Rotations and velocity products, from the parent's turning.
fn descend(slot: u32, seen: Seen, before: Turning) -> Turning {
    let link = seen.link;
    let to = record(slot);
    var parent = before;
    if link.parent == NONE {
        parent.w = zero3();
        parent.axes = mat3x3<real>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    } else if (link.flags & FOLLOWS) == 0u {
        let above = record(link.parent);
        parent.w = scratch_at(above).xyz;
        if HAS_FORCES != 0u {
            let axes = above + 4u + HAS_SPHERICAL;
            parent.axes = mat3x3<real>(
                scratch_at(axes).xyz,
                scratch_at(axes + 1u).xyz,
                scratch_at(axes + 2u).xyz,
            );
        }
    }
    var turn: vec2<real> = vec2<real>(0.0, 1.0);
    if link.kind == REVOLUTE {
        let angle = seen.other;
        if abs(angle) > LARGEST_ANGLE {
            fail(slot, LARGE_ANGLE);
        }
        turn = sin_cos(clamp(angle, -LARGEST_ANGLE, LARGEST_ANGLE));
    }
    let child = placement(seen, turn);
    let w = parent.w * child.axes;
    let across = joint_velocity(seen);
    let c = velocity_product(link.kind, w, child.origin * child.axes, across);
    let turning = w + across.angular;
    set_scratch(to, vec4<real>(turning, turn.x));
    set_scratch(to + 1u, vec4<real>(c.linear, turn.y));
    var axes = child.axes;
    if HAS_FORCES != 0u {
        axes = parent.axes * child.axes;
        let place = to + 4u + HAS_SPHERICAL;
        set_scratch(place, vec4<real>(axes[0], 0.0));
        set_scratch(place + 1u, vec4<real>(axes[1], 0.0));
        set_scratch(place + 2u, vec4<real>(axes[2], 0.0));
    }
    return Turning(turning, axes);
}
