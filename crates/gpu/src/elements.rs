//! How elements are spread over workgroups, on the host and in kernels.

/// The part of WGSL that goes with [`workgroups`]: `element(id, groups, per_group)` is the number of
/// an invocation, from its `global_invocation_id` and `num_workgroups`, and `workgroups(items,
/// per_group)` makes the three words of an indirect dispatch on the device. For up to 2^31 elements.
pub const ELEMENTS: &str = include_str!("elements.wgsl");

/// The number of workgroups for `items` in groups of `per_group`, spread over two dimensions where
/// one is not enough: beyond 65 535 groups, which for groups of 64 is beyond 4 194 240 items.
///
/// The number of an invocation is therefore not `global_invocation_id.x`, but `element(..)` of the
/// part [`ELEMENTS`]; that of a workgroup is `id.y * groups.x + id.x` of `workgroup_id` and
/// `num_workgroups`. Numbers at and beyond `items` have nothing to do.
///
/// Of up to 2^31 items every invocation has a number of its own. Beyond, the last workgroups may pass
/// 2^32 and begin again at 0: `element` would give the first elements twice.
///
/// ```
/// use vertebra_gpu::workgroups;
/// assert_eq!(workgroups(1000, 256), [4, 1, 1]);
/// let [x, y, _] = workgroups(1 << 30, 256);
/// assert!(x <= 65_535 && u64::from(x) * u64::from(y) * 256 >= 1 << 30);
/// ```
#[must_use]
pub fn workgroups(items: u32, per_group: u32) -> [u32; 3] {
    const MOST: u32 = 65_535; // WebGPU's maxComputeWorkgroupsPerDimension
    let groups = items.div_ceil(per_group.max(1));
    let rows = groups.div_ceil(MOST).max(1);
    [groups.div_ceil(rows), rows, 1]
}
