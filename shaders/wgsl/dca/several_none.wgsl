// For models without joints of several freedoms.

fn let_turning_go(
    part: Interior,
    load: Turning,
    axes: mat3x3<real>,
    spot: Spot,
    floor: real,
    c: Motion,
) -> Interior {
    return part;
}

fn let_all_go(part: Interior, load: Load, axes: mat3x3<real>, spot: Spot, c: Motion) -> Interior {
    return part;
}

fn respond_turning(v: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    return Response(given, motion_zero());
}

fn respond_free(v: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    return Response(given, motion_zero());
}
