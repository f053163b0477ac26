// Levels of a tree: of blocks it is 0, and eight nodes in a row have one above.

// Of nodes in a row: the first, and how many.
struct Span {
    first: u32,
    count: u32,
}

// The nodes of a level that have any of these blocks below them.
fn span_above(first: u32, blocks: u32, level: u32) -> Span {
    let shift = 3u * level;
    let begin = first >> shift;
    return Span(begin, ((first + blocks + (1u << shift) - 1u) >> shift) - begin);
}
