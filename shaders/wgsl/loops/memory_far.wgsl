// The numbers of a group where they are kept.

fn number(at: u32) -> real { return real(loops[at]); }

fn put_number(at: u32, value: real) { loops[at] = chunk_real(value); }

fn wait_for_numbers() { storageBarrier(); }

fn fetch_numbers(g: Group, lane: u32) {}

fn keep_numbers(g: Group, lane: u32) {}
