// An item's numbers in the arrays of a batch, and the failures it reports.

var<private> item: u32;
var<private> step_number: u32;
var<private> stage: u32;
// Rows where the step starts and where it ends, and those of the state at hand.
var<private> start: u32;
var<private> next: u32;
var<private> source: u32;
// Whether this item failed in an earlier step.
var<private> halted: bool;

fn state_at(row: u32) -> real {
    return state[row * plan.stride + item];
}

fn set_state(row: u32, value: real) {
    state[row * plan.stride + item] = value;
}

fn force_at(row: u32) -> real {
    return forces[row * plan.stride + item];
}

fn state3(row: u32) -> vec3<real> {
    return vec3<real>(state_at(row), state_at(row + 1u), state_at(row + 2u));
}

fn force3(row: u32) -> vec3<real> {
    return vec3<real>(force_at(row), force_at(row + 1u), force_at(row + 2u));
}

fn quaternion_at(row: u32) -> vec4<real> {
    return vec4<real>(state3(row), state_at(row + 3u));
}

fn rates(link: BatchLink) -> u32 {
    return source + plan.positions + link.dof;
}

// A slot's records: [w, sine] and [c.linear, cosine], later the acceleration; then W and what is added
// to it; then the axes in the world.
fn record(slot: u32) -> u32 {
    return slot * (4u + HAS_SPHERICAL + 3u * HAS_FORCES);
}

fn scratch_at(place: u32) -> vec4<real> {
    return scratch[place * plan.stride + item];
}

fn set_scratch(place: u32, value: vec4<real>) {
    scratch[place * plan.stride + item] = value;
}

fn fail(slot: u32, why: u32) {
    if !halted {
        atomicMax(&status[2u * item], ~(8u * slot + why));
        atomicStore(&status[2u * item + 1u], plan.done + step_number);
    }
}

// What lanes of an item wrote is seen by all of them.
fn meet() {
    if LANES > 1u {
        storageBarrier();
    }
}
