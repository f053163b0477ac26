// Cholesky factors of symmetric matrices of order 3 and 6, in scalars.

// L with L L' = S.
struct Cholesky3 {
    // Reciprocals of L's diagonal.
    inverse: vec3<real>,
    // L_zy, L_zx, L_yx
    lower: vec3<real>,
    // Whether every pivot was above the floor.
    positive: bool,
}

// The factors of [A H'; H C] by blocks: A = La La', Y = H La'^-1, C - Y Y' = Lc Lc'.
struct Cholesky6 {
    angular: Cholesky3,
    coupling: mat3x3<real>,
    linear: Cholesky3,
    positive: bool,
}

// A pivot that is not above the floor makes the factor unusable but finite.
fn cholesky3(s: Sym3, floor: real) -> Cholesky3 {
    let x: real = s.diagonal.x;
    let positive_x = x > floor;
    let inverse_x: real = 1.0 / sqrt(select(real(1.0), x, positive_x));
    let yx = s.off.z * inverse_x;
    let zx = s.off.y * inverse_x;
    let y: real = s.diagonal.y - yx * yx;
    let positive_y = y > floor;
    let inverse_y: real = 1.0 / sqrt(select(real(1.0), y, positive_y));
    let zy = (s.off.x - zx * yx) * inverse_y;
    let z: real = s.diagonal.z - zx * zx - zy * zy;
    let positive_z = z > floor;
    let inverse_z: real = 1.0 / sqrt(select(real(1.0), z, positive_z));
    return Cholesky3(
        vec3<real>(inverse_x, inverse_y, inverse_z),
        vec3<real>(zy, zx, yx),
        positive_x && positive_y && positive_z,
    );
}

// L^-1 b
fn cholesky3_lower(factor: Cholesky3, b: vec3<real>) -> vec3<real> {
    let x = b.x * factor.inverse.x;
    let y = (b.y - factor.lower.z * x) * factor.inverse.y;
    let z = (b.z - factor.lower.y * x - factor.lower.x * y) * factor.inverse.z;
    return vec3<real>(x, y, z);
}

// L'^-1 b
fn cholesky3_upper(factor: Cholesky3, b: vec3<real>) -> vec3<real> {
    let z = b.z * factor.inverse.z;
    let y = (b.y - factor.lower.x * z) * factor.inverse.y;
    let x = (b.x - factor.lower.y * z - factor.lower.z * y) * factor.inverse.x;
    return vec3<real>(x, y, z);
}

// S^-1 b
fn cholesky3_solve(factor: Cholesky3, b: vec3<real>) -> vec3<real> {
    return cholesky3_upper(factor, cholesky3_lower(factor, b));
}

// Y Y' by rows y_i = La^-1 (row i of H).
fn cholesky6(inertia: Inertia, angular_floor: real, linear_floor: real) -> Cholesky6 {
    let angular = cholesky3(inertia.angular, angular_floor);
    let rows = transpose(inertia.coupling);
    let x = cholesky3_lower(angular, rows[0]);
    let y = cholesky3_lower(angular, rows[1]);
    let z = cholesky3_lower(angular, rows[2]);
    let rest = Sym3(
        inertia.linear.diagonal - vec3<real>(dot(x, x), dot(y, y), dot(z, z)),
        inertia.linear.off - vec3<real>(dot(y, z), dot(x, z), dot(x, y)),
    );
    let linear = cholesky3(rest, linear_floor);
    return Cholesky6(
        angular,
        transpose(mat3x3<real>(x, y, z)),
        linear,
        angular.positive && linear.positive,
    );
}

// The acceleration that a force gives: [A H'; H C]^-1 f.
fn cholesky6_solve(factor: Cholesky6, f: Force) -> Motion {
    let up = cholesky3_lower(factor.angular, f.angular);
    let rest = f.linear - factor.coupling * up;
    let linear = cholesky3_solve(factor.linear, rest);
    return Motion(
        cholesky3_upper(factor.angular, up - linear * factor.coupling),
        linear,
    );
}
