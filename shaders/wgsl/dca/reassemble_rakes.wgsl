// Side branches in a correction: how their bias forces change, and the forces that they take of their carriers.

// About the carrier's handle point, if they are given about the joint of a head.
fn at_carrier(rake: u32, f: Force) -> Force {
    let head = words[sizes.rake_words + rake];
    if head == NONE {
        return f;
    }
    return force_shifted_back(f, get_placed(head).offset);
}

fn added_by(rake: u32) -> Force {
    return at_carrier(rake, fetch_two(added_at() + rake, sizes.rakes));
}

fn taken_by_rake(rake: u32) -> Force {
    return at_carrier(rake, fetch_two(taken_at() + rake, sizes.rakes));
}

fn resum_rakes(sum: u32) {
    let at = sizes.sum_words + 3u * sum;
    let a = words[at];
    let b = words[at + 1u];
    put_added(words[at + 2u], force_add(added_by(a), added_by(b)));
    put_taken(words[at + 2u], force_add(taken_by_rake(a), taken_by_rake(b)));
}

// Of all that is raked onto a body.
fn added_onto(slot: u32, flags: u32, share: real) -> Force {
    var sum = force_zero();
    if (flags & CARRIES) != 0u {
        for (var i = 0u; i < 2u; i++) {
            let rake = rake_onto(slot, i);
            if rake != NONE {
                sum = force_add(sum, added_by(rake));
            }
        }
    }
    return force_scaled(sum, share);
}

fn taken_onto(slot: u32, flags: u32) -> Force {
    var sum = force_zero();
    if (flags & CARRIES) != 0u {
        for (var i = 0u; i < 2u; i++) {
            let rake = rake_onto(slot, i);
            if rake != NONE {
                sum = force_add(sum, taken_by_rake(rake));
            }
        }
    }
    return sum;
}

// The same of the outboard half of a cut body. Side branches hang from the inboard one, whose acceleration is another
// as far as the join before has lost digits: the inertias that this half counts on are moved by the difference.
fn taken_apart(slot: u32, flags: u32, before: u32) -> Force {
    var sum = force_zero();
    if (flags & CARRIES) != 0u {
        let jump = apart(before);
        let moved = Motion(jump.angular, jump.linear);
        for (var i = 0u; i < 2u; i++) {
            let rake = rake_onto(slot, i);
            if rake != NONE {
                let counted = inertia_mul(get_rake(rake).inertia, moved);
                sum = force_add(sum, force_sub(taken_by_rake(rake), counted));
            }
        }
    }
    return sum;
}
