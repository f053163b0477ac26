// Joints of several freedoms in a correction.

fn let_turning_go_again(change: Change, v: u32) -> Change {
    let a = get_several4(v, 0u);
    let h = get_several4(v, 1u);
    let t = get_several4(v, 2u);
    let u = cholesky3_lower(Cholesky3(a.d, h.d, true), -change.bias.angular);
    put_several4(v, 2u, t.a, t.b, t.c, t.d + u);
    let tip_l = mat3x3<real>(get_several(v, 0u), get_several(v, 1u), get_several(v, 2u));
    return Change(
        Force(zero3(), change.bias.linear + u * mat3x3<real>(h.a, h.b, h.c)),
        force_add(change.drift, Force(u * mat3x3<real>(t.a, t.b, t.c), u * tip_l)),
    );
}

fn let_all_go_again(change: Change, v: u32) -> Change {
    var inverse = get_several_inverse(v);
    let y = lower6(inverse.factor, change.bias);
    inverse.bias = force_add(inverse.bias, y);
    put_several_inverse(v, inverse);
    return Change(
        force_zero(),
        force_sub(change.drift, matrix6_transpose_mul(inverse.far, y)),
    );
}
