// For models without screw joints.

const HAS_SCREWS = false;

fn pitch_of(slot: u32) -> real { return 0.0; }
