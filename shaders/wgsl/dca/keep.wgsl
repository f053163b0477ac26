// What a solution leaves for its corrections, in the precision of the chunks: the accelerations of the bodies, the
// forces between chunks, and what side branches take of the bodies that carry them.
//
// A correction solves the equations of bodies at rest for what is missing, with the factors at hand: its way down
// gives changes, which are added up here. What is left of the equations is taken from the sums, body by body, on the
// way up (reassemble.wgsl), and where two halves of a cut body meet from the accelerations that they have.

const IS_KEPT = true;

fn is_first() -> bool { return layer.sweep == 0u; }

// Starts, behind that of the rakes, of each join's force and the accelerations of its two sides; of how the
// handles of carriers have changed since the solution before; of each rake how its bias force changes, and the
// force that it takes; of each slot its body's acceleration.
const FORCE = 0u;
const INBOARD_SIDE = 2u;
const OUTBOARD = 4u;

fn moved_at() -> u32 { return kept_at() + 6u * sizes.joins; }
fn added_at() -> u32 { return moved_at() + 2u * sizes.slots * sizes.carriers; }
fn taken_at() -> u32 { return added_at() + 2u * sizes.rakes; }
fn solved_at() -> u32 { return taken_at() + 2u * sizes.rakes; }

// Two vectors from two fours.
fn fetch_two(at: u32, stride: u32) -> Force {
    return Force(fetch(at).xyz, fetch(at + stride).xyz);
}

fn put_two(at: u32, stride: u32, v: Force) {
    put(at, vec4<real>(v.angular, 0.0));
    put(at + stride, vec4<real>(v.linear, 0.0));
}

// The force on the outboard part of a join, of all solutions.
fn force_at(join: u32) -> Force { return fetch_two(kept_at() + join, sizes.joins); }

// A number of it before this correction.
fn kept_number(join: u32, own: u32) -> chunk_real {
    if is_first() {
        return chunk_real(0.0);
    }
    return scratch[kept_at() + join + own / 3u * sizes.joins][own % 3u];
}

// Adds a number, as the chunks are given it.
fn keep_number(join: u32, own: u32, kept: chunk_real, number: real) {
    let at = kept_at() + join + own / 3u * sizes.joins;
    scratch[at][own % 3u] = kept + chunk_real(tree_real(number));
}

// The acceleration of a cut body, as the chunk on one side has it, before this correction.
fn kept_end(join: u32, side: u32) -> Motion {
    if is_first() || join == NONE {
        return motion_zero();
    }
    return end_at(join, side);
}

fn keep_end(join: u32, side: u32, kept: Motion, a: Motion) {
    let sum = motion_add(kept, a);
    let at = kept_at() + side * sizes.joins + join;
    put_two(at, sizes.joins, Force(sum.angular, sum.linear));
}

fn end_at(join: u32, side: u32) -> Motion {
    let end = fetch_two(kept_at() + side * sizes.joins + join, sizes.joins);
    return Motion(end.angular, end.linear);
}

// The difference of the accelerations on both sides, taken before it is rounded to what joins compute in.
fn apart(join: u32) -> Force {
    let at = kept_at() + join;
    let n = sizes.joins;
    return Force(
        vec4<real>(scratch[at + INBOARD_SIDE * n] - scratch[at + OUTBOARD * n]).xyz,
        vec4<real>(scratch[at + (INBOARD_SIDE + 1u) * n] - scratch[at + (OUTBOARD + 1u) * n]).xyz,
    );
}

// The acceleration of a body's joint, before this correction.
fn kept_body(slot: u32) -> Motion {
    if is_first() {
        return motion_zero();
    }
    return solved(slot);
}

fn keep_body(slot: u32, kept: Motion, a: Motion) -> Motion {
    let sum = motion_add(kept, a);
    put_two(solved_at() + slot, sizes.slots, Force(sum.angular, sum.linear));
    return sum;
}

fn solved(slot: u32) -> Motion {
    let a = fetch_two(solved_at() + slot, sizes.slots);
    return Motion(a.angular, a.linear);
}

fn put_handle(slot: u32, handle: Motion) {
    put_two(moved_at() + slot, sizes.slots, Force(handle.angular, handle.linear));
    let at = carriers_at() + slot + sizes.slots;
    var sum = Force(handle.angular, handle.linear);
    if !is_first() {
        sum = force_add(sum, fetch_two(at, sizes.slots));
    }
    put_two(at, sizes.slots, sum);
}

// What a path's joins are given at its head: an acceleration, or what a correction adds to it.
fn hanging_again(head: u32, carrier: u32) -> Force {
    if is_first() {
        return hanging(head, carrier);
    }
    if carrier == NONE {
        return force_zero();
    }
    let moved = fetch_two(moved_at() + carrier, sizes.slots);
    return seen_from(head, moved.angular, moved.linear);
}

// Changes of nodes, then factors of joins, behind the forces that act in these.
const CHANGE_SIZE = 3u;
const FACTOR_SIZE = 6u;

fn change_at(node: u32) -> u32 { return acting_at(sizes.joins) + CHANGE_SIZE * node; }

fn factor_at(join: u32) -> u32 {
    return change_at(sizes.chunk_nodes + sizes.joins) + FACTOR_SIZE * join;
}

fn keep_factor(join: u32, factor: Cholesky6) {
    let at = factor_at(join);
    let a = factor.angular;
    let l = factor.linear;
    let c = factor.coupling;
    tree_put_vectors(at, a.inverse, a.lower, l.inverse, l.lower);
    tree_put_vectors(at + 3u, c[0], c[1], c[2], zero3());
}

fn get_factor(join: u32) -> Cholesky6 {
    let at = factor_at(join);
    let a = vec4<real>(nodes[at]);
    let b = vec4<real>(nodes[at + 1u]);
    let c = vec4<real>(nodes[at + 2u]);
    let d = vec4<real>(nodes[at + 3u]);
    let e = vec4<real>(nodes[at + 4u]);
    let f = vec4<real>(nodes[at + 5u]);
    return Cholesky6(
        Cholesky3(a.xyz, vec3<real>(a.w, b.xy), true),
        mat3x3<real>(d.xyz, vec3<real>(d.w, e.xy), vec3<real>(e.zw, f.x)),
        Cholesky3(vec3<real>(b.zw, c.x), c.yzw, true),
        true,
    );
}

fn put_added(rake: u32, force: Force) { put_two(added_at() + rake, sizes.rakes, force); }

fn put_taken(rake: u32, force: Force) { put_two(taken_at() + rake, sizes.rakes, force); }
