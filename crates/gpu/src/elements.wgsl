// Elements of a dispatch over `workgroups(items, per_group)`, which takes two dimensions where one is
// not enough.

// The element of an invocation, from its global_invocation_id and num_workgroups; `per_group` is the
// x of @workgroup_size, whose y and z are 1.
fn element(id: vec3<u32>, groups: vec3<u32>, per_group: u32) -> u32 {
    return id.y * (groups.x * per_group) + id.x;
}

// The three words of an indirect dispatch for so many items, as `workgroups` on the host has them.
fn workgroups(items: u32, per_group: u32) -> vec3<u32> {
    let most = 65535u;
    let groups = items / per_group + u32(items % per_group != 0u);
    let rows = max(groups / most + u32(groups % most != 0u), 1u);
    return vec3<u32>(groups / rows + u32(groups % rows != 0u), rows, 1u);
}
