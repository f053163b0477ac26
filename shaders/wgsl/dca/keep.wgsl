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

// Behind the forces that act in joins: changes of nodes, the rows of each join's G^-1, and what differs in it.
const CHANGE_SIZE = 3u;
const INVERSE_SIZE = 12u;
const DIFFERING_SIZE = 2u;

fn change_at(node: u32) -> u32 { return acting_at(sizes.joins) + CHANGE_SIZE * node; }

fn inverse_at(join: u32) -> u32 {
    return change_at(sizes.chunk_nodes + sizes.joins) + INVERSE_SIZE * join;
}

fn differing_at(join: u32) -> u32 { return inverse_at(sizes.joins) + DIFFERING_SIZE * join; }

// Six numbers at the start of two fours.
fn six_at(at: u32) -> Force {
    let a = vec4<real>(nodes[at]);
    let b = vec4<real>(nodes[at + 1u]);
    return Force(a.xyz, vec3<real>(a.w, b.xy));
}

fn inverse_row(join: u32, row: u32) -> Force { return six_at(inverse_at(join) + 2u * row); }

// The inverse is symmetric: its rows are solutions.
fn keep_inverse_row(join: u32, factor: Cholesky6, row: u32) {
    let one = vec3<real>(vec3<u32>(row % 3u) == vec3<u32>(0u, 1u, 2u));
    let is_angular = row < 3u;
    let solved = cholesky6_solve(
        factor,
        Force(select(zero3(), one, is_angular), select(one, zero3(), is_angular)),
    );
    let at = inverse_at(join) + 2u * row;
    tree_put(at, solved.angular.x, solved.angular.y, solved.angular.z, solved.linear.x);
    tree_put(at + 1u, solved.linear.y, solved.linear.z, 0.0, 0.0);
}

fn put_added(rake: u32, force: Force) { put_two(added_at() + rake, sizes.rakes, force); }

fn put_taken(rake: u32, force: Force) { put_two(taken_at() + rake, sizes.rakes, force); }
