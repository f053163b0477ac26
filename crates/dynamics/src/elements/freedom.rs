//! The elements of single joints.

use super::Work;
use super::law::{Law, Part};
use super::motor::Motor;
use vertebra_assembly::{Body, BodyId, JointKind, Model, Rest, Spring, State, Stop};
use vertebra_spatial::{Quat, Vec3, vec3};

/// Rates below which dry friction holds, as part of the model's unit of rate.
const SLIP: f64 = 1e-5;

/// The elements of a joint with one freedom.
#[derive(Clone, Debug)]
pub(super) struct Freedom {
    pub(super) body: u32,
    pub(super) q: usize,
    pub(super) dof: usize,
    /// Spring and damper, in force at all rates.
    pub(super) stiffness: f64,
    pub(super) rest: f64,
    pub(super) damping: f64,
    pub(super) armature: f64,
    pub(super) friction: f64,
    /// Rate below which friction holds.
    slip: f64,
    pub(super) range: Option<[f64; 2]>,
    pub(super) stop: Stop,
    /// About the inertia that the joint moves.
    pub(super) moved: f64,
    /// Rate at which a joint is brought back into its range.
    recovery: f64,
    pub(super) motor: Motor,
    pub(super) effort: f64,
    /// Of motor, friction and stop in the step at hand, and the parts of them that are taken.
    laws: [Law; 3],
    parts: [Part; 3],
    /// The part of the stop's law in which it does nothing.
    open: Part,
}

/// A step as laws see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) q: f64,
    pub(super) qd: f64,
    /// Length of the step; none, of no length, for forces as they are now.
    pub(super) h: f64,
    /// Inertia by which a hard stop exceeds what it stops, as a multiple of that.
    pub(super) firmness: f64,
}

impl Freedom {
    pub(super) fn new(model: &Model, body: BodyId, joint: &Body, moved: f64) -> Self {
        let units = model.units();
        let rate = match joint.joint.kind {
            JointKind::Prismatic { .. } => units.velocity(),
            _ => 1.0 / units.time,
        };
        let j = &joint.joint;
        let (stiffness, rest) = match j.spring {
            Some(Spring {
                stiffness,
                rest: Rest::Position(rest),
            }) => (stiffness, rest),
            _ => (0.0, 0.0),
        };
        Self {
            body: body.0,
            q: joint.position_start,
            dof: joint.dof_start,
            stiffness,
            rest,
            damping: j.damping,
            armature: j.armature,
            friction: j.friction,
            slip: SLIP * rate,
            range: j.limits.and_then(|limits| limits.position),
            stop: j.stop,
            moved,
            recovery: rate,
            motor: Motor::OFF,
            effort: (j.limits.and_then(|limits| limits.effort)).unwrap_or(f64::INFINITY),
            laws: [Law::NONE; 3],
            parts: [Part::Slope; 3],
            open: Part::Slope,
        }
    }

    /// Whether there is anything to compute.
    pub(super) fn is_idle(&self) -> bool {
        self.stiffness == 0.0
            && self.damping == 0.0
            && self.armature == 0.0
            && self.friction == 0.0
            && self.range.is_none()
            && self.motor.is_off()
    }

    /// Whether the force jumps where the state does not.
    pub(super) fn is_rough(&self) -> bool {
        self.friction > 0.0 || (self.range.is_some() && matches!(self.stop, Stop::Hard { .. }))
    }

    /// Takes the laws of a step.
    pub(super) fn begin(&mut self, now: &Moment) {
        let (stop, open) = self.stop_law(now);
        // A stop that held goes on holding, unless the other bound is the nearer one now.
        if self.parts[2] != Part::Slope || self.open != open {
            self.parts[2] = open;
        }
        self.open = open;
        self.laws = [self.motor_law(now), self.friction_law(), stop];
        // A motor that was limited may be so no more.
        if self.laws[0].most == f64::INFINITY {
            self.parts[0] = Part::Slope;
        }
    }

    fn motor_law(&self, now: &Moment) -> Law {
        let Motor {
            force,
            position,
            rate,
            stiffness,
            damping,
            limit,
        } = self.motor;
        let limit = limit.min(self.effort);
        Law {
            at: force + stiffness * (position - now.q) + damping * rate,
            slope: damping + now.h * stiffness,
            least: -limit,
            most: limit,
        }
    }

    /// Coulomb's law, its step replaced by a slope: f = -F v / slip where |v| < slip.
    fn friction_law(&self) -> Law {
        if self.friction == 0.0 {
            return Law::NONE;
        }
        Law {
            at: 0.0,
            slope: self.friction / self.slip,
            least: -self.friction,
            most: self.friction,
        }
    }

    /// The law of the bound that is nearer, and the part of it in which it does nothing.
    ///
    /// With g the displacement to the bound, positive inside the range, and sign s of the direction to
    /// it, a soft stop exerts -s max(0, -k (g - h s v) + c s v). A hard one lets s v be at most g / h,
    /// the rate that reaches the bound at the end of the step; after an impact at rate v0, -e v0; and
    /// outside of the range the rate at which the joint comes back, bounded itself. It does so as a
    /// damper against which the joint's inertia is nothing.
    fn stop_law(&self, now: &Moment) -> (Law, Part) {
        let Some([lower, upper]) = self.range else {
            return (Law::NONE, Part::Slope);
        };
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

    /// Joint force and inertia of the step, as the parts taken make them.
    pub(super) fn load(&self, now: &Moment) -> [f64; 2] {
        let mut load = [
            -self.stiffness * (now.q + now.h * now.qd - self.rest) - self.damping * now.qd,
            self.armature + now.h * (self.damping + now.h * self.stiffness),
        ];
        if now.h == 0.0 {
            load[0] += self.laws.iter().map(|law| law.force(now.qd)).sum::<f64>();
            return load;
        }
        for (law, &part) in self.laws.iter().zip(&self.parts) {
            law.load(part, now.qd, now.h, &mut load);
        }
        load
    }

    /// Takes the parts that a rate at the end of the step asks for; whether they are others.
    pub(super) fn follow(&mut self, v: f64, tolerance: f64) -> bool {
        let mut changed = false;
        for (law, part) in self.laws.iter().zip(&mut self.parts) {
            let next = law.next(*part, v, tolerance);
            changed |= next != *part;
            *part = next;
        }
        changed
    }

    /// Adds the work of a step that ended with the rate v: forces at its end over the displacement that
    /// the mean rate makes of it, so that kinetic energy is accounted for to rounding.
    pub(super) fn account(&self, now: &Moment, v: f64, work: &mut Work) {
        let way = 0.5 * now.h * (now.qd + v);
        let [motor, friction, stop] =
            [0, 1, 2].map(|k| self.laws[k].exerted(self.parts[k], v) * way);
        work.springs -= self.stiffness * (now.q + now.h * v - self.rest) * way;
        work.dampers -= self.damping * v * way;
        work.motors += motor;
        work.friction += friction;
        work.stops += stop;
    }

    /// Adds the work of a step between two states that took forces as they were: their mean over the way.
    pub(super) fn account_between(&self, from: [f64; 2], to: [f64; 2], work: &mut Work) {
        let forces = |[q, qd]: [f64; 2]| {
            let now = Moment {
                q,
                qd,
                h: 0.0,
                firmness: 0.0,
            };
            [
                -self.stiffness * (q - self.rest),
                -self.damping * qd,
                self.motor_law(&now).force(qd),
                self.stop_law(&now).0.force(qd),
            ]
        };
        let (before, after) = (forces(from), forces(to));
        let way = 0.5 * (to[0] - from[0]);
        work.springs += (before[0] + after[0]) * way;
        work.dampers += (before[1] + after[1]) * way;
        work.motors += (before[2] + after[2]) * way;
        work.stops += (before[3] + after[3]) * way;
    }

    /// Energies of the spring and of the rotor.
    pub(super) fn stored(&self, q: f64, qd: f64) -> [f64; 2] {
        let off = q - self.rest;
        [
            0.5 * self.stiffness * off * off,
            0.5 * self.armature * qd * qd,
        ]
    }
}

/// The elements of a spherical joint: the same in all directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub(super) q: usize,
    pub(super) dof: usize,
    pub(super) stiffness: f64,
    pub(super) rest: Quat<f64>,
    pub(super) damping: f64,
    pub(super) armature: f64,
}

impl Ball {
    /// None if the joint has no elements.
    pub(super) fn new(body: &Body) -> Option<Self> {
        let joint = &body.joint;
        let (stiffness, rest) = match joint.spring {
            Some(Spring {
                stiffness,
                rest: Rest::Orientation(rest),
            }) => (stiffness, rest),
            _ => (0.0, glam::DQuat::IDENTITY),
        };
        if stiffness == 0.0 && joint.damping == 0.0 && joint.armature == 0.0 {
            return None;
        }
        Some(Self {
            q: body.position_start,
            dof: body.dof_start,
            stiffness,
            rest: Quat::from_glam(rest),
            damping: joint.damping,
            armature: joint.armature,
        })
    }

    /// The rotation vector from the rest to an orientation, in the child's axes; the short way.
    fn off(&self, q: &[f64]) -> Vec3<f64> {
        let turned = Quat::from_xyzw(q[self.q], q[self.q + 1], q[self.q + 2], q[self.q + 3]);
        (self.rest.conjugate() * turned).log()
    }

    fn rate(&self, qd: &[f64]) -> Vec3<f64> {
        vec3(qd[self.dof], qd[self.dof + 1], qd[self.dof + 2])
    }

    /// Joint forces of the step, and the inertia that they add to each freedom.
    ///
    /// The rotation vector changes with w to first order in itself, so that at the end of the step it is
    /// about off + h w.
    pub(super) fn load(&self, q: &[f64], qd: &[f64], h: f64) -> ([f64; 3], f64) {
        let w = self.rate(qd);
        let force = -((self.off(q) + w * h) * self.stiffness + w * self.damping);
        let inertia = self.armature + h * (self.damping + h * self.stiffness);
        (force.to_array(), inertia)
    }

    /// Adds the work of a step of h between two states, implicit or not.
    pub(super) fn account(
        &self,
        (from, to): (&State, &State),
        (h, implicit): (f64, bool),
        work: &mut Work,
    ) {
        let (before, after) = (self.rate(&from.qd), self.rate(&to.qd));
        let way = (before + after) * (0.5 * h);
        let (off, rate) = if implicit {
            (self.off(&from.q) + after * h, after)
        } else {
            let off = self.off(&from.q) + self.off(&to.q);
            (off * 0.5, (before + after) * 0.5)
        };
        work.springs -= self.stiffness * off.dot(way);
        work.dampers -= self.damping * rate.dot(way);
    }

    /// Energies of the spring and of the rotor.
    pub(super) fn stored(&self, q: &[f64], qd: &[f64]) -> [f64; 2] {
        [
            0.5 * self.stiffness * self.off(q).length_squared(),
            0.5 * self.armature * self.rate(qd).length_squared(),
        ]
    }
}

/// About the inertia that each joint with one freedom moves [kg m^2 or kg]: a sum over what hangs from
/// it, of which every joint passes half on.
pub(super) fn moved(model: &Model) -> Vec<f64> {
    // Sums of m, m |r| and m r^2 about the joint.
    let mut sums = vec![[0.0_f64; 3]; model.bodies().len()];
    for (index, body) in model.bodies().iter().enumerate().rev() {
        let joint = body.joint.child_placement.translation;
        let (mass, arm) = (body.mass.mass, (body.mass.center - joint).length());
        let inertia = body.mass.inertia;
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        let own = [mass, mass * arm, 0.5 * trace + mass * arm * arm];
        let mut total = sums[index];
        for (total, own) in total.iter_mut().zip(own) {
            *total += own;
        }
        sums[index] = total;
        if let Some(parent) = body.parent {
            let origin = (model.body(parent)).map(|body| body.joint.child_placement.translation);
            let to = body.joint.parent_placement.translation;
            let r = (to - origin.unwrap_or_default()).length();
            let [m, first, second] = total.map(|sum| 0.5 * sum);
            let passed = [m, first + r * m, second + 2.0 * r * first + r * r * m];
            for (sum, passed) in sums[parent.index()].iter_mut().zip(passed) {
                *sum += passed;
            }
        }
    }
    let of = |(body, [mass, _, second]): (&Body, [f64; 3])| match body.joint.kind {
        JointKind::Prismatic { .. } => mass,
        JointKind::Screw { pitch, .. } => second + pitch * pitch * mass,
        _ => second,
    };
    model.bodies().iter().zip(sums).map(of).collect()
}
