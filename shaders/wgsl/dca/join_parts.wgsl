// Rounds in which there is nothing but joins.

fn go_up(kind: u32, index: u32) {}

fn go_down(kind: u32, index: u32) {}
