//! Seeded randomness that is the same on every machine: a permuted congruential generator and the
//! portable functions of `libm`.

use glam::{DQuat, DVec3};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random(oorandom::Rand64);

impl Random {
    /// The stream of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(oorandom::Rand64::new(u128::from(seed)))
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0.rand_float()
    }

    /// Uniform in [-1, 1).
    pub fn symmetric(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Uniform among 0 .. count - 1; 0 where the count is 0.
    pub fn below(&mut self, count: usize) -> usize {
        if count == 0 {
            return 0;
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the number drawn is below a usize"
        )]
        let drawn = self.0.rand_range(0..count as u64) as usize;
        drawn
    }

    /// A direction, uniform over the sphere.
    pub fn direction(&mut self) -> DVec3 {
        let z = self.symmetric();
        let angle = core::f64::consts::TAU * self.unit();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), z).normalize()
    }

    /// A rotation, uniform over all of them (Shoemake, Graphics Gems III, 1992).
    pub fn rotation(&mut self) -> DQuat {
        let u = self.unit();
        let (a, b) = (
            core::f64::consts::TAU * self.unit(),
            core::f64::consts::TAU * self.unit(),
        );
        let (p, r) = ((1.0 - u).sqrt(), u.sqrt());
        DQuat::from_xyzw(
            p * libm::sin(a),
            p * libm::cos(a),
            r * libm::sin(b),
            r * libm::cos(b),
        )
        .normalize()
    }
}
