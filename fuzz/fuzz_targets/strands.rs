#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::Joint;
use vertebra::files::strands::parse;
use vertebra_fuzz::model_is_sound;

fuzz_target!(|text: &str| {
    let Ok(strands) = parse(text) else {
        return;
    };
    for links in [None, Some(8)] {
        if let Ok(model) = strands.build(&Joint::spherical(), links) {
            model_is_sound(&model);
        }
    }
});
