// Poses of all bodies of many states of one model: one lane an item, body after body from its parent's.

struct Pose {
    // x, y, z, w
    rotation: vec4<real>,
    translation: vec4<real>,
}

@group(0) @binding(0) var<uniform> plan: BatchPlan;
@group(0) @binding(1) var<storage, read> links: array<BatchLink>;
// The unit of length; then of each body the joint's place on the parent and the body's against the joint.
@group(0) @binding(2) var<storage, read> constants: array<vec4<real>>;
@group(0) @binding(3) var<storage, read> state: array<real>;
@group(0) @binding(4) var<storage, read_write> poses: array<array<vec4<real>, 2>>;

fn composed(a: Pose, b: Pose) -> Pose {
    return Pose(
        quaternion_normalized(quaternion_product(a.rotation, b.rotation)),
        a.translation + vec4<real>(quaternion_turned(a.rotation, b.translation.xyz), 0.0),
    );
}

fn state_at(row: u32, item: u32) -> real {
    return state[(plan.half * (plan.positions + plan.dofs) + row) * plan.stride + item];
}

fn state3(row: u32, item: u32) -> vec3<real> {
    return vec3<real>(state_at(row, item), state_at(row + 1u, item), state_at(row + 2u, item));
}

fn moved(link: BatchLink, item: u32) -> Pose {
    let row = link.position;
    let length: real = constants[0].x;
    var pose: Pose = Pose(vec4<real>(0.0, 0.0, 0.0, 1.0), vec4<real>(0.0, 0.0, 0.0, 0.0));
    if link.kind == REVOLUTE {
        let turn: vec2<real> = sin_cos(0.5 * clamp(state_at(row, item), -LARGEST_ANGLE, LARGEST_ANGLE));
        pose.rotation = vec4<real>(0.0, 0.0, turn.x, turn.y);
    } else if link.kind == PRISMATIC {
        pose.translation.z = state_at(row, item) * length;
    } else if link.kind == SPHERICAL {
        pose.rotation = vec4<real>(state3(row, item), state_at(row + 3u, item));
    } else if link.kind == FREE {
        pose.translation = vec4<real>(state3(row, item) * length, 0.0);
        pose.rotation = vec4<real>(state3(row + 3u, item), state_at(row + 6u, item));
    }
    return pose;
}

@compute @workgroup_size(64)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let item = (group_id.y * groups.x + group_id.x) * 64u + lane;
    if item >= plan.stride {
        return;
    }
    for (var body = 0u; body < plan.levels; body++) {
        let link = links[body];
        let at = 1u + 4u * body;
        var pose = Pose(constants[at], constants[at + 1u]);
        if link.parent != NONE {
            let parent = poses[link.parent * plan.stride + item];
            pose = composed(Pose(parent[0], parent[1]), pose);
        }
        pose = composed(pose, moved(link, item));
        pose = composed(pose, Pose(constants[at + 2u], constants[at + 3u]));
        poses[body * plan.stride + item] = array<vec4<real>, 2>(pose.rotation, pose.translation);
    }
}
