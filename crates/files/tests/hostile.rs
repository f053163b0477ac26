//! Damaged files never panic, and what is accepted is a sound model.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../../assembly/tests/common/damage.rs"]
mod damage;

use damage::{damaged, damages};
use proptest::prelude::*;
use vertebra_assembly::{Joint, Model, State};
use vertebra_files::{FileError, bvh, strands};

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
    fn sdf_is_refused_or_sound(damages in damages(), which in 0..2_usize) {
        let texts = [include_str!("data/rover.sdf"), include_str!("data/crane.sdf")];
        let text = damaged(texts[which], &damages);
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
