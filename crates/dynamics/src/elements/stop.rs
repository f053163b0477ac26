//! What keeps a coordinate in its range.

use super::law::{Law, Part};
use vertebra_assembly::Stop;

/// A step as the law of one coordinate sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) q: f64,
    pub(super) qd: f64,
    /// Length of the step; none, of no length, for forces as they are now.
    pub(super) h: f64,
    /// Inertia by which a hard stop exceeds what it stops, as a multiple of that.
    pub(super) firmness: f64,
}

/// A stop at each end of a range.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub(super) range: [f64; 2],
    pub(super) stop: Stop,
    /// About the inertia that the joint moves.
    pub(super) moved: f64,
    /// Rate at which a joint is brought back into its range.
    pub(super) recovery: f64,
}

impl Ends {
    /// The law of the bound that is nearer, and the part of it in which it does nothing.
    ///
    /// With g the displacement to the bound, positive inside the range, and sign s of the direction to
    /// it, a soft stop exerts -s max(0, -k (g - h s v) + c s v). A hard one lets s v be at most g / h,
    /// the rate that reaches the bound at the end of the step; after an impact at rate v0, -e v0; and
    /// outside of the range the rate at which the joint comes back, bounded itself. It does so as a
    /// damper against which the joint's inertia is nothing.
    pub(super) fn law(&self, now: &Moment) -> (Law, Part) {
        let [lower, upper] = self.range;
        let is_upper = upper - now.q <= now.q - lower;
        let (gap, sign) = if is_upper {
            (upper - now.q, 1.0)
        } else {
            (now.q - lower, -1.0)
        };
        let (at, slope) = match self.stop {
            Stop::Soft { stiffness, damping } => {
                // A damper beyond the bound only, which is where the step ends or starts.
                let beyond = gap <= now.h * sign * now.qd || gap <= 0.0;
                let damping = if beyond { damping } else { 0.0 };
                (sign * stiffness * gap, damping + now.h * stiffness)
            }
            Stop::Hard { .. } if now.h == 0.0 => return (Law::NONE, Part::Slope),
            Stop::Hard { restitution } => {
                let reach = (gap / now.h).max(-self.recovery);
                let toward = sign * now.qd;
                let bound = if restitution > 0.0 && toward > reach {
                    reach.min(-restitution * toward)
                } else {
                    reach
                };
                let slope = now.firmness * self.moved / now.h;
                (sign * slope * bound, slope)
            }
        };
        // A range without width holds from both sides.
        let (least, most, open) = if upper == lower {
            (f64::NEG_INFINITY, f64::INFINITY, Part::Slope)
        } else if is_upper {
            (f64::NEG_INFINITY, 0.0, Part::Most)
        } else {
            (0.0, f64::INFINITY, Part::Least)
        };
        let law = Law {
            at,
            slope,
            least,
            most,
        };
        (law, open)
    }
}

/// A stop in the step at hand, and the part of its law that is taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taken {
    pub(super) law: Law,
    pub(super) part: Part,
    /// The part of the law in which it does nothing.
    open: Part,
}

impl Taken {
    pub(super) const NONE: Self = Self {
        law: Law::NONE,
        part: Part::Slope,
        open: Part::Slope,
    };

    /// Takes the law of a step of h, or of no step: questions between steps leave the part as it is. A stop that held goes on
    /// holding, unless the other bound is the nearer one now.
    pub(super) fn begin(&mut self, (law, open): (Law, Part), h: f64) {
        self.law = law;
        if h == 0.0 {
            return;
        }
        if self.part != Part::Slope || self.open != open {
            self.part = open;
        }
        self.open = open;
    }

    /// Takes the part that a rate at the end of the step asks for; whether it is another.
    pub(super) fn follow(&mut self, v: f64, tolerance: f64) -> bool {
        let next = self.law.next(self.part, v, tolerance);
        core::mem::replace(&mut self.part, next) != next
    }
}
