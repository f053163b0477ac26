//! The law of bounded elements that act in three directions alike.

use vertebra_spatial::Vec3;

/// Shares are taken as found when they change by less than this part of themselves.
const SETTLED: f64 = 1e-6;

/// f(v) = share u with u = at - slope v, and a share below 1 where |f| would exceed the limit: then it is such
/// that |f| is the limit, and f points as u does. v is the rate at the end of the step.
///
/// Whatever the share, this is a spring or damper alike in all directions, by which a step is implicit. The
/// share is found by solving. A body of inertia m that starts with the rate v0 and is moved by nothing else has
/// v = v0 + h share u / m, hence |u| = |at - slope v0| / (1 + give share) with give = h slope / m: of one
/// solution the next share follows as
///
/// share' = limit / (|u| (1 + give share) - limit give),  1 if that is not below 1,
///
/// and of two solutions `give` follows, which steps remember as they do the share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round {
    at: Vec3<f64>,
    slope: f64,
    limit: f64,
    pub(super) share: f64,
    /// 1 / m.
    mobility: f64,
    /// Share and |u| of the solution before, in this step.
    before: Option<[f64; 2]>,
}

impl Round {
    /// No force, in a joint that moves about this inertia.
    pub(super) fn new(moved: f64) -> Self {
        Self {
            at: Vec3::ZERO,
            slope: 0.0,
            limit: f64::INFINITY,
            share: 1.0,
            mobility: 1.0 / moved,
            before: None,
        }
    }

    /// Takes the law of a step.
    pub(super) fn begin(&mut self, at: Vec3<f64>, slope: f64, limit: f64) {
        (self.at, self.slope, self.limit) = (at, slope, limit);
        self.before = None;
        if limit == f64::INFINITY {
            self.share = 1.0;
        }
    }

    /// The force at a rate.
    pub(super) fn force(&self, v: Vec3<f64>) -> Vec3<f64> {
        let wanted = self.at - v * self.slope;
        let size = wanted.length();
        if size > self.limit {
            return wanted * (self.limit / size);
        }
        wanted
    }

    /// What its share makes of a step of h from the rate `qd`: a joint force, and an inertia.
    pub(super) fn load(&self, qd: Vec3<f64>, h: f64) -> (Vec3<f64>, f64) {
        let slope = self.share * self.slope;
        (self.exerted(qd), h * slope)
    }

    /// The force of its share at the rate at the end of the step.
    pub(super) fn exerted(&self, v: Vec3<f64>) -> Vec3<f64> {
        (self.at - v * self.slope) * self.share
    }

    /// Takes the share that a rate at the end of a step of h asks for, which is known to `tolerance`; whether it
    /// is another.
    pub(super) fn follow(&mut self, v: Vec3<f64>, h: f64, tolerance: f64) -> bool {
        if self.limit == f64::INFINITY {
            return false;
        }
        let (share, size) = (self.share, (self.at - v * self.slope).length());
        let softness = h * self.slope;
        if let Some([other, before]) = self.before.replace([share, size]) {
            let (less, more) = (before - size, (size * share - before * other) * softness);
            let mobility = less / more;
            // Solutions that differ by rounding alone say nothing.
            let is_known = less.abs() > self.slope * tolerance;
            if is_known && mobility.is_finite() && mobility > 0.0 {
                self.mobility = mobility;
            }
        }
        let give = softness * self.mobility;
        let rest = size * (1.0 + give * share) - self.limit * give;
        let next = if rest > self.limit {
            self.limit / rest
        } else {
            1.0
        };
        let slack = SETTLED + self.slope * tolerance / size;
        // Not so where the slack is no number, because no force is wanted.
        let changed = (next - share).abs() > slack * share;
        if changed {
            self.share = next;
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra_spatial::vec3;

    /// On a ball under a torque the law ends at its one solution from any share, in a few solutions.
    #[test]
    fn shares_are_found_in_a_few_solutions() {
        let h = 1e-3;
        let zero = Vec3::ZERO;
        for (at, slope, limit) in [
            (zero, 1e5, 2.0),
            (vec3(3.0, 4.0, 0.0), 0.0, 2.0),
            (vec3(30.0, -4.0, 1.0), 1e9, 2.0),
            (vec3(30.0, -4.0, 1.0), 2.0, f64::INFINITY),
        ] {
            for (qd, push) in [
                (vec3(1.0, 2.0, -1.0), zero),
                (zero, vec3(0.0, 1.9, 0.0)),
                (zero, vec3(0.0, 2.1, 0.0)),
                (vec3(-3.0, 0.0, 0.0), vec3(0.0, 5.0, 0.0)),
            ] {
                for (start, guess) in [(1.0, 0.5), (1e-3, 0.5), (0.3, 0.1), (1.0, 3.0)] {
                    let mass = 0.5;
                    let mut law = Round::new(guess);
                    law.share = start;
                    law.begin(at, slope, limit);
                    let mut passes = 1;
                    let v = loop {
                        let (force, inertia) = law.load(qd, h);
                        let v = qd + (force + push) * (h / (mass + inertia));
                        if !law.follow(v, h, 0.0) {
                            break v;
                        }
                        passes += 1;
                        assert!(passes <= 10, "{at:?} {slope} {qd:?} {push:?}: {law:?}");
                    };
                    let rest = (v - qd) * mass - (law.force(v) + push) * h;
                    let scale = mass * qd.length() + h * (4.0 + push.length());
                    assert!(rest.length() <= 1e-5 * scale, "{rest:?} after {passes}");
                    assert!(law.exerted(v).length() <= limit * (1.0 + 1e-5));
                }
            }
        }
    }
}
