override STAGE: u32 = 0u;

fn fail(element: u32) {
    atomicOr(&status[0], 1u << STAGE);
    // The complement, because a cleared word must stand for no element.
    atomicMax(&status[1u + STAGE], ~element);
}
