//! Iterative refinement: a correction of a solution by what it leaves of the bodies' own equations.
//!
//! The solution is three sets of numbers, each rounded by itself: accelerations a and transmitted
//! forces f of the bodies, and joint accelerations qdd. They leave, of the equations of a body and its
//! joint,
//!
//! r = external + f - I a - sum over children of X' f_child,   j = X a_before + c + S qdd - a,
//!
//! and S'f = tau to rounding. The same equations, linear in what is missing, give the correction: of
//! bodies at rest, on which the forces r act and in whose joints accelerations jump by j. The factors
//! of the solution serve once more, so that a correction is one sweep of vectors up and down. Taken as
//! residuals of joint forces, r would grow with the condition of the mass matrix, up to n^4 on chains.
//!
//! j is rounding where a chunk went from body to body, and the error of the joins where it starts at a
//! cut body or ends with a leaf. It is taken out first, chunk by chunk: e = X e_before + j from e = 0
//! where the chunk hangs makes a + e match across all of its joints. r is that of a + e, and what then
//! responds has no jump left inside, so that nothing need be kept of the inertias between the joints.
//! What hangs from a body with its old a (side branches, the outboard half of a cut body) sees its e as
//! a jump of the handle.

use super::chunk::Own;
use super::interior::Freedom;
use super::join::Node;
use super::plan::{ChunkPlan, Inboard, Outboard, Part, Plan, Raked};
use super::rake::Rake;
use super::solution::Acting;
use super::split::{Divide, Fault, Outcome, PARALLEL_BODIES, Slots, divide, for_each};
use super::tree::{Descent, Rakes, Tree};
use crate::refine::{Loads, Size};
use vertebra_spatial::matrix6::add_scaled;
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Memory of the corrections, one entry a slot unless it says otherwise.
#[derive(Clone, Debug)]
pub(super) struct Corrections<T> {
    /// e of each body, about its joint's origin.
    pub(super) jumps: Vec<Motion<T>>,
    /// r of each body, about its handle point.
    pub(super) loads: Vec<Force<T>>,
    /// Corrections of the accelerations; of the freedoms.
    accelerations: Vec<Motion<T>>,
    pub(super) qdd: Vec<T>,
    /// Corrections of the transmitted forces.
    wrenches: Vec<Force<T>>,
    /// For each chunk, the slot of the first body beyond its cut body on the path.
    beyond: Vec<Option<usize>>,
}

impl<T: Real> Corrections<T> {
    pub(super) fn new(plan: &Plan<T>) -> Self {
        let mut beyond = vec![None; plan.chunks.len()];
        for (index, chunk) in plan.chunks.iter().enumerate() {
            if let Inboard::Cut(cut) = chunk.inboard {
                // The chunk whose last slot it is.
                let inboard = plan.extents.partition_point(|extent| extent.slot <= cut) - 1;
                beyond[inboard] = Some(plan.extents[index].slot);
            }
        }
        let (bodies, freedoms) = (plan.len(), plan.model_dofs.len());
        Self {
            jumps: vec![Motion::ZERO; bodies],
            loads: vec![Force::ZERO; bodies],
            accelerations: vec![Motion::ZERO; bodies],
            qdd: vec![T::ZERO; freedoms],
            wrenches: vec![Force::ZERO; bodies],
            beyond,
        }
    }
}

/// A chunk's own share of what the equations leave.
type Left<'a, T> = (Slots<'a, Motion<T>>, Slots<'a, Force<T>>);

impl<T: Real, L: Real> Tree<T, L> {
    /// Corrects the solution once, or adds the response to other loads; gives the residual before. The
    /// transmitted forces have to be there.
    pub(super) fn correct(&mut self, loads: Loads, threads: bool) -> Result<f64, Fault> {
        let parallel = threads && self.plan.len() >= PARALLEL_BODIES;
        let mut own =
            (self.corrections.take()).unwrap_or_else(|| Corrections::new(&self.plan).into());
        let corrected = self.correct_in(&mut own, loads, parallel);
        self.corrections = Some(own);
        corrected
    }

    /// By how much the last correction changed the freedoms, in the order of the slots.
    pub(super) fn changes(&self) -> &[T] {
        self.corrections.as_ref().map_or(&[], |own| &own.qdd)
    }

    fn correct_in(
        &mut self,
        own: &mut Corrections<T>,
        loads: Loads,
        parallel: bool,
    ) -> Result<f64, Fault> {
        let left = (Slots(&mut own.jumps), Slots(&mut own.loads));
        let chunks = 0..self.plan.chunks.len();
        let beyond = &own.beyond;
        let residual = divide(
            parallel,
            &self.plan.extents,
            chunks,
            left,
            &|chunk, left| self.measure(chunk, beyond[chunk], loads, left),
        );
        let descended = self.respond_again(own, parallel);
        let acting = Acting::Loads {
            loads: &own.loads,
            jumps: &own.jumps,
        };
        self.transmit_into(&mut own.wrenches, &acting, parallel);
        self.exchange(own);
        descended?;
        for (a, &change) in self.chunks.accelerations.iter_mut().zip(&own.accelerations) {
            *a += change;
        }
        for (qdd, &change) in self.chunks.qdd.iter_mut().zip(&own.qdd) {
            *qdd += change;
        }
        for (f, &change) in self.wrenches.iter_mut().zip(&own.wrenches) {
            *f += change;
        }
        Ok(residual)
    }

    /// Up and down: what loads and jumps move. It is left in the chunks, and the solution that they had in `own`.
    pub(super) fn respond_again(
        &mut self,
        own: &mut Corrections<T>,
        parallel: bool,
    ) -> Result<(), Fault> {
        for round in 0..self.plan.schedule.round_count() {
            self.sum_again(round, parallel);
            self.assemble_again(round, own, parallel);
            self.join_again(round, parallel);
        }
        self.exchange(own);
        let descent = Descent {
            base: Motion::ZERO,
            jumps: Some(&own.jumps),
        };
        self.descend(&descent, parallel)
    }

    /// Exchanges the accelerations in the chunks with those in `own`.
    pub(super) fn exchange(&mut self, own: &mut Corrections<T>) {
        core::mem::swap(&mut self.chunks.accelerations, &mut own.accelerations);
        core::mem::swap(&mut self.chunks.qdd, &mut own.qdd);
    }

    /// What the equations of a chunk's bodies leave; gives the largest part of any term that it is.
    fn measure(
        &self,
        chunk: usize,
        beyond: Option<usize>,
        loads: Loads,
        (jumps_out, loads_out): Left<'_, T>,
    ) -> f64 {
        let (plan, places) = (&self.plan, &self.places.bodies);
        let slots = plan.slots_of(chunk);
        let (first, last) = (slots.start, slots.end - 1);
        let mut jump = Motion::ZERO;
        let mut worst = f64::DONE;
        for (slot, (jump_out, load_out)) in slots.zip(jumps_out.0.iter_mut().zip(loads_out.0)) {
            let placed = &places[slot];
            if slot > first {
                jump = jump.shifted(placed.offset);
            }
            let settled = loads == Loads::Settled;
            if loads != Loads::Rounding
                && let Some(above) = self.above_a_seam(chunk, slot, (first, last), settled)
            {
                let (own, part) = self.jump(slot, above);
                worst = worst.and(part);
                jump += own;
            }
            *jump_out = jump;

            let (mut a, mut f) = (self.chunks.accelerations[slot] + jump, self.wrenches[slot]);
            if plan.at_center[slot] {
                a = placed.handle_acceleration(a);
                f = f.shifted_back(-placed.arm);
            }
            let inertial = placed.inertia.mul(a);
            let mut rest = f + placed.external - inertial;
            let mut size = (Size::of_force(f).or(Size::of_force(placed.external)))
                .or(Size::of_force(inertial));
            let next = if slot == last { beyond } else { Some(slot + 1) };
            if let Some(next) = next {
                let taken = self.wrenches[next].shifted_back(places[next].offset);
                rest -= taken;
                size = size.or(Size::of_force(taken));
            }
            for &raked in plan.rakes[slot].iter().flatten() {
                let taken = self.taken(&self.wrenches, raked);
                rest -= taken;
                size = size.or(Size::of_force(taken));
            }
            worst = worst.and(size.left(Size::of_force(rest)));
            *load_out = match loads {
                Loads::Left | Loads::Settled => rest,
                Loads::Rounding => size.or(Size::of_turning(&placed.inertia, a)).rounding(slot),
            };
        }
        worst
    }

    /// The acceleration that a body's joint hangs from, seen at the joint, if the joins have put the two
    /// together and not the chunk itself, or the bodies have been moved since.
    fn above_a_seam(
        &self,
        chunk: usize,
        slot: usize,
        (first, last): (usize, usize),
        settled: bool,
    ) -> Option<Motion<T>> {
        let (plan, places) = (&self.plan, &self.places.bodies);
        let solved = &self.chunks.accelerations;
        let ChunkPlan {
            inboard, outboard, ..
        } = plan.chunks[chunk];
        let above = match inboard {
            Inboard::Cut(cut) if slot == first => places[cut].handle_acceleration(solved[cut]),
            _ if !settled && (slot != last || outboard != Outboard::Leaf) => return None,
            _ if slot > first => solved[slot - 1],
            Inboard::Carrier(carrier) => places[carrier].handle_acceleration(solved[carrier]),
            _ => return Some(self.base),
        };
        Some(above.shifted(places[slot].offset))
    }

    /// j, and the largest part of its terms that it is.
    fn jump(&self, slot: usize, above: Motion<T>) -> (Motion<T>, f64) {
        let dofs = self.plan.dofs_of(slot);
        let a = self.chunks.accelerations[slot];
        let mut matched = above + self.places.bodies[slot].bias_acceleration;
        let size = Size::of_motion(a).or(Size::of_motion(matched));
        let columns = &self.places.columns[dofs.clone()];
        for (&column, &qdd) in columns.iter().zip(&self.chunks.qdd[dofs]) {
            matched += column * qdd;
        }
        let jump = matched - a;
        let size = size.or(Size::of_motion(matched));
        (jump, size.left(Size::of_motion(jump)))
    }

    /// Up: the biases of the rake sums of a round.
    fn sum_again(&mut self, round: usize, parallel: bool) {
        let range = self.plan.schedule.sums_in(round);
        let (before, own) = self.sums.split_at_mut(range.start);
        let rakes = Rakes {
            plan: &self.plan,
            places: &self.places,
            chunks: &self.chunks.rakes,
            joins: &self.joins,
            sums: before,
        };
        for_each(parallel, range, own, &|index, sum: &mut Rake<T>| {
            let [a, b] = rakes.plan.sums[index];
            sum.bias = rakes.bias(a, Motion::ZERO) + rakes.bias(b, Motion::ZERO);
        });
    }

    /// Up: the biases of the chunks of a round.
    fn assemble_again(&mut self, round: usize, corrections: &Corrections<T>, parallel: bool) {
        let range = self.plan.schedule.chunks_in(round);
        let start = &self.plan.extents[range.start];
        let (before, own) = self.chunks.share().divide(start);
        let given = Given {
            rakes: Rakes {
                plan: &self.plan,
                places: &self.places,
                chunks: before.rakes,
                joins: &self.joins,
                sums: &self.sums,
            },
            corrections,
            added: &self.added,
        };
        divide(parallel, &self.plan.extents, range, own, &|index, own| {
            given.assemble(index, own);
        });
    }

    /// Up: the biases of the joins of a round.
    fn join_again(&mut self, round: usize, parallel: bool) {
        let plan = &self.plan;
        let range = plan.schedule.joins_in(round);
        let (before, own) = self.joins.split_at_mut(range.start);
        let nodes = &self.chunks.nodes;
        let ends = |part: Part| {
            let node: &Node<L> = match part {
                Part::Chunk(chunk) => &nodes[plan.extents[chunk].node],
                Part::Join(join) => &before[join].node,
            };
            [node.b1, node.b2]
        };
        for_each(parallel, range, own, &|index, state| {
            let join = &plan.joins[index];
            let (a, b) = (ends(join.inboard), ends(join.outboard));
            let [b1, b2] = state.joined.rejoin(join.head.is_some(), a, b);
            (state.node.b1, state.node.b2) = (b1, b2);
        });
    }
}

impl<T: Real, L: Real> Rakes<'_, T, L> {
    /// The force that moves what is raked onto a body with the handle of that, which accelerates by
    /// `jump`.
    fn bias(&self, raked: Raked, jump: Motion<T>) -> Force<T> {
        let rake = match raked {
            Raked::Chunk { rake, .. } => &self.chunks[rake],
            Raked::Join { join, head } => {
                let (node, r) = (&self.joins[join].node, self.places.bodies[head].offset);
                let jump = jump.shifted(r).to_array().map(T::cast);
                let mut force = node.phi11.mul(&jump);
                add_scaled(&mut force, &node.b1, L::ONE);
                return Force::from_array(force.map(L::cast)).shifted_back(r);
            }
            Raked::Sum(sum) => &self.sums[sum],
        };
        rake.bias + rake.inertia.mul(jump)
    }
}

/// What the chunks read on the way up.
struct Given<'a, T, L> {
    rakes: Rakes<'a, T, L>,
    corrections: &'a Corrections<T>,
    added: &'a [T],
}

impl<T: Real, L: Real> Given<'_, T, L> {
    /// The bias force of a body's share, rakes included, about its handle point. Side branches hang
    /// from the body's acceleration without its jump, which therefore moves them.
    fn bias(&self, slot: usize, share: f64) -> Force<T> {
        let mut bias = -self.corrections.loads[slot];
        let rakes = &self.rakes.plan.rakes[slot];
        if rakes[0].is_some() {
            let arm = self.rakes.places.bodies[slot].arm;
            let jump = self.corrections.jumps[slot].shifted(arm);
            for &raked in rakes.iter().flatten() {
                bias += self.rakes.bias(raked, jump);
            }
        }
        bias * T::from_f64(share)
    }

    /// The same of the outboard half of a cut body, to which the jump is one of its neighbour.
    fn bias_beyond(&self, slot: usize) -> Force<T> {
        let placed = &self.rakes.places.bodies[slot];
        let jump = self.corrections.jumps[slot].shifted(placed.arm);
        let mut bias = -self.corrections.loads[slot] - placed.inertia.mul(jump);
        for &raked in self.rakes.plan.rakes[slot].iter().flatten() {
            bias += self.rakes.bias(raked, Motion::ZERO);
        }
        bias * T::HALF
    }

    /// [`chunk::assemble`](super::chunk::assemble) of biases alone, with the factors it left.
    fn assemble(&self, chunk: usize, own: Own<'_, T, L>) {
        let (plan, places) = (self.rakes.plan, &self.rakes.places.bodies);
        let ChunkPlan {
            inboard,
            outboard,
            last_share,
            ..
        } = plan.chunks[chunk];
        let slots = plan.slots_of(chunk);
        let (first, last) = (slots.start, slots.end - 1);
        let first_dof = plan.dofs[first] as usize;
        let inner = matches!(inboard, Inboard::Cut(_));
        let is_leaf = outboard == Outboard::Leaf;

        let mut bias = Force::ZERO;
        let mut drift = [T::ZERO; 6];
        for slot in (first..if is_leaf { last } else { slots.end }).rev() {
            let placed = &places[slot];
            let share = if slot == last { last_share } else { 1.0 };
            bias += self.bias(slot, share);
            if plan.at_center[slot] {
                bias = bias.shifted_back(placed.arm);
            }
            let dofs = plan.dofs_of(slot);
            let joint = (
                &self.rakes.places.columns[dofs.clone()],
                &self.added[dofs.clone()],
            );
            let freedoms = &mut own.freedoms[dofs.start - first_dof..dofs.end - first_dof];
            let_go(joint, freedoms, &mut bias, &mut drift);
            if inner || slot > first {
                bias = bias.shifted_back(placed.offset);
            }
        }
        let mut ends = [bias.to_array(), drift];
        if let Inboard::Cut(cut) = inboard
            && let Some(inverse) = own.inner.first_mut()
        {
            bias += self.bias_beyond(cut);
            inverse.bias = inverse.own.mul(&bias.to_array());
            ends[0] = inverse.own.transpose_mul(&inverse.bias).map(|x| -x);
            add_scaled(
                &mut ends[1],
                &inverse.far.transpose_mul(&inverse.bias),
                -T::ONE,
            );
        }
        if let Some(leaf) = own.leaves.first_mut() {
            let inverse = &mut leaf.body;
            inverse.bias = inverse.own.mul(&self.bias(last, last_share).to_array());
            let beyond = [&inverse.far, &inverse.own]
                .map(|side| side.transpose_mul(&inverse.bias).map(|x| -x));
            ends = leaf
                .joined
                .rejoin_across(!inner, &mut leaf.seam, ends, beyond);
        }
        if let Some(kept) = own.rakes.first_mut() {
            kept.bias = Force::from_array(ends[0]).shifted_back(places[first].offset);
        }
        if let Some(kept) = own.nodes.first_mut() {
            let jump = self.corrections.jumps[last].shifted(places[last].arm);
            add_scaled(&mut ends[1], &jump.to_array(), T::ONE);
            [kept.b1, kept.b2] = ends.map(|end| end.map(T::cast));
        }
    }
}

/// [`Interior::let_go`](super::interior::Interior::let_go) of a bias force, about the joint's origin, and
/// of the tip's acceleration, where no joint force acts and nothing moves.
#[inline]
fn let_go<T: Real>(
    (columns, added): (&[Motion<T>], &[T]),
    freedoms: &mut [Freedom<T>],
    bias: &mut Force<T>,
    drift: &mut [T; 6],
) {
    if let ([column], [freedom]) = (columns, &mut *freedoms) {
        freedom.drive = -column.dot(*bias);
        let response = freedom.drive * freedom.pivot[0];
        *bias += freedom.column * response;
        add_scaled(drift, &freedom.tip, response);
        return;
    }
    let mut passed = *bias;
    for k in 0..freedoms.len() {
        // L^-1 u, row by row.
        let mut drive = -columns[k].dot(*bias);
        for l in 0..k {
            drive -= freedoms[k].pivot[l] * freedoms[l].drive;
        }
        drive = drive * freedoms[k].pivot[k];
        freedoms[k].drive = drive;
        passed += freedoms[k].column * drive;
        add_scaled(drift, &freedoms[k].tip, drive);
    }
    // As in the solution, what these let go is exactly nothing, unless they have inertia of their own.
    match columns.len() {
        0 => {}
        _ if added.iter().any(|&own| own != T::ZERO) => {}
        3 => passed.angular = Vec3::ZERO,
        _ => passed = Force::ZERO,
    }
    *bias = passed;
}
