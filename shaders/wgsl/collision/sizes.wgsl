// What kernels that go through jobs work on.

struct Sizes {
    // Number of jobs.
    jobs: u32,
    // Workgroups of all jobs.
    groups: u32,
    // Places in the queue.
    queue: u32,
    // The level of the nodes, and where it begins among the boxes of A and of B.
    level: u32,
    a_at: u32,
    b_at: u32,
}
