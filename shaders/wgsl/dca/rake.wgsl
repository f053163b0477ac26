// Side branches: inertia and bias force, added to those of the body that carries them; rake.rs of the
// dynamics has the formulas.

// About the handle point of the body that carries the path.
struct Rake {
    inertia: Inertia,
    bias: Force,
    // Inertia [rotation, translation] whose rounding this may be.
    carried: vec2<real>,
}

// About the head's joint; `coarser` is rounding in the precision it was put together in, as multiples of
// rounding in this one.
fn put_rake(index: u32, rake: Rake, coarser: real) {
    let at = rakes_at() + index;
    let n = sizes.rakes;
    let m = rake.inertia;
    put4(at, n, m.angular.diagonal, m.angular.off, m.linear.diagonal, m.linear.off);
    put4(at + 3u * n, n, m.coupling[0], m.coupling[1], m.coupling[2], rake.bias.angular);
    put(at + 6u * n, vec4<real>(rake.bias.linear, 0.0));
    put(at + 7u * n, vec4<real>(rake.carried, coarser, 0.0));
}

// About the head's joint, or of a sum about the carrier's handle; without what is carried.
fn rake_at_head(index: u32) -> Rake {
    let at = rakes_at() + index;
    let n = sizes.rakes;
    let m = get4(at, n);
    let h = get4(at + 3u * n, n);
    return Rake(
        Inertia(Sym3(m.a, m.b), mat3x3<real>(h.a, h.b, h.c), Sym3(m.c, m.d)),
        Force(h.d, fetch(at + 6u * n).xyz),
        vec2<real>(0.0, 0.0),
    );
}

fn get_rake(index: u32) -> Rake {
    var rake = rake_at_head(index);
    let rest = fetch(rakes_at() + index + 7u * sizes.rakes);
    let head = words[sizes.rake_words + index];
    if head != NONE {
        let offset = get_placed(head).offset;
        rake.inertia = inertia_shifted_back(rake.inertia, offset);
        rake.bias = force_shifted_back(rake.bias, offset);
    }
    let traces = vec2<real>(sym_trace(rake.inertia.angular), sym_trace(rake.inertia.linear));
    rake.carried = rest.xy + traces * rest.z;
    return rake;
}

fn rake_added(a: Rake, b: Rake, share: real) -> Rake {
    return Rake(
        inertia_add(a.inertia, inertia_scaled(b.inertia, share)),
        force_add(a.bias, force_scaled(b.bias, share)),
        a.carried + b.carried * share,
    );
}

fn sum_rakes(sum: u32) {
    let at = sizes.sum_words + 3u * sum;
    let a = get_rake(words[at]);
    let b = get_rake(words[at + 1u]);
    put_rake(words[at + 2u], rake_added(a, b, 1.0), 0.0);
}
