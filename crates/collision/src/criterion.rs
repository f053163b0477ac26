//! What makes two triangles a pair.

use glam::DVec3;

use crate::bounds::Bounds;
use crate::distance::DistanceBounds;
use crate::exact::{self, Decision};
use crate::predicates::Plane;

/// When two triangles are a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Criterion {
    /// They share a point.
    Meet,
    /// They may be no further apart than this \[m], which is positive and below 2^127.
    Within(f64),
}

impl Criterion {
    /// Decides a pair, given the plane of B.
    #[inline]
    pub(crate) fn decide(self, a: &[DVec3; 3], b: &[DVec3; 3], plane_b: &Plane) -> Decision {
        let mut decision = exact::decide(a, b, plane_b);
        if let Self::Within(distance) = self {
            decision.meet |= DistanceBounds::of_disjoint(a, b).lower <= distance;
        }
        decision
    }

    /// How far apart the boxes of a pair can be, rounded up \[m]; none if they touch.
    #[inline]
    pub(crate) fn reach(self) -> Option<f32> {
        match self {
            Self::Meet => None,
            Self::Within(distance) => Some(Bounds::round_up(distance)),
        }
    }
}
