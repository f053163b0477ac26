//! Side branches, whose far ends are free: to the body that carries them no more than an inertia and
//! a bias force, added to its own.

use super::join::Node;
use super::place::Placed;
use vertebra_spatial::{ArticulatedInertia, Force, Mat6, Real};

/// Ia and pa about the handle point of the body that carries the path.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rake<T> {
    pub(super) inertia: ArticulatedInertia<T>,
    pub(super) bias: Force<T>,
    /// Inertia [rotation, translation] whose rounding this may be: before the path's joint let go of it.
    pub(super) carried: [T; 2],
}

impl<T: Real> Rake<T> {
    /// Adds a share of another about the same point.
    pub(super) fn add(&mut self, other: &Self, share: T) {
        self.inertia += other.inertia.scaled(share);
        self.bias += other.bias * share;
        for (sum, carried) in self.carried.iter_mut().zip(other.carried) {
            *sum += carried * share;
        }
    }

    /// A whole path with this first body, of which `carried` was had before its joint let go, and which
    /// was put together in the precision `L`.
    pub(super) fn of_node<L: Real>(node: &Node<L>, head: &Placed<T>, carried: [T; 2]) -> Self {
        let inertia: Mat6<T> = node.phi11.map(L::cast);
        let inertia = inertia.to_inertia().shifted_back(head.offset);
        // Rounding in that precision, as multiples of rounding in this one.
        let coarser = L::EPSILON.cast::<T>() * (T::ONE / T::EPSILON);
        Self {
            inertia,
            bias: Force::from_array(node.b1.map(L::cast)).shifted_back(head.offset),
            carried: [
                carried[0] + inertia.angular.trace() * coarser,
                carried[1] + inertia.linear.trace() * coarser,
            ],
        }
    }
}
