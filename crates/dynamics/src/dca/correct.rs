//! Iterative refinement: a correction of a solution by what it leaves of the bodies' own equations.
//!
//! Accelerations a and transmitted forces f of the bodies and joint accelerations qdd leave, of the equations
//! of a body and its joint,
//!
//! r = external + f - I a - sum over children of X' f_child,   j = X a_before + c + S qdd - a,
//!
//! and S'f = tau to rounding. The same equations, linear in what is missing, give the correction: of
//! bodies at rest, on which the forces r act and in whose joints accelerations jump by j. The factors
//! of the solution serve once more, so that a correction is one sweep of vectors up and down. Taken as
//! residuals of joint forces, r would grow with the condition of the mass matrix, up to n^4 on chains.
//!
//! Any f near those of the solution will do: how far off they are is in r. The solution knows the forces on the ends of each
//! chunk; from its tip inwards f is what balances the body, so that of r the part is left that S'f = tau then takes
//! out, and what the outboard half of a cut body is off balance by, at which the sum ends.
//!
//! The error of the joins is that the halves of a cut body do not accelerate alike: each has the acceleration of its chunk,
//! and g, by which the inboard half's is more, is a jump between the two. So inside a chunk nothing is off but by rounding.
//! There j is rounding too where a chunk went from body to body, and more where it ends with a leaf or bodies have been moved
//! since. It is taken out first: e = X e_before + j from e = 0 where the chunk starts makes a + e match across all of its joints.
//! r is that of a + e, and what then responds has no jump left inside, so that nothing need be kept of the inertias between the joints.
//! What hangs from a body with its old a (side branches, the outboard half of a cut body) sees its e as
//! a jump of the handle. Corrections of a and of the forces on the ends are kept, f is made of them once more.

use super::chunk::Own;
use super::interior::Freedom;
use super::join::Node;
use super::plan::{ChunkPlan, Inboard, Outboard, Part, Plan, Raked};
use super::rake::Rake;
use super::solution::Acting;
use super::split::{Divide, Fault, Inner, Outcome, PARALLEL_BODIES, Slots, divide, for_each};
use super::tree::{Descent, Rakes, Tree};
use crate::link::Kind;
use crate::refine::{Loads, Size};
use vertebra_spatial::matrix6::add_scaled;
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Memory of the corrections, one entry a slot unless it says otherwise.
#[derive(Clone, Debug)]
pub(super) struct Corrections<T> {
    /// e of each body, about its joint's origin.
    pub(super) jumps: Vec<Motion<T>>,
    /// r of each body, of a cut one of its inboard half, about its handle point.
    pub(super) loads: Vec<Force<T>>,
    /// The same of the outboard half, one entry a chunk that starts there.
    pub(super) beyond: Vec<Force<T>>,
    /// g, likewise.
    pub(super) gaps: Vec<Motion<T>>,
    /// Corrections of the accelerations; of the freedoms.
    accelerations: Vec<Motion<T>>,
    pub(super) qdd: Vec<T>,
}

impl<T: Real> Corrections<T> {
    pub(super) fn new(plan: &Plan<T>) -> Self {
        let (bodies, freedoms) = (plan.len(), plan.model_dofs.len());
        let inner = plan.extents[plan.chunks.len()].inner;
        Self {
            jumps: vec![Motion::ZERO; bodies],
            loads: vec![Force::ZERO; bodies],
            beyond: vec![Force::ZERO; inner],
            gaps: vec![Motion::ZERO; inner],
            accelerations: vec![Motion::ZERO; bodies],
            qdd: vec![T::ZERO; freedoms],
        }
    }
}

/// A chunk's own share of what does not match: e of its bodies, g.
type Jumps<'a, T> = (Slots<'a, Motion<T>>, Inner<'a, Motion<T>>);

/// A chunk's own share of what the equations leave: transmitted forces, r of its bodies and of the half it starts at.
type Left<'a, T> = (
    (Slots<'a, Force<T>>, Slots<'a, Force<T>>),
    Inner<'a, Force<T>>,
);

impl<T: Real, L: Real> Tree<T, L> {
    /// Corrects the solution once, or adds the response to other loads; gives the residual before.
    pub(super) fn correct(
        &mut self,
        loads: Loads,
        acting: Acting<'_>,
        threads: bool,
    ) -> Result<f64, Fault> {
        let parallel = threads && self.plan.len() >= PARALLEL_BODIES;
        let mut own =
            (self.corrections.take()).unwrap_or_else(|| Corrections::new(&self.plan).into());
        let corrected = self.correct_in(&mut own, loads, acting, parallel);
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
        acting: Acting<'_>,
        parallel: bool,
    ) -> Result<f64, Fault> {
        let chunks = 0..self.plan.chunks.len();
        let jumps = (Slots(&mut own.jumps), Inner(&mut own.gaps));
        let mismatch = divide(
            parallel,
            &self.plan.extents,
            chunks,
            jumps,
            &|chunk, jumps| self.mismatch(chunk, loads, jumps),
        );
        let residual = mismatch.and(match loads {
            Loads::Left | Loads::Settled => self.measure::<false>(own, acting, parallel),
            Loads::Rounding => self.measure::<true>(own, acting, parallel),
        });
        let descended = self.respond_again(own, parallel);
        self.keep_ends(true);
        self.exchange(own);
        descended?;
        for (a, &change) in self.chunks.accelerations.iter_mut().zip(&own.accelerations) {
            *a += change;
        }
        for (qdd, &change) in self.chunks.qdd.iter_mut().zip(&own.qdd) {
            *qdd += change;
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

    /// e of a chunk's bodies and g; gives the largest part of any term of a match that j is.
    fn mismatch(&self, chunk: usize, loads: Loads, (jumps, gap): Jumps<'_, T>) -> f64 {
        let slots = self.plan.slots_of(chunk);
        let (first, last) = (slots.start, slots.end - 1);
        let settled = loads == Loads::Settled;
        let mut worst = f64::DONE;
        jumps.0.fill(Motion::ZERO);
        gap.0.fill(Motion::ZERO);
        if loads == Loads::Rounding {
            return worst;
        }
        let seam = |slot| {
            let above = self.above_a_seam(chunk, slot, (first, last), settled)?;
            Some(self.jump(slot, above))
        };
        let mut slots = slots.zip(jumps.0);
        if let [gap] = gap.0
            && let Some((slot, _)) = slots.next()
            && let Some((own, part)) = seam(slot)
        {
            *gap = own.shifted(-self.places.bodies[slot].offset);
            worst = part;
        }
        if !settled && self.plan.chunks[chunk].outboard != Outboard::Leaf {
            return worst;
        }
        let mut jump = Motion::ZERO;
        for (slot, kept) in slots {
            if slot > first {
                jump = jump.shifted(self.places.bodies[slot].offset);
            }
            if let Some((own, part)) = seam(slot) {
                worst = worst.and(part);
                jump += own;
            }
            *kept = jump;
        }
        worst
    }

    /// Transmitted forces, and what with them the equations of all bodies leave; gives the largest part of its
    /// terms that it is.
    fn measure<const ROUNDING: bool>(
        &mut self,
        own: &mut Corrections<T>,
        acting: Acting<'_>,
        parallel: bool,
    ) -> f64 {
        let mut wrenches = core::mem::take(&mut self.wrenches);
        let mut residual = f64::DONE;
        for round in 0..self.plan.schedule.round_count() {
            let range = self.plan.schedule.chunks_in(round);
            let start = self.plan.extents[range.start];
            let (before, forces) = wrenches.split_at_mut(start.slot);
            let left = (
                (Slots(forces), Slots(&mut own.loads[start.slot..])),
                Inner(&mut own.beyond[start.inner..]),
            );
            let jumps = (own.jumps.as_slice(), own.gaps.as_slice());
            let worst = divide(parallel, &self.plan.extents, range, left, &|chunk, left| {
                self.balance::<ROUNDING>(chunk, before, jumps, acting, left)
            });
            residual = residual.and(worst);
        }
        self.wrenches = wrenches;
        residual
    }

    /// The same of a chunk.
    fn balance<const ROUNDING: bool>(
        &self,
        chunk: usize,
        before: &[Force<T>],
        (jumps, gaps): (&[Motion<T>], &[Motion<T>]),
        acting: Acting<'_>,
        ((forces, loads), beyond): Left<'_, T>,
    ) -> f64 {
        let (plan, places) = (&self.plan, &self.places.bodies);
        let slots = plan.slots_of(chunk);
        let last = slots.end - 1;
        let [x, tip] = self.ends[chunk];
        let mut worst = f64::DONE;
        // What the next body takes, and the same with the force on the tip.
        let mut taken = Force::ZERO;
        let own = forces.0.iter_mut().zip(loads.0).rev();
        for (slot, (force, load)) in slots.rev().zip(own) {
            let placed = &places[slot];
            let mut a = self.chunks.accelerations[slot] + jumps[slot];
            if plan.at_center[slot] {
                a = placed.handle_acceleration(a);
            }
            let mut inertial = placed.inertia.mul(a);
            let mut external = placed.external;
            for &raked in plan.rakes[slot].iter().flatten() {
                external -= self.taken(before, raked);
            }
            if slot == last {
                let share = T::from_f64(plan.chunks[chunk].last_share);
                (inertial, external) = (inertial * share, external * share + tip);
            }
            let mut balanced = inertial - external + taken;
            if plan.at_center[slot] {
                balanced = balanced.shifted_back(placed.arm);
            }
            let mut f = balanced;
            match plan.links[slot].kind {
                Kind::Revolute => f.angular -= self.hinge_excess(slot, f, acting),
                _ => f = self.along_freedoms(slot, f, acting),
            }
            let rest = f - balanced;
            let mut size =
                (Size::of_force(f).or(Size::of_force(external))).or(Size::of_force(inertial));
            worst = worst.and(size.left(Size::of_force(rest)));
            *load = if ROUNDING {
                size = size.or(Size::of_force(taken));
                size.or(Size::of_turning(&placed.inertia, a)).rounding(slot)
            } else if plan.at_center[slot] {
                rest.shifted_back(-placed.arm)
            } else {
                rest
            };
            *force = f;
            taken = f.shifted_back(placed.offset);
        }
        if let (Inboard::Cut(cut), [beyond]) = (plan.chunks[chunk].inboard, beyond.0) {
            let placed = &places[cut];
            let inboard = placed.handle_acceleration(self.chunks.accelerations[cut]);
            let a = inboard - gaps[plan.extents[chunk].inner];
            let mut half = placed.inertia.mul(a) - placed.external;
            for &raked in plan.rakes[cut].iter().flatten() {
                half += self.taken(before, raked);
            }
            half = half * T::HALF;
            let rest = x - half - taken;
            let size = (Size::of_force(x).or(Size::of_force(half))).or(Size::of_force(taken));
            worst = worst.and(size.left(Size::of_force(rest)));
            *beyond = if ROUNDING { Force::ZERO } else { rest };
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
            let share = T::from_f64(share);
            for &raked in rakes.iter().flatten() {
                bias += self.rakes.bias(raked, jump) * share;
            }
        }
        bias
    }

    /// The same of the outboard half of a cut body. Side branches hang from the inboard half's acceleration.
    fn bias_beyond(&self, inner: usize, cut: usize) -> Force<T> {
        let mut bias = -self.corrections.beyond[inner];
        for &raked in self.rakes.plan.rakes[cut].iter().flatten() {
            bias += self.rakes.bias(raked, -self.corrections.gaps[inner]) * T::HALF;
        }
        bias
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
            bias += self.bias_beyond(plan.extents[chunk].inner, cut);
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
            if inner {
                let gap = self.corrections.gaps[plan.extents[chunk].inner];
                add_scaled(&mut ends[0], &gap.to_array(), -T::ONE);
            }
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
