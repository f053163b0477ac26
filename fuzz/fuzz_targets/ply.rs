#![no_main]

use libfuzzer_sys::fuzz_target;
use vertebra::TriangleMesh;
use vertebra_fuzz::mesh_is_sound;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = TriangleMesh::from_ply(bytes) {
        mesh_is_sound(&mesh);
    }
});
