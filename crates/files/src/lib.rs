//! Articulated models from files and to files.
//!
//! | module | reads | gives |
//! |---|---|---|
//! | [`mjcf`] | MuJoCo's robots and scenes | model with its loops, shapes, actuators |
//! | [`sdf`] | the models of SDFormat | model with its loops, shapes |
//! | [`pdb`] | proteins, PDB and mmCIF | chains that turn about their torsion angles |
//! | [`bvh`] | motion capture | skeleton, and its motion as positions over time |
//! | [`strands`] | hair, ropes, roots: polylines | chains along them |
//!
//! and [`recording`] writes poses over time as glTF, which common viewers play, and as JSON. URDF, read
//! and written, is in `vertebra-assembly`.
//!
//! A file is read whole or refused: a [`FileError`] names the file, the line, the element, what is
//! wrong and the remedy, and nothing half-built is left behind. What a format says and the model cannot
//! hold is listed, never dropped in silence.

pub mod bvh;
mod error;
#[cfg(feature = "mjcf")]
pub mod mjcf;
#[cfg(feature = "pdb")]
pub mod pdb;
#[cfg(feature = "recording")]
pub mod recording;
#[cfg(feature = "sdf")]
pub mod sdf;
mod shape;
pub mod strands;
mod tree;

pub use error::{FileError, Problem};
pub use shape::{Part, Shape, TriangleSoup};
pub use vertebra_assembly::{Ignored, Location};

use std::path::Path;

/// The text of a file.
fn read_text(path: &Path) -> Result<String, FileError> {
    std::fs::read_to_string(path).map_err(|error| {
        let location = Location {
            file: Some(path.to_owned()),
            line: None,
            element: "the file".to_owned(),
        };
        FileError::new(location, Problem::Unreadable(error))
    })
}
