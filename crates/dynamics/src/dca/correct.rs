//! Iterative refinement: a correction of a solution by what it [leaves](super::balance) of the bodies' own
//! equations.
//!
//! The same equations, linear in what is missing, give the correction: of bodies at rest, on which the loads r act
//! and in whose joints accelerations jump by j. The factors of the solution serve once more, so that a correction is
//! one sweep of vectors up and down. What it changes of the accelerations and of the forces on the chunks' ends is added.

use super::balance::{Equations, Share};
use super::chunk::Own;
use super::interior::Freedom;
use super::plan::{ChunkPlan, Inboard, Outboard, Part, Plan, Raked};
use super::rake::Rake;
use super::solution::{Acting, Driving};
use super::split::{Divide, Fault, Outcome, PARALLEL_BODIES, Slots, divide, for_each};
use super::tree::{Descent, Rakes, Tree};
use crate::own::OwnInertia;
use crate::refine::Loads;
use vertebra_spatial::matrix6::add_scaled;
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Memory of the corrections, one entry a slot unless it says otherwise.
#[derive(Clone, Debug)]
pub(super) struct Corrections<T> {
    /// e of each body, about its joint's origin.
    pub(super) jumps: Vec<Motion<T>>,
    /// Of each chunk what the halves of the cut bodies at its ends [take](super::halves) from the others.
    pub(super) evening: Vec<[Force<T>; 2]>,
    /// Loads of a [substitution](super::substitute), about the handle points; none before the first.
    pub(super) loads: Vec<Force<T>>,
    /// What responds: accelerations, and one entry a freedom. On the way up the solution.
    accelerations: Vec<Motion<T>>,
    pub(super) qdd: Vec<T>,
}

impl<T: Real> Corrections<T> {
    pub(super) fn new(plan: &Plan<T>) -> Self {
        Self {
            jumps: vec![Motion::ZERO; plan.len()],
            evening: vec![[Force::ZERO; 2]; plan.chunks.len()],
            loads: Vec::new(),
            accelerations: vec![Motion::ZERO; plan.len()],
            qdd: vec![T::ZERO; plan.model_dofs.len()],
        }
    }
}

/// Where loads come from.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    /// The equations of the bodies.
    Equations(Loads, Acting<'a>),
    /// Those in [`Corrections`], without jumps.
    Given,
}

impl<T: Real, L: Real> Tree<T, L> {
    /// Corrects the solution once, or finds the response to other loads; gives the residual before.
    pub(super) fn correct(
        &mut self,
        loads: Loads,
        acting: Acting<'_>,
        threads: bool,
    ) -> Result<f64, Fault> {
        let mut own =
            (self.corrections.take()).unwrap_or_else(|| Corrections::new(&self.plan).into());
        match loads {
            Loads::Left | Loads::Settled => self.even(&mut own),
            Loads::Rounding => own.evening.fill([Force::ZERO; 2]),
        }
        let source = Source::Equations(loads, acting);
        let residual = self.sweep(&mut own, source, threads);
        if residual.is_ok() && loads != Loads::Rounding {
            self.keep_ends(Some(&own.evening));
            for (a, &change) in self.chunks.accelerations.iter_mut().zip(&own.accelerations) {
                *a += change;
            }
            for (qdd, &change) in self.chunks.qdd.iter_mut().zip(&own.qdd) {
                *qdd += change;
            }
        }
        self.corrections = Some(own);
        residual
    }

    /// By how much the last correction changed the freedoms, in the order of the slots.
    pub(super) fn changes(&self) -> &[T] {
        self.corrections.as_ref().map_or(&[], |own| &own.qdd)
    }

    /// Up and down: leaves in `own` what loads and jumps move, and gives the largest of what they are of any equation's
    /// terms.
    pub(super) fn sweep(
        &mut self,
        own: &mut Corrections<T>,
        source: Source<'_>,
        threads: bool,
    ) -> Result<f64, Fault> {
        let parallel = threads && self.plan.len() >= PARALLEL_BODIES;
        self.exchange(own);
        let mut residual = f64::DONE;
        for round in 0..self.plan.schedule.round_count() {
            self.sum_again(round, parallel);
            residual = residual.and(self.assemble_again(round, own, source, parallel));
            self.join_again(round, parallel);
        }
        let descent = Descent {
            base: Motion::ZERO,
            jumps: Some(&own.jumps),
        };
        let descended = self.descend(&descent, parallel);
        self.exchange(own);
        descended.map(|()| residual)
    }

    /// Exchanges the accelerations in the chunks with those in `own`.
    fn exchange(&mut self, own: &mut Corrections<T>) {
        core::mem::swap(&mut self.chunks.accelerations, &mut own.accelerations);
        core::mem::swap(&mut self.chunks.qdd, &mut own.qdd);
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
            sum.bias = rakes.at_rest(a) + rakes.at_rest(b);
        });
    }

    /// Up: the biases of the chunks of a round; gives the largest part of any equation's terms that is left.
    fn assemble_again(
        &mut self,
        round: usize,
        own: &mut Corrections<T>,
        source: Source<'_>,
        parallel: bool,
    ) -> f64 {
        let range = self.plan.schedule.chunks_in(round);
        let (plan, places) = (&self.plan, &self.places);
        let start = &plan.extents[range.start];
        let (before, share) = self.chunks.share().divide(start);
        let given = Given {
            rakes: Rakes {
                plan,
                places,
                chunks: before.rakes,
                joins: &self.joins,
                sums: &self.sums,
            },
            added: &self.added,
        };
        let Corrections {
            jumps,
            evening,
            loads,
            accelerations,
            qdd,
        } = own;
        let (loads_kind, acting) = match source {
            Source::Equations(loads, acting) => (loads, acting),
            Source::Given => {
                return divide(parallel, &plan.extents, range, share, &|chunk, own| {
                    let jumps = &jumps[plan.slots_of(chunk)];
                    given.assemble(chunk, own, jumps, |share| match share {
                        Share::Body(slot) => loads[slot],
                        Share::Beyond(_) => Force::ZERO,
                    });
                    f64::DONE
                });
            }
        };
        let (before, forces) = self.wrenches.split_at_mut(start.slot);
        let equations = Equations {
            plan,
            places,
            base: self.base,
            loads: loads_kind,
            driving: Driving {
                plan,
                columns: &places.columns,
                own: OwnInertia {
                    diagonal: &self.added,
                    across: &self.across,
                },
                qdd,
                acting,
            },
            accelerations,
            evening,
            ends: &self.ends,
            before,
        };
        let share = (share, (Slots(forces), Slots(&mut jumps[start.slot..])));
        divide(parallel, &plan.extents, range, share, &|chunk, share| {
            let (own, (forces, jumps)) = share;
            let mut balance = equations.balance(chunk, jumps.0, forces.0);
            given.assemble(chunk, own, balance.jumps, |share| balance.load(share));
            balance.worst
        })
    }

    /// Up: the biases of the joins of a round.
    fn join_again(&mut self, round: usize, parallel: bool) {
        let plan = &self.plan;
        let range = plan.schedule.joins_in(round);
        let (before, own) = self.joins.split_at_mut(range.start);
        let nodes = &self.chunks.nodes;
        let ends = |part: Part| match part {
            Part::Chunk(chunk) => nodes[plan.extents[chunk].node].free(),
            Part::Join(join) => before[join].node.free(),
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
    #[inline(always)]
    fn bias(&self, raked: Raked, jump: Motion<T>) -> Force<T> {
        self.at_rest(raked) + self.inertial(raked, jump)
    }

    /// The force that holds the handle.
    #[inline(always)]
    fn at_rest(&self, raked: Raked) -> Force<T> {
        match raked {
            Raked::Chunk { rake, .. } => self.chunks[rake].bias,
            Raked::Join { join, head } => {
                let (node, r) = (&self.joins[join].node, self.places.bodies[head].offset);
                Force::from_array(node.b1.map(L::cast)).shifted_back(r)
            }
            Raked::Sum(sum) => self.sums[sum].bias,
        }
    }

    /// The force that accelerates it by `jump` if nothing else acts.
    #[inline(always)]
    pub(super) fn inertial(&self, raked: Raked, jump: Motion<T>) -> Force<T> {
        match raked {
            Raked::Chunk { rake, .. } => self.chunks[rake].inertia.mul(jump),
            Raked::Join { join, head } => {
                let (node, r) = (&self.joins[join].node, self.places.bodies[head].offset);
                let jump = jump.shifted(r).to_array().map(T::cast);
                Force::from_array(node.phi11.mul(&jump).map(L::cast)).shifted_back(r)
            }
            Raked::Sum(sum) => self.sums[sum].inertia.mul(jump),
        }
    }
}

/// What the chunks read on the way up.
struct Given<'a, T, L> {
    rakes: Rakes<'a, T, L>,
    added: &'a [T],
}

impl<T: Real, L: Real> Given<'_, T, L> {
    /// The bias force of a body's share, rakes included, about its handle point. Side branches hang
    /// from the body's acceleration without its jump, which therefore moves them.
    #[inline(always)]
    fn bias(&self, slot: usize, jump: Motion<T>, share: f64, load: Force<T>) -> Force<T> {
        let mut bias = -load;
        let rakes = &self.rakes.plan.rakes[slot];
        if rakes[0].is_some() {
            let jump = jump.shifted(self.rakes.places.bodies[slot].arm);
            let share = T::from_f64(share);
            for &raked in rakes.iter().flatten() {
                bias += self.rakes.bias(raked, jump) * share;
            }
        }
        bias
    }

    /// [`chunk::assemble`](super::chunk::assemble) of biases alone, with the factors it left. `load` is asked
    /// from the tip inwards.
    #[inline(always)]
    fn assemble(
        &self,
        chunk: usize,
        own: Own<'_, T>,
        jumps: &[Motion<T>],
        mut load: impl FnMut(Share) -> Force<T>,
    ) {
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

        let mut bias = Force::ZERO;
        let mut drift = [T::ZERO; 6];
        let mut leaf = Force::ZERO;
        for slot in slots.rev() {
            let placed = &places[slot];
            let share = if slot == last { last_share } else { 1.0 };
            let own_bias = self.bias(slot, jumps[slot - first], share, load(Share::Body(slot)));
            if slot == last && outboard == Outboard::Leaf {
                leaf = own_bias;
                continue;
            }
            bias += own_bias;
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
            // Side branches hang from the inboard half.
            bias += self.bias(cut, Motion::ZERO, 0.5, load(Share::Beyond(cut)));
            inverse.bias = inverse.own.mul(&bias.to_array());
            ends[0] = inverse.own.transpose_mul(&inverse.bias).map(|x| -x);
            add_scaled(
                &mut ends[1],
                &inverse.far.transpose_mul(&inverse.bias),
                -T::ONE,
            );
        }
        if let Some(kept) = own.leaves.first_mut() {
            let inverse = &mut kept.body;
            inverse.bias = inverse.own.mul(&leaf.to_array());
            let beyond = [&inverse.far, &inverse.own]
                .map(|side| side.transpose_mul(&inverse.bias).map(|x| -x));
            ends = kept
                .joined
                .rejoin_across(!inner, &mut kept.seam, ends, beyond);
        }
        if let Some(kept) = own.rakes.first_mut() {
            kept.bias = Force::from_array(ends[0]).shifted_back(places[first].offset);
        }
        if let Some(kept) = own.nodes.first_mut() {
            let jump = jumps[last - first].shifted(places[last].arm);
            add_scaled(&mut ends[1], &jump.to_array(), T::ONE);
            [kept.b1, kept.b2] = ends;
        }
    }
}

/// [`Interior::let_go`](super::interior::Interior::let_go) of a bias force, about the joint's origin, and
/// of the tip's acceleration, where no joint force acts and nothing moves.
#[inline(always)]
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
