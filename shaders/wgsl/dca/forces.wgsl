// What acts: -g, the step in time, joint forces, what elements are given, pushes.

@group(0) @binding(8) var<storage, read> forces: array<chunk_real>;

const STEP_SIZE = 3u;
const JOINT_FORCES = 4u;

fn joint_force(at: u32) -> real { return real(forces[JOINT_FORCES + at]); }

fn joint_forces3(at: u32) -> vec3<real> {
    return vec3<real>(joint_force(at), joint_force(at + 1u), joint_force(at + 2u));
}
