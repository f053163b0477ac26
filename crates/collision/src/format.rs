//! Mesh file formats.

pub(crate) mod obj;
pub(crate) mod off;
pub(crate) mod ply;
mod polygon;
pub(crate) mod stl;
mod text;
