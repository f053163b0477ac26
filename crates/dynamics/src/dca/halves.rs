//! What one half of a cut body takes from the other of what the two are off balance by.
//!
//! [What is left](super::balance) of the equation of a cut body is found at its outboard half. As a load on that half alone it is
//! for the joins to share out, which leaves a rounding of theirs, and a body that is light beside what it
//! transmits feels it: branch tips 1e4 times as heavy ended at 3e-9 after one correction over f32 joins, which with the same load on
//! both halves end at 2e-11. So half of it goes to the inboard half.
//!
//! Between halves that is one more internal force, which need not be exact as long as both have the same, and it is known
//! before the equations are gone through. For the outboard half was in balance where its own chunk has
//! moved it, and is off balance since it is taken to move as the inboard one does, by d more, as the
//! chunk's first joint tells: with M the inertia of that half, what hangs from it included, by -M d. Hence
//!
//! T = M d / 2 on the outboard half, -T on the inboard one.

use super::correct::Corrections;
use super::plan::Inboard;
use super::solution::across;
use super::tree::{Rakes, Tree};
use vertebra_spatial::Real;

impl<T: Real, L: Real> Tree<T, L> {
    /// Finds T and -T at the ends of the chunks, for the solution as it stands.
    pub(super) fn even(&self, own: &mut Corrections<T>) {
        let (plan, places) = (&self.plan, &self.places.bodies);
        let solved = &self.chunks.accelerations;
        let rakes = Rakes {
            plan,
            places: &self.places,
            chunks: &self.chunks.rakes,
            joins: &self.joins,
            sums: &self.sums,
        };
        for (chunk, planned) in plan.chunks.iter().enumerate() {
            let Inboard::Cut(cut) = planned.inboard else {
                continue;
            };
            let first = plan.extents[chunk].slot;
            let (body, next) = (&places[cut], &places[first]);
            let above = body.handle_acceleration(solved[cut]).shifted(next.offset);
            let moved = across(plan, &self.places.columns, &self.chunks.qdd, first);
            let d = above + next.bias_acceleration + moved - solved[first];
            let d = d.shifted(-next.offset);
            let mut force = body.inertia.mul(d);
            for &raked in plan.rakes[cut].iter().flatten() {
                force += rakes.inertial(raked, d);
            }
            // M is half of that.
            let force = force * (T::HALF * T::HALF);
            let inboard = plan.extents.partition_point(|extent| extent.slot <= cut) - 1;
            own.evening[chunk][0] = force;
            own.evening[inboard][1] = -force;
        }
    }
}
