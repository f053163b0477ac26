//! Where the bodies are and how they turn, over the rounds of the assembly tree.
//!
//! Up: every chunk multiplies its joints' rotations, every join those of its parts, so that each
//! part knows how its outboard end is turned and turning as seen from its inboard end. Down: each
//! part is handed the rotation and angular velocity of the body that its inboard end hangs from,
//! and a chunk takes them on to its bodies, with all that the dynamics need of them. With
//! (R, w) those of a part, w in the axes at its inboard end, two parts in a row compose to
//! (R1 R2, w1 + R1 w2).

use super::plan::{ChunkPlan, Extent, Inboard, JoinPlan, Parent, Part, Plan};
use super::split::{Divide, divide, for_each};
use crate::Forces;
use crate::across::Given;
use crate::drift::Drift;
use crate::kinematics::{BLOCK, sines_and_cosines};
use vertebra_assembly::Units;
use vertebra_spatial::{Force, Mat3, Motion, Real, RigidInertia, Vec3};

/// How one end of a part is turned and turns, seen from another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn<T> {
    rotation: Mat3<T>,
    spin: Vec3<T>,
}

impl<T: Real> Turn<T> {
    const NONE: Self = Self {
        rotation: Mat3::IDENTITY,
        spin: Vec3::ZERO,
    };

    /// This one, then the next.
    fn then(&self, next: &Self) -> Self {
        Self {
            rotation: self.rotation * next.rotation,
            spin: self.spin + self.rotation * next.spin,
        }
    }
}

/// A body in the world, all about its handle point in world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<T> {
    /// Joint axes to world axes; on the way up to the axes of the body before.
    pub(super) rotation: Mat3<T>,
    /// Angular velocity.
    pub(super) spin: Vec3<T>,
    /// From the handle point that the joint hangs from to the joint's origin; on the way up in the
    /// axes of the body before.
    pub(super) offset: Vec3<T>,
    /// From the joint's origin to the handle point.
    pub(super) arm: Vec3<T>,
    /// Velocity-product terms c of the acceleration across the joint.
    pub(super) bias_acceleration: Motion<T>,
    /// Rigid inertia.
    pub(super) inertia: RigidInertia<T>,
    /// External force minus velocity-product force.
    pub(super) external: Force<T>,
}

impl<T: Real> Placed<T> {
    /// A body with these joint axes and this offset beyond one that turns with `w`; turning itself with
    /// `spin`, if that is known. Fills the motion subspace in; the terms are those of
    /// [`crate::kinematics`].
    #[inline(always)]
    fn new(
        plan: &Plan<T>,
        slot: usize,
        (w, spin): (Vec3<T>, Option<Vec3<T>>),
        (rotation, offset): (Mat3<T>, Vec3<T>),
        columns: &mut [Motion<T>],
        given: &Given<'_>,
    ) -> Self {
        let link = &plan.links[slot];
        let (joint_velocity, turning_rates) = link.span(&rotation, given, columns);
        let wj = w.cross(joint_velocity.linear);
        let spin = spin.unwrap_or(w + joint_velocity.angular);
        let inertia = link.inertia.rotated(&rotation);
        Self {
            rotation,
            spin,
            offset,
            arm: if plan.at_center[slot] {
                rotation * plan.frames[slot].center
            } else {
                Vec3::ZERO
            },
            bias_acceleration: Motion::new(
                w.cross(joint_velocity.angular),
                w.cross(w.cross(offset)) + wj + wj + turning_rates,
            ),
            external: -inertia.bias(spin),
            inertia,
        }
    }

    /// The velocity-product acceleration of the body's point at `r` from one that has none.
    pub(super) fn centripetal(&self, r: Vec3<T>) -> Motion<T> {
        Motion::new(Vec3::ZERO, self.spin.cross(self.spin.cross(r)))
    }

    /// The acceleration of the handle point, given that of the joint's origin.
    pub(super) fn handle_acceleration(&self, origin: Motion<T>) -> Motion<T> {
        origin.shifted(self.arm) + self.centripetal(self.arm)
    }
}

/// The kinematics of all bodies.
#[derive(Clone, Debug)]
pub(super) struct Places<T> {
    pub(super) bodies: Vec<Placed<T>>,
    /// Motion subspaces, one column a freedom in the order of the slots.
    pub(super) columns: Vec<Motion<T>>,
    /// Across each chunk and each join.
    across_chunks: Vec<Turn<T>>,
    across_joins: Vec<Turn<T>>,
    /// What each join's inboard end hangs from.
    under_joins: Vec<Turn<T>>,
}

impl<T: Real> Places<T> {
    pub(super) fn new(plan: &Plan<T>) -> Self {
        let placed = Placed {
            rotation: Mat3::IDENTITY,
            spin: Vec3::ZERO,
            offset: Vec3::ZERO,
            arm: Vec3::ZERO,
            bias_acceleration: Motion::ZERO,
            inertia: RigidInertia::ZERO,
            external: Force::ZERO,
        };
        let freedoms = plan.dofs[plan.len()] as usize;
        Self {
            bodies: vec![placed; plan.len()],
            columns: vec![Motion::ZERO; freedoms],
            across_chunks: vec![Turn::NONE; plan.chunks.len()],
            across_joins: vec![Turn::NONE; plan.joins.len()],
            under_joins: vec![Turn::NONE; plan.joins.len()],
        }
    }

    /// Computes everything for a state.
    pub(super) fn set(&mut self, plan: &Plan<T>, given: &Given<'_>, parallel: bool) {
        let own = Locals {
            bodies: &mut self.bodies,
            turns: &mut self.across_chunks,
        };
        let chunks = 0..plan.chunks.len();
        divide(parallel, &plan.extents, chunks, own, &|chunk, own| {
            own.turn(plan, chunk, given);
        });
        for round in 0..plan.schedule.round_count() {
            self.compose(plan, round, parallel);
        }
        for round in (0..plan.schedule.round_count()).rev() {
            self.hand_out(plan, round, parallel);
            self.place(plan, round, given, parallel);
        }
    }

    /// Up: the joins of a round.
    fn compose(&mut self, plan: &Plan<T>, round: usize, parallel: bool) {
        let range = plan.schedule.joins_in(round);
        let (before, own) = self.across_joins.split_at_mut(range.start);
        let chunks = &self.across_chunks;
        let across = |part: Part| match part {
            Part::Chunk(chunk) => &chunks[chunk],
            Part::Join(join) => &before[join],
        };
        for_each(parallel, range, own, &|join, turn| {
            let plan = &plan.joins[join];
            *turn = across(plan.inboard).then(across(plan.outboard));
        });
    }

    /// Down: what the joins of a round hang from.
    fn hand_out(&mut self, plan: &Plan<T>, round: usize, parallel: bool) {
        let range = plan.schedule.joins_in(round);
        let (own, later) = self.under_joins.split_at_mut(range.end);
        let (bodies, across) = (&self.bodies, (&self.across_chunks, &self.across_joins));
        let first_later = range.end;
        for_each(
            parallel,
            range.clone(),
            &mut own[range.start..],
            &|join, turn| {
                let JoinPlan { parent, head, .. } = plan.joins[join];
                *turn = match (parent, head) {
                    (Some(parent), _) => {
                        let start = &later[parent.join - first_later];
                        under(plan, parent, start, across)
                    }
                    (None, Some(head)) => carried(bodies, 0, head.carrier),
                    (None, None) => Turn::NONE,
                };
            },
        );
    }

    /// Down: the bodies of a round's chunks.
    fn place(&mut self, plan: &Plan<T>, round: usize, given: &Given<'_>, parallel: bool) {
        let range = plan.schedule.chunks_in(round);
        let (start, end) = (plan.extents[range.start], plan.extents[range.end]);
        let (bodies, later) = self.bodies[start.slot..].split_at_mut(end.slot - start.slot);
        let across = (&self.across_chunks, &self.across_joins);
        let joins = &self.under_joins;
        let own = Globals {
            bodies,
            columns: &mut self.columns[start.dof..end.dof],
        };
        divide(parallel, &plan.extents, range, own, &|chunk, own| {
            let ChunkPlan {
                parent, inboard, ..
            } = plan.chunks[chunk];
            let start = match (parent, inboard) {
                (Some(parent), _) => under(plan, parent, &joins[parent.join], across),
                (None, Inboard::Carrier(slot)) => carried(later, end.slot, Some(slot)),
                (None, _) => Turn::NONE,
            };
            own.place(plan, chunk, start, given);
        });
    }

    /// Takes out what rounding has added up of rotations and angular velocities from joint to joint.
    pub(super) fn settle(
        &mut self,
        plan: &Plan<T>,
        drift: &mut Drift,
        given: &Given<'_>,
        parallel: bool,
    ) {
        let slot = |body: usize| plan.slots[body] as usize;
        let link = |body: usize| &plan.links[slot(body)];
        drift.measure(given, plan.len(), link, |body| {
            let placed = &self.bodies[slot(body)];
            (placed.rotation, placed.spin)
        });
        let own = Globals {
            bodies: &mut self.bodies,
            columns: &mut self.columns,
        };
        let chunks = 0..plan.chunks.len();
        divide(parallel, &plan.extents, chunks, own, &|chunk, own| {
            own.settle(plan, chunk, drift, given);
        });
    }

    /// Adds to the external forces those that are given.
    pub(super) fn push(&mut self, plan: &Plan<T>, forces: &Forces, units: &Units) {
        for (id, wrench) in forces.acting() {
            let slot = plan.slots[id.index()] as usize;
            let body = &mut self.bodies[slot];
            let wrench = plan.frames[slot].wrench_at_joint(body.rotation, wrench, units);
            body.external += wrench.shifted_back(-body.arm);
        }
    }
}

/// What a part hangs from whose parent hangs from `start`: the same, or what is across the part
/// inboard of it.
fn under<T: Real>(
    plan: &Plan<T>,
    parent: Parent,
    start: &Turn<T>,
    (chunks, joins): (&Vec<Turn<T>>, &Vec<Turn<T>>),
) -> Turn<T> {
    if !parent.outboard {
        return *start;
    }
    start.then(match plan.joins[parent.join].inboard {
        Part::Chunk(chunk) => &chunks[chunk],
        Part::Join(join) => &joins[join],
    })
}

/// How a path's carrier is turned, given the bodies from a slot on.
fn carried<T: Real>(bodies: &[Placed<T>], first: usize, carrier: Option<usize>) -> Turn<T> {
    carrier.map_or(Turn::NONE, |slot| Turn {
        rotation: bodies[slot - first].rotation,
        spin: bodies[slot - first].spin,
    })
}

/// A chunk's share on the way up.
struct Locals<'a, T> {
    bodies: &'a mut [Placed<T>],
    turns: &'a mut [Turn<T>],
}

impl<T: Real> Divide for Locals<'_, T> {
    fn divide(self, at: &Extent) -> (Self, Self) {
        let (bodies, more_bodies) = self.bodies.split_at_mut(at.slot);
        let (turns, more_turns) = self.turns.split_at_mut(at.chunk);
        let own = Self { bodies, turns };
        let rest = Self {
            bodies: more_bodies,
            turns: more_turns,
        };
        (own, rest)
    }
}

impl<T: Real> Locals<'_, T> {
    /// The rotations of a chunk's joints, and across all of them.
    fn turn(self, plan: &Plan<T>, chunk: usize, given: &Given<'_>) {
        let links = &plan.links[plan.slots_of(chunk)];
        let mut across = Turn::NONE;
        let mut turns = [(T::ZERO, T::ZERO); BLOCK];
        for (bodies, links) in self.bodies.chunks_mut(BLOCK).zip(links.chunks(BLOCK)) {
            sines_and_cosines(links, given.q, &mut turns);
            for ((body, link), &turn) in bodies.iter_mut().zip(links).zip(&turns) {
                let local = link.local(given, turn);
                (body.rotation, body.offset) = (local.rotation, local.translation);
                across = across.then(&Turn {
                    rotation: local.rotation,
                    spin: local.rotation * link.turning(given),
                });
            }
        }
        if let Some(turn) = self.turns.first_mut() {
            *turn = across;
        }
    }
}

/// A chunk's share on the way down.
struct Globals<'a, T> {
    bodies: &'a mut [Placed<T>],
    columns: &'a mut [Motion<T>],
}

impl<T: Real> Divide for Globals<'_, T> {
    fn divide(self, at: &Extent) -> (Self, Self) {
        let (bodies, more_bodies) = self.bodies.split_at_mut(at.slot);
        let (columns, more_columns) = self.columns.split_at_mut(at.dof);
        let own = Self { bodies, columns };
        let rest = Self {
            bodies: more_bodies,
            columns: more_columns,
        };
        (own, rest)
    }
}

impl<T: Real> Globals<'_, T> {
    /// The bodies of a chunk that hangs from `start`.
    fn place(self, plan: &Plan<T>, chunk: usize, start: Turn<T>, given: &Given<'_>) {
        let slots = plan.slots_of(chunk);
        let (mut parent, mut w) = (start.rotation, start.spin);
        let mut columns = self.columns;
        for (body, slot) in self.bodies.iter_mut().zip(slots) {
            let rotation = parent * body.rotation;
            let offset = parent * body.offset;
            let own = next(&mut columns, plan, slot);
            *body = Placed::new(plan, slot, (w, None), (rotation, offset), own, given);
            (parent, w) = (rotation, body.spin);
        }
    }

    /// The bodies of a chunk where they are without drift.
    fn settle(self, plan: &Plan<T>, chunk: usize, drift: &Drift, given: &Given<'_>) {
        let mut columns = self.columns;
        for (body, slot) in self.bodies.iter_mut().zip(plan.slots_of(chunk)) {
            let link = &plan.links[slot];
            let (parent, w) = drift.settled(link.parent);
            let (rotation, spin) = drift.settled(Some(plan.bodies[slot] as usize));
            let offset = parent * link.displacement(given);
            let own = next(&mut columns, plan, slot);
            *body = Placed::new(plan, slot, (w, Some(spin)), (rotation, offset), own, given);
        }
    }
}

/// Takes a slot's own columns off the first of those that are left.
fn next<'a, T: Real>(
    columns: &mut &'a mut [Motion<T>],
    plan: &Plan<T>,
    slot: usize,
) -> &'a mut [Motion<T>] {
    let (own, rest) = core::mem::take(columns).split_at_mut(plan.links[slot].kind.dof_count());
    *columns = rest;
    own
}
