// For steps that take one solution.

fn is_needed() -> bool { return true; }

fn is_group_needed(lane: u32) -> bool { return true; }

fn is_first_attempt() -> bool { return true; }
