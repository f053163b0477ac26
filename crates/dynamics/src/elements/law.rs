//! The one law that all elements obey: a force that falls with the rate, between two bounds.

/// f(v) = at - slope v, but at least `least` and at most `most`; v is the rate at the end of the step.
///
/// In a step of length h, v = qd + h qdd: on the slope the force is at - slope qd - (h slope) qdd, that
/// is a joint force and an inertia of the freedom's own; on a bound it is a joint force alone. The slope
/// is never negative, so that f is monotone and a step has one solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Law {
    pub(super) at: f64,
    pub(super) slope: f64,
    pub(super) least: f64,
    pub(super) most: f64,
}

/// Which part of a law is in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Part {
    Least,
    #[default]
    Slope,
    Most,
}

impl Law {
    /// No force at all.
    pub(super) const NONE: Self = Self {
        at: 0.0,
        slope: 0.0,
        least: 0.0,
        most: 0.0,
    };

    /// The force at a rate.
    pub(super) fn force(&self, v: f64) -> f64 {
        // Not `clamp`, which panics where a bound is NaN.
        (self.at - self.slope * v).min(self.most).max(self.least)
    }

    /// The part to be taken next if `part` led to the rate v, which is known to `tolerance`. A law is
    /// followed one part at a time: from bound to bound at once, two of them can alternate for ever.
    pub(super) fn next(&self, part: Part, v: f64, tolerance: f64) -> Part {
        let slack = self.slope * tolerance;
        let force = self.at - self.slope * v;
        match part {
            Part::Slope if force > self.most + slack => Part::Most,
            Part::Slope if force < self.least - slack => Part::Least,
            Part::Most if force < self.most => Part::Slope,
            Part::Least if force > self.least => Part::Slope,
            unchanged => unchanged,
        }
    }

    /// Adds what a part of it makes of a step from the rate `qd` to a joint force and an inertia.
    pub(super) fn load(&self, part: Part, qd: f64, h: f64, [force, inertia]: &mut [f64; 2]) {
        match part {
            Part::Slope => {
                *force += self.at - self.slope * qd;
                *inertia += h * self.slope;
            }
            Part::Least => *force += self.least,
            Part::Most => *force += self.most,
        }
    }

    /// The force of a part at the rate at the end of the step.
    pub(super) fn exerted(&self, part: Part, v: f64) -> f64 {
        match part {
            Part::Slope => self.at - self.slope * v,
            Part::Least => self.least,
            Part::Most => self.most,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRICTION: Law = Law {
        at: 0.0,
        slope: 1e3,
        least: -2.0,
        most: 2.0,
    };

    #[test]
    fn a_law_is_monotone_and_bounded() {
        let mut before = f64::INFINITY;
        for k in -100..=100 {
            let force = FRICTION.force(f64::from(k) * 1e-4);
            assert!(force <= before && force.abs() <= 2.0);
            before = force;
        }
        assert_eq!(FRICTION.force(0.0), 0.0);
    }

    /// From any part, following the law on a mass under a force ends at its one solution.
    #[test]
    fn parts_are_found_in_a_few_steps() {
        let (mass, h) = (0.5, 1e-3);
        for (qd, push) in [
            (1.0, 0.0),
            (1e-4, 0.0),
            (0.0, 1.9),
            (0.0, 2.1),
            (-3.0, 5.0),
            (2.0, -2000.0),
        ] {
            for start in [Part::Least, Part::Slope, Part::Most] {
                let (mut part, mut passes) = (start, 0);
                let v = loop {
                    let mut load = [push, mass];
                    FRICTION.load(part, qd, h, &mut load);
                    let v = qd + h * load[0] / load[1];
                    let next = FRICTION.next(part, v, 0.0);
                    passes += 1;
                    if next == part {
                        break v;
                    }
                    part = next;
                };
                let rest = mass * (v - qd) - h * (push + FRICTION.force(v));
                assert!(
                    rest.abs() <= 8.0 * f64::EPSILON * (mass * qd.abs() + h * (2.0 + push.abs()))
                );
                assert!(passes <= 3, "{passes} from {start:?} at {qd} under {push}");
                // Friction alone reverses nothing.
                assert!(push != 0.0 || v * qd >= 0.0);
            }
        }
    }
}
