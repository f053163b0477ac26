// Joins in dynamics, and what those of a workgroup hand to each other: numbers that have to be in memory by the next
// round take a fence for the whole device, on chip a barrier of the workgroup.

const TEAM = 16u;
const JOINS = LANES / TEAM;

// The nodes of a join's parts; the joins before and after; if it is the head of a path, its first body and the one
// that carries it; its rake; the places on chip of its parts' joins and of those before and after, a byte each; its own.
struct Seam {
    join: u32,
    inboard: u32,
    outboard: u32,
    before: u32,
    after: u32,
    head: u32,
    carrier: u32,
    rake: u32,
    others: u32,
    place: u32,
}

fn seam_at(at: u32) -> Seam {
    return Seam(
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
    );
}

const PLACES = 96u;
// Of what comes from another dispatch, or through memory.
const NOWHERE = 255u;

// Bytes of `others`.
const INBOARD_PLACE = 0u;
const OUTBOARD_PLACE = 8u;
const BEFORE_PLACE = 16u;
const AFTER_PLACE = 24u;

fn place_of(seam: Seam, which: u32) -> u32 { return (seam.others >> which) & 255u; }

// By places: on the way down the force between a join's parts; on a way up of vectors what it adds to b1 and b2.
var<workgroup> handed: array<tree_real, HANDED * PLACES>;

fn hand_on(seam: Seam, own: u32, number: real) {
    if seam.place != NOWHERE {
        handed[HANDED * seam.place + own] = tree_real(number);
    }
}

fn handed_number(place: u32, own: u32) -> real { return real(handed[HANDED * place + own]); }

fn handed_force(place: u32, first: u32) -> Force {
    return Force(
        vec3<real>(
            handed_number(place, first),
            handed_number(place, first + 1u),
            handed_number(place, first + 2u),
        ),
        vec3<real>(
            handed_number(place, first + 3u),
            handed_number(place, first + 4u),
            handed_number(place, first + 5u),
        ),
    );
}
