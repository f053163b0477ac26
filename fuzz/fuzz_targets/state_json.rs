#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;
use vertebra::{Model, State};
use vertebra_fuzz::{every_kind, state_is_sound};

static MODEL: LazyLock<Model> = LazyLock::new(every_kind);

fuzz_target!(|bytes: &[u8]| {
    if let Ok(state) = serde_json::from_slice::<State>(bytes)
        && state.check(&MODEL).is_ok()
    {
        state_is_sound(&MODEL, &state);
    }
});
