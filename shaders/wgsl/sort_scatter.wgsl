// Sorts each tile by the digit in workgroup memory, then writes it where `offsets` says: the keys of
// a digit leave side by side, so that their writes join. Equal digits keep their order.
//
// A row of lanes (a subgroup, or a single lane) holds ITEMS * lanes consecutive elements, lane by
// lane; rows follow each other. The rank of a key among the equal digits of its tile is the number in
// the rows before, plus in its own row before this round, plus in the lanes before in this round.
// (D. Merrill and A. Grimshaw, "High performance and scalable radix sorting", 2011; ranks by ballots
// as A. Adinets and D. Merrill, "Onesweep", 2022.)

@group(0) @binding(0) var<uniform> ranges: Ranges;
@group(0) @binding(1) var<uniform> digit: Digit;
@group(0) @binding(2) var<storage, read> keys: array<u32>;
@group(0) @binding(3) var<storage, read> values: array<u32>;
@group(0) @binding(4) var<storage, read> offsets: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_keys: array<u32>;
@group(0) @binding(6) var<storage, read_write> sorted_values: array<u32>;
@group(0) @binding(7) var<storage, read_write> status: array<atomic<u32>>;

// Equal digits of each row, two counts of 16 bits a word.
var<workgroup> counters: array<atomic<u32>, ROWS * BINS / 2u>;
// First place of each digit in the sorted tile.
var<workgroup> starts: array<u32, BINS>;
// What to add to a place in the sorted tile to have the place in all.
var<workgroup> shifts: array<u32, BINS>;
var<workgroup> exchange: array<u32, TILE>;

// Where a lane stands.
struct Row {
    number: u32,
    lane: u32,
    // Lanes of a row.
    lanes: u32,
}

// The lanes of a row that hold the same digit.
struct Peers {
    // Those before this one.
    before: u32,
    // All of them.
    count: u32,
    // The first.
    leader: u32,
}

fn counter(row: u32, value: u32) -> u32 {
    return row * (BINS / 2u) + value / 2u;
}

fn half_of(word: u32, value: u32) -> u32 {
    return word >> (16u * (value & 1u)) & 0xffffu;
}

fn sort_tile(row: Row, thread: u32, tile: u32) {
    let range = ranges.level[0];
    if tile >= range.tiles {
        return;
    }
    for (var i = thread; i < ROWS * (BINS / 2u); i += THREADS) {
        atomicStore(&counters[i], 0u);
    }
    // Cleared before anything is counted.
    workgroupBarrier();

    // Beyond the end the largest keys stand, which end up there again.
    let first = tile * TILE + row.number * row.lanes * ITEMS + row.lane;
    var held: array<u32, ITEMS>;
    var places: array<u32, ITEMS>;
    for (var i = 0u; i < ITEMS; i++) {
        let at = first + i * row.lanes;
        held[i] = 0xffffffffu;
        if at < range.count {
            held[i] = keys[at];
        }
    }
    for (var i = 0u; i < ITEMS; i++) {
        let value = digit_of(held[i]);
        let peers = find_peers(row, value);
        var before = 0u;
        if row.lane == peers.leader {
            let added = peers.count << (16u * (value & 1u));
            before = half_of(atomicAdd(&counters[counter(row.number, value)], added), value);
        }
        places[i] = from_leader(before, peers.leader) + peers.before;
    }
    // All rows have counted.
    workgroupBarrier();

    // Counts become sums over the rows before; what they come to is the tile's count of the digit.
    if thread < BINS / 2u {
        var sum = 0u;
        for (var number = 0u; number < ROWS; number++) {
            let at = number * (BINS / 2u) + thread;
            let here = atomicLoad(&counters[at]);
            atomicStore(&counters[at], sum);
            sum += here;
        }
        starts[2u * thread] = sum & 0xffffu;
        starts[2u * thread + 1u] = sum >> 16u;
    }
    var start = 0u;
    var own = 0u;
    for (var round = 0u; round < BITS; round++) {
        let width = 1u << round;
        // What the last round wrote is read ...
        workgroupBarrier();
        if thread < BINS {
            if round == 0u {
                own = starts[thread];
                start = own;
            }
            if thread >= width {
                start += starts[thread - width];
            }
        }
        // ... by all before it is written again.
        workgroupBarrier();
        if thread < BINS {
            starts[thread] = start;
        }
    }
    // The last round is over before its sums lose their own count.
    workgroupBarrier();
    if thread < BINS {
        starts[thread] = start - own;
        // A single tile is sorted where it stands.
        shifts[thread] = 0u;
        if range.tiles > 1u {
            let offset = offsets[thread * range.tiles + tile];
            shifts[thread] = offset - (start - own);
        }
    }
    // Starts are there before they are used.
    workgroupBarrier();

    for (var i = 0u; i < ITEMS; i++) {
        let value = digit_of(held[i]);
        let rows_before = half_of(atomicLoad(&counters[counter(row.number, value)]), value);
        places[i] += starts[value] + rows_before;
        exchange[places[i]] = held[i];
    }
    // All keys are in their places.
    workgroupBarrier();
    let end = range.count - tile * TILE;
    for (var i = 0u; i < ITEMS; i++) {
        let place = i * THREADS + thread;
        if place < end {
            let key = exchange[place];
            held[i] = shifts[digit_of(key)] + place;
            sorted_keys[held[i]] = key;
        }
    }
    // All keys have left before values take their places.
    workgroupBarrier();
    for (var i = 0u; i < ITEMS; i++) {
        let at = first + i * row.lanes;
        if at < range.count {
            exchange[places[i]] = values[at];
        }
    }
    // All values are in their places.
    workgroupBarrier();
    for (var i = 0u; i < ITEMS; i++) {
        let place = i * THREADS + thread;
        if place < end {
            sorted_values[held[i]] = exchange[place];
        }
    }
}
