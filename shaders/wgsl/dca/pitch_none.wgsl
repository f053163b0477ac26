// For models without screw joints.

const HAS_SCREWS = false;

fn pitch_of(slot: u32) -> real { return 0.0; }

fn turning_axis(slot: u32, z: vec3<real>) -> Motion { return Motion(z, zero3()); }
