// For models in whose joints nothing acts but the forces given.

fn own_inertia(spot: Spot, k: u32) -> real { return 0.0; }

fn has_own_inertia(spot: Spot) -> bool { return false; }

fn account(g: Group, lane: u32) {}

fn own_energy(spot: Spot) -> real { return 0.0; }
