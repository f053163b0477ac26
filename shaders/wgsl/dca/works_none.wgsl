// For models without elements.

fn begin_attempts() {}

fn commit_works(spot: Spot) {}
