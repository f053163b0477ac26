// Nodes of the tree and what joins keep, in memory.

@group(0) @binding(8) var<storage, read> forces: array<chunk_real>;
@group(0) @binding(9) var<storage, read_write> nodes: array<vec4<tree_real>>;

// Starts of the arrays in `nodes`: nodes, what joins keep, what acts on them.
fn node_count() -> u32 { return sizes.chunk_nodes + sizes.joins; }
fn joined_at() -> u32 { return 23u * node_count(); }
fn acting_at() -> u32 { return joined_at() + 25u * sizes.joins; }

// Starts of the arrays in `forces`: -g, the step in time, joint forces, pushes.
const STEP_SIZE = 3u;
const JOINT_FORCES = 4u;

fn tree_put(at: u32, v: vec4<real>) { nodes[at] = vec4<tree_real>(v); }

fn tree_get(at: u32) -> vec4<real> { return vec4<real>(nodes[at]); }

fn tree_put4(at: u32, stride: u32, a: vec3<real>, b: vec3<real>, c: vec3<real>, d: vec3<real>) {
    tree_put(at, vec4<real>(a, d.x));
    tree_put(at + stride, vec4<real>(b, d.y));
    tree_put(at + 2u * stride, vec4<real>(c, d.z));
}

fn tree_get4(at: u32, stride: u32) -> Four {
    let a = tree_get(at);
    let b = tree_get(at + stride);
    let c = tree_get(at + 2u * stride);
    return Four(a.xyz, b.xyz, c.xyz, vec3<real>(a.w, b.w, c.w));
}

fn put_node(index: u32, node: Node) {
    let n = node_count();
    let p = node.phi11;
    let c = node.phi12;
    let r = node.phi22;
    tree_put4(index, n, p.angular.diagonal, p.angular.off, p.linear.diagonal, p.linear.off);
    tree_put4(index + 3u * n, n, p.coupling[0], p.coupling[1], p.coupling[2], node.b1.angular);
    tree_put4(index + 6u * n, n, c.aa[0], c.aa[1], c.aa[2], node.b1.linear);
    tree_put4(index + 9u * n, n, c.al[0], c.al[1], c.al[2], node.b2.angular);
    tree_put4(index + 12u * n, n, c.la[0], c.la[1], c.la[2], node.b2.linear);
    tree_put4(index + 15u * n, n, c.ll[0], c.ll[1], c.ll[2], r.angular.diagonal);
    tree_put4(index + 18u * n, n, r.coupling[0], r.coupling[1], r.coupling[2], r.angular.off);
    tree_put(index + 21u * n, vec4<real>(r.linear.diagonal, 0.0));
    tree_put(index + 22u * n, vec4<real>(r.linear.off, 0.0));
}

fn get_node(index: u32) -> Node {
    let n = node_count();
    let p = tree_get4(index, n);
    let h = tree_get4(index + 3u * n, n);
    let aa = tree_get4(index + 6u * n, n);
    let al = tree_get4(index + 9u * n, n);
    let la = tree_get4(index + 12u * n, n);
    let ll = tree_get4(index + 15u * n, n);
    let r = tree_get4(index + 18u * n, n);
    return Node(
        Inertia(Sym3(p.a, p.b), mat3x3<real>(h.a, h.b, h.c), Sym3(p.c, p.d)),
        Matrix6(
            mat3x3<real>(aa.a, aa.b, aa.c),
            mat3x3<real>(al.a, al.b, al.c),
            mat3x3<real>(la.a, la.b, la.c),
            mat3x3<real>(ll.a, ll.b, ll.c),
        ),
        Inertia(
            Sym3(ll.d, r.d),
            mat3x3<real>(r.a, r.b, r.c),
            Sym3(tree_get(index + 21u * n).xyz, tree_get(index + 22u * n).xyz),
        ),
        Force(h.d, aa.d),
        Force(al.d, la.d),
    );
}

fn put_joined(join: u32, joined: Joined) {
    let at = joined_at() + join;
    let n = sizes.joins;
    let f = joined.factor;
    let i = joined.inboard;
    let o = joined.outboard;
    tree_put4(at, n, f.angular.inverse, f.angular.lower, f.linear.inverse, f.linear.lower);
    tree_put4(at + 3u * n, n, f.coupling[0], f.coupling[1], f.coupling[2], joined.bias.angular);
    tree_put4(at + 6u * n, n, i.aa[0], i.aa[1], i.aa[2], joined.bias.linear);
    tree_put4(at + 9u * n, n, i.al[0], i.al[1], i.al[2], o.aa[0]);
    tree_put4(at + 12u * n, n, i.la[0], i.la[1], i.la[2], o.aa[1]);
    tree_put4(at + 15u * n, n, i.ll[0], i.ll[1], i.ll[2], o.aa[2]);
    tree_put4(at + 18u * n, n, o.al[0], o.al[1], o.al[2], o.la[0]);
    tree_put4(at + 21u * n, n, o.ll[0], o.ll[1], o.ll[2], o.la[1]);
    tree_put(at + 24u * n, vec4<real>(o.la[2], 0.0));
}

fn get_joined(join: u32) -> Joined {
    let at = joined_at() + join;
    let n = sizes.joins;
    let f = tree_get4(at, n);
    let h = tree_get4(at + 3u * n, n);
    let aa = tree_get4(at + 6u * n, n);
    let al = tree_get4(at + 9u * n, n);
    let la = tree_get4(at + 12u * n, n);
    let ll = tree_get4(at + 15u * n, n);
    let o = tree_get4(at + 18u * n, n);
    let l = tree_get4(at + 21u * n, n);
    return Joined(
        Cholesky6(
            Cholesky3(f.a, f.b, true),
            mat3x3<real>(h.a, h.b, h.c),
            Cholesky3(f.c, f.d, true),
            true,
        ),
        Matrix6(
            mat3x3<real>(aa.a, aa.b, aa.c),
            mat3x3<real>(al.a, al.b, al.c),
            mat3x3<real>(la.a, la.b, la.c),
            mat3x3<real>(ll.a, ll.b, ll.c),
        ),
        Matrix6(
            mat3x3<real>(al.d, la.d, ll.d),
            mat3x3<real>(o.a, o.b, o.c),
            mat3x3<real>(o.d, l.d, tree_get(at + 24u * n).xyz),
            mat3x3<real>(l.a, l.b, l.c),
        ),
        Force(h.d, aa.d),
    );
}

// What acts on a join: x and f2 at its ends, and the force on its outboard part where the two meet.
struct Acting {
    x: Force,
    f2: Force,
    force: Force,
}

fn put_acting(join: u32, acting: Acting) {
    let at = acting_at() + join;
    let n = sizes.joins;
    tree_put4(at, n, acting.x.angular, acting.x.linear, acting.f2.angular, acting.f2.linear);
    tree_put(at + 3u * n, vec4<real>(acting.force.angular, 0.0));
    tree_put(at + 4u * n, vec4<real>(acting.force.linear, 0.0));
}

// x and f2.
struct Ends {
    x: Force,
    f2: Force,
}

// What acts at the ends of a part whose parent is known.
fn handed(parent: u32) -> Ends {
    let at = acting_at() + (parent >> 1u);
    let n = sizes.joins;
    let force = Force(tree_get(at + 3u * n).xyz, tree_get(at + 4u * n).xyz);
    let four = tree_get4(at, n);
    if (parent & 1u) == 0u {
        return Ends(Force(four.a, four.b), force_scaled(force, -1.0));
    }
    return Ends(force, Force(four.c, four.d));
}

// The acceleration a1 that a path's head hangs from.
fn hanging(head: u32, carrier: u32) -> Force {
    if carrier == NONE {
        return Force(
            zero3(),
            vec3<real>(real(forces[0]), real(forces[1]), real(forces[2])),
        );
    }
    let at = carriers_at() + carrier;
    let handle = Motion(fetch(at + sizes.slots).xyz, fetch(at + 2u * sizes.slots).xyz);
    let a = motion_shifted(handle, get_placed(head).offset);
    return Force(a.angular, a.linear);
}
