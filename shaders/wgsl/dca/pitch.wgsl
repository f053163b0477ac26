// Screw joints: those that slide by so much a radian that they turn, both about z.

const HAS_SCREWS = true;

// Behind the rows of the bodies and the first ones of elements.
const PITCH_ROW: u32 = 8u;

// In the model's unit of length; of other joints zero.
fn pitch_of(slot: u32) -> real {
    return vec4<real>(links[PITCH_ROW * sizes.slots + slot]).w;
}

// The freedom of a joint about z.
fn turning_axis(slot: u32, z: vec3<real>) -> Motion { return Motion(z, z * pitch_of(slot)); }
