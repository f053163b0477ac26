// Nodes of the tree and what joins keep, in memory. A record is contiguous, because several lanes share it.
//
// A node is Phi12 by rows, b1, b2, and the lower triangles of Phi11 and Phi22 by rows. What a join keeps are
// rows of G^-1 [Phi21 of the inboard part, Phi12 of the outboard one, the difference of b], sixteen numbers
// each. What acts in it is the force between its parts.

@group(0) @binding(9) var<storage, read_write> nodes: array<vec4<tree_real>>;

const NODE_SIZE = 23u;
const JOINED_SIZE = 24u;
const ROW_SIZE = 4u;
// Where the last number of a row is.
const DIFFERENCE = 12u;
const ACTING_SIZE = 2u;

fn node_at(index: u32) -> u32 { return NODE_SIZE * index; }

fn joined_at(join: u32) -> u32 {
    return NODE_SIZE * (sizes.chunk_nodes + sizes.joins) + JOINED_SIZE * join;
}

fn acting_at(join: u32) -> u32 { return joined_at(sizes.joins) + ACTING_SIZE * join; }

fn tree_put(at: u32, x: real, y: real, z: real, w: real) {
    nodes[at] = vec4<tree_real>(vec4<real>(x, y, z, w));
}

// Numbers that lanes own.
fn number_at(at: u32, i: u32) -> real { return real(nodes[at + i / 4u][i % 4u]); }

fn put_number(at: u32, i: u32, number: real) {
    nodes[at + i / 4u][i % 4u] = tree_real(number);
}

fn tree_put_vectors(at: u32, v: vec3<real>, w: vec3<real>, x: vec3<real>, y: vec3<real>) {
    tree_put(at, v.x, v.y, v.z, w.x);
    tree_put(at + 1u, w.y, w.z, x.x, x.y);
    tree_put(at + 2u, x.z, y.x, y.y, y.z);
}

fn put_node(index: u32, node: Node) {
    let at = node_at(index);
    let a = transpose(node.phi12.aa);
    let b = transpose(node.phi12.al);
    let c = transpose(node.phi12.la);
    let d = transpose(node.phi12.ll);
    tree_put_vectors(at, a[0], b[0], a[1], b[1]);
    tree_put_vectors(at + 3u, a[2], b[2], c[0], d[0]);
    tree_put_vectors(at + 6u, c[1], d[1], c[2], d[2]);
    let b1 = node.b1;
    let b2 = node.b2;
    tree_put_vectors(at + 9u, b1.angular, b1.linear, b2.angular, b2.linear);
    let p = node.phi11;
    let h = p.coupling;
    let q = node.phi22;
    let k = q.coupling;
    tree_put(at + 12u, p.angular.diagonal.x, p.angular.off.z, p.angular.diagonal.y, p.angular.off.y);
    tree_put(at + 13u, p.angular.off.x, p.angular.diagonal.z, h[0].x, h[1].x);
    tree_put(at + 14u, h[2].x, p.linear.diagonal.x, h[0].y, h[1].y);
    tree_put(at + 15u, h[2].y, p.linear.off.z, p.linear.diagonal.y, h[0].z);
    tree_put(at + 16u, h[1].z, h[2].z, p.linear.off.y, p.linear.off.x);
    tree_put(at + 17u, p.linear.diagonal.z, q.angular.diagonal.x, q.angular.off.z, q.angular.diagonal.y);
    tree_put(at + 18u, q.angular.off.y, q.angular.off.x, q.angular.diagonal.z, k[0].x);
    tree_put(at + 19u, k[1].x, k[2].x, q.linear.diagonal.x, k[0].y);
    tree_put(at + 20u, k[1].y, k[2].y, q.linear.off.z, q.linear.diagonal.y);
    tree_put(at + 21u, k[0].z, k[1].z, k[2].z, q.linear.off.y);
    tree_put(at + 22u, q.linear.off.x, q.linear.diagonal.z, 0.0, 0.0);
}

// x and f2.
struct Ends {
    x: Force,
    f2: Force,
}

// The force on the outboard part of a join.
fn acting(join: u32) -> Force {
    let at = acting_at(join);
    let a = vec4<real>(nodes[at]);
    let b = vec4<real>(nodes[at + 1u]);
    return Force(a.xyz, vec3<real>(a.w, b.xy));
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
    return seen_from(head, fetch(at + sizes.slots).xyz, fetch(at + 2u * sizes.slots).xyz);
}

// A motion of the handle that a path hangs from, at the joint of its head.
fn seen_from(head: u32, angular: vec3<real>, linear: vec3<real>) -> Force {
    let a = motion_shifted(Motion(angular, linear), get_placed(head).offset);
    return Force(a.angular, a.linear);
}
