// For models without joints of several freedoms.

fn let_turning_go(
    part: Interior,
    drive: vec3<real>,
    v: u32,
    floor: real,
    c: Motion,
    slot: u32,
) -> Interior {
    return part;
}

fn let_all_go(part: Interior, drive: Force, v: u32, slot: u32) -> Interior { return part; }

fn respond_turning(v: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    return Response(given, motion_zero());
}

fn respond_free(v: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    return Response(given, motion_zero());
}
