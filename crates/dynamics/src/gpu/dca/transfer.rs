//! States and forces as the kernels have them.

use super::engine::{self, PUSH, PUSHED, PUSHED_SLOTS};
use super::tables::Tables;
use crate::link::{BodyFrame, Scales};
use crate::{Error, Forces, Precision, Wrench};
use vertebra_assembly::{JointKind, Model, State, Units};
use vertebra_spatial::Vec3;

/// Angle up to which f32 has digits left for sines \[rad\].
const LARGEST_F32_ANGLE: f64 = 131_072.0;

/// What turns the model's numbers into the kernels', which have their own units and order.
pub(super) struct Transfer<'a> {
    pub(super) model: &'a Model,
    pub(super) tables: &'a Tables,
    pub(super) scales: &'a Scales,
    /// Of the state on the device.
    pub(super) precision: Precision,
}

impl Transfer<'_> {
    /// A state as the kernels have it: twice, as it is and to be worked on.
    pub(super) fn to_device(&self, state: &State) -> Result<Vec<f64>, Error> {
        let mut q = state.q.clone();
        scale_lengths(self.model, &mut q, 1.0 / self.model.units().length);
        if self.precision == Precision::F32 {
            self.check_angles(state)?;
        }
        let positions = self.tables.positions.iter().map(|&at| q[at as usize]);
        let mut numbers: Vec<f64> = positions.collect();
        let rates = (self.tables.dofs.iter())
            .map(|&at| state.qd[at as usize] * self.scales.rate[at as usize]);
        numbers.extend(rates);
        if self.precision == Precision::F32
            && let Some(at) = numbers.iter().position(|x| x.abs() > f64::from(f32::MAX))
        {
            let counts = self.tables.positions.len();
            let body = self.model.bodies().iter().find(|body| {
                let (positions, dofs) = (body.position_range(), body.dof_range());
                match at.checked_sub(counts) {
                    None => positions.contains(&(self.tables.positions[at] as usize)),
                    Some(at) => dofs.contains(&(self.tables.dofs[at] as usize)),
                }
            });
            return Err(Error::Overflow {
                quantity: "position or rate",
                body: body.map_or_else(String::new, |body| body.name.clone()),
                time: state.time,
            });
        }
        numbers.extend_from_within(..);
        Ok(numbers)
    }

    fn check_angles(&self, state: &State) -> Result<(), Error> {
        let large = self.model.bodies().iter().find(|body| {
            let turns = matches!(
                body.joint.kind,
                JointKind::Revolute { .. } | JointKind::Screw { .. }
            );
            turns && state.q[body.position_start].abs() > LARGEST_F32_ANGLE
        });
        large.map_or(Ok(()), |body| {
            Err(Error::Overflow {
                quantity: "angle",
                body: body.name.clone(),
                time: state.time,
            })
        })
    }

    /// What pushes each body that is pushed; `control` is given the number of each slot.
    pub(super) fn pushes(&self, forces: &Forces, control: &mut [u32]) -> Vec<[f64; PUSH]> {
        let mut pushes: Vec<[f64; PUSH]> = Vec::new();
        let units = self.model.units();
        for (id, wrench) in forces.acting() {
            let slot = self.tables.slots[id.index()] as usize;
            let number = &mut control[PUSHED_SLOTS + slot];
            if *number == 0 {
                pushes.push([0.0; PUSH]);
                *number = engine::number(pushes.len());
            }
            let frame = BodyFrame::<f64>::new(&self.model.bodies()[id.index()], units);
            let origin = if self.tables.at_center[slot] {
                frame.center
            } else {
                Vec3::ZERO
            };
            add_push(
                &mut pushes[*number as usize - 1],
                &frame,
                origin,
                wrench,
                units,
            );
        }
        control[PUSHED] = engine::number(pushes.len());
        pushes
    }

    /// The state that so many numbers of the device's are.
    pub(super) fn state_of(&self, numbers: &[f64], time: f64) -> State {
        let (q, qd) = numbers.split_at(self.tables.positions.len());
        let mut state = State::neutral(self.model);
        for (&at, &number) in self.tables.positions.iter().zip(q) {
            state.q[at as usize] = number;
        }
        for (&at, &number) in self.tables.dofs.iter().zip(qd) {
            state.qd[at as usize] = number / self.scales.rate[at as usize];
        }
        scale_lengths(self.model, &mut state.q, self.model.units().length);
        state.time = time;
        state
    }
}

/// Adds a wrench to what pushes a body, about the handle point `origin`: world axes first, a force, a
/// moment, and the columns of f a' with its point a in joint axes; then in joint axes force and moment.
fn add_push(
    push: &mut [f64; PUSH],
    frame: &BodyFrame<f64>,
    origin: Vec3<f64>,
    wrench: &Wrench,
    units: &Units,
) {
    let force = Vec3::from_glam(wrench.force / units.force());
    let torque = Vec3::from_glam(wrench.torque / units.energy());
    let at = match wrench.point {
        None => frame.center,
        Some(point) => frame.placement.point(Vec3::from_glam(point / units.length)),
    };
    let arm = at - origin;
    let mut add = |part: usize, v: Vec3<f64>| {
        for (sum, term) in push[3 * part..].iter_mut().zip(v.to_array()) {
            *sum += term;
        }
    };
    if wrench.body_axes {
        let axes = frame.placement.rotation;
        let (force, torque) = (axes * force, axes * torque);
        add(5, force);
        add(6, torque + arm.cross(force));
    } else {
        add(0, force);
        add(1, torque);
        for (column, along) in arm.to_array().into_iter().enumerate() {
            add(2 + column, force * along);
        }
    }
}

/// Multiplies those positions that are lengths.
fn scale_lengths(model: &Model, q: &mut [f64], factor: f64) {
    for body in model.bodies() {
        let lengths = match body.joint.kind {
            JointKind::Prismatic { .. } => 1,
            JointKind::Free => 3,
            _ => 0,
        };
        for position in &mut q[body.position_start..][..lengths] {
            *position *= factor;
        }
    }
}
