#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::files::pdb::{Options, parse_mmcif};
use vertebra_fuzz::model_is_sound;

fuzz_target!(|text: &str| {
    if let Ok(protein) = parse_mmcif(text, &Options::default()) {
        model_is_sound(&protein.model);
    }
});
