//! The elements of spherical joints.

use super::Work;
use super::motor::SphericalMotor;
use super::round::Round;
use super::stop::{Ends, Moment, Taken};
use crate::elements::freedom::SLIP;
use core::f64::consts::TAU;
use vertebra_assembly::{BallRange, Body, BodyId, Model, Rest, Spring, State, Stop};
use vertebra_spatial::{Quat, Vec3, vec3};

/// The elements of a spherical joint. Spring, damper, rotor, friction and motor are alike in all directions.
#[derive(Clone, Debug)]
pub(super) struct Ball {
    pub(super) body: u32,
    pub(super) q: usize,
    pub(super) dof: usize,
    pub(super) stiffness: f64,
    pub(super) rest: Quat<f64>,
    pub(super) damping: f64,
    pub(super) armature: f64,
    pub(super) friction: f64,
    /// Rate below which friction holds.
    slip: f64,
    pub(super) motor: SphericalMotor,
    pub(super) effort: f64,
    /// About the inertia that it moves.
    #[cfg(feature = "gpu")]
    pub(super) moved: f64,
    pub(super) rubs: Round,
    pub(super) drives: Round,
    pub(super) bounds: Vec<Bound>,
}

/// A step as the elements of a spherical joint see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turned {
    pub(super) q: Quat<f64>,
    pub(super) w: Vec3<f64>,
    pub(super) h: f64,
    pub(super) firmness: f64,
}

/// Joint forces of a step, and the inertia that they add: its diagonal and, xy, xz and yz, what is off it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Load {
    pub(super) force: [f64; 3],
    pub(super) inertia: [f64; 3],
    pub(super) across: [f64; 3],
}

/// A coordinate of the orientation that has a range.
#[derive(Clone, Copy, Debug)]
pub(super) enum Coordinate {
    /// The angle of the whole turn.
    Turn,
    /// The angle between an axis of the child and the same of the parent.
    Swing(Vec3<f64>),
    /// The angle about that axis.
    Twist(Vec3<f64>),
}

/// A coordinate that is kept in its range, and its state in the step at hand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    pub(super) coordinate: Coordinate,
    pub(super) ends: Ends,
    /// How fast the coordinate changes with the rate about each axis.
    gradient: Vec3<f64>,
    pub(super) taken: Taken,
}

impl Coordinate {
    /// Its value and its gradient g, of which its rate is g'w, with q from the child's axes to the parent's.
    ///
    /// - **Turn**: the rotation vector r has r'w as the rate of |r|^2 / 2, so that g = r / |r|.
    /// - **Swing** of the axis a, which from the child is seen at b = q^-1 a on the parent: b' = -w x b and
    ///   cos = a'b, hence g = b x a / |b x a|.
    /// - **Twist** (the angle of the nearest turn about a: Dobrowolski 2015, swing-twist decomposition): with q = (v, c), s = a'v and d = s^2 + c^2 it is
    ///   2 atan2(s, c). From 2 q' = q w, g = (c^2 a + c a x v + s v) / d, whose length is 1 over the cosine of half
    ///   the swing.
    ///
    /// The gradient is zero where there is none: at no turn, and of the twist after half a turn across.
    fn at(self, q: Quat<f64>) -> (f64, Vec3<f64>) {
        match self {
            Self::Turn => {
                let r = q.log();
                let angle = r.length();
                (angle, unit_or_zero(r, angle))
            }
            Self::Swing(a) => {
                let across = (q.conjugate().to_matrix() * a).cross(a);
                let along = (q.to_matrix() * a).dot(a);
                let sine = across.length();
                (sine.atan2(along), unit_or_zero(across, sine))
            }
            Self::Twist(a) => {
                let (v, c) = if q.w < 0.0 { (-q.v, -q.w) } else { (q.v, q.w) };
                let s = a.dot(v);
                let d = s * s + c * c;
                let angle = 2.0 * s.atan2(c);
                if d < f64::EPSILON {
                    return (angle, Vec3::ZERO);
                }
                let gradient = a * (c * c) + a.cross(v) * c + v * s;
                (angle, gradient * (1.0 / d))
            }
        }
    }
}

fn unit_or_zero(v: Vec3<f64>, length: f64) -> Vec3<f64> {
    if length < f64::EPSILON {
        return Vec3::ZERO;
    }
    v * (1.0 / length)
}

impl Bound {
    fn moment(&self, now: &Turned) -> (Moment, Vec3<f64>) {
        let (mut q, gradient) = self.coordinate.at(now.q);
        if let Coordinate::Twist(_) = self.coordinate {
            // Angles a whole turn apart are one twist: of those the one nearest to the middle of the range.
            let [lower, upper] = self.ends.range;
            let middle = 0.5 * (lower + upper);
            q -= TAU * ((q - middle) / TAU).round();
        }
        let moment = Moment {
            q,
            qd: gradient.dot(now.w),
            h: now.h,
            firmness: now.firmness,
        };
        (moment, gradient)
    }

    fn begin(&mut self, now: &Turned) {
        let (moment, gradient) = self.moment(now);
        self.gradient = gradient;
        self.taken.begin(self.ends.law(&moment), now.h);
    }

    /// The force as it is now.
    fn force(&self, now: &Turned) -> Vec3<f64> {
        let (moment, gradient) = self.moment(now);
        gradient * self.ends.law(&moment).0.force(moment.qd)
    }

    fn add_to(&self, now: &Turned, sum: &mut Load) {
        let g = self.gradient;
        let mut load = [0.0; 2];
        let (law, part) = (self.taken.law, self.taken.part);
        law.load(part, g.dot(now.w), now.h, &mut load);
        let [force, inertia] = load;
        let [x, y, z] = g.to_array();
        for (sum, g) in sum.force.iter_mut().zip([x, y, z]) {
            *sum += force * g;
        }
        for (sum, square) in sum.inertia.iter_mut().zip([x * x, y * y, z * z]) {
            *sum += inertia * square;
        }
        for (sum, product) in sum.across.iter_mut().zip([x * y, x * z, y * z]) {
            *sum += inertia * product;
        }
    }
}

/// The coordinates of a range, each with its bounds.
fn coordinates(range: &BallRange) -> Vec<(Coordinate, [f64; 2])> {
    // No bound from below is nearer than the one from above.
    let below = |most| [f64::NEG_INFINITY, most];
    match *range {
        BallRange::Turn { angle } => vec![(Coordinate::Turn, below(angle))],
        BallRange::Cone { axis, swing, twist } => {
            let axis = Vec3::from_glam(axis);
            // A whole turn is no bound.
            let twist = twist.filter(|[lower, upper]| upper - lower < TAU);
            let twist = twist.map(|range| (Coordinate::Twist(axis), range));
            let swing = (Coordinate::Swing(axis), below(swing));
            core::iter::once(swing).chain(twist).collect()
        }
    }
}

impl Ball {
    pub(super) fn new(model: &Model, id: BodyId, body: &Body, moved: f64) -> Self {
        let joint = &body.joint;
        let (stiffness, rest) = match joint.spring {
            Some(Spring {
                stiffness,
                rest: Rest::Orientation(rest),
            }) => (stiffness, rest),
            _ => (0.0, glam::DQuat::IDENTITY),
        };
        let rate = 1.0 / model.units().time;
        let limits = joint.limits.unwrap_or_default();
        let bounded = limits.orientation.as_ref().map(coordinates);
        let bound = |(coordinate, range)| Bound {
            coordinate,
            ends: Ends {
                range,
                stop: joint.stop,
                moved,
                recovery: rate,
            },
            gradient: Vec3::ZERO,
            taken: Taken::NONE,
        };
        Self {
            body: id.0,
            q: body.position_start,
            dof: body.dof_start,
            stiffness,
            rest: Quat::from_glam(rest),
            damping: joint.damping,
            armature: joint.armature,
            friction: joint.friction,
            slip: SLIP * rate,
            motor: SphericalMotor::OFF,
            effort: limits.effort.unwrap_or(f64::INFINITY),
            #[cfg(feature = "gpu")]
            moved,
            rubs: Round::new(moved),
            drives: Round::new(moved),
            bounds: bounded.into_iter().flatten().map(bound).collect(),
        }
    }

    /// Whether there is anything to compute.
    pub(super) fn is_idle(&self) -> bool {
        self.stiffness == 0.0
            && self.damping == 0.0
            && self.armature == 0.0
            && self.friction == 0.0
            && self.bounds.is_empty()
            && self.motor.is_off()
    }

    /// Whether the force jumps where the state does not.
    pub(super) fn is_rough(&self) -> bool {
        let is_hard = |bound: &Bound| matches!(bound.ends.stop, Stop::Hard { .. });
        self.friction > 0.0 || self.bounds.iter().any(is_hard)
    }

    /// What it sees of a state.
    pub(super) fn turned(&self, state: &State, h: f64, firmness: f64) -> Turned {
        let (q, w) = (&state.q[self.q..], &state.qd[self.dof..]);
        Turned {
            q: Quat::from_xyzw(q[0], q[1], q[2], q[3]),
            w: vec3(w[0], w[1], w[2]),
            h,
            firmness,
        }
    }

    /// The rotation vector from an orientation to another, in the latter's axes; the short way.
    fn off(from: Quat<f64>, to: Quat<f64>) -> Vec3<f64> {
        (from.conjugate() * to).log()
    }

    /// The force of the motor at rate zero, and how it falls with the rate at the end of the step.
    fn motor_law(&self, now: &Turned) -> (Vec3<f64>, f64) {
        let SphericalMotor {
            torque,
            orientation,
            rate,
            stiffness,
            damping,
            ..
        } = self.motor;
        let mut at = Vec3::from_glam(torque) + Vec3::from_glam(rate) * damping;
        if stiffness != 0.0 {
            at -= Self::off(Quat::from_glam(orientation), now.q) * stiffness;
        }
        (at, damping + now.h * stiffness)
    }

    /// Takes the laws of a step.
    pub(super) fn begin(&mut self, now: &Turned) {
        let (at, slope) = self.motor_law(now);
        self.drives
            .begin(at, slope, self.motor.limit.min(self.effort));
        // Coulomb's law, its jump replaced by a slope: f = -F v / slip where |v| < slip.
        let rubbing = self.friction / self.slip;
        let limit = if self.friction > 0.0 {
            self.friction
        } else {
            f64::INFINITY
        };
        self.rubs.begin(Vec3::ZERO, rubbing, limit);
        for bound in &mut self.bounds {
            bound.begin(now);
        }
    }

    /// Joint forces of the step, and the inertia that they add.
    ///
    /// The rotation vector changes with w to first order in itself, so that at the end of the step it is
    /// about off + h w.
    pub(super) fn load(&self, now: &Turned) -> Load {
        let (w, h) = (now.w, now.h);
        let mut force = -(w * self.damping);
        if self.stiffness != 0.0 {
            force -= (Self::off(self.rest, now.q) + w * h) * self.stiffness;
        }
        let mut inertia = self.armature + h * (self.damping + h * self.stiffness);
        if h == 0.0 {
            force += self.drives.force(w) + self.rubs.force(w);
            for bound in &self.bounds {
                force += bound.force(now);
            }
        } else {
            for law in [&self.drives, &self.rubs] {
                let (push, holds) = law.load(w, h);
                force += push;
                inertia += holds;
            }
        }
        let mut sum = Load {
            force: force.to_array(),
            inertia: [inertia; 3],
            across: [0.0; 3],
        };
        if h != 0.0 {
            for bound in &self.bounds {
                bound.add_to(now, &mut sum);
            }
        }
        sum
    }

    /// Takes the parts that the rate v at the end of the step asks for; whether they are others.
    pub(super) fn follow(&mut self, v: Vec3<f64>, h: f64, tolerance: f64) -> bool {
        let mut changed = self.drives.follow(v, h, tolerance);
        changed |= self.rubs.follow(v, h, tolerance);
        for bound in &mut self.bounds {
            let rate = bound.gradient.dot(v);
            let tolerance = tolerance * bound.gradient.length();
            changed |= bound.taken.follow(rate, tolerance);
        }
        changed
    }

    /// Adds the work of an implicit step that ended with the rate v: forces at its end over the displacement
    /// that the mean rate makes of it.
    pub(super) fn account(&self, now: &Turned, v: Vec3<f64>, work: &mut Work) {
        let way = (now.w + v) * (0.5 * now.h);
        if self.stiffness != 0.0 {
            let off = Self::off(self.rest, now.q) + v * now.h;
            work.springs -= self.stiffness * off.dot(way);
        }
        work.dampers -= self.damping * v.dot(way);
        work.motors += self.drives.exerted(v).dot(way);
        work.friction += self.rubs.exerted(v).dot(way);
        for bound in &self.bounds {
            let g = bound.gradient;
            let exerted = bound.taken.law.exerted(bound.taken.part, g.dot(v));
            work.stops += exerted * g.dot(way);
        }
    }

    /// Adds the work of a step of h between two states that took forces as they were: their mean over the way.
    pub(super) fn account_between(&self, ends: [Turned; 2], h: f64, work: &mut Work) {
        let [from, to] = ends;
        let way = (from.w + to.w) * (0.5 * h);
        for now in ends {
            let half = way * 0.5;
            work.springs -= self.stiffness * Self::off(self.rest, now.q).dot(half);
            work.dampers -= self.damping * now.w.dot(half);
            let mut drives = self.drives;
            let (at, slope) = self.motor_law(&now);
            drives.begin(at, slope, self.motor.limit.min(self.effort));
            work.motors += drives.force(now.w).dot(half);
            for bound in &self.bounds {
                work.stops += bound.force(&now).dot(half);
            }
        }
    }

    /// Energies of the spring and of the rotor.
    pub(super) fn stored(&self, now: &Turned) -> [f64; 2] {
        [
            0.5 * self.stiffness * Self::off(self.rest, now.q).length_squared(),
            0.5 * self.armature * now.w.length_squared(),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra_assembly::Random;

    /// Gradients are those of the values, by differences.
    #[test]
    fn coordinates_change_as_their_gradients_say() {
        let mut random = Random::new(5);
        for _ in 0..200 {
            let axis = Vec3::from_glam(random.direction());
            let q = Quat::from_glam(random.rotation());
            let w = Vec3::from_glam(random.direction());
            for coordinate in [
                Coordinate::Turn,
                Coordinate::Swing(axis),
                Coordinate::Twist(axis),
            ] {
                let (_, gradient) = coordinate.at(q);
                let h = 1e-6;
                let [before, after] = [-h, h].map(|h| coordinate.at(q.integrate(w * h)).0);
                let rate = (after - before) / (2.0 * h);
                let length = gradient.length();
                // Not across the place where an angle jumps, nor where it turns fast.
                if rate.abs() < 100.0 && length < 10.0 {
                    let off = (rate - gradient.dot(w)).abs();
                    assert!(off <= 1e-6 * length * length, "{coordinate:?}: {off:e}");
                }
                let expected = match coordinate {
                    Coordinate::Twist(axis) => 1.0 / (0.5 * Coordinate::Swing(axis).at(q).0).cos(),
                    _ => 1.0,
                };
                assert!((length - expected).abs() <= 1e-9 * expected * expected);
            }
        }
    }
}
