// Every lane is a row by itself: it has no peers.
fn find_peers(row: Row, value: u32) -> Peers {
    return Peers(0u, 1u, 0u);
}

fn from_leader(value: u32, leader: u32) -> u32 {
    return value;
}
