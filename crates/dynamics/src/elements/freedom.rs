//! The elements of joints with one freedom.

use super::Work;
use super::law::{Law, Part};
use super::motor::Motor;
use super::stop::{Ends, Moment, Taken};
use vertebra_assembly::{Body, BodyId, JointKind, Model, Rest, Spring, Stop};

/// Rates below which dry friction holds, as part of the model's unit of rate.
pub(super) const SLIP: f64 = 1e-5;

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
    pub(super) ends: Option<Ends>,
    pub(super) motor: Motor,
    pub(super) effort: f64,
    /// Of motor and friction in the step at hand, and the parts of them that are taken.
    laws: [Law; 2],
    pub(super) parts: [Part; 2],
    pub(super) stops: Taken,
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
            ends: (j.limits.and_then(|limits| limits.position)).map(|range| Ends {
                range,
                stop: j.stop,
                moved,
                recovery: rate,
            }),
            motor: Motor::OFF,
            effort: (j.limits.and_then(|limits| limits.effort)).unwrap_or(f64::INFINITY),
            laws: [Law::NONE; 2],
            parts: [Part::Slope; 2],
            stops: Taken::NONE,
        }
    }

    /// Whether there is anything to compute.
    pub(super) fn is_idle(&self) -> bool {
        self.stiffness == 0.0
            && self.damping == 0.0
            && self.armature == 0.0
            && self.friction == 0.0
            && self.ends.is_none()
            && self.motor.is_off()
    }

    /// Whether the force jumps where the state does not.
    pub(super) fn is_rough(&self) -> bool {
        let is_hard = |ends: Ends| matches!(ends.stop, Stop::Hard { .. });
        self.friction > 0.0 || self.ends.is_some_and(is_hard)
    }

    /// Takes the laws of a step.
    pub(super) fn begin(&mut self, now: &Moment) {
        self.stops.begin(self.stop_law(now), now.h);
        self.laws = [self.motor_law(now), self.friction_law()];
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

    fn stop_law(&self, now: &Moment) -> (Law, Part) {
        (self.ends).map_or((Law::NONE, Part::Slope), |ends| ends.law(now))
    }

    /// Joint force and inertia of the step, as the parts taken make them.
    pub(super) fn load(&self, now: &Moment) -> [f64; 2] {
        let mut load = [
            -self.stiffness * (now.q + now.h * now.qd - self.rest) - self.damping * now.qd,
            self.armature + now.h * (self.damping + now.h * self.stiffness),
        ];
        if now.h == 0.0 {
            let laws = self.laws.iter().chain([&self.stops.law]);
            load[0] += laws.map(|law| law.force(now.qd)).sum::<f64>();
            return load;
        }
        for (law, &part) in self.laws.iter().zip(&self.parts) {
            law.load(part, now.qd, now.h, &mut load);
        }
        let Taken { law, part, .. } = self.stops;
        law.load(part, now.qd, now.h, &mut load);
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
        changed | self.stops.follow(v, tolerance)
    }

    /// Adds the work of a step that ended with the rate v: forces at its end over the displacement that
    /// the mean rate makes of it, so that kinetic energy is accounted for to rounding.
    pub(super) fn account(&self, now: &Moment, v: f64, work: &mut Work) {
        let way = 0.5 * now.h * (now.qd + v);
        let [motor, friction] = [0, 1].map(|k| self.laws[k].exerted(self.parts[k], v) * way);
        let stop = self.stops.law.exerted(self.stops.part, v) * way;
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

/// About the inertia that each joint moves [kg m^2 or kg]: a sum over what hangs from
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
