//! Structs that kernels and the host both read: the same fields at the same places, which a test
//! compares with the shaders.

use bytemuck::{Pod, Zeroable};

/// What one level works on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Range {
    /// Number of elements.
    pub count: u32,
    /// Number of tiles.
    pub tiles: u32,
    /// An array of uniforms has elements of 16 bytes.
    pub unused: [u32; 2],
}

/// What a kernel works on, level by level: elements, the totals of their tiles, the totals of those.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Ranges {
    /// The levels.
    pub level: [Range; 4],
}

/// What [`Ranges`] follow from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Lengths {
    /// Elements there is room for.
    pub most: u32,
    /// Elements of a tile of the first level.
    pub tile: u32,
    /// Elements of the second level for each tile of the first.
    pub per_tile: u32,
    /// Elements of a tile of the second level and all further.
    pub further_tile: u32,
}

/// What a pass of the sort looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Digit {
    /// Its lowest bit.
    pub shift: u32,
    /// Its bits that count: fewer than all in the last pass of some keys.
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
