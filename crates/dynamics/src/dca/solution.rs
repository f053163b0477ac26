//! What a solved tree says of its bodies: accelerations, and the forces that the joints transmit.

use super::place::Places;
use super::plan::{Plan, Raked};
use super::split::{PARALLEL_BODIES, Slots, divide};
use super::tree::Tree;
use crate::Forces;
use crate::drive::transmitted;
use crate::link::Scales;
use crate::own::OwnInertia;
use crate::residual::Solution;
use vertebra_spatial::{Force, Motion, Number, Real, Vec3};

/// The forces that are given, and the factors to the model's units.
pub(super) type Acting<'a> = (&'a Forces, &'a Scales);

impl<T: Real, L: Real> Tree<T, L> {
    /// Acceleration of a body's joint's origin, gravity taken off.
    pub(super) fn acceleration(&self, body: usize) -> Motion<T> {
        self.chunks.accelerations[self.plan.slots[body] as usize]
    }

    /// Force that a body's joint transmits to it, about the joint's origin.
    pub(super) fn wrench(&self, body: usize) -> Force<T> {
        self.wrenches[self.plan.slots[body] as usize]
    }

    /// Computes the transmitted forces of the solution from the tips of every chunk inwards, so that no sum is
    /// longer than one: of each body's inertia and bias, what its rakes and the next body take, and what
    /// acts on the chunk's tip. What rounding leaves of them along a joint's freedoms is taken out,
    /// as the articulated-body algorithm does.
    pub(super) fn transmit(&mut self, acting: Acting<'_>, threads: bool) {
        let parallel = threads && self.plan.len() >= PARALLEL_BODIES;
        let mut wrenches = core::mem::take(&mut self.wrenches);
        let driving = Driving {
            plan: &self.plan,
            columns: &self.places.columns,
            own: OwnInertia {
                diagonal: &self.added,
                across: &self.across,
            },
            qdd: &self.chunks.qdd,
            acting,
        };
        for round in 0..self.plan.schedule.round_count() {
            let range = self.plan.schedule.chunks_in(round);
            let start = self.plan.extents[range.start].slot;
            let (before, own) = wrenches.split_at_mut(start);
            divide(
                parallel,
                &self.plan.extents,
                range,
                Slots(own),
                &|chunk, own: Slots<'_, _>| {
                    self.transmit_chunk(chunk, &driving, before, own.0);
                },
            );
        }
        self.wrenches = wrenches;
    }

    fn transmit_chunk(
        &self,
        chunk: usize,
        driving: &Driving<'_, T>,
        before: &[Force<T>],
        own: &mut [Force<T>],
    ) {
        let slots = self.plan.slots_of(chunk);
        let (first, last) = (slots.start, slots.end - 1);
        for slot in slots.rev() {
            let placed = &self.places.bodies[slot];
            let a = self.chunks.accelerations[slot];
            let mut f = placed.inertia.mul(placed.handle_acceleration(a)) - placed.external;
            for &raked in self.plan.rakes[slot].iter().flatten() {
                f += taken(&self.plan, &self.places, before, raked);
            }
            if slot == last {
                f = f * T::from_f64(self.plan.chunks[chunk].last_share) - self.ends[chunk][1];
            } else {
                let next = self.places.bodies[slot + 1].offset;
                f += own[slot + 1 - first].shifted_back(next);
            }
            if self.plan.at_center[slot] {
                f = f.shifted_back(placed.arm);
            }
            own[slot - first] = driving.along_freedoms(slot, f);
        }
    }

    /// All that [`residual`](crate::residual) asks for.
    pub(super) fn solution(&self) -> Solution<T::Wide> {
        let bodies = 0..self.plan.len();
        let mut qdd = vec![T::Wide::ZERO; self.chunks.qdd.len()];
        for (slot, link) in self.plan.links.iter().enumerate() {
            let own = &self.chunks.qdd[self.plan.dofs_of(slot)];
            for (qdd, own) in qdd[link.v..].iter_mut().zip(own) {
                *qdd = own.widen();
            }
        }
        Solution {
            a: bodies
                .clone()
                .map(|body| self.acceleration(body).map(T::widen))
                .collect(),
            f: bodies.map(|body| self.wrench(body).map(T::widen)).collect(),
            qdd,
        }
    }
}

/// What paths raked onto a body take of its force, about its handle point, given the transmitted forces of their heads.
pub(super) fn taken<T: Real>(
    plan: &Plan<T>,
    places: &Places<T>,
    wrenches: &[Force<T>],
    raked: Raked,
) -> Force<T> {
    match raked {
        Raked::Chunk { head, .. } | Raked::Join { head, .. } => {
            wrenches[head].shifted_back(places.bodies[head].offset)
        }
        // Sums of sums are as deep as a logarithm.
        Raked::Sum(sum) => {
            let [a, b] = plan.sums[sum];
            taken(plan, places, wrenches, a) + taken(plan, places, wrenches, b)
        }
    }
}

/// What a joint adds to the acceleration of the body before it, but for velocities.
#[inline(always)]
pub(super) fn across<T: Real>(
    plan: &Plan<T>,
    columns: &[Motion<T>],
    qdd: &[T],
    slot: usize,
) -> Motion<T> {
    let dofs = plan.dofs_of(slot);
    let freedoms = columns[dofs.clone()].iter().zip(&qdd[dofs]);
    freedoms.fold(Motion::ZERO, |sum, (&column, &qdd)| sum + column * qdd)
}

/// What drives the freedoms.
pub(super) struct Driving<'a, T> {
    pub(super) plan: &'a Plan<T>,
    /// Motion subspaces.
    pub(super) columns: &'a [Motion<T>],
    /// Inertia of the freedoms' own.
    pub(super) own: OwnInertia<'a, T>,
    pub(super) qdd: &'a [T],
    pub(super) acting: Acting<'a>,
}

impl<T: Real> Driving<'_, T> {
    /// The joint force given along a freedom of a slot's joint.
    #[inline(always)]
    fn given(&self, slot: usize, freedom: usize) -> T {
        let (forces, scales) = self.acting;
        let given = self.plan.links[slot].v + freedom;
        T::from_f64(forces.joint[given] / scales.force[given])
    }

    /// What a force has along a hinge too much: the joint force drives it, but for what its own inertia takes.
    #[inline(always)]
    pub(super) fn hinge_excess(&self, slot: usize, f: Force<T>) -> Vec3<T> {
        let dof = self.plan.dofs[slot] as usize;
        let axis = self.columns[dof].angular;
        let tau = self.given(slot, 0) - self.own.diagonal[dof] * self.qdd[dof];
        axis * (axis.dot(f.angular) - tau)
    }

    /// Replaces the part of a force along a joint's freedoms by what drives them.
    pub(super) fn along_freedoms(&self, slot: usize, f: Force<T>) -> Force<T> {
        let dofs = self.plan.dofs_of(slot);
        let columns = &self.columns[dofs.clone()];
        let mut tau = [T::ZERO; 6];
        for (k, tau) in tau.iter_mut().enumerate().take(columns.len()) {
            *tau = self.given(slot, k);
        }
        let held = self.own.of(dofs.clone()).mul(&self.qdd[dofs]);
        for (tau, held) in tau.iter_mut().zip(held) {
            *tau -= held;
        }
        transmitted(f, columns, &tau)
    }
}
