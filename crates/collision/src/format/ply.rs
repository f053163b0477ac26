//! PLY, the Stanford polygon format: text and binary of either byte order.
//!
//! A reader of our own, for the same reasons as for OBJ: the order of the file and what is wrong where are part of the
//! result. Elements and properties that have no bearing on the triangles are passed over.

mod header;
mod read;
mod source;
mod write;

pub(crate) use read::read;
pub use write::{PlyPart, write_ply};
