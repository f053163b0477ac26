#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::assembly::urdf::{Options, parse};
use vertebra_fuzz::model_is_sound;

fuzz_target!(|text: &str| {
    let default = Options::default();
    for options in [
        default.clone(),
        default.clone().floating_base(),
        default.keep_fixed(),
    ] {
        let Ok(robot) = parse(text, &options) else {
            continue;
        };
        model_is_sound(&robot.model);
        for part in &robot.geometry {
            assert!(part.placement.translation.is_finite() && part.placement.rotation.is_finite());
            assert!(
                part.body
                    .is_none_or(|body| robot.model.body(body).is_some())
            );
        }
        for body in robot.joints.values() {
            assert!(robot.model.body(*body).is_some());
        }
    }
});
