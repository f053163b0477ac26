// What the counters count.
const QUEUED: u32 = 0u;
const HITS: u32 = 1u;
const UNDECIDED: u32 = 2u;
