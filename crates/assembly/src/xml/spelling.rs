//! Slips of the pen in names.

/// The known name that a word is nearly spelt like: one letter off in words of four and five, two in
/// longer ones. Shorter words are too much alike.
pub(super) fn nearest<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    let allowed = match word.len() {
        0..=3 => return None,
        4..=5 => 1,
        _ => 2,
    };
    let apart = |name: &&&str| distance(word, name);
    let nearest = known.iter().filter(|name| name.len() > 3).min_by_key(apart);
    nearest
        .copied()
        .filter(|name| (1..=allowed).contains(&distance(word, name)))
}

/// Letters to change, insert or take away that make one word of the other (Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = core::mem::replace(&mut row[0], i + 1);
        for (j, other) in b.iter().enumerate() {
            let changed = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_told_from_other_words() {
        let known = [
            "damping",
            "range",
            "axis",
            "pos",
            "frictionloss",
            "stiffness",
        ];
        assert_eq!(nearest("dampign", &known), Some("damping"));
        assert_eq!(nearest("rang", &known), Some("range"));
        assert_eq!(nearest("frictionlos", &known), Some("frictionloss"));
        assert_eq!(nearest("axes", &known), Some("axis"));
        for other in ["margin", "group", "user", "po", "damping", "xyz", "solref"] {
            assert_eq!(nearest(other, &known), None, "{other}");
        }
    }
}
