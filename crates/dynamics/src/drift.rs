//! Where bodies are and how they turn, without what rounding adds up along a chain.
//!
//! Rotations R and angular velocities w are had from body to body, R = R_parent L and w = w_parent + R s, L
//! across the joint and s its rates in its axes. Each is rounded by itself and handed on, so that what is
//! known of a body is off by eps from its neighbours, but by sqrt(n) eps from the world: the joints'
//! accelerations change by as much and more. What a body alone adds can be had in hindsight,
//!
//! E = R_parent L - R,   e = w_parent + R s - w,
//!
//! of the R and w as they were rounded, to more digits than f64 ([`Twofold`]). To first order in
//! rounding the places without it are then R + D R and w + d, with sums over the bodies on the way from the
//! world,
//!
//! D = D_parent + E R',   d = d_parent + e + D R s,
//!
//! rounded once. That costs less than a solution; the same places in the reference precision, six.

use crate::across::Given;
use crate::link::{Kind, Link};
use vertebra_assembly::Model;
use vertebra_spatial::{DoubleDouble, Mat3, Number, Real, Twofold, Vec3, twofold};

/// The drift of all bodies, in the model's order.
#[derive(Clone, Debug)]
pub(crate) struct Drift {
    /// The joint's axes on the parent.
    axes: Vec<Twofold>,
    /// D and d, then the places without them.
    bodies: Vec<(Mat3<f64>, Vec3<f64>)>,
}

impl Drift {
    /// None for a precision in which there is none that f64 would show.
    pub(crate) fn of(model: &Model, epsilon: f64) -> Option<Self> {
        (epsilon >= f64::EPSILON).then(|| Self::new(model))
    }

    fn new(model: &Model) -> Self {
        let axes = model.bodies().iter().map(|body| {
            let link = Link::<DoubleDouble>::new(body, model);
            Twofold::rounded(&link.placement.rotation)
        });
        Self {
            axes: axes.collect(),
            bodies: vec![(Mat3::ZERO, Vec3::ZERO); model.bodies().len()],
        }
    }

    /// Finds the drift of so many bodies: `link` gives a body's, `place` its rotation and angular velocity
    /// as they have been rounded.
    pub(crate) fn measure<'a, T: Real>(
        &mut self,
        given: &Given<'_>,
        count: usize,
        link: impl Fn(usize) -> &'a Link<T>,
        place: impl Fn(usize) -> (Mat3<T>, Vec3<T>),
    ) {
        let place = |body: usize| {
            let (rotation, spin) = place(body);
            (rotation.map(Real::to_f64), spin.map(Real::to_f64))
        };
        for body in 0..count {
            let link = link(body);
            let (rotation, spin) = place(body);
            let (above, turned, spun) = match link.parent {
                Some(parent) => {
                    let (turned, spun) = self.bodies[parent];
                    (place(parent), turned, spun)
                }
                None => ((Mat3::IDENTITY, Vec3::ZERO), Mat3::ZERO, Vec3::ZERO),
            };
            let axes = &self.axes[body];
            let mut across = Twofold::new(above.0).then(axes);
            match link.kind {
                Kind::Fixed | Kind::Prismatic => {}
                Kind::Revolute | Kind::Screw => across = across.turned(given.q[link.q]),
                Kind::Spherical | Kind::Free => {
                    let turn = DoubleDouble::rotation_of(link.quaternion(given));
                    across = across.then(&Twofold::rounded(&turn));
                }
            }
            let turned = turned + across.beyond(rotation) * rotation.transpose();
            let rates: Vec3<f64> = link.turning(given);
            let missing = twofold::missing(above.1, &rotation, rates, spin);
            self.bodies[body] = (turned, spun + missing + turned * (rotation * rates));
        }
        for body in 0..count {
            let (rotation, spin) = place(body);
            let (turned, spun) = self.bodies[body];
            self.bodies[body] = (rotation + turned * rotation, spin + spun);
        }
    }

    /// Rotation and angular velocity of a body, or the world, without drift.
    pub(crate) fn settled<T: Real>(&self, body: Option<usize>) -> (Mat3<T>, Vec3<T>) {
        match body {
            Some(body) => {
                let (rotation, spin) = self.bodies[body];
                (rotation.map(T::from_f64), spin.map(T::from_f64))
            }
            None => (Mat3::IDENTITY, Vec3::ZERO),
        }
    }
}
