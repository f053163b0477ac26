// For models without elements.

fn settle(slot: u32, kind: u32, begun: Begun, before: Motion, rates: Motion, qdd: Motion) {}

fn settle_between(slot: u32, kind: u32, begun: Begun, before: Motion, rates: Motion) {}
