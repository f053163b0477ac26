//! A loop or coupling of a model as rows of J.

use super::equation::{self, Equation, Moving};
use super::seen_at;
use crate::workspace::Sweeps;
use core::ops::Range;
use vertebra_assembly::{BodyId, Coupling, JointKind, Loop, Model};
use vertebra_spatial::{Force, Transform, Vec3};

/// One loop or coupling.
#[derive(Clone, Debug)]
pub(crate) struct Constraint {
    pub(crate) name: String,
    /// Its rows of J.
    pub(crate) rows: Range<usize>,
    /// The bodies that it moves and all theirs up to the world, parents first, and the freedoms of these.
    pub(super) bodies: Vec<usize>,
    pub(crate) dofs: Vec<usize>,
    /// Where its first row's entries start.
    start: usize,
    pub(crate) kind: Kind,
}

#[derive(Clone, Debug)]
pub(crate) enum Kind {
    Loop(Box<Closing>),
    Coupling {
        /// Where the coordinates of the follower and of the other are in q.
        positions: [usize; 2],
        /// Entries of the row that are not zero.
        entries: [(usize, f64); 2],
        /// The model's unit of the follower's coordinate in SI, the ratio and the offset in SI.
        unit: f64,
        ratio: f64,
        offset: f64,
        /// e in the model's units.
        value: f64,
    },
}

/// A loop.
#[derive(Clone, Debug)]
pub(crate) struct Closing {
    pub(crate) ends: [Option<End>; 2],
    /// Where the frames of ends without a body are, in the world.
    pub(crate) placements: [Transform<f64>; 2],
    pub(crate) equations: Vec<Equation>,
    /// The longest link of the loop, in the model's lengths.
    pub(crate) size: f64,
}

/// One side of a loop.
#[derive(Clone, Debug)]
pub(crate) struct End {
    pub(crate) body: usize,
    /// The closure's frame in the body's joint frame.
    pub(crate) frame: Transform<f64>,
    /// The body and those that carry it, but none that carries both ends, inwards; with each the place of
    /// its first freedom in a row.
    path: Vec<(usize, usize)>,
}

impl Constraint {
    /// All of a model, with the number of rows and of entries of J.
    pub(crate) fn of_model(model: &Model, s: &Sweeps<f64>) -> (Vec<Self>, usize, usize) {
        let (mut rows, mut entries) = (0, 0);
        let mut all: Vec<Self> = (model
            .loops()
            .iter()
            .map(|closed| Self::of_loop(closed, model, s)))
        .chain(
            model
                .couplings()
                .map(|coupling| Self::of_coupling(coupling, model, s)),
        )
        .collect();
        for constraint in &mut all {
            let count = constraint.rows.len();
            constraint.rows = rows..rows + count;
            constraint.start = entries;
            rows += count;
            entries += count * constraint.dofs.len();
        }
        (all, rows, entries)
    }

    fn of_loop(closed: &Loop, model: &Model, s: &Sweeps<f64>) -> Self {
        let unit = model.units().length;
        let axes = equation::axes(&closed.closure);
        let mut placements = [Transform::IDENTITY; 2];
        for k in 0..2 {
            let mut placement = closed.placements[k];
            placement.translation /= unit;
            placements[k] = Transform::from_pose(&placement);
            placements[k].rotation = placements[k].rotation * axes[k];
        }
        let bodies = bodies_of(s, closed.bodies.map(|body| body.map(BodyId::index)));
        let paths = closed
            .bodies
            .map(|body| body.map_or(Vec::new(), |body| s.path_to(body.index())));
        let common = (paths[0].iter().zip(&paths[1]))
            .take_while(|(a, b)| a == b)
            .count();
        let mut size = 0.0_f64;
        let mut ends = [None, None];
        for k in 0..2 {
            let Some(body) = closed.bodies[k].map(BodyId::index) else {
                continue;
            };
            let frame = s.frames[body].placement * placements[k];
            let path = &paths[k][common..];
            // From joint to joint, and to the closure; where both sides meet, the two together.
            for &link in path.iter().skip(1) {
                size = size.max(s.links[link].placement.translation.length());
            }
            size = size.max(frame.translation.length());
            ends[k] = Some(End {
                body,
                frame,
                path: (path.iter().rev())
                    .map(|&link| (link, slot_of(s, &bodies, link)))
                    .collect(),
            });
        }
        let base = [0, 1].map(|k| match paths[k].get(common) {
            Some(&link) => s.links[link].placement.translation,
            None if closed.bodies[k].is_none() => placements[k].translation,
            // The body carries the other one: its closure's frame is on the common body.
            None => ends[k]
                .as_ref()
                .map_or(Vec3::ZERO, |end| end.frame.translation),
        });
        size = size.max((base[1] - base[0]).length());
        if let vertebra_assembly::Closure::Distance { length } = closed.closure {
            size = size.max(length / unit);
        }
        let equations = equation::equations(&closed.closure, unit);
        Self {
            name: closed.name.clone(),
            rows: 0..equations.len(),
            dofs: dofs_of(s, &bodies),
            bodies,
            start: 0,
            kind: Kind::Loop(Box::new(Closing {
                ends,
                placements,
                equations,
                size: if size > 0.0 { size } else { 1.0 },
            })),
        }
    }

    fn of_coupling(coupling: Coupling, model: &Model, s: &Sweeps<f64>) -> Self {
        let pair = [coupling.body, coupling.other].map(BodyId::index);
        let units = pair.map(|body| match model.bodies()[body].joint.kind {
            JointKind::Prismatic { .. } => model.units().length,
            _ => 1.0,
        });
        let bodies = bodies_of(s, pair.map(Some));
        let slots = pair.map(|body| slot_of(s, &bodies, body));
        Self {
            rows: 0..1,
            dofs: dofs_of(s, &bodies),
            bodies,
            start: 0,
            kind: Kind::Coupling {
                positions: pair.map(|body| s.links[body].q),
                entries: [
                    (slots[0], 1.0),
                    (slots[1], -coupling.ratio * units[1] / units[0]),
                ],
                unit: units[0],
                ratio: coupling.ratio,
                offset: coupling.offset,
                value: 0.0,
            },
            name: coupling.name,
        }
    }

    /// Takes the coordinates of coupled joints, in SI.
    pub(super) fn read_positions(&mut self, q: &[f64]) {
        if let Kind::Coupling {
            positions: [own, other],
            unit,
            ratio,
            offset,
            value,
            ..
        } = &mut self.kind
        {
            *value = (q[*own] - *ratio * q[*other] - *offset) / *unit;
        }
    }

    /// The row of a coupling.
    pub(super) fn coupled(&self) -> Option<[usize; 1]> {
        matches!(self.kind, Kind::Coupling { .. }).then_some([self.rows.start])
    }

    /// The freedom of the joint that a coupling makes follow.
    pub(super) fn first_dof(&self) -> usize {
        match self.kind {
            Kind::Coupling { entries, .. } => self.dofs[entries[0].0],
            Kind::Loop(_) => self.dofs.first().copied().unwrap_or(0),
        }
    }

    /// What a row's values are measured by.
    pub(crate) fn size_of(&self, row: usize) -> f64 {
        match &self.kind {
            Kind::Loop(closing) if closing.equations[row - self.rows.start].is_length() => {
                closing.size
            }
            _ => 1.0,
        }
    }

    /// Where a row's entries are.
    pub(super) fn entries(&self, row: usize) -> Range<usize> {
        let start = self.start + (row - self.rows.start) * self.dofs.len();
        start..start + self.dofs.len()
    }

    /// A row of J or Y, one entry for each of the constraint's freedoms.
    pub(super) fn row<'a>(&self, row: usize, values: &'a [f64]) -> &'a [f64] {
        &values[self.entries(row)]
    }

    /// The product of a row with a vector over all freedoms.
    pub(super) fn times(&self, row: usize, values: &[f64], vector: &[f64]) -> f64 {
        let terms = self.row(row, values).iter().zip(&self.dofs);
        terms.map(|(&entry, &dof)| entry * vector[dof]).sum()
    }

    /// Adds a multiple of a row to a vector over all freedoms.
    pub(super) fn add(&self, row: usize, values: &[f64], factor: f64, vector: &mut [f64]) {
        for (&dof, &entry) in self.dofs.iter().zip(self.row(row, values)) {
            vector[dof] += factor * entry;
        }
    }

    pub(super) fn evaluate(
        &self,
        s: &Sweeps<f64>,
        accelerating: bool,
        values: &mut [f64],
        wrenches: &mut [Force<f64>],
        second_rates: &mut [f64],
        jacobian: &mut [f64],
    ) {
        let first = self.rows.start;
        let Closing {
            ends,
            placements,
            equations,
            ..
        } = match &self.kind {
            Kind::Coupling { entries, value, .. } => {
                let row = &mut jacobian[self.entries(first)];
                row.fill(0.0);
                for &(slot, entry) in entries {
                    row[slot] = entry;
                }
                values[first] = *value;
                // Linear: the second rate is that of the accelerations themselves.
                second_rates[first] = (entries.iter())
                    .map(|&(slot, entry)| entry * s.u[self.dofs[slot]])
                    .sum();
                return;
            }
            Kind::Loop(closing) => &**closing,
        };
        let sides = [0, 1].map(|k| side(s, ends[k].as_ref(), &placements[k], accelerating));
        let [(a, arm_a), (b, arm_b)] = &sides;
        // The second origin seen from each body's own.
        let reach = b.placement.translation - a.placement.translation;
        let arms = [*arm_a + reach, *arm_b];
        for (row, equation) in self.rows.clone().zip(equations) {
            let evaluated = equation.evaluate(a, b);
            values[row] = evaluated.value;
            wrenches[row] = evaluated.wrench;
            second_rates[row] = evaluated.second_rate;
            let entries = &mut jacobian[self.entries(row)];
            entries.fill(0.0);
            for ((end, arm), sign) in ends.iter().zip(arms).zip([-1.0, 1.0]) {
                let Some(end) = end else { continue };
                let mut f = evaluated.wrench.shifted_back(arm) * sign;
                for &(body, slot) in &end.path {
                    let columns = &s.subspace[s.dofs(body)];
                    for (entry, column) in entries[slot..].iter_mut().zip(columns) {
                        *entry += column.dot(f);
                    }
                    f = f.shifted_back(s.offset[body]);
                }
            }
        }
    }

    /// Where a loop's force acts: body, point in the body's frame in the model's lengths, and sign.
    pub(super) fn points(&self, s: &Sweeps<f64>) -> impl Iterator<Item = (BodyId, Vec3<f64>, f64)> {
        let points = match &self.kind {
            Kind::Loop(closing) => closing.points(s),
            Kind::Coupling { .. } => [None, None],
        };
        points.into_iter().flatten()
    }
}

impl Closing {
    fn points(&self, s: &Sweeps<f64>) -> [Option<(BodyId, Vec3<f64>, f64)>; 2] {
        let sides = [0, 1].map(|k| side(s, self.ends[k].as_ref(), &self.placements[k], false));
        let [(a, arm_a), (b, arm_b)] = &sides;
        let reach = b.placement.translation - a.placement.translation;
        let arms = [*arm_a + reach, *arm_b];
        [0, 1].map(|k| {
            let body = self.ends[k].as_ref()?.body;
            let in_joint_frame = s.rotation[body].transpose_mul(arms[k]);
            let point = s.frames[body].placement.inverse().point(in_joint_frame);
            #[expect(
                clippy::cast_possible_truncation,
                reason = "models have no more than u32::MAX bodies"
            )]
            let id = BodyId(body as u32);
            Some((id, point, [-1.0, 1.0][k]))
        })
    }
}

/// A side's frame, its origin seen from that of the innermost body that carries both sides, and its arm from the
/// body's own origin.
fn side(
    s: &Sweeps<f64>,
    end: Option<&End>,
    placement: &Transform<f64>,
    accelerating: bool,
) -> (Moving, Vec3<f64>) {
    let Some(end) = end else {
        return (Moving::fixed(*placement), Vec3::ZERO);
    };
    let arm = s.rotation[end.body] * end.frame.translation;
    let mut origin = arm;
    for &(body, _) in &end.path {
        origin += s.offset[body];
    }
    let mut moving = Moving::fixed(Transform {
        rotation: s.rotation[end.body] * end.frame.rotation,
        translation: origin,
    });
    if accelerating {
        let (velocity, acceleration) = seen_at(s, end.body, arm);
        moving.spin = velocity.angular;
        moving.velocity = velocity.linear;
        moving.turning = acceleration.angular;
        moving.acceleration = acceleration.linear;
    }
    (moving, arm)
}

/// Bodies and all that carry them, parents first.
fn bodies_of(s: &Sweeps<f64>, bodies: [Option<usize>; 2]) -> Vec<usize> {
    let mut all: Vec<usize> = bodies
        .into_iter()
        .flatten()
        .flat_map(|body| s.path_to(body))
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn dofs_of(s: &Sweeps<f64>, bodies: &[usize]) -> Vec<usize> {
    bodies.iter().flat_map(|&body| s.dofs(body)).collect()
}

/// The place of a body's first freedom in a row.
fn slot_of(s: &Sweeps<f64>, bodies: &[usize], body: usize) -> usize {
    let before = bodies.iter().take_while(|&&other| other < body);
    before.map(|&other| s.links[other].kind.dof_count()).sum()
}
