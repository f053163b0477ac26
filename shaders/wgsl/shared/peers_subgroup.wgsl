// A subgroup is a row. Lanes with the same digit, `value`, find each other by ballots, one for each bit.
fn find_peers(row: Row, value: u32) -> Peers {
    var peers = lanes_where(true);
    for (var bit = 0u; bit < BITS; bit++) {
        let is_set = (value >> bit & 1u) != 0u;
        let lanes = lanes_where(is_set);
        peers &= select(~lanes, lanes, is_set);
    }
    return Peers(count_lanes(peers & lanes_before(row.lane)), count_lanes(peers), first_lane(peers));
}

fn from_leader(value: u32, leader: u32) -> u32 {
    return subgroupShuffle(value, leader);
}
