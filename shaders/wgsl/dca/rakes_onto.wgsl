// Adds to a body's share what is raked onto it.
fn with_rakes(body: Rake, slot: u32, flags: u32, share: real) -> Rake {
    var sum = body;
    if (flags & CARRIES) != 0u {
        for (var i = 0u; i < 2u; i++) {
            let rake = rake_onto(slot, i);
            if rake != NONE {
                sum = rake_added(sum, get_rake(rake), share);
            }
        }
    }
    return sum;
}
