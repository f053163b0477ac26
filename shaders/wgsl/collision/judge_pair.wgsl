// Triangles of two meshes: every pair once, and judged by whether they meet.
fn is_once(entry: u32, a: u32, b: u32) -> bool {
    return true;
}

fn judge(entry: u32, a: u32, b: u32, corners: Corners, posed: Posed) -> u32 {
    return decide(corners, posed);
}
