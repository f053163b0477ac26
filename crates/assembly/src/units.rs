//! Each model's own units.

use crate::{Joint, MassProperties};
use glam::DVec3;
use std::collections::BTreeMap;

/// The units a solver computes in, so that a protein in SI does not underflow in f32.
///
/// Each is a power of two: changing to them and back is exact, and in f64 changes no result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Mass \[kg\].
    pub mass: f64,
    /// Length \[m\].
    pub length: f64,
    /// Time \[s\].
    pub time: f64,
}

impl Units {
    /// Kilogram, metre, second.
    pub const SI: Self = Self {
        mass: 1.0,
        length: 1.0,
        time: 1.0,
    };

    /// Unit of joint forces of rotation and of energy [N m, J].
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.force() * self.length
    }

    /// Unit of force \[N\].
    #[must_use]
    pub fn force(&self) -> f64 {
        self.mass * self.acceleration()
    }

    /// Unit of velocity [m/s].
    #[must_use]
    pub fn velocity(&self) -> f64 {
        self.length / self.time
    }

    /// Unit of acceleration [m/s^2].
    #[must_use]
    pub fn acceleration(&self) -> f64 {
        self.length / (self.time * self.time)
    }

    /// The median mass and length of a model's bodies and the time in which gravity acts over that
    /// length, each rounded down to a power of two.
    pub(crate) fn of_sizes(sizes: &Sizes, gravity: DVec3) -> Self {
        let mass = sizes.masses.median().unwrap_or(1.0);
        let length = sizes.lengths.median().unwrap_or(1.0);
        let g = gravity.length();
        let time = if g > 0.0 {
            power_of_two((length / g).sqrt())
        } else {
            1.0
        };
        Self { mass, length, time }
    }
}

/// Masses and lengths of a model's bodies, counted such that bodies can be taken out again: a change of a
/// few of many bodies need not look at the others.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sizes {
    masses: Octaves,
    lengths: Octaves,
}

impl Sizes {
    pub(crate) fn add(&mut self, joint: &Joint, mass: &MassProperties) {
        self.count(joint, mass, |count| *count += 1);
    }

    /// Takes out what was added.
    pub(crate) fn remove(&mut self, joint: &Joint, mass: &MassProperties) {
        self.count(joint, mass, |count| *count -= 1);
    }

    fn count(&mut self, joint: &Joint, body: &MassProperties, change: impl Fn(&mut usize)) {
        let mut length = |value: f64| self.lengths.count(value, &change);
        if body.mass > 0.0 {
            let inertia = body.inertia;
            let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
            length((trace.max(0.0) / body.mass).sqrt());
            length((body.center - joint.child_placement.translation).length());
            self.masses.count(body.mass, &change);
        }
        length(joint.parent_placement.translation.length());
    }
}

/// How many positive numbers there are between neighbouring powers of two.
#[derive(Clone, Debug, Default)]
struct Octaves(BTreeMap<u64, usize>);

impl Octaves {
    fn count(&mut self, value: f64, change: impl Fn(&mut usize)) {
        if value > 0.0 {
            change(self.0.entry(exponent(value)).or_default());
        }
    }

    /// The median rounded down to a power of two.
    fn median(&self) -> Option<f64> {
        let middle = self.0.values().sum::<usize>() / 2;
        let mut below = 0;
        let found = self.0.iter().find(|(_, count)| {
            below += **count;
            below > middle
        });
        found.map(|(&exponent, _)| clamped(exponent))
    }
}

/// The bits of a positive number's exponent, in order of size.
fn exponent(value: f64) -> u64 {
    value.to_bits() & 0x7ff0_0000_0000_0000
}

fn clamped(exponent: u64) -> f64 {
    f64::from_bits(exponent).clamp(2.0_f64.powi(-300), 2.0_f64.powi(300))
}

/// The largest power of two not above a positive normal number: its bits without the fraction.
fn power_of_two(value: f64) -> f64 {
    clamped(exponent(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two() {
        assert_eq!(power_of_two(1.0), 1.0);
        assert_eq!(power_of_two(1.999), 1.0);
        assert_eq!(power_of_two(0.3), 0.25);
        assert_eq!(power_of_two(1e-26).log2().fract(), 0.0);
    }

    /// The median of counts is that of the sorted numbers, also after some were taken out.
    #[test]
    fn medians_of_octaves() {
        let mut random = crate::Random::new(5);
        for length in 1..40 {
            let mut values: Vec<f64> = (0..length)
                .map(|_| (8.0 * random.symmetric()).exp2())
                .collect();
            let mut octaves = Octaves::default();
            values
                .iter()
                .for_each(|&v| octaves.count(v, |count| *count += 1));
            for _ in 0..length / 3 {
                let gone = values.pop().unwrap_or(1.0);
                octaves.count(gone, |count| *count -= 1);
            }
            values.sort_by(f64::total_cmp);
            let median = values[values.len() / 2];
            assert_eq!(octaves.median(), Some(power_of_two(median)));
        }
        assert_eq!(Octaves::default().median(), None);
    }
}
