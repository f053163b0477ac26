//! What a solved tree says of its bodies: accelerations, and the forces that the joints transmit.

use super::plan::Raked;
use super::split::{PARALLEL_BODIES, Slots, divide};
use super::tree::Tree;
use crate::Forces;
use crate::drive::transmitted;
use crate::link::Scales;
use crate::own::OwnInertia;
use crate::residual::Solution;
use vertebra_spatial::{Force, Motion, Number, Real};

/// What acts on the bodies.
pub(super) enum Acting<'a, T> {
    /// All there is.
    All(&'a Forces, &'a Scales),
    /// In a [correction](super::correct) loads alone, which have jumps of the accelerations in them
    /// already; at rest.
    Loads {
        loads: &'a [Force<T>],
        jumps: &'a [Motion<T>],
    },
}

impl<T: Real, L: Real> Tree<T, L> {
    /// Acceleration of a body's joint's origin, gravity taken off.
    pub(super) fn acceleration(&self, body: usize) -> Motion<T> {
        self.chunks.accelerations[self.plan.slots[body] as usize]
    }

    /// Force that a body's joint transmits to it, about the joint's origin.
    pub(super) fn wrench(&self, body: usize) -> Force<T> {
        self.wrenches[self.plan.slots[body] as usize]
    }

    /// Computes the transmitted forces of the solution.
    pub(super) fn transmit(&mut self, forces: &Forces, scales: &Scales, threads: bool) {
        let parallel = threads && self.plan.len() >= PARALLEL_BODIES;
        let mut wrenches = core::mem::take(&mut self.wrenches);
        self.transmit_into(&mut wrenches, &Acting::All(forces, scales), parallel);
        self.wrenches = wrenches;
    }

    /// Computes transmitted forces from the tips of every chunk inwards, so that no sum is longer
    /// than one: of each body's inertia and bias, what its rakes and the next body take, and what
    /// acts on the chunk's tip. What rounding leaves of them along a joint's freedoms is taken out,
    /// as the articulated-body algorithm does.
    pub(super) fn transmit_into(
        &self,
        wrenches: &mut [Force<T>],
        acting: &Acting<'_, T>,
        parallel: bool,
    ) {
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
                    self.transmit_chunk(chunk, acting, before, own.0);
                },
            );
        }
    }

    fn transmit_chunk(
        &self,
        chunk: usize,
        acting: &Acting<'_, T>,
        before: &[Force<T>],
        own: &mut [Force<T>],
    ) {
        let slots = self.plan.slots_of(chunk);
        let (first, last) = (slots.start, slots.end - 1);
        for slot in slots.rev() {
            let placed = &self.places.bodies[slot];
            let a = self.chunks.accelerations[slot];
            let mut f = match acting {
                Acting::All(..) => {
                    placed.inertia.mul(placed.handle_acceleration(a)) - placed.external
                }
                Acting::Loads { loads, jumps } => {
                    let response = (a - jumps[slot]).shifted(placed.arm);
                    placed.inertia.mul(response) - loads[slot]
                }
            };
            for &raked in self.plan.rakes[slot].iter().flatten() {
                f += self.taken(before, raked);
            }
            if slot == last {
                f = f * T::from_f64(self.plan.chunks[chunk].last_share);
                f -= self.tip_force(chunk);
            } else {
                let next = self.places.bodies[slot + 1].offset;
                f += own[slot + 1 - first].shifted_back(next);
            }
            if self.plan.at_center[slot] {
                f = f.shifted_back(placed.arm);
            }
            own[slot - first] = self.along_freedoms(slot, f, acting);
        }
    }

    /// What paths raked onto a body take of its force, about its handle point.
    pub(super) fn taken(&self, wrenches: &[Force<T>], raked: Raked) -> Force<T> {
        match raked {
            Raked::Chunk { head, .. } | Raked::Join { head, .. } => {
                wrenches[head].shifted_back(self.places.bodies[head].offset)
            }
            // Sums of sums are as deep as a logarithm.
            Raked::Sum(sum) => {
                let [a, b] = self.plan.sums[sum];
                self.taken(wrenches, a) + self.taken(wrenches, b)
            }
        }
    }

    /// Replaces the part of a force along a joint's freedoms by the joint force.
    pub(super) fn along_freedoms(
        &self,
        slot: usize,
        f: Force<T>,
        acting: &Acting<'_, T>,
    ) -> Force<T> {
        let dofs = self.plan.dofs_of(slot);
        let columns = &self.places.columns[dofs.clone()];
        let mut tau = [T::ZERO; 6];
        if let Acting::All(forces, scales) = acting {
            let first = self.plan.links[slot].v;
            for (k, tau) in tau.iter_mut().enumerate().take(columns.len()) {
                *tau = T::from_f64(forces.joint[first + k] / scales.force[first + k]);
            }
        }
        let own = OwnInertia {
            diagonal: &self.added,
            across: &self.across,
        };
        let held = own.of(dofs.clone()).mul(&self.chunks.qdd[dofs]);
        for (tau, held) in tau.iter_mut().zip(held) {
            *tau -= held;
        }
        transmitted(f, columns, &tau)
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
