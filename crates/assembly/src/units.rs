//! Each model's own units.

use crate::MassProperties;
use glam::DVec3;
use vertebra_spatial::Pose;

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
    pub(crate) fn of_bodies<'a>(
        bodies: impl Iterator<Item = (&'a MassProperties, &'a Pose, &'a Pose)>,
        gravity: DVec3,
    ) -> Self {
        let mut masses = Vec::new();
        let mut lengths = Vec::new();
        for (body, parent_placement, child_placement) in bodies {
            if body.mass > 0.0 {
                masses.push(body.mass);
                let inertia = body.inertia;
                let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
                lengths.push((trace.max(0.0) / body.mass).sqrt());
                lengths.push((body.center - child_placement.translation).length());
            }
            lengths.push(parent_placement.translation.length());
        }
        let mass = power_of_two(median_of_positive(masses).unwrap_or(1.0));
        let length = power_of_two(median_of_positive(lengths).unwrap_or(1.0));
        let g = gravity.length();
        let time = if g > 0.0 {
            power_of_two((length / g).sqrt())
        } else {
            1.0
        };
        Self { mass, length, time }
    }
}

fn median_of_positive(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|&v| v > 0.0);
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}

/// The largest power of two not above a positive normal number: its bits without the fraction.
fn power_of_two(value: f64) -> f64 {
    let exponent = value.to_bits() & 0x7ff0_0000_0000_0000;
    f64::from_bits(exponent).clamp(2.0_f64.powi(-300), 2.0_f64.powi(300))
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
}
