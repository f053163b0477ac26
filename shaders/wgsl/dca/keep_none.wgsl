// For solutions that are not corrected.

const IS_KEPT = false;
const OUTBOARD = 4u;
const INBOARD_SIDE = 2u;

fn is_first() -> bool { return true; }

fn kept_number(join: u32, own: u32) -> chunk_real { return chunk_real(0.0); }

fn keep_number(join: u32, own: u32, kept: chunk_real, number: real) {}

fn keep_inverse_row(join: u32, factor: Cholesky6, row: u32) {}

fn kept_end(join: u32, side: u32) -> Motion { return motion_zero(); }

fn keep_end(join: u32, side: u32, kept: Motion, a: Motion) {}

fn kept_body(slot: u32) -> Motion { return motion_zero(); }

fn keep_body(slot: u32, kept: Motion, a: Motion) -> Motion { return a; }

fn put_handle(slot: u32, handle: Motion) {
    let at = carriers_at() + slot;
    put(at + sizes.slots, vec4<real>(handle.angular, 0.0));
    put(at + 2u * sizes.slots, vec4<real>(handle.linear, 0.0));
}

fn hanging_again(head: u32, carrier: u32) -> Force { return hanging(head, carrier); }
