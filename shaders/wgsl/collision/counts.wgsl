// What the counters count. Hits are the first, where sorting looks for the number of pairs.
const HITS: u32 = 0u;
const QUEUED: u32 = 1u;
const UNDECIDED: u32 = 2u;

// The counter of the queue of a level: of blocks it is QUEUED, others come after all else.
fn queue_counter(level: u32) -> u32 {
    return select(UNDECIDED + level, QUEUED, level == 0u);
}
