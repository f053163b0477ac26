//! Structs that kernels and the host both read: the same fields at the same places, which a test
//! compares with the shaders.

use bytemuck::{Pod, Zeroable};

/// What a tiled kernel works on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Range {
    /// Number of elements.
    pub count: u32,
    /// Number of tiles.
    pub tiles: u32,
}

/// What a pass of the sort works on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Pass {
    /// Number of keys.
    pub count: u32,
    /// Number of tiles.
    pub tiles: u32,
    /// Lowest bit of the digit.
    pub shift: u32,
    /// Bits of the digit that count.
    pub mask: u32,
}

/// What the histogram works on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Bins {
    /// Number of keys.
    pub count: u32,
    /// Number of bins.
    pub bins: u32,
}

/// What the test for finite numbers works on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Numbers {
    /// How many.
    pub count: u32,
    /// Words of a number: 1 for f32, 2 for f64.
    pub words: u32,
}
