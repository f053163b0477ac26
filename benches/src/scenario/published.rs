//! What the source published: Yeonhee Lee, "Parallel collision detection and dynamics simulation
//! using CUDA", master's thesis, Ewha Womans University, January 2009, chapter V. Core2 Duo E6550,
//! GeForce 8800 GTX; mean of 10 runs.

/// Bodies of a chain, and time of one step with its result on the CPU \[s\].
pub const CHAIN_STEP: [(usize, f64); 5] = [
    (128, 34.74e-3),
    (256, 40.28e-3),
    (512, 44.84e-3),
    (1024, 52.15e-3),
    (2048, 57.94e-3),
];

/// Times of an all-pairs test of two meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshTimes {
    /// On the GPU, with upload and download \[s\].
    pub gpu_s: f64,
    /// On one CPU thread \[s\].
    pub cpu_s: f64,
}

/// Sphere of 960 triangles against cylinder of 216.
pub const SPHERE_CYLINDER: MeshTimes = MeshTimes {
    gpu_s: 2.34e-3,
    cpu_s: 11.84e-3,
};

/// Cup of 7580 triangles against sugar bowl of 5250.
pub const CUP_BOWL: MeshTimes = MeshTimes {
    gpu_s: 183.9e-3,
    cpu_s: 2099.5e-3,
};

/// Cup of 7580 triangles against spoon of 26012.
pub const CUP_SPOON: MeshTimes = MeshTimes {
    gpu_s: 1084.22e-3,
    cpu_s: 10_377.62e-3,
};

/// The published time of a chain's step \[s\].
#[must_use]
pub fn chain_step(bodies: usize) -> Option<f64> {
    let found = CHAIN_STEP.iter().find(|(size, _)| *size == bodies);
    found.map(|(_, seconds)| *seconds)
}
