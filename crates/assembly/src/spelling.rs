//! Slips of the pen in names.

/// Of longer words none is taken for another, since the time that takes grows with their square \[bytes\].
const LONGEST: usize = 64;

/// The known name that a word is nearly spelt like: two neighbours exchanged in names of three letters, one letter
/// off from names of four and five, two from longer ones. Shorter names are too much alike.
#[must_use]
pub fn nearest<'k>(word: &str, known: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    let apart = known.filter_map(|name| {
        if name.len().max(word.len()) > LONGEST {
            return None;
        }
        let allowed = match name.len() {
            0..=2 => 0,
            3 => usize::from(is_anagram(word, name)),
            4..=5 => 1,
            _ => 2,
        };
        // No more bytes differ than letters of four each.
        let is_like = name.len().abs_diff(word.len()) <= 4 * allowed;
        let apart = if is_like { distance(word, name) } else { 0 };
        (1..=allowed).contains(&apart).then_some((name, apart))
    });
    // Of several the first by name, in whatever order they are known.
    let nearest = apart.min_by_key(|&(name, apart)| (apart, name));
    nearest.map(|(name, _)| name)
}

/// Whether two words are made of the same bytes.
fn is_anagram(a: &str, b: &str) -> bool {
    let [mut a, mut b] = [a, b].map(|word| word.as_bytes().to_vec());
    a.sort_unstable();
    b.sort_unstable();
    a == b
}

/// Letters to change, insert, take away or exchange with their neighbours that make one word of the other (the
/// restricted distance of Damerau 1964 and Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let [a, b]: [Vec<char>; 2] = [a, b].map(|word| word.chars().collect());
    // The distances of the beginnings of both.
    let mut table = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            if i == 0 || j == 0 {
                table[i][j] = i + j;
                continue;
            }
            let changed = table[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            table[i][j] = changed.min(table[i - 1][j] + 1).min(table[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                table[i][j] = table[i][j].min(table[i - 2][j - 2] + 1);
            }
        }
    }
    table[a.len()][b.len()]
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
        assert_eq!(nearest("dampign", known.into_iter()), Some("damping"));
        assert_eq!(nearest("rang", known.into_iter()), Some("range"));
        assert_eq!(
            nearest("frictionlos", known.into_iter()),
            Some("frictionloss")
        );
        assert_eq!(nearest("axes", known.into_iter()), Some("axis"));
        assert_eq!(nearest("rnage", known.into_iter()), Some("range"));
        assert_eq!(nearest("pso", known.into_iter()), Some("pos"));
        let long = "a".repeat(LONGEST);
        assert_eq!(nearest(&long[1..], [&*long].into_iter()), Some(&*long));
        let longer = "a".repeat(LONGEST + 1);
        assert_eq!(nearest(&long, [&*longer].into_iter()), None);
        for other in [
            "sop", "margin", "group", "user", "po", "damping", "xyz", "solref",
        ] {
            assert_eq!(nearest(other, known.into_iter()), None, "{other}");
        }
    }
}
