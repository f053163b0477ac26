// Nothing is raked onto bodies of the first round's chunks.
fn with_rakes(body: Rake, slot: u32, flags: u32, share: real) -> Rake { return body; }
