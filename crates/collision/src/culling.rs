//! Which pairs of triangles are looked at.

/// How the pairs that cannot meet are left out.
///
/// The answers do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Culling {
    /// Whichever should be faster, by a model of the costs.
    #[default]
    Auto,
    /// The box of every triangle against that of every other.
    AllPairs,
    /// Bounding volume hierarchies: those of [`Collider`](crate::Collider)s, and for other meshes new ones over the
    /// triangles near the other mesh.
    Bvh,
}

/// Comparing two boxes, eight at a time \[ns].
const PAIR: f64 = 0.4;

/// Posing a triangle and its plane for all pairs \[ns].
const ROW: f64 = 25.0;

/// Taking a triangle into a hierarchy, or leaving it out because it is far from the other mesh \[ns].
const BUILD: f64 = 30.0;

/// What a query through hierarchies takes at least \[ns].
const DESCENT: f64 = 1000.0;

impl Culling {
    /// Whether to use hierarchies, for meshes of so many triangles, the second number those of meshes without one.
    ///
    /// The costs that both ways have in common are left out. The constants were measured on one thread (the table is in
    /// `docs/performance.md`); they matter only for meshes of some ten to a few hundred triangles, and there a wrong
    /// choice costs microseconds.
    pub(crate) fn uses_bvh(self, [a, b]: [usize; 2], unprepared: usize) -> bool {
        match self {
            Self::AllPairs => false,
            Self::Bvh => true,
            Self::Auto => {
                let [a, b, unprepared] = [a, b, unprepared].map(|count| count as f64);
                let all_pairs = PAIR * a * b + ROW * (a + b);
                all_pairs > DESCENT + BUILD * unprepared
            }
        }
    }
}
