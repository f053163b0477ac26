// What a solution leaves for its corrections, in the precision of the chunks.
//
// A chunk answers what is given at its ends to all digits; what the joins give is rounded by theirs. So
// what is left of the equations are differences where parts meet: of the accelerations of the two halves of
// each cut body; and of the force that a raked path of several chunks exerts, from the one that its inertia
// and bias force have promised to the body that carries it. Neither grows with the condition of the whole.
// The joins answer both with corrections, in their own precision and with the factors they have; forces are
// added up in the precision of the chunks, which are then solved anew.

const IS_KEPT = true;

// Starts, behind that of the rakes, of each join's force and the accelerations of its two sides; of how the
// handles of carriers have changed since the solution before; of each rake what is to be added to its bias
// force; and of those of paths of several chunks how the first of these responds.
const FORCE = 0u;
const INBOARD_SIDE = 2u;
const OUTBOARD = 4u;

fn moved_at() -> u32 { return kept_at() + 6u * sizes.joins; }
fn added_at() -> u32 { return moved_at() + 2u * sizes.slots * sizes.carriers; }
fn heads_at() -> u32 { return added_at() + 2u * sizes.rakes; }

// Two vectors from two fours.
fn fetch_two(at: u32, stride: u32) -> Force {
    return Force(fetch(at).xyz, fetch(at + stride).xyz);
}

fn put_two(at: u32, stride: u32, v: Force) {
    put(at, vec4<real>(v.angular, 0.0));
    put(at + stride, vec4<real>(v.linear, 0.0));
}

// As chunks are given it.
fn force_at(join: u32) -> Force { return fetch_two(kept_at() + join, sizes.joins); }

// A number of the first force, or of what a correction adds.
fn keep_number(join: u32, own: u32, number: real) {
    let at = kept_at() + join + own / 3u * sizes.joins;
    var sum = chunk_real(number);
    if layer.sweep > 0u {
        sum += scratch[at][own % 3u];
    }
    scratch[at][own % 3u] = sum;
}

// The acceleration of a cut body, as the chunk on one side has it.
fn keep_end(join: u32, side: u32, a: Motion) {
    put_two(kept_at() + side * sizes.joins + join, sizes.joins, Force(a.angular, a.linear));
}

// The difference of the accelerations on both sides.
fn apart(join: u32) -> Force {
    let at = kept_at() + join;
    let n = sizes.joins;
    return Force(
        vec4<real>(scratch[at + 2u * n] - scratch[at + 4u * n]).xyz,
        vec4<real>(scratch[at + 3u * n] - scratch[at + 5u * n]).xyz,
    );
}

fn put_handle(slot: u32, handle: Motion) {
    let at = carriers_at() + slot + sizes.slots;
    let new_handle = Force(handle.angular, handle.linear);
    if layer.sweep > 0u {
        let old = fetch_two(at, sizes.slots);
        put_two(moved_at() + slot, sizes.slots, force_sub(new_handle, old));
    }
    put_two(at, sizes.slots, new_handle);
}

// What a path's joins are given at its head: an acceleration, or what a correction adds to it.
fn hanging_again(head: u32, carrier: u32) -> Force {
    if layer.sweep == 0u {
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

// Where what is kept of a rake's first chunk starts.
fn head_at(rake: u32) -> u32 { return heads_at() + rake - sizes.single_rakes; }

fn put_head(rake: u32, node: Node) {
    let at = head_at(rake);
    let n = sizes.path_rakes;
    let m = node.phi11;
    let b = node.phi12;
    put4(at, n, m.angular.diagonal, m.angular.off, m.linear.diagonal, m.linear.off);
    put4(at + 3u * n, n, m.coupling[0], m.coupling[1], m.coupling[2], b.al[0]);
    put4(at + 6u * n, n, b.aa[0], b.aa[1], b.aa[2], b.al[1]);
    put4(at + 9u * n, n, b.la[0], b.la[1], b.la[2], b.al[2]);
    put4(at + 12u * n, n, b.ll[0], b.ll[1], b.ll[2], zero3());
    put_two(at + 15u * n, n, node.b1);
}

// The force that a path of several chunks exerts on the body that carries it, less what that counts on.
fn keep_head(chunk: u32, ends: Ends) {
    let rake = chunk_word(chunk, RAKE);
    if rake == NONE || chunk_word(chunk, NODE) == NONE {
        return;
    }
    let at = head_at(rake);
    let n = sizes.path_rakes;
    let m = get4(at, n);
    let h = get4(at + 3u * n, n);
    let aa = get4(at + 6u * n, n);
    let la = get4(at + 9u * n, n);
    let ll = get4(at + 12u * n, n);
    let inertia = Inertia(Sym3(m.a, m.b), mat3x3<real>(h.a, h.b, h.c), Sym3(m.c, m.d));
    let tip = Matrix6(
        mat3x3<real>(aa.a, aa.b, aa.c),
        mat3x3<real>(h.d, aa.d, la.d),
        mat3x3<real>(la.a, la.b, la.c),
        mat3x3<real>(ll.a, ll.b, ll.c),
    );
    let counted = rake_at_head(rake);
    let a = Motion(ends.x.angular, ends.x.linear);
    let beyond: Inertia = inertia_add(inertia, inertia_scaled(counted.inertia, -1.0));
    let moving = force_sub(inertia_mul(beyond, a), matrix6_mul(tip, ends.f2));
    let bias = force_sub(fetch_two(at + 15u * n, n), counted.bias);
    put_added(rake, force_add(moving, bias));
}

fn put_added(rake: u32, force: Force) {
    put_two(added_at() + rake, sizes.rakes, force);
}
