// What a body needs, a level ahead.

const DESCEND: u32 = 0u;
const ASCEND: u32 = 1u;
const RESPOND: u32 = 2u;

// What a sweep reads of a body that no other lane writes. It is read a level ahead, since few warps run
// at once and nothing else would hide the latency.
struct Seen {
    link: BatchLink,
    // Joint axes on the parent by columns, with the origin's coordinates.
    x: vec4<real>,
    y: vec4<real>,
    z: vec4<real>,
    // The first rate.
    rate: real,
    // The first coordinate on the way down, the first joint force on the way up.
    other: real,
    // The body's records.
    first: vec4<real>,
    second: vec4<real>,
    third: vec4<real>,
    fourth: vec4<real>,
}

fn look(level: u32, lane: u32, sweep: u32) -> Seen {
    // The level after the last is read again instead.
    let slot = min(level, plan.levels - 1u) * LANES + lane;
    let at = 1u + 6u * slot;
    var seen: Seen;
    seen.link = links[slot];
    seen.x = constants[at];
    seen.y = constants[at + 1u];
    seen.z = constants[at + 2u];
    seen.rate = state_at(rates(seen.link));
    let place = record(slot);
    if sweep == DESCEND {
        seen.other = state_at(source + seen.link.position);
    } else {
        seen.first = scratch_at(place);
        seen.second = scratch_at(place + 1u);
    }
    if sweep == ASCEND {
        seen.other = force_at(seen.link.dof);
    }
    if sweep == RESPOND {
        seen.third = scratch_at(place + 2u);
        seen.fourth = scratch_at(place + 3u);
    }
    return seen;
}
