// Rounds in which there is nothing but joins.

const LANES = 32u;

fn go_up(kind: u32, index: u32) { join_parts(index); }

fn go_down(kind: u32, index: u32) { part_parts(index); }
