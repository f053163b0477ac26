// The joins of the tree, 16 lanes each: what the sweeps up and down share.

const TEAM = 16u;
const JOINS = LANES / TEAM;

const NODE_NUMBERS = 4u * NODE_SIZE;
// Starts of the parts of a node.
const B1 = 36u;
const B2 = 42u;
const PHI11 = 48u;
const PHI22 = 69u;

// Columns of Y_A, Y_B, and y; two numbers more make fours.
const BIAS = 72u;
const COLUMNS = 80u;
// Fours of Y_A and Y_B.
const SIDES = 18u;

// Both parts' nodes, of which the first becomes the whole's, and columns.
var<workgroup> inboard_node: array<real, NODE_NUMBERS * JOINS>;
var<workgroup> outboard_node: array<real, NODE_NUMBERS * JOINS>;
var<workgroup> columns: array<real, COLUMNS * JOINS>;

fn inboard3(at: u32) -> vec3<real> {
    return vec3<real>(inboard_node[at], inboard_node[at + 1u], inboard_node[at + 2u]);
}

fn outboard3(at: u32) -> vec3<real> {
    return vec3<real>(outboard_node[at], outboard_node[at + 1u], outboard_node[at + 2u]);
}

fn column(at: u32) -> Force {
    return Force(
        vec3<real>(columns[at], columns[at + 1u], columns[at + 2u]),
        vec3<real>(columns[at + 3u], columns[at + 4u], columns[at + 5u]),
    );
}

fn force_dot(a: Force, b: Force) -> real {
    return dot(a.angular, b.angular) + dot(a.linear, b.linear);
}

fn get_factor(at: u32) -> Cholesky6 {
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
