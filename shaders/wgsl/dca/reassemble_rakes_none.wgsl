// Nothing is raked onto bodies of the first round's chunks.

fn added_onto(slot: u32, flags: u32, share: real) -> Force { return force_zero(); }

fn taken_onto(slot: u32, flags: u32) -> Force { return force_zero(); }

fn taken_apart(slot: u32, flags: u32, before: u32) -> Force { return force_zero(); }
