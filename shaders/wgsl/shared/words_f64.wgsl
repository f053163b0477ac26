// An f64 by its bits, the lower word first.
alias Words = vec2<u32>;

fn is_number(words: Words) -> bool {
    return (words.y & 0x7ff00000u) != 0x7ff00000u;
}
