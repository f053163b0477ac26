//! What the articulated-body algorithm hands from body to body on the way up.

use core::ops::AddAssign;
use vertebra_spatial::{ArticulatedInertia, Force, Number, RigidInertia};

/// What a body hands to its parent, about the parent's origin; or what a body is made of.
#[derive(Clone, Copy)]
pub(crate) struct PassedOn<T> {
    /// X' Ia X.
    pub(crate) inertia: ArticulatedInertia<T>,
    /// X' pa.
    pub(crate) bias: Force<T>,
    /// Traces of what arrives before the joint lets go ([`carried`](crate::workspace::Sweeps::carried)).
    pub(crate) carried: [T; 2],
}

impl<T: Number> PassedOn<T> {
    pub(crate) const ZERO: Self = Self {
        inertia: ArticulatedInertia::ZERO,
        bias: Force::ZERO,
        carried: [T::ZERO; 2],
    };

    #[inline(always)]
    pub(crate) fn of_body(inertia: &RigidInertia<T>, bias: Force<T>) -> Self {
        let inertia = ArticulatedInertia::from(*inertia);
        Self {
            inertia,
            bias,
            carried: [inertia.angular.trace(), inertia.linear.trace()],
        }
    }
}

impl<T: Number> AddAssign for PassedOn<T> {
    #[inline(always)]
    fn add_assign(&mut self, rhs: Self) {
        self.inertia += rhs.inertia;
        self.bias += rhs.bias;
        self.carried[0] += rhs.carried[0];
        self.carried[1] += rhs.carried[1];
    }
}
