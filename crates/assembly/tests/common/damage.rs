//! Damage to texts, for tests that read them.

use proptest::prelude::*;

/// What damage is done with.
const DEBRIS: [&str; 26] = [
    "nan",
    "inf",
    "-1",
    "1e999",
    "1e308",
    "-1e-320",
    "0",
    "",
    " ",
    "'",
    "\"",
    "<",
    ">",
    "/>",
    "${",
    "&lt;",
    "&b;",
    "<!--",
    "\0",
    "null",
    "\u{feff}",
    "<joint name='x' type='fixed'>",
    "{",
    "}",
    "\u{e9}",
    "99999999999999999999",
];

/// One thing that happens to a text; positions are in 1/1024 of its length.
#[derive(Clone, Debug)]
pub(crate) enum Damage {
    Cut(usize, usize),
    Truncate(usize),
    Insert(usize, usize),
    /// A number becomes something else.
    Number(usize, usize),
    /// A stretch is written once more elsewhere.
    Copy(usize, usize, usize),
    /// Two neighbouring stretches change places.
    Swap(usize, usize, usize),
}

/// One to three things that happen to a text.
pub(crate) fn damages() -> impl Strategy<Value = Vec<Damage>> {
    let at = 0..1024_usize;
    let damage = prop_oneof![
        (at.clone(), 1..40_usize).prop_map(|(a, n)| Damage::Cut(a, n)),
        at.clone().prop_map(Damage::Truncate),
        (at.clone(), 0..DEBRIS.len()).prop_map(|(a, i)| Damage::Insert(a, i)),
        (at.clone(), 0..DEBRIS.len()).prop_map(|(a, i)| Damage::Number(a, i)),
        (at.clone(), 1..200_usize, at.clone()).prop_map(|(a, n, b)| Damage::Copy(a, n, b)),
        (at, 1..60_usize, 1..60_usize).prop_map(|(a, n, m)| Damage::Swap(a, n, m)),
    ];
    prop::collection::vec(damage, 1..4)
}

/// A text after all of them.
pub(crate) fn damaged(text: &str, damages: &[Damage]) -> String {
    let mut text: Vec<char> = text.chars().collect();
    for damage in damages {
        let length = text.len();
        let place = |at: &usize| at * length / 1024;
        let end = |from: usize, n: usize| (from + n).min(length);
        match damage {
            Damage::Cut(a, n) => drop(text.drain(place(a)..end(place(a), *n))),
            Damage::Truncate(a) => text.truncate(place(a)),
            Damage::Insert(a, i) => drop(text.splice(place(a)..place(a), DEBRIS[*i].chars())),
            Damage::Number(a, i) => {
                let is_number = |c: &char| c.is_ascii_digit() || "+-.".contains(*c);
                let from = (place(a)..length)
                    .find(|&at| is_number(&text[at]))
                    .unwrap_or(length);
                let to = (from..length)
                    .find(|&at| !is_number(&text[at]))
                    .unwrap_or(length);
                drop(text.splice(from..to, DEBRIS[*i].chars()));
            }
            Damage::Copy(a, n, b) => {
                let stretch = text[place(a)..end(place(a), *n)].to_vec();
                drop(text.splice(place(b)..place(b), stretch));
            }
            Damage::Swap(a, n, m) => {
                let from = place(a);
                let to = end(from, n + m);
                text[from..to].rotate_left((*n).min(to - from));
            }
        }
    }
    text.into_iter().collect()
}
