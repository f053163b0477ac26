// Sets of lanes in subgroups of up to 128.
alias Lanes = vec4<u32>;

fn lanes_where(condition: bool) -> Lanes {
    return subgroupBallot(condition);
}

// All words below the lane's are full, those above are empty.
fn lanes_before(lane: u32) -> Lanes {
    let word = vec4<u32>(0u, 1u, 2u, 3u);
    let here = vec4<u32>((1u << (lane & 31u)) - 1u);
    let below = select(here, vec4<u32>(0xffffffffu), word < vec4<u32>(lane >> 5u));
    return select(below, vec4<u32>(0u), word > vec4<u32>(lane >> 5u));
}

fn count_lanes(lanes: Lanes) -> u32 {
    let counts = countOneBits(lanes);
    return counts.x + counts.y + counts.z + counts.w;
}

fn first_lane(lanes: Lanes) -> u32 {
    for (var word = 0u; word < 4u; word++) {
        if lanes[word] != 0u {
            return 32u * word + firstTrailingBit(lanes[word]);
        }
    }
    return 0u;
}
