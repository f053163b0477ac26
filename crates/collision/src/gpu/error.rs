//! What can go wrong on a GPU.

use crate::error::{MeshError, QueryError};

/// Why a question could not be answered on a GPU.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The question was refused.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// The mesh was refused.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The device failed.
    #[error(transparent)]
    Device(#[from] vertebra_gpu::Error),
    /// A mesh does not fit on the device.
    #[error(
        "{count} {element} are too many for the device ({limit} = {available} bytes): {fits} fit; split the mesh, or ask \
         on the CPU"
    )]
    TooLarge {
        /// "vertices" or "triangles".
        element: &'static str,
        /// How many there are.
        count: usize,
        /// How many fit.
        fits: u64,
        /// The limit of the device.
        limit: &'static str,
        /// What it allows \[byte].
        available: u64,
    },
    /// A matrix of all pairs does not fit into memory.
    #[error(
        "a matrix of {rows} by {columns} pairs takes {bytes} bytes, and there is no such memory: ask for pairs, a mask or a count"
    )]
    MatrixTooLarge {
        /// Triangles of A.
        rows: u32,
        /// Triangles of B.
        columns: u32,
        /// What it would take \[byte].
        bytes: u64,
    },
    /// A device was asked for.
    #[error(
        "a GPU was asked for and no device given: open one with `Device::auto`, or leave the choice open"
    )]
    NoDevice,
    /// The two meshes are on different devices.
    #[error("the two meshes are on different devices: prepare both on one")]
    OtherDevice,
}
