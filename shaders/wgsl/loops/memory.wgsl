// Loops and couplings in memory. Those that move the same joints make up a group, to which a workgroup belongs:
// with all bodies that these joints carry, level by level from the world.

// Stage of a loop that is not closed.
const OPEN = 3u;

// Where the tables of a group start; `memory` is in `loops`, `constants` in `links`.
struct Group {
    bodies: u32,
    levels: u32,
    rows: u32,
    pairs: u32,
    dofs: u32,
    // Bodies along the longest loop.
    most: u32,
    bodies_at: u32,
    levels_at: u32,
    rows_at: u32,
    pairs_at: u32,
    dofs_at: u32,
    constants: u32,
    memory: u32,
    // Numbers there.
    length: u32,
}

fn group_at(at: u32) -> Group {
    return Group(
        words[at],
        words[at + 1u],
        words[at + 2u],
        words[at + 3u],
        words[at + 4u],
        words[at + 5u],
        words[at + 6u],
        words[at + 7u],
        words[at + 8u],
        words[at + 9u],
        words[at + 10u],
        words[at + 11u],
        words[at + 12u],
        words[at + 13u],
    );
}

// A body; children and parent are numbers within the group, freedoms too.
struct Member {
    spot: Spot,
    parent: u32,
    children: u32,
    child_count: u32,
    dof: u32,
}

fn member_at(g: Group, body: u32) -> Member {
    let at = g.bodies_at + 5u * body;
    return Member(
        spot_of(words[at]),
        words[at + 1u],
        words[at + 2u],
        words[at + 3u],
        words[at + 4u],
    );
}

// Bodies of a level, and the end of them.
fn level_at(g: Group, level: u32) -> vec2<u32> {
    return vec2<u32>(words[g.levels_at + level], words[g.levels_at + level + 1u]);
}

// A loop or coupling. `chains` lists the bodies from its first end inwards, from its second, and those that carry
// both; its entries in a row follow them. Of a coupling the ends are where the entries of its two joints are.
struct Constraint {
    rows: u32,
    first_row: u32,
    entries: u32,
    // The freedom of each entry.
    dofs_at: u32,
    chains: u32,
    first: u32,
    second: u32,
    carrying: u32,
    ends: vec2<u32>,
    constants: u32,
    // Of a coupling, its two coordinates.
    positions: vec2<u32>,
}

fn constraint_at(at: u32) -> Constraint {
    return Constraint(
        words[at],
        words[at + 1u],
        words[at + 2u],
        words[at + 3u],
        words[at + 4u],
        words[at + 5u],
        words[at + 6u],
        words[at + 7u],
        vec2<u32>(words[at + 8u], words[at + 9u]),
        words[at + 10u],
        vec2<u32>(words[at + 11u], words[at + 12u]),
    );
}

// Kinds of equations.
const POINT = 0u;
const PERPENDICULAR = 1u;
const THREAD = 2u;
const DISTANCE = 3u;
const COUPLING = 4u;

// An equation: what it is of which axes; where its constraint, its entries in J and Y are; its row of A from the
// column `begin` on.
struct Row {
    constraint: u32,
    kind: u32,
    axes: vec2<u32>,
    jacobian: u32,
    whitened: u32,
    matrix: u32,
    begin: u32,
    constants: u32,
}

fn row_at(g: Group, row: u32) -> Row {
    let at = g.rows_at + 7u * row;
    let code = words[at + 1u];
    return Row(
        words[at],
        code & 7u,
        vec2<u32>((code >> 3u) & 3u, (code >> 5u) & 3u),
        words[at + 2u],
        words[at + 3u],
        words[at + 4u],
        words[at + 5u],
        words[at + 6u],
    );
}

// The BODY numbers of a body: its place and motion, where its factors were made; the inertia and the force that it
// passes on, its response, and how high its origin is, times gravity.
const ROTATION = 0u;
const OFFSET = 4u;
const SPIN = 7u;
const VELOCITY = 10u;
const TURNING = 13u;
const ACCELERATION = 16u;
const FACTORED = 19u;
const HANDED = 26u;
const PASSED = 47u;
const RESPONSE = 53u;
const HEIGHT = 59u;

fn body_memory(g: Group, body: u32) -> u32 { return g.memory + BODY * body; }

// The FREEDOM numbers of a freedom: a column of U, 1/D, and what is solved for.
const D_INVERSE = 6u;
const SOLVED = 7u;

fn freedom_memory(g: Group, dof: u32) -> u32 {
    return g.memory + BODY * g.bodies + FREEDOM * dof;
}

// The ROW numbers of a row: what is left of it, its second rate, the square of its row of Y, the factor that makes rows
// alike, 1 over the diagonal of A's factor, and the force along it.
const VALUE = 0u;
const SECOND_RATE = 1u;
const SQUARE = 2u;
const SCALE = 3u;
const PIVOT = 4u;
const FORCE = 5u;

fn row_memory(g: Group, row: u32) -> u32 {
    return freedom_memory(g, g.dofs) + ROW * row;
}

fn three(at: u32) -> vec3<real> {
    return vec3<real>(number(at), number(at + 1u), number(at + 2u));
}

fn put_three(at: u32, v: vec3<real>) {
    put_number(at, v.x);
    put_number(at + 1u, v.y);
    put_number(at + 2u, v.z);
}

fn six(at: u32) -> Force { return Force(three(at), three(at + 3u)); }

fn put_six(at: u32, angular: vec3<real>, linear: vec3<real>) {
    put_three(at, angular);
    put_three(at + 3u, linear);
}

fn freedoms_of(kind: u32) -> u32 {
    switch kind {
        case REVOLUTE, PRISMATIC, SCREW: { return 1u; }
        case SPHERICAL: { return 3u; }
        case FREE: { return 6u; }
        default: { return 0u; }
    }
}

// A column of S: joints of several freedoms are let go along the child's axes one after the other.
fn freedom_along(spot: Spot, k: u32, axes: mat3x3<real>) -> Motion {
    let kind = kind_of(spot.flags);
    if kind == REVOLUTE || kind == SCREW {
        return turning_axis(spot.slot, axes[2]);
    }
    if kind == PRISMATIC {
        return Motion(zero3(), axes[2]);
    }
    let axis = column_of(axes, select(k, k - 3u, k > 2u));
    if k > 2u {
        return Motion(zero3(), axis);
    }
    return Motion(axis, zero3());
}

fn column_of(m: mat3x3<real>, k: u32) -> vec3<real> {
    if k == 0u {
        return m[0];
    }
    if k == 1u {
        return m[1];
    }
    return m[2];
}

// How often lanes take a turn for so many items.
fn passes_for(count: u32) -> u32 { return (count + LANES - 1u) / LANES; }
