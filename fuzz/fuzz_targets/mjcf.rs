#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::files::mjcf::{Options, parse};
use vertebra_fuzz::model_is_sound;

fuzz_target!(|text: &str| {
    if let Ok(robot) = parse(text, &Options::default()) {
        model_is_sound(&robot.model);
    }
});
