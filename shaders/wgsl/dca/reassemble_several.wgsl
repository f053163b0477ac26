// Joints of several freedoms in a correction.

fn let_turning_go_again(change: Change, v: u32) -> Change {
    let a = get_several4(v, 0u);
    let h = get_several4(v, 1u);
    let t = get_several4(v, 2u);
    let u = cholesky3_lower(Cholesky3(a.d, h.d, true), -change.bias.angular);
    put_several4(v, 2u, t.a, t.b, t.c, u);
    let tip_l = mat3x3<real>(get_several(v, 0u), get_several(v, 1u), get_several(v, 2u));
    var left = zero3();
    if HAS_OWN && is_turning_held(moments_kept(v)) {
        left = change.bias.angular + u * mat3x3<real>(a.a, a.b, a.c);
    }
    return Change(
        change.whole,
        Force(left, change.bias.linear + u * mat3x3<real>(h.a, h.b, h.c)),
        force_add(change.drift, Force(u * mat3x3<real>(t.a, t.b, t.c), u * tip_l)),
    );
}

fn let_all_go_again(change: Change, v: u32) -> Change {
    var inverse = get_several_inverse(v);
    let y = lower6(inverse.factor, change.bias);
    inverse.bias = y;
    let own = Force(own_kept3(v), own_kept3(v + 3u));
    put_several_inverse(v, inverse);
    keep_own3(v + 3u, own.linear);
    var left = force_zero();
    if HAS_OWN && is_held(own) {
        let columns = lower66(inverse.factor, matrix6_of(get_held(v)));
        left = force_sub(change.bias, matrix6_transpose_mul(columns, y));
    }
    return Change(
        change.whole,
        left,
        force_sub(change.drift, matrix6_transpose_mul(inverse.far, y)),
    );
}
