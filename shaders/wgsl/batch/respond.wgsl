// Down again: accelerations of bodies and joints.

// The acceleration of a body from that of the one its lane did before, or its parent's.
fn respond(slot: u32, seen: Seen, before: Motion) -> Motion {
    let link = seen.link;
    let at = record(slot);
    let child = placement(seen, vec2<real>(seen.first.w, seen.second.w));
    var parent = before;
    if link.parent == NONE {
        parent = Motion(zero3(), constants[0].xyz);
    } else if (link.flags & FOLLOWS) == 0u {
        let above = record(link.parent);
        parent = Motion(scratch_at(above).xyz, scratch_at(above + 1u).xyz);
    }
    let across = joint_velocity(seen);
    let shifted = motion_shifted(parent, child.origin);
    var a = Motion(
        shifted.angular * child.axes + cross3(seen.first.xyz, across.angular),
        shifted.linear * child.axes + seen.second.xyz,
    );
    let w_angular = seen.third;
    let w_linear = seen.fourth;
    if HAS_FREE != 0u && link.kind == FREE {
        let free = Motion(w_angular.xyz, w_linear.xyz);
        finish_several(slot, link, motion_sub(free, a));
        a = free;
    } else if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        let last = scratch_at(at + 4u);
        let angular = vec3<real>(w_angular.w, w_linear.w, last.w)
            - w_angular.xyz * a.linear.x - w_linear.xyz * a.linear.y - last.xyz * a.linear.z;
        finish_several(slot, link, Motion(angular - a.angular, zero3()));
        a.angular = angular;
    } else if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        let along: real = w_angular.w - dot(w_angular.xyz, a.angular)
            - w_linear.x * a.linear.x - w_linear.y * a.linear.y;
        finish_one(slot, link, along - a.linear.z);
        a.linear.z = along;
    } else {
        let about: real = w_angular.w - w_angular.x * a.angular.x - w_angular.y * a.angular.y
            - dot(w_linear.xyz, a.linear);
        finish_one(slot, link, about - a.angular.z);
        a.angular.z = about;
    }
    if (link.flags & KEPT) != 0u {
        set_scratch(at, vec4<real>(a.angular, 0.0));
        set_scratch(at + 1u, vec4<real>(a.linear, 0.0));
    }
    return a;
}
