// What the counters count. Hits are the first, where sorting looks for the number of pairs.
const HITS: u32 = 0u;
const QUEUED: u32 = 1u;
const UNDECIDED: u32 = 2u;
const LEFT: u32 = 3u;
// Where the counters end and the answer begins.
const ANSWER: u32 = 16u;

// The counter of the queue of a level: of blocks it is QUEUED, others come after LEFT.
fn queue_counter(level: u32) -> u32 {
    return select(LEFT + level, QUEUED, level == 0u);
}
