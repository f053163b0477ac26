//! Damaged files never panic, and what is accepted is a sound model.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use proptest::prelude::*;
use vertebra_assembly::{Joint, Model, State};
use vertebra_files::{FileError, bvh, strands};

/// What damage is done with.
const DEBRIS: [&str; 18] = [
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
    "/>",
    "{",
    "}",
    "\0",
    "\u{e9}",
    "99999999999999999999",
];

/// A text with one thing done to it: cut, replaced at a number, or a stretch copied elsewhere.
/// Positions are in 1/4096 of its length.
#[derive(Clone, Debug)]
enum Damage {
    Cut(usize, usize),
    Insert(usize, usize),
    Number(usize, usize),
    Copy(usize, usize, usize),
    Truncate(usize),
}

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    let at = 0..4096_usize;
    let damage = prop_oneof![
        (at.clone(), 1..40_usize).prop_map(|(a, n)| Damage::Cut(a, n)),
        (at.clone(), 0..DEBRIS.len()).prop_map(|(a, i)| Damage::Insert(a, i)),
        (at.clone(), 0..DEBRIS.len()).prop_map(|(a, i)| Damage::Number(a, i)),
        (at.clone(), 1..200_usize, at.clone()).prop_map(|(a, n, b)| Damage::Copy(a, n, b)),
        at.prop_map(Damage::Truncate),
    ];
    prop::collection::vec(damage, 1..4)
}

fn damaged(text: &str, damages: &[Damage]) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    for damage in damages {
        let place = |at: usize| at * chars.len() / 4096;
        let debris = |index: usize| DEBRIS[index].chars().collect::<Vec<char>>();
        match *damage {
            Damage::Cut(at, length) => {
                let at = place(at);
                let end = (at + length).min(chars.len());
                chars.drain(at..end);
            }
            Damage::Insert(at, index) => {
                let at = place(at);
                chars.splice(at..at, debris(index));
            }
            Damage::Number(at, index) => {
                let digit = |c: &char| c.is_ascii_digit() || *c == '.' || *c == '-';
                if let Some(start) = chars[place(at)..].iter().position(digit) {
                    let start = place(at) + start;
                    let length = chars[start..].iter().take_while(|c| digit(c)).count();
                    chars.splice(start..start + length, debris(index));
                }
            }
            Damage::Copy(from, length, to) => {
                let (from, to) = (place(from), place(to));
                let end = (from + length).min(chars.len());
                let stretch = chars[from..end].to_vec();
                chars.splice(to..to, stretch);
            }
            Damage::Truncate(at) => chars.truncate(place(at)),
        }
    }
    chars.into_iter().collect()
}

/// An error that names something, or a model that survives being written down.
fn sound<T>(read: Result<T, FileError>, model: impl Fn(&T) -> Option<Model>) {
    match read {
        Err(error) => assert!(error.to_string().len() > 10),
        Ok(read) => {
            let Some(model) = model(&read) else { return };
            for body in model.bodies() {
                assert_eq!(body.mass.violation(), None, "{}", body.name);
            }
            let written = model.describe();
            assert_eq!(written.clone().build().unwrap().describe(), written);
            assert_eq!(State::random(&model, 1).check(&model), Ok(()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn bvh_is_refused_or_sound(damages in damages()) {
        let text = damaged(include_str!("data/walk.bvh"), &damages);
        sound(bvh::parse(&text, &bvh::Options::default()), |capture| {
            for time in [-1.0, 0.0, 0.3, 1e9] {
                let state = capture.motion.state(&capture.model, time).unwrap();
                assert!(state.q.iter().chain(&state.qd).all(|x| x.is_finite()));
            }
            Some(capture.model.clone())
        });
    }

    #[test]
    fn strands_are_refused_or_sound(damages in damages(), links in 1..20_usize) {
        let text = damaged(include_str!("data/locks.strands"), &damages);
        sound(strands::parse(&text), |strands| {
            strands.build(&Joint::spherical(), Some(links)).ok()
        });
    }

    #[test]
    fn arbitrary_text_is_refused(text in "\\PC{0,200}") {
        prop_assert!(bvh::parse(&text, &bvh::Options::default()).is_err());
        prop_assert!(strands::parse(&text).is_err());
    }
}

#[cfg(feature = "mjcf")]
proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn mjcf_is_refused_or_sound(damages in damages(), which in 0..4_usize) {
        let texts = [
            include_str!("data/quadruped.xml"),
            include_str!("data/mechanism.xml"),
            include_str!("data/chain.xml"),
            include_str!("data/linkage.xml"),
        ];
        let text = damaged(texts[which], &damages);
        let options = vertebra_files::mjcf::Options::default();
        sound(vertebra_files::mjcf::parse(&text, &options), |robot| Some(robot.model.clone()));
    }
}

#[cfg(feature = "sdf")]
proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn sdf_is_refused_or_sound(damages in damages()) {
        let text = damaged(include_str!("data/rover.sdf"), &damages);
        sound(vertebra_files::sdf::parse(&text), |import| Some(import.model.clone()));
    }
}

#[cfg(feature = "pdb")]
proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn pdb_is_refused_or_sound(damages in damages()) {
        let options = vertebra_files::pdb::Options::default();
        let text = damaged(include_str!("data/peptide.pdb"), &damages);
        sound(vertebra_files::pdb::parse_pdb(&text, &options), |read| Some(read.model.clone()));
        let text = damaged(include_str!("data/peptide.cif"), &damages);
        sound(vertebra_files::pdb::parse_mmcif(&text, &options), |read| Some(read.model.clone()));
    }
}

/// Bodies nested as deep as a chain of thousands are read without running out of stack.
#[cfg(feature = "mjcf")]
#[test]
fn deep_files_are_read() {
    let depth = 3000;
    let mut text = String::from("<mujoco><worldbody>");
    for _ in 0..depth {
        text += "<body pos='0 0 1'><joint axis='1 0 0'/><geom size='0.1'/>";
    }
    text += &"</body>".repeat(depth);
    text += "</worldbody></mujoco>";
    let options = vertebra_files::mjcf::Options::default();
    let robot = vertebra_files::mjcf::parse(&text, &options).unwrap();
    assert_eq!(robot.model.depth(), depth);
    let mut text = String::from("HIERARCHY\nROOT a {\nOFFSET 0 0 0\nCHANNELS 0\n");
    for _ in 0..100_000 {
        text += "JOINT b {\nOFFSET 0 1 0\n";
    }
    assert!(bvh::parse(&text, &bvh::Options::default()).is_err());
}
