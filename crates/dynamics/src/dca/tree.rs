//! The sweeps over the rounds of an assembly tree: up, which answers how each part responds, and down,
//! which tells each part what acts on it.

use super::chunk::{self, Chunks, Ends};
use super::correct::Corrections;
use super::join::{Joined, Node, join};
use super::place::Places;
use super::plan::{ChunkPlan, Head, JoinPlan, Part, Plan, Raked};
use super::rake::Rake;
use super::split::{Divide, Fault, PARALLEL_BODIES, divide, for_each};
use crate::Forces;
use crate::across::Given;
use crate::drift::Drift;
use crate::link::Scales;
use crate::own::OwnInertia;
use vertebra_assembly::schedule::Schedule;
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// A join's response, what it keeps, and what acts on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct JoinState<T, L> {
    pub(super) node: Node<L>,
    pub(super) joined: Joined<L>,
    /// f1, or a1 of a path's head.
    pub(super) x: [L; 6],
    pub(super) f2: [L; 6],
    /// The force on the outboard part where the two meet, as the joins have it.
    pub(super) force: [L; 6],
    /// The same of the solution.
    pub(super) met: Force<T>,
}

/// All that a solver over an assembly tree computes, chunks in the precision `T`, joins in `L`.
#[derive(Clone, Debug)]
pub(super) struct Tree<T, L> {
    pub(super) plan: Plan<T>,
    pub(super) places: Places<T>,
    /// -g, the acceleration of a world that replaces gravity.
    pub(super) base: Motion<T>,
    pub(super) chunks: Chunks<T>,
    /// Inertia of the freedoms' own in the order of the slots, and whether any is not zero.
    pub(super) added: Vec<T>,
    pub(super) across: Vec<T>,
    adds: bool,
    /// Forces that the joints transmit, about the joints' origins.
    pub(super) wrenches: Vec<Force<T>>,
    /// Of each chunk the forces f1, if it starts at a cut body, and f2 on its ends.
    pub(super) ends: Vec<[Force<T>; 2]>,
    pub(super) sums: Vec<Rake<T>>,
    pub(super) joins: Vec<JoinState<T, L>>,
    /// What the forces leave of the accelerations where two chunks [meet](super::meet).
    pub(super) gaps: Vec<[L; 6]>,
    /// Memory of the corrections, taken when the first one is asked for.
    pub(super) corrections: Option<Box<Corrections<T>>>,
    pub(super) drift: Option<Box<Drift>>,
}

impl<T: Real, L: Real> Tree<T, L> {
    pub(super) fn new(model: &Model, schedule: Schedule, weights: &[f64]) -> Self {
        let plan = Plan::new(model, schedule, weights);
        let state = JoinState {
            node: Node::ZERO,
            joined: Joined::NONE,
            x: [L::ZERO; 6],
            f2: [L::ZERO; 6],
            force: [L::ZERO; 6],
            met: Force::ZERO,
        };
        let gravity = model.gravity() / model.units().acceleration();
        Self {
            places: Places::new(&plan),
            base: Motion::new(Vec3::ZERO, -Vec3::from_glam(gravity)),
            chunks: Chunks::new(&plan.extents[plan.chunks.len()]),
            added: vec![T::ZERO; plan.model_dofs.len()],
            across: vec![T::ZERO; plan.model_dofs.len()],
            adds: false,
            wrenches: vec![Force::ZERO; plan.len()],
            ends: vec![[Force::ZERO; 2]; plan.chunks.len()],
            sums: vec![Rake::default(); plan.sums.len()],
            joins: vec![state; plan.joins.len()],
            gaps: vec![[L::ZERO; 6]; plan.joins.len()],
            corrections: None,
            drift: None,
            plan,
        }
    }

    /// Forward dynamics.
    pub(super) fn solve(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
        scales: &Scales,
        threads: bool,
    ) -> Result<(), Fault> {
        let parallel = threads && self.plan.len() >= PARALLEL_BODIES;
        let given = Given {
            q: &state.q,
            qd: &state.qd,
            rate_scales: &scales.rate,
            length: model.units().length,
        };
        self.places.set(&self.plan, &given, parallel);
        self.places.push(&self.plan, forces, model.units());
        self.set_added(forces, scales);
        for round in 0..self.plan.schedule.round_count() {
            self.sum(round, parallel);
            self.assemble(round, &forces.joint, &scales.force, parallel)?;
            self.join(round, parallel)?;
        }
        let descent = Descent {
            base: self.base,
            jumps: None,
        };
        self.descend(&descent, parallel)?;
        self.keep_ends(None);
        Ok(())
    }

    /// Takes the inertia of the freedoms' own.
    fn set_added(&mut self, forces: &Forces, scales: &Scales) {
        let adds = !forces.joint_inertia.is_empty();
        if adds || self.adds {
            let own = self.added.iter_mut().zip(&mut self.across);
            for ((own, across), &dof) in own.zip(&self.plan.model_dofs) {
                let dof = dof as usize;
                let scale = scales.inertia(dof);
                *own = T::from_f64(forces.inertia(dof) * scale);
                *across = T::from_f64(forces.inertia_across(dof) * scale);
            }
        }
        self.adds = adds;
    }

    /// Down: forces in the joins and accelerations in the chunks.
    pub(super) fn descend(
        &mut self,
        descent: &Descent<'_, T>,
        parallel: bool,
    ) -> Result<(), Fault> {
        for round in (0..self.plan.schedule.round_count()).rev() {
            self.meet(round, descent, parallel);
            self.respond(round, descent, parallel)?;
        }
        Ok(())
    }

    /// Up: adds the rakes of a round in pairs.
    fn sum(&mut self, round: usize, parallel: bool) {
        let range = self.plan.schedule.sums_in(round);
        let (before, own) = self.sums.split_at_mut(range.start);
        let rakes = Rakes {
            plan: &self.plan,
            places: &self.places,
            chunks: &self.chunks.rakes,
            joins: &self.joins,
            sums: before,
        };
        for_each(parallel, range, own, &|index, sum| {
            let [a, b] = rakes.plan.sums[index];
            *sum = rakes.rake(a);
            sum.add(&rakes.rake(b), T::ONE);
        });
    }

    /// Up: the chunks of a round.
    fn assemble(
        &mut self,
        round: usize,
        tau: &[f64],
        force_scales: &[f64],
        parallel: bool,
    ) -> Result<(), Fault> {
        let range = self.plan.schedule.chunks_in(round);
        let start = &self.plan.extents[range.start];
        let (before, own) = self.chunks.share().divide(start);
        let rakes = Rakes {
            plan: &self.plan,
            places: &self.places,
            chunks: before.rakes,
            joins: &self.joins,
            sums: &self.sums,
        };
        let given = chunk::Given {
            plan: &self.plan,
            places: &self.places,
            tau,
            force_scales,
            own: OwnInertia {
                diagonal: &self.added,
                across: &self.across,
            },
            jumps: None,
        };
        divide(parallel, &self.plan.extents, range, own, &|index, own| {
            chunk::assemble(&given, index, own, |slot| rakes.onto(slot))
        })
    }

    /// Up: the joins of a round.
    fn join(&mut self, round: usize, parallel: bool) -> Result<(), Fault> {
        let plan = &self.plan;
        let range = plan.schedule.joins_in(round);
        let (before, own) = self.joins.split_at_mut(range.start);
        let nodes = &self.chunks.nodes;
        let node = |part: Part| match part {
            Part::Chunk(chunk) => nodes[plan.extents[chunk].node].cast(),
            Part::Join(join) => before[join].node,
        };
        for_each(
            parallel,
            range,
            own,
            &|index, state: &mut JoinState<T, L>| {
                let JoinPlan {
                    inboard,
                    outboard,
                    head,
                    cut,
                    ..
                } = plan.joins[index];
                let joined = join(head.is_some(), &node(inboard), &node(outboard));
                (state.node, state.joined) = joined.ok_or(Fault::Unjoined(cut))?;
                Ok(())
            },
        )
    }

    /// Down: the accelerations in the chunks of a round.
    fn respond(
        &mut self,
        round: usize,
        descent: &Descent<'_, T>,
        parallel: bool,
    ) -> Result<(), Fault> {
        let plan = &self.plan;
        let range = plan.schedule.chunks_in(round);
        let (start, end) = (plan.extents[range.start], plan.extents[range.end]);
        let (_, own) = self.chunks.share().divide(&start);
        let (own, later) = own.divide(&end.beyond(&start));
        let given = chunk::Given {
            plan,
            places: &self.places,
            tau: &[],
            force_scales: &[],
            own: OwnInertia {
                diagonal: &self.added,
                across: &self.across,
            },
            jumps: descent.jumps,
        };
        let joins = &self.joins;
        divide(parallel, &plan.extents, range, own, &|index, own| {
            let chunk = &plan.chunks[index];
            let [f1, f2] = acting(joins, chunk);
            let x = match chunk.head(plan.extents[index].slot) {
                Some(head) => {
                    let a = &later.accelerations;
                    descent.hanging(head, given.places, a, end.slot).to_array()
                }
                None => f1.to_array(),
            };
            let ends = Ends {
                x,
                f2: f2.to_array(),
            };
            chunk::solve(&given, index, own, &ends)
        })
    }
}

impl<T: Real, L: Real> Tree<T, L> {
    /// Keeps what acts on the chunks' ends; of a correction adds it, and what it has [evened](super::halves) before.
    pub(super) fn keep_ends(&mut self, evened: Option<&[[Force<T>; 2]]>) {
        for (chunk, kept) in self.ends.iter_mut().enumerate() {
            let acting = acting(&self.joins, &self.plan.chunks[chunk]);
            match evened {
                None => *kept = acting,
                Some(evened) => {
                    for (k, kept) in kept.iter_mut().enumerate() {
                        *kept += acting[k] + evened[chunk][k];
                    }
                }
            }
        }
    }
}

/// The forces f1 and f2 on the ends of a chunk; what a path's head is given is an acceleration instead.
pub(super) fn acting<T: Real, L>(joins: &[JoinState<T, L>], chunk: &ChunkPlan) -> [Force<T>; 2] {
    let [inboard, outboard] = chunk
        .ends
        .map(|join| join.map_or(Force::ZERO, |join| joins[join].met));
    [inboard, -outboard]
}

impl<T, L: Real> JoinState<T, L> {
    /// x and f2 of its inboard or outboard part.
    pub(super) fn handed(&self, outboard: bool) -> ([L; 6], [L; 6]) {
        if outboard {
            (self.force, self.f2)
        } else {
            (self.x, self.force.map(|f| -f))
        }
    }
}

/// What the way down starts from.
pub(super) struct Descent<'a, T> {
    /// Acceleration of the world.
    pub(super) base: Motion<T>,
    /// Of a correction ([`chunk::Given`]).
    pub(super) jumps: Option<&'a [Motion<T>]>,
}

impl<T: Real> Descent<'_, T> {
    /// The acceleration a1 that a path's head hangs from, given those of the bodies from a slot on.
    pub(super) fn hanging(
        &self,
        head: Head,
        places: &Places<T>,
        accelerations: &[Motion<T>],
        first: usize,
    ) -> Motion<T> {
        let Some(carrier) = head.carrier else {
            return self.base;
        };
        let (placed, a) = (&places.bodies[carrier], accelerations[carrier - first]);
        let handle = match self.jumps {
            Some(_) => a.shifted(placed.arm),
            None => placed.handle_acceleration(a),
        };
        handle.shifted(places.bodies[head.slot].offset)
    }
}

/// What is raked onto bodies, as far as it is known.
pub(super) struct Rakes<'a, T, L> {
    pub(super) plan: &'a Plan<T>,
    pub(super) places: &'a Places<T>,
    pub(super) chunks: &'a [Rake<T>],
    pub(super) joins: &'a [JoinState<T, L>],
    pub(super) sums: &'a [Rake<T>],
}

impl<T: Real, L: Real> Rakes<'_, T, L> {
    fn rake(&self, raked: Raked) -> Rake<T> {
        match raked {
            Raked::Chunk { rake, .. } => self.chunks[rake],
            Raked::Join { join, head } => {
                let head = &self.places.bodies[head];
                Rake::of_node(&self.joins[join].node, head, [T::ZERO; 2])
            }
            Raked::Sum(sum) => self.sums[sum],
        }
    }

    fn onto(&self, slot: usize) -> impl Iterator<Item = Rake<T>> + '_ {
        let rakes = self.plan.rakes[slot];
        rakes.into_iter().flatten().map(|raked| self.rake(raked))
    }
}
