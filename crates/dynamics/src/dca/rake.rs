//! Side branches, whose far ends are free: to the body that carries them no more than an inertia and
//! a bias force, added to its own.

use super::join::Node;
use super::place::Placed;
use vertebra_spatial::{ArticulatedInertia, Force, Mat6, Real};

/// Ia and pa.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rake<T> {
    pub(super) inertia: ArticulatedInertia<T>,
    pub(super) bias: Force<T>,
}

impl<T: Real> Rake<T> {
    /// Adds a share of another about the same point.
    pub(super) fn add(&mut self, other: &Self, share: T) {
        self.inertia += other.inertia.scaled(share);
        self.bias += other.bias * share;
    }

    /// A whole path, about its first joint's origin, in another precision if need be.
    pub(super) fn of_node<L: Real>(node: &Node<L>) -> Self {
        let inertia: Mat6<T> = node.phi11.map(L::cast);
        Self {
            inertia: inertia.to_inertia(),
            bias: Force::from_array(node.b1.map(L::cast)),
        }
    }

    /// The same about the handle point of the body that carries the path with this first body.
    pub(super) fn carried(&self, head: &Placed<T>) -> Self {
        Self {
            inertia: self.inertia.shifted_back(head.offset),
            bias: self.bias.shifted_back(head.offset),
        }
    }
}
