// Which of the `jobs`, of which there are `sizes.jobs`, a workgroup belongs to.

// How often jobs can be halved to find the one that a workgroup belongs to.
const HALVINGS: u32 = 32u;

// The last job that begins at this workgroup or before.
fn job_of(group: u32) -> u32 {
    var first = 0u;
    var end = sizes.jobs;
    for (var i = 0u; i < HALVINGS; i++) {
        if end - first <= 1u {
            break;
        }
        let middle = first + (end - first) / 2u;
        if jobs[middle].first_group <= group {
            first = middle;
        } else {
            end = middle;
        }
    }
    return first;
}
