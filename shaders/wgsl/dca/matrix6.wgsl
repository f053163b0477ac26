// Six-by-six matrices by blocks, angular rows and columns first. What is symmetric is an `Inertia`, whatever
// it means; a vector of six is a `Force`.

struct Matrix6 {
    aa: mat3x3<real>,
    al: mat3x3<real>,
    la: mat3x3<real>,
    ll: mat3x3<real>,
}

fn zero33() -> mat3x3<real> { return mat3x3<real>(zero3(), zero3(), zero3()); }

fn one33() -> mat3x3<real> {
    return mat3x3<real>(
        vec3<real>(1.0, 0.0, 0.0),
        vec3<real>(0.0, 1.0, 0.0),
        vec3<real>(0.0, 0.0, 1.0),
    );
}

fn matrix6_zero() -> Matrix6 { return Matrix6(zero33(), zero33(), zero33(), zero33()); }

fn matrix6_one() -> Matrix6 { return Matrix6(one33(), zero33(), zero33(), one33()); }

fn matrix6_transposed(m: Matrix6) -> Matrix6 {
    return Matrix6(transpose(m.aa), transpose(m.la), transpose(m.al), transpose(m.ll));
}

fn matrix6_of(m: Inertia) -> Matrix6 {
    return Matrix6(full(m.angular), transpose(m.coupling), m.coupling, full(m.linear));
}

fn matrix6_less(a: Matrix6, b: Matrix6) -> Matrix6 {
    return Matrix6(a.aa - b.aa, a.al - b.al, a.la - b.la, a.ll - b.ll);
}

fn matrix6_mul(m: Matrix6, v: Force) -> Force {
    return Force(m.aa * v.angular + m.al * v.linear, m.la * v.angular + m.ll * v.linear);
}

// M' v
fn matrix6_transpose_mul(m: Matrix6, v: Force) -> Force {
    return Force(v.angular * m.aa + v.linear * m.la, v.angular * m.al + v.linear * m.ll);
}

// A'B
fn transpose_product(a: Matrix6, b: Matrix6) -> Matrix6 {
    let at = matrix6_transposed(a);
    return Matrix6(
        at.aa * b.aa + at.al * b.la,
        at.aa * b.al + at.al * b.ll,
        at.la * b.aa + at.ll * b.la,
        at.la * b.al + at.ll * b.ll,
    );
}

// M'M
fn gram3(m: mat3x3<real>) -> Sym3 {
    return Sym3(
        vec3<real>(dot(m[0], m[0]), dot(m[1], m[1]), dot(m[2], m[2])),
        vec3<real>(dot(m[1], m[2]), dot(m[0], m[2]), dot(m[0], m[1])),
    );
}

fn gram6(m: Matrix6) -> Inertia {
    return Inertia(
        sym_add(gram3(m.aa), gram3(m.la)),
        transpose(m.al) * m.aa + transpose(m.ll) * m.la,
        sym_add(gram3(m.al), gram3(m.ll)),
    );
}

fn sym_scaled(s: Sym3, factor: real) -> Sym3 {
    return Sym3(s.diagonal * factor, s.off * factor);
}

fn inertia_scaled(inertia: Inertia, factor: real) -> Inertia {
    return Inertia(
        sym_scaled(inertia.angular, factor),
        inertia.coupling * factor,
        sym_scaled(inertia.linear, factor),
    );
}

fn full(s: Sym3) -> mat3x3<real> {
    return mat3x3<real>(sym_column_x(s), sym_column_y(s), sym_column_z(s));
}

// a b'
fn outer3(a: vec3<real>, b: vec3<real>) -> mat3x3<real> {
    return mat3x3<real>(a * b.x, a * b.y, a * b.z);
}

// r x each column.
fn cross_columns(r: vec3<real>, m: mat3x3<real>) -> mat3x3<real> {
    return mat3x3<real>(cross3(r, m[0]), cross3(r, m[1]), cross3(r, m[2]));
}

// X'M: what maps to forces about one point maps to forces about the point from which that lies at `r`.
fn matrix6_shifted_back(m: Matrix6, r: vec3<real>) -> Matrix6 {
    return Matrix6(m.aa + cross_columns(r, m.la), m.al + cross_columns(r, m.ll), m.la, m.ll);
}

// The trace of the angular block of X'MX, for the point from which this one lies at `r`.
fn shifted_angular_trace(m: Inertia, r: vec3<real>) -> real {
    let h = m.coupling;
    let skew = vec3<real>(h[2].y - h[1].z, h[0].z - h[2].x, h[1].x - h[0].y);
    let coupled: real = dot(r, skew);
    return sym_trace(m.angular) + coupled + coupled + dot(r, r) * sym_trace(m.linear)
        - dot(r, sym_mul(m.linear, r));
}

// L^-1 M by columns.
fn lower33(factor: Cholesky3, m: mat3x3<real>) -> mat3x3<real> {
    return mat3x3<real>(
        cholesky3_lower(factor, m[0]),
        cholesky3_lower(factor, m[1]),
        cholesky3_lower(factor, m[2]),
    );
}

fn lower6(factor: Cholesky6, v: Force) -> Force {
    let angular = cholesky3_lower(factor.angular, v.angular);
    return Force(
        angular,
        cholesky3_lower(factor.linear, v.linear - factor.coupling * angular),
    );
}

fn upper6(factor: Cholesky6, v: Force) -> Force {
    let linear = cholesky3_upper(factor.linear, v.linear);
    return Force(
        cholesky3_upper(factor.angular, v.angular - linear * factor.coupling),
        linear,
    );
}

fn lower66(factor: Cholesky6, m: Matrix6) -> Matrix6 {
    let aa = lower33(factor.angular, m.aa);
    let al = lower33(factor.angular, m.al);
    return Matrix6(
        aa,
        al,
        lower33(factor.linear, m.la - factor.coupling * aa),
        lower33(factor.linear, m.ll - factor.coupling * al),
    );
}

// L^-1
fn lower_inverse(factor: Cholesky6) -> Matrix6 {
    let aa = lower33(factor.angular, one33());
    return Matrix6(
        aa,
        zero33(),
        lower33(factor.linear, zero33() - factor.coupling * aa),
        lower33(factor.linear, one33()),
    );
}
