// Two parts of a path, put together where they meet; join.rs of the dynamics has the formulas. A node holds
// Phi11, Phi12, Phi22, b1, b2, or at a path's head Ia, B, C, pa, d.

struct Node {
    phi11: Inertia,
    phi12: Matrix6,
    phi22: Inertia,
    b1: Force,
    b2: Force,
}

// What a join keeps for the way down.
struct Joined {
    factor: Cholesky6,
    inboard: Matrix6,
    outboard: Matrix6,
    bias: Force,
}

struct JoinedNode {
    node: Node,
    joined: Joined,
}

// The rest of a join, given G and the rows of both sides and of the bias, all by the constraint forces.
fn finish(
    is_head: bool,
    a: Node,
    b: Node,
    g: Inertia,
    inboard_rows: Matrix6,
    outboard_rows: Matrix6,
    bias_rows: Force,
) -> JoinedNode {
    let factor: Cholesky6 = cholesky6(g, 0.0, 0.0);
    let inboard = lower66(factor, inboard_rows);
    let outboard = lower66(factor, outboard_rows);
    let bias = lower6(factor, bias_rows);
    let sign: real = select(real(-1.0), real(1.0), is_head);
    let node: Node = Node(
        inertia_add(a.phi11, inertia_scaled(gram6(inboard), sign)),
        transpose_product(inboard, outboard),
        inertia_add(b.phi22, inertia_scaled(gram6(outboard), -1.0)),
        force_add(a.b1, force_scaled(matrix6_transpose_mul(inboard, bias), sign)),
        force_add(b.b2, matrix6_transpose_mul(outboard, bias)),
    );
    return JoinedNode(node, Joined(factor, inboard, outboard, bias));
}

// The force on the outboard part, given x and f2 at the ends of the whole.
fn force_between(joined: Joined, x: Force, f2: Force) -> Force {
    let rest = force_sub(
        force_add(joined.bias, matrix6_mul(joined.inboard, x)),
        matrix6_mul(joined.outboard, f2),
    );
    return upper6(joined.factor, rest);
}
