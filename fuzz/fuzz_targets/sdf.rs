#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::files::sdf::parse;
use vertebra_fuzz::model_is_sound;

fuzz_target!(|text: &str| {
    if let Ok(import) = parse(text) {
        model_is_sound(&import.model);
    }
});
