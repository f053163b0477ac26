//! What a solution leaves of the bodies' own equations, chunk by chunk from the tips inwards.
//!
//! Accelerations a and transmitted forces f of the bodies and joint accelerations qdd leave, of the equations of a body
//! and its joint,
//!
//! r = external + f - I a - sum over children of X' f_child,   j = X a_before + c + S qdd - a.
//!
//! Taken as residuals of joint forces, r would grow with the condition of the mass matrix, up to n^4 on chains. But any f
//! near those of the solution will do, since how far off they are is in r. The solution knows the forces on the ends of each
//! chunk; from its tip inwards f is what balances the body, so that of r there is left what S'f = tau then takes out, and
//! what the outboard half of a cut body is off balance by, at which the sum ends and of which the inboard half
//! [takes](super::halves) a half.
//!
//! j is rounding where a chunk went from body to body, and the error of the joins where it starts at a cut body or ends
//! with a leaf, or where bodies have been moved since. It is taken out first: e = X e_before + j from e = 0 where the chunk
//! hangs makes a + e match across all of its joints. r is that of a + e, while f balances a: moved along with the error of the
//! joins it would be a residual of joint forces. What then responds has no jump left inside, so that nothing need be kept of the inertias
//! between the joints, and what the joins have got wrong is taken out as it is, not through factors that have lost
//! its digits: where f32 has none left of 8 decades of masses, corrections converge nonetheless. What hangs from a body with its old
//! a (side branches, the outboard half of a cut body) sees its e as a jump of the handle.

use super::place::Places;
use super::plan::{ChunkPlan, Inboard, Outboard, Plan};
use super::solution::{Driving, across, taken};
use super::split::Outcome;
use crate::link::Kind;
use crate::refine::{Loads, Size};
use vertebra_spatial::{Force, Motion, Real};

/// A body's share in a chunk.
#[derive(Clone, Copy, Debug)]
pub(super) enum Share {
    /// All of a slot's body; if it is cut, its inboard half.
    Body(usize),
    /// The outboard half of the cut body that the chunk starts at.
    Beyond(usize),
}

/// The equations of the bodies, and the solution that is put into them.
pub(super) struct Equations<'a, T> {
    pub(super) plan: &'a Plan<T>,
    pub(super) places: &'a Places<T>,
    /// Acceleration of the world.
    pub(super) base: Motion<T>,
    /// What becomes of them.
    pub(super) loads: Loads,
    pub(super) driving: Driving<'a, T>,
    pub(super) accelerations: &'a [Motion<T>],
    /// What [halves](super::halves) of cut bodies take from each other.
    pub(super) evening: &'a [[Force<T>; 2]],
    /// Forces on the chunks' ends.
    pub(super) ends: &'a [[Force<T>; 2]],
    /// Transmitted forces of the chunks of earlier rounds.
    pub(super) before: &'a [Force<T>],
}

/// The equations of a chunk, which are gone through from its tip inwards.
pub(super) struct Balance<'a, T> {
    equations: &'a Equations<'a, T>,
    chunk: usize,
    first: usize,
    last: usize,
    /// e of its bodies, and whether any is not zero.
    pub(super) jumps: &'a [Motion<T>],
    moved: bool,
    /// Transmitted forces of its bodies.
    forces: &'a mut [Force<T>],
    /// The force that the next body takes, about the handle point of the one before.
    taken: Force<T>,
    /// The largest part of the terms of an equation that is left.
    pub(super) worst: f64,
}

impl<'a, T: Real> Equations<'a, T> {
    /// Finds e of a chunk's bodies, for its equations to be gone through.
    pub(super) fn balance(
        &'a self,
        chunk: usize,
        jumps: &'a mut [Motion<T>],
        forces: &'a mut [Force<T>],
    ) -> Balance<'a, T> {
        let slots = self.plan.slots_of(chunk);
        let ChunkPlan {
            inboard, outboard, ..
        } = self.plan.chunks[chunk];
        let seam = matches!(inboard, Inboard::Cut(_)) || outboard == Outboard::Leaf;
        let worst = if seam || self.loads == Loads::Settled {
            self.jumps(chunk, jumps)
        } else {
            f64::DONE
        };
        let moved = match self.loads {
            Loads::Left => seam,
            Loads::Settled => true,
            Loads::Rounding => false,
        };
        if !moved {
            jumps.fill(Motion::ZERO);
        }
        Balance {
            equations: self,
            chunk,
            first: slots.start,
            last: slots.end - 1,
            jumps,
            moved,
            forces,
            taken: Force::ZERO,
            worst,
        }
    }

    /// e of a chunk's bodies; gives the largest part of any term of a match that j is.
    fn jumps(&self, chunk: usize, jumps: &mut [Motion<T>]) -> f64 {
        let slots = self.plan.slots_of(chunk);
        let ends = (slots.start, slots.end - 1);
        let mut jump = Motion::ZERO;
        let mut worst = f64::DONE;
        for (slot, kept) in slots.zip(jumps) {
            if slot > ends.0 {
                jump = jump.shifted(self.places.bodies[slot].offset);
            }
            if let Some(above) = self.above_a_seam(chunk, slot, ends) {
                let (own, part) = self.jump(slot, above);
                worst = worst.and(part);
                jump += own;
            }
            *kept = jump;
        }
        worst
    }

    /// The acceleration that a body's joint hangs from, seen at the joint, if the joins have put the two
    /// together and not the chunk itself, or the bodies have been moved since.
    #[inline(always)]
    fn above_a_seam(
        &self,
        chunk: usize,
        slot: usize,
        (first, last): (usize, usize),
    ) -> Option<Motion<T>> {
        let (plan, places) = (&self.plan, &self.places.bodies);
        let settled = self.loads == Loads::Settled;
        let solved = self.accelerations;
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

    /// j, and the largest part of its terms that it is, the acceleration of gravity among them.
    fn jump(&self, slot: usize, above: Motion<T>) -> (Motion<T>, f64) {
        let a = self.accelerations[slot];
        let carried = above + self.places.bodies[slot].bias_acceleration;
        let size = Size::of_motion(a).or(Size::of_motion(carried));
        let matched = carried + across(self.plan, &self.places.columns, self.driving.qdd, slot);
        let jump = matched - a;
        let size = size
            .or(Size::of_motion(matched))
            .or(Size::of_motion(self.base));
        (jump, size.left(Size::of_motion(jump)))
    }
}

impl<T: Real> Balance<'_, T> {
    /// The load that a share of a body is left with, about its handle point.
    #[inline(always)]
    pub(super) fn load(&mut self, share: Share) -> Force<T> {
        match share {
            Share::Body(slot) => self.body(slot),
            Share::Beyond(cut) => self.beyond(cut),
        }
    }

    #[inline(always)]
    fn body(&mut self, slot: usize) -> Force<T> {
        let Equations {
            plan,
            places,
            driving,
            ..
        } = self.equations;
        let placed = &places.bodies[slot];
        let centered = plan.at_center[slot];
        let (mut a, mut jump) = (
            self.equations.accelerations[slot],
            self.jumps[slot - self.first],
        );
        if centered {
            a = placed.handle_acceleration(a);
            jump = jump.shifted(placed.arm);
        }
        let mut inertial = placed.inertia.mul(a);
        let mut external = placed.external;
        for &raked in plan.rakes[slot].iter().flatten() {
            external -= taken(plan, places, self.equations.before, raked);
        }
        let mut moved = Force::ZERO;
        if self.moved {
            moved = placed.inertia.mul(jump);
        }
        if slot == self.last {
            let share = T::from_f64(plan.chunks[self.chunk].last_share);
            let [_, tip] = self.equations.ends[self.chunk];
            (inertial, moved) = (inertial * share, moved * share);
            external = external * share + tip;
        }
        let mut balanced = inertial - external + self.taken;
        if centered {
            balanced = balanced.shifted_back(placed.arm);
        }
        let mut f = balanced;
        match plan.links[slot].kind {
            Kind::Revolute => f.angular -= driving.hinge_excess(slot, f),
            _ => f = driving.along_freedoms(slot, f),
        }
        let mut rest = f - balanced;
        if centered {
            rest = rest.shifted_back(-placed.arm);
        }
        rest -= moved;
        let mut size =
            (Size::of_force(f).or(Size::of_force(external))).or(Size::of_force(inertial));
        // What the next body takes may be all there is.
        let beside = size.or_weight(plan.least_forces[slot]);
        self.worst = self.worst.and(beside.leaving(rest));
        if self.equations.loads == Loads::Rounding {
            size = size.or(Size::of_force(self.taken));
            rest = size.or(Size::of_turning(&placed.inertia, a)).rounding(slot);
        }
        if slot == self.last {
            rest += self.equations.evening[self.chunk][1];
        }
        self.forces[slot - self.first] = f;
        self.taken = f.shifted_back(placed.offset);
        rest
    }

    fn beyond(&mut self, cut: usize) -> Force<T> {
        let Equations { plan, places, .. } = self.equations;
        let placed = &places.bodies[cut];
        let a = placed.handle_acceleration(self.equations.accelerations[cut]);
        let mut half = placed.inertia.mul(a) - placed.external;
        for &raked in plan.rakes[cut].iter().flatten() {
            half += taken(plan, places, self.equations.before, raked);
        }
        half = half * T::HALF;
        let [end, _] = self.equations.ends[self.chunk];
        let rest = end - half - self.taken;
        let size = (Size::of_force(end).or(Size::of_force(half))).or(Size::of_force(self.taken));
        let size = size.or_weight(plan.least_forces[cut]);
        self.worst = self.worst.and(size.left(Size::of_force(rest)));
        match self.equations.loads {
            Loads::Left | Loads::Settled => rest + self.equations.evening[self.chunk][0],
            Loads::Rounding => Force::ZERO,
        }
    }
}
