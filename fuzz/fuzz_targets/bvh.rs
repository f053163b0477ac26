#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::files::bvh::{Options, parse};
use vertebra_fuzz::model_is_sound;

fuzz_target!(|text: &str| {
    if let Ok(capture) = parse(text, &Options::default()) {
        model_is_sound(&capture.model);
        for frame in 0..capture.motion.len().min(100) {
            let time = capture.motion.frame_time() * frame as f64;
            let state = capture.motion.state(&capture.model, time);
            assert!(state.is_ok_and(|state| state.check(&capture.model).is_ok()));
        }
    }
});
