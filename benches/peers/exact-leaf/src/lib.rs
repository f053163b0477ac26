//! Our exact test of two triangles behind a C function, so that another program's hierarchy can have it for a leaf.

use glam::DVec3;
use vertebra_collision::exact::triangles_intersect;

/// Corners of a triangle: nine numbers in a row \[m].
type Corners = [[f64; 3]; 3];

/// Whether two closed triangles share a point: `bool vertebra_triangles_intersect(const double *, const double *)`.
///
/// C callers pass two pointers, each to nine readable, aligned `double`s that nothing writes during the call: that is
/// what the references ask for.
// SAFETY: the name begins with that of the project, and no other symbol of the program has it.
#[unsafe(no_mangle)]
pub extern "C" fn vertebra_triangles_intersect(a: &Corners, b: &Corners) -> bool {
    triangles_intersect(&a.map(DVec3::from), &b.map(DVec3::from))
}
