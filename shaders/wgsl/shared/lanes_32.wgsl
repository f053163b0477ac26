// Sets of lanes in subgroups of up to 32.
alias Lanes = u32;

fn lanes_where(condition: bool) -> Lanes {
    return subgroupBallot(condition).x;
}

fn lanes_before(lane: u32) -> Lanes {
    return (1u << lane) - 1u;
}

fn count_lanes(lanes: Lanes) -> u32 {
    return countOneBits(lanes);
}

fn first_lane(lanes: Lanes) -> u32 {
    return firstTrailingBit(lanes);
}
