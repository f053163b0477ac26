//! What a solved tree says of its bodies: accelerations, and the forces that the joints transmit.

use super::plan::Raked;
use super::tree::Tree;
use crate::Forces;
use crate::drive::transmitted;
use crate::link::Scales;
use crate::residual::Solution;
use vertebra_spatial::{Force, Motion, Number, Real};

impl<T: Real, L: Real> Tree<T, L> {
    /// Acceleration of a body's joint's origin, gravity taken off.
    pub(super) fn acceleration(&self, body: usize) -> Motion<T> {
        self.chunks.accelerations[self.plan.slots[body] as usize]
    }

    /// Force that a body's joint transmits to it, about the joint's origin.
    pub(super) fn wrench(&self, body: usize) -> Force<T> {
        self.wrenches[self.plan.slots[body] as usize]
    }

    /// Computes the transmitted forces from the tips of every chunk inwards, so that no sum is
    /// longer than one: of each body's inertia and bias, what its rakes and the next body take, and
    /// what acts on the chunk's tip. What rounding leaves of them along a joint's freedoms is taken
    /// out, as the articulated-body algorithm does.
    pub(super) fn transmit(&mut self, forces: &Forces, scales: &Scales) {
        for chunk in 0..self.plan.chunks.len() {
            let slots = self.plan.slots_of(chunk);
            let last = slots.end - 1;
            for slot in slots.rev() {
                let placed = &self.places.bodies[slot];
                let a = placed.handle_acceleration(self.chunks.accelerations[slot]);
                let mut f = placed.inertia.mul(a) - placed.external;
                for raked in self.plan.rakes[slot].into_iter().flatten() {
                    f += self.taken(raked);
                }
                if slot == last {
                    f = f * T::from_f64(self.plan.chunks[chunk].last_share);
                    f -= self.tip_force(chunk);
                } else {
                    let next = self.places.bodies[slot + 1].offset;
                    f += self.wrenches[slot + 1].shifted_back(next);
                }
                self.wrenches[slot] =
                    self.along_freedoms(slot, f.shifted_back(placed.arm), forces, scales);
            }
        }
    }

    /// What paths raked onto a body take of its force, about its handle point.
    fn taken(&self, raked: Raked) -> Force<T> {
        match raked {
            Raked::Chunk { head, .. } | Raked::Join { head, .. } => {
                self.wrenches[head].shifted_back(self.places.bodies[head].offset)
            }
            // Sums of sums are as deep as a logarithm.
            Raked::Sum(sum) => {
                let [a, b] = self.plan.sums[sum];
                self.taken(a) + self.taken(b)
            }
        }
    }

    /// Replaces the part of a force along a joint's freedoms by the joint force.
    fn along_freedoms(
        &self,
        slot: usize,
        f: Force<T>,
        forces: &Forces,
        scales: &Scales,
    ) -> Force<T> {
        let link = &self.plan.links[slot];
        let columns = &self.places.columns[self.plan.dofs_of(slot)];
        let mut tau = [T::ZERO; 6];
        for (k, tau) in tau.iter_mut().enumerate().take(columns.len()) {
            *tau = T::from_f64(forces.joint[link.v + k] / scales.force[link.v + k]);
        }
        transmitted(link.kind, f, columns, &tau)
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
