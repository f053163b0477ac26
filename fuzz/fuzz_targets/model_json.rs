#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::Model;
use vertebra_fuzz::model_is_sound;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(model) = serde_json::from_slice::<Model>(bytes) {
        model_is_sound(&model);
    }
});
