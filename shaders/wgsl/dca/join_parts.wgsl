// Rounds in which there is nothing but joins.

const LANES = 256u;

fn go_up(kind: u32, index: u32) {}

fn go_down(kind: u32, index: u32) {}
