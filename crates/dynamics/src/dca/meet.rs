//! The forces where the parts of a path meet.
//!
//! Joins hand out what acts on a path from its ends to its chunks. Where they are in less precision than
//! the chunks, so are the forces f that they find; but how these fit the chunks is known in the precision of the chunks,
//! whose own responses tell what is left between two neighbours A and B of the accelerations where they meet,
//!
//! gap = a2 of A - a1 of B = Phi21 x + b2 - Phi22 f of A - (Phi11 f + Phi12 f2 + b1) of B.
//!
//! Once more through the joins, as vectors up and down, it gives what f lacks: the error of the joins comes in
//! squared, for one product with each matrix of a chunk and of a join.

use super::chunk::Chunks;
use super::plan::{JoinPlan, Part};
use super::split::for_each;
use super::tree::{Descent, JoinState, Tree, acting};
use vertebra_spatial::matrix6::add_scaled;
use vertebra_spatial::{Force, Real};

impl<T: Real, L: Real> Tree<T, L> {
    /// Down: the forces in the paths whose last join is of a round.
    pub(super) fn meet(&mut self, last: usize, descent: &Descent<'_, T>, parallel: bool) {
        let joins = &self.plan.joins;
        if !(self.plan.schedule.joins_in(last)).any(|join| joins[join].last == last) {
            return;
        }
        for round in (0..=last).rev() {
            self.part(last, round, Some(descent), parallel);
        }
        // A correction need not be exact.
        let coarse = L::EPSILON.to_f64() > T::EPSILON.to_f64();
        if coarse && descent.jumps.is_none() {
            self.find_gaps(last, descent, parallel);
            for round in 0..=last {
                self.close(last, round, parallel);
            }
            for round in (0..=last).rev() {
                self.part(last, round, None, parallel);
            }
        }
    }

    /// Down: the forces in the joins of a round; without a descent those that close gaps, which are added.
    fn part(
        &mut self,
        last: usize,
        round: usize,
        descent: Option<&Descent<'_, T>>,
        parallel: bool,
    ) {
        let plan = &self.plan;
        let range = plan.schedule.joins_in(round);
        let (own, later) = self.joins.split_at_mut(range.end);
        let (first_later, start) = (range.end, range.start);
        let (accelerations, places) = (&self.chunks.accelerations, &self.places);
        for_each(parallel, range, &mut own[start..], &|index, state| {
            let JoinPlan { parent, head, .. } = plan.joins[index];
            if plan.joins[index].last != last {
                return;
            }
            let given =
                parent.map(|parent| later[parent.join - first_later].handed(parent.outboard));
            (state.x, state.f2) = given.unwrap_or_else(|| {
                let a = head
                    .zip(descent)
                    .map(|(head, descent)| descent.hanging(head, places, accelerations, 0));
                let x = a.unwrap_or_default().to_array().map(T::cast);
                (x, [L::ZERO; 6])
            });
            state.force = state.joined.force(&state.x, &state.f2);
            let force = Force::from_array(state.force.map(L::cast));
            match descent {
                Some(_) => state.met = force,
                None => state.met += force,
            }
        });
    }

    /// What the forces leave of the accelerations where chunks meet.
    fn find_gaps(&mut self, last: usize, descent: &Descent<'_, T>, parallel: bool) {
        let (plan, places, joins) = (&self.plan, &self.places, &self.joins);
        let Chunks {
            nodes,
            accelerations,
            ..
        } = &self.chunks;
        for_each(parallel, 0..joins.len(), &mut self.gaps, &|index, gap| {
            let join = &plan.joins[index];
            if join.last != last {
                return;
            }
            let [a, b] = join.chunks.map(|chunk| &plan.chunks[chunk]);
            let [f1, f] = acting(joins, a).map(Force::to_array);
            let [_, f2] = acting(joins, b).map(Force::to_array);
            let head = a.head(plan.extents[join.chunks[0]].slot);
            let x = head.map_or(f1, |head| {
                descent.hanging(head, places, accelerations, 0).to_array()
            });
            let [a, b] = join.chunks.map(|chunk| &nodes[plan.extents[chunk].node]);
            let mut left = a.b2;
            add_scaled(&mut left, &a.phi12.transpose_mul(&x), T::ONE);
            add_scaled(&mut left, &a.phi22.mul(&f), T::ONE);
            add_scaled(&mut left, &b.phi11.mul(&f), T::ONE);
            add_scaled(&mut left, &b.phi12.mul(&f2), -T::ONE);
            add_scaled(&mut left, &b.b1, -T::ONE);
            *gap = left.map(T::cast);
        });
    }

    /// Up: the joins of a round, of chunks that answer nothing but the gaps between them.
    fn close(&mut self, last: usize, round: usize, parallel: bool) {
        let plan = &self.plan;
        let range = plan.schedule.joins_in(round);
        let (before, own) = self.joins.split_at_mut(range.start);
        let gaps = &self.gaps;
        let ends = |part: Part| match part {
            Part::Chunk(_) => [[L::ZERO; 6]; 2],
            Part::Join(join) => before[join].node.free(),
        };
        for_each(
            parallel,
            range,
            own,
            &|index, state: &mut JoinState<T, L>| {
                let join = &plan.joins[index];
                if join.last != last {
                    return;
                }
                let (mut a, b) = (ends(join.inboard), ends(join.outboard));
                add_scaled(&mut a[1], &gaps[index], L::ONE);
                let [b1, b2] = state.joined.rejoin(join.head.is_some(), a, b);
                (state.node.b1, state.node.b2) = (b1, b2);
            },
        );
    }
}
