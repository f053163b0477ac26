// An f32 by its bits.
alias Words = u32;

fn is_number(words: Words) -> bool {
    return (words & 0x7f800000u) != 0x7f800000u;
}
