// What all kernels of divide and conquer share in memory. `real` is what a kernel computes in, `chunk_real`
// and `tree_real` are what chunks and joins are kept in.
//
// Arrays are kept component by component: record i of an array of records of four numbers each is at
// first + i, first + count + i, first + 2 count + i ..., so that neighbouring lanes read neighbouring memory.

struct Sizes {
    slots: u32,
    positions: u32,
    dofs: u32,
    chunks: u32,
    joins: u32,
    // Nodes of chunks, which are before those of joins.
    chunk_nodes: u32,
    inners: u32,
    leaves: u32,
    rakes: u32,
    // Whether bodies carry others' paths.
    carriers: u32,
    // Whether every joint has one freedom: numbers of slots are then those of positions and rates.
    single: u32,
    // First words of the tables of chunks, cut bodies, sums and rakes.
    chunk_words: u32,
    cut_words: u32,
    sum_words: u32,
    rake_words: u32,
    // Metres in the model's unit of length.
    length: f32,
    // First number of `forces` that says what pushes bodies.
    pushes: u32,
    // First four of `scratch` that says what acts in spherical joints, if that is worked out by itself.
    balls: u32,
}

// What a dispatch works on: chunks a lane each, or several rounds of the tree.
struct Layer {
    // Number of chunks; of workgroups that have something to do.
    count: u32,
    rounds: u32,
    // First word of the table: for each workgroup where the items of its rounds start, and end.
    starts: u32,
    // Whether the rounds are gone through up (1), down (2), or both (3).
    ways: u32,
    // The stage of an integrator, or what becomes of the state.
    stage: u32,
    // 0 for a solution, 1 for its first correction, ...
    sweep: u32,
    // Which solution of a step it is that is implicit in what acts in joints, from 1; 0 where that acts as it does now.
    attempt: u32,
}

@group(0) @binding(0) var<uniform> sizes: Sizes;
@group(0) @binding(1) var<uniform> layer: Layer;
@group(0) @binding(2) var<storage, read> words: array<u32>;
@group(0) @binding(3) var<storage, read> links: array<vec4<chunk_real>>;
// The state at the start of the step, positions and rates; then the state that is worked on; then of
// Runge and Kutta's method displacements, sums of rates and sums of accelerations; accelerations; works of elements.
@group(0) @binding(4) var<storage, read_write> state: array<chunk_real>;
@group(0) @binding(5) var<storage, read_write> scratch: array<vec4<chunk_real>>;
// Whether a step has failed, the number of steps since that was last reset, the number of bodies that are
// pushed, the last attempt of a step that asked for another; from the fifth word on the number of each of these, counted from 1, by slots.
@group(0) @binding(6) var<storage, read_write> control: array<u32>;
@group(0) @binding(7) var<storage, read_write> status: array<atomic<u32>>;

const HALTED = 0u;
const STEPS = 1u;
const PUSHED = 2u;
// All lanes of an attempt write the same.
const LAST_ASKED = 3u;
const PUSHED_SLOTS = 4u;

const NONE = 0xffffffffu;

// Words of a join in the table of a round: itself, then what dynamics or kinematics want to know.
const RECORD = 10u;

// Stages that can fail, in the order of the recording's.
const SINGULAR = 0u;
const UNJOINED = 1u;
const OVERFLOW = 2u;

// Reports the body of a slot; of the first step that fails.
fn fail(stage: u32, slot: u32) {
    if control[HALTED] == 0u {
        atomicOr(&status[0], 1u << stage);
        // The complement, because a cleared word must stand for no element.
        atomicMax(&status[1u + stage], ~body_of(slot));
    }
}

// Tables of slots: the joint's kind and flags, start in q, start in qd, body; then, if any body carries
// others' paths, two numbers of rakes each.
const AT_CENTER = 8u;
const CARRIES = 16u;

fn flags_of(slot: u32) -> u32 { return words[slot]; }

fn position_of(slot: u32) -> u32 {
    if sizes.single != 0u {
        return slot;
    }
    return words[sizes.slots + slot];
}

fn dof_of(slot: u32) -> u32 {
    if sizes.single != 0u {
        return slot;
    }
    return words[2u * sizes.slots + slot];
}

fn body_of(slot: u32) -> u32 { return words[3u * sizes.slots + slot]; }
fn rake_onto(slot: u32, which: u32) -> u32 { return words[(4u + which) * sizes.slots + slot]; }

fn kind_of(flags: u32) -> u32 { return flags & 7u; }

// Tables of chunks. The slots of a round's chunks are numbered by their place in the chunk, then by chunks,
// the longest first. A chunk with a node and a rake is the head of a raked path of several. The joins before
// and after are those of the cut bodies at its ends; what a chunk hangs from is what a join hangs from, then
// what is across another part.
const JAG = 0u;
const RANK = 1u;
const LENGTH = 2u;
const INBOARD = 3u;
const ENDS = 4u;
const UNDER = 5u;
const NODE = 6u;
const INNER = 7u;
const LEAF = 8u;
const RAKE = 9u;
const BEFORE = 10u;
const AFTER = 11u;
const ACROSS = 12u;

// Bits of ENDS.
const FROM_CARRIER = 1u;
const FROM_CUT = 2u;
const TO_HALF = 4u;
const TO_LEAF = 8u;
const IS_HALVED = 16u;

fn chunk_word(chunk: u32, which: u32) -> u32 {
    return words[sizes.chunk_words + which * sizes.chunks + chunk];
}

struct Slots {
    jag: u32,
    rank: u32,
    length: u32,
}

fn slots_of(chunk: u32) -> Slots {
    return Slots(chunk_word(chunk, JAG), chunk_word(chunk, RANK), chunk_word(chunk, LENGTH));
}

fn slot_at(slots: Slots, place: u32) -> u32 {
    return words[slots.jag + place] + slots.rank;
}

// The slot at a place of a chunk, or at its last one. Looked up two places ahead, because what is read of a
// body waits for it, and a lane waits where a read does.
fn slot_ahead(slots: Slots, place: u32) -> u32 {
    return slot_at(slots, min(place, slots.length - 1u));
}

// A slot and what tables say of it: looked up a place ahead.
struct Spot {
    slot: u32,
    flags: u32,
    q: u32,
    v: u32,
}

fn spot_of(slot: u32) -> Spot {
    return Spot(slot, flags_of(slot), position_of(slot), dof_of(slot));
}

// The body that a join puts together.
fn cut_of(join: u32) -> u32 { return words[sizes.cut_words + join]; }

// Starts of the arrays in `scratch`: of each slot its place, and if it carries paths its handle's position and
// acceleration; what is across each chunk and join; what each join hangs from; of each freedom what the way
// down needs; of inner chunks and leaves their inverses; rakes; what corrections keep (keep.wgsl).
fn carriers_at() -> u32 { return 4u * sizes.slots; }
fn turns_at() -> u32 { return carriers_at() + 3u * sizes.slots * sizes.carriers; }
fn turns() -> u32 { return sizes.chunks + sizes.joins; }
fn unders_at() -> u32 { return turns_at() + 3u * turns(); }
fn freedoms_at() -> u32 { return unders_at() + 3u * sizes.joins; }
fn inners_at() -> u32 { return freedoms_at() + 4u * sizes.dofs; }
fn leaves_at() -> u32 { return inners_at() + 16u * sizes.inners; }
fn rakes_at() -> u32 { return leaves_at() + 32u * sizes.leaves; }
fn kept_at() -> u32 { return rakes_at() + 8u * sizes.rakes; }

// Starts of the arrays in `state`.
fn work_q() -> u32 { return sizes.positions + sizes.dofs; }
fn work_qd() -> u32 { return 2u * sizes.positions + sizes.dofs; }
// WORKS sums a freedom of the work that elements and loops have done, at the start of the step and after it.
fn works_at() -> u32 { return 2u * sizes.positions + 6u * sizes.dofs; }

struct Four {
    a: vec3<real>,
    b: vec3<real>,
    c: vec3<real>,
    d: vec3<real>,
}

fn put(at: u32, v: vec4<real>) { scratch[at] = vec4<chunk_real>(v); }

fn fetch(at: u32) -> vec4<real> { return vec4<real>(scratch[at]); }

// Four vectors in three.
fn put4(at: u32, stride: u32, a: vec3<real>, b: vec3<real>, c: vec3<real>, d: vec3<real>) {
    put(at, vec4<real>(a, d.x));
    put(at + stride, vec4<real>(b, d.y));
    put(at + 2u * stride, vec4<real>(c, d.z));
}

fn get4(at: u32, stride: u32) -> Four {
    let a = fetch(at);
    let b = fetch(at + stride);
    let c = fetch(at + 2u * stride);
    return Four(a.xyz, b.xyz, c.xyz, vec3<real>(a.w, b.w, c.w));
}
