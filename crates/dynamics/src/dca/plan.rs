//! What of an assembly tree does not change: places in memory, roles of the bodies, constants.
//!
//! Bodies are kept chunk by chunk in **slots**, in the order of the schedule's chunks, so that every
//! chunk, and every round of them, owns one run of each array. Each body's data refer to its
//! **handle point**: its joint's origin, or its centre of mass where it is cut or a leaf. The
//! constants of the joints beyond are shifted accordingly once and for all.

use super::leaf::outboard;
use crate::balance::least_forces;
use crate::link::{BodyFrame, Link};
use vertebra_assembly::schedule::{Node, NodeId, Schedule};
use vertebra_assembly::{Body, Model};
use vertebra_spatial::{Real, SmallCholesky, Sym3};

/// How a chunk ends outboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outboard {
    /// With a light tail: nothing beyond.
    Free,
    /// With the inboard half of a cut body, which the recursion starts from.
    Half,
    /// With the inboard half of a cut body or a heavy tail as a leaf of its own, joined to what the
    /// recursion has gathered: for bodies so heavy that a recursion through the light ones inboard
    /// of them would lose these.
    Leaf,
}

/// Where the arrays of a chunk start.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Extent {
    pub(crate) chunk: usize,
    pub(crate) slot: usize,
    pub(crate) dof: usize,
    /// Chunks that start at a cut body.
    pub(crate) inner: usize,
    /// Chunks that end with a leaf.
    pub(crate) leaf: usize,
    /// Chunks that are joined to others.
    pub(crate) node: usize,
    /// Chunks that are a whole path raked onto a body.
    pub(crate) rake: usize,
}

impl Extent {
    /// From `start` to here.
    pub(crate) const fn beyond(&self, start: &Self) -> Self {
        Self {
            chunk: self.chunk - start.chunk,
            slot: self.slot - start.slot,
            dof: self.dof - start.dof,
            inner: self.inner - start.inner,
            leaf: self.leaf - start.leaf,
            node: self.node - start.node,
            rake: self.rake - start.rake,
        }
    }
}

/// What a path starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Inboard {
    /// The world.
    World,
    /// Another path's body, by its slot.
    Carrier(usize),
    /// The outboard half of the path's own cut body, by its slot.
    Cut(usize),
}

/// The join that a part becomes part of, and on which side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parent {
    pub(crate) join: usize,
    pub(crate) outboard: bool,
}

/// One chunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChunkPlan {
    pub(crate) inboard: Inboard,
    pub(crate) outboard: Outboard,
    /// Share of its last body: 1/2 if it is cut.
    pub(crate) last_share: f64,
    /// None for a path of a single chunk.
    pub(crate) parent: Option<Parent>,
    /// The joins where its inboard and its outboard end meet another chunk, if they do.
    pub(crate) ends: [Option<usize>; 2],
}

impl ChunkPlan {
    /// Whether it starts at a cut body.
    pub(crate) const fn is_inner(&self) -> bool {
        matches!(self.inboard, Inboard::Cut(_))
    }

    /// Where its path starts, if that is here: at the slot `first`.
    pub(crate) const fn head(&self, first: usize) -> Option<Head> {
        let carrier = match self.inboard {
            Inboard::Cut(_) => return None,
            Inboard::Carrier(slot) => Some(slot),
            Inboard::World => None,
        };
        Some(Head {
            slot: first,
            carrier,
        })
    }
}

/// A part of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Chunk(usize),
    Join(usize),
}

/// Where a path starts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Head {
    /// Slot of its first body.
    pub(crate) slot: usize,
    /// Slot of the body that carries it; none for the world.
    pub(crate) carrier: Option<usize>,
}

/// One join.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JoinPlan {
    pub(crate) inboard: Part,
    pub(crate) outboard: Part,
    /// Where the path starts, if this part does: the join is then of the head's form.
    pub(crate) head: Option<Head>,
    pub(crate) parent: Option<Parent>,
    /// The round of its path's last join.
    pub(crate) last: usize,
    /// The chunks that meet here.
    pub(crate) chunks: [usize; 2],
    /// The cut body's slot.
    pub(crate) cut: usize,
}

/// What is raked onto a body.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Raked {
    /// A path of one chunk, by its entry among the chunks of that kind, and its head's slot.
    Chunk { rake: usize, head: usize },
    /// A path of several, by its join and its head's slot.
    Join { join: usize, head: usize },
    /// A sum of two.
    Sum(usize),
}

/// The constant part of a solver over an assembly tree.
#[derive(Clone, Debug)]
pub(crate) struct Plan<T> {
    pub(crate) schedule: Schedule,
    /// Body of each slot, and slot of each body.
    pub(crate) bodies: Vec<u32>,
    pub(crate) slots: Vec<u32>,
    pub(crate) links: Vec<Link<T>>,
    pub(crate) frames: Vec<BodyFrame<T>>,
    /// Whether a slot's handle point is its centre of mass.
    pub(crate) at_center: Vec<bool>,
    /// By no less than these what is left of each slot's equations is measured.
    pub(crate) least_forces: Vec<T>,
    /// Start of each slot's freedoms, one entry more than slots.
    pub(crate) dofs: Vec<u32>,
    /// Each freedom's place in the model's order.
    pub(crate) model_dofs: Vec<u32>,
    pub(crate) chunks: Vec<ChunkPlan>,
    /// One entry more than chunks.
    pub(crate) extents: Vec<Extent>,
    pub(crate) joins: Vec<JoinPlan>,
    /// What is raked onto each slot's body: at most two.
    pub(crate) rakes: Vec<[Option<Raked>; 2]>,
    /// The parts of each rake sum.
    pub(crate) sums: Vec<[Raked; 2]>,
}

/// The weights of the bodies: their masses, but none for those whose inertia has no inverse in this
/// precision (points, lines).
pub(crate) fn weights(model: &Model, epsilon: f64) -> Vec<f64> {
    let weight = |body: &Body| {
        let central = Sym3::<f64>::from_glam(body.mass.inertia);
        let m = central.to_mat3();
        let mut d = [[0.0; 6]; 6];
        for (j, column) in [m.x_axis, m.y_axis, m.z_axis].into_iter().enumerate() {
            for (row, entry) in d.iter_mut().zip(column.to_array()) {
                row[j] = entry;
            }
        }
        let floor = 64.0 * epsilon * central.trace();
        let invertible = SmallCholesky::factor(3, &d, &[floor; 6]).is_ok();
        if invertible { body.mass.mass } else { 0.0 }
    };
    model.bodies().iter().map(weight).collect()
}

/// The weights by which bodies are chosen to be cut, from their [`weights`] m and from what side branches
/// carry: sqrt(m (m + side)).
///
/// A body that heavy branches hang from is best cut: inside a chunk their inertia comes out at both
/// ends, beside the light bodies there. But a light body under heavy branches is heavy in some
/// directions only, and its half is no good end, none at all where the ratio has more digits than the
/// tree (`docs/accuracy.md` compares the choices). What a joint of d freedoms passes on of the inertia
/// beyond is taken as 1 - d/6 of it; the path is assumed to go on with the largest subtree.
pub(crate) fn cut_weights(model: &Model, weights: &[f64], epsilon: f64) -> Vec<f64> {
    #[derive(Clone, Copy, Default)]
    struct Children {
        bodies: usize,
        passed: f64,
        largest: usize,
        passed_by_largest: f64,
    }
    let mut children = vec![Children::default(); weights.len()];
    let mut cuts = vec![0.0; weights.len()];
    for (index, body) in model.bodies().iter().enumerate().rev() {
        let below = children[index];
        let (own, side) = (weights[index], below.passed - below.passed_by_largest);
        let side = if side * 16.0 * epsilon > own {
            0.0
        } else {
            side.max(0.0)
        };
        cuts[index] = (own * (own + side)).sqrt();
        if let Some(parent) = body.parent {
            let freedoms = u32::try_from(body.dof_range().len()).unwrap_or(6);
            let kept = 1.0 - f64::from(freedoms) / 6.0;
            let passed = (body.mass.mass + below.passed) * kept;
            let above = &mut children[parent.index()];
            let bodies = below.bodies + 1;
            above.bodies += bodies;
            above.passed += passed;
            if bodies >= above.largest {
                above.largest = bodies;
                above.passed_by_largest = passed;
            }
        }
    }
    cuts
}

impl<T: Real> Plan<T> {
    pub(crate) fn new(model: &Model, schedule: Schedule, weights: &[f64]) -> Self {
        let order = schedule.order();
        let mut bodies = Vec::with_capacity(order.len());
        for chunk in schedule.chunks() {
            bodies.extend(order[chunk.joints()].iter().map(|body| body.0));
        }
        let mut slots = vec![0; bodies.len()];
        for (slot, &body) in (0..).zip(&bodies) {
            slots[body as usize] = slot;
        }
        let least = least_forces(model);
        let least_forces = bodies.iter().map(|&body| T::from_f64(least[body as usize]));
        let least_forces = least_forces.collect();
        let mut plan = Self {
            bodies,
            slots,
            links: Vec::new(),
            frames: Vec::new(),
            at_center: vec![false; order.len()],
            least_forces,
            dofs: vec![0],
            model_dofs: Vec::new(),
            chunks: Vec::new(),
            extents: vec![Extent::default()],
            joins: Vec::new(),
            rakes: Vec::new(),
            sums: Vec::new(),
            schedule,
        };
        plan.place_chunks(model, weights);
        plan.place_joins();
        plan.place_rakes();
        plan.place_links(model);
        plan
    }

    /// Number of slots.
    pub(crate) fn len(&self) -> usize {
        self.bodies.len()
    }

    /// The slots of a chunk.
    pub(crate) fn slots_of(&self, chunk: usize) -> core::ops::Range<usize> {
        self.extents[chunk].slot..self.extents[chunk + 1].slot
    }

    /// The freedoms of a slot.
    pub(crate) fn dofs_of(&self, slot: usize) -> core::ops::Range<usize> {
        self.dofs[slot] as usize..self.dofs[slot + 1] as usize
    }

    fn slot_of(&self, body: vertebra_assembly::BodyId) -> usize {
        self.slots[body.index()] as usize
    }

    fn place_chunks(&mut self, model: &Model, weights: &[f64]) {
        let schedule = &self.schedule;
        let order = schedule.order();
        let mut carriers = vec![None; order.len()];
        for path in schedule.paths() {
            carriers[path.bodies().start] = path.carrier;
        }
        let mut at = 0;
        for chunk in schedule.chunks() {
            let inboard = match (schedule.inboard_cut(chunk), carriers[chunk.joints().start]) {
                (Some(cut), _) => Inboard::Cut(self.slot_of(cut)),
                (None, Some(carrier)) => Inboard::Carrier(self.slot_of(carrier)),
                (None, None) => Inboard::World,
            };
            at += chunk.joints().len();
            let outboard = outboard(model, schedule, chunk, weights);
            self.at_center[at - 1] = outboard != Outboard::Free;
            self.chunks.push(ChunkPlan {
                inboard,
                outboard,
                last_share: if chunk.tail { 1.0 } else { 0.5 },
                parent: None,
                ends: [None; 2],
            });
        }
    }

    fn place_joins(&mut self) {
        let count = self.chunks.len();
        let part = |node: NodeId| {
            if node.index() < count {
                Part::Chunk(node.index())
            } else {
                Part::Join(node.index() - count)
            }
        };
        let mut firsts = Vec::with_capacity(count);
        let mut first = 0;
        for chunk in self.schedule.chunks() {
            firsts.push(first);
            first += chunk.joints().len();
        }
        // The first and the last chunk of each join.
        let mut spans: Vec<[usize; 2]> = Vec::with_capacity(self.schedule.joins().len());
        for (index, join) in self.schedule.joins().iter().enumerate() {
            let (inboard, outboard) = (part(join.inboard), part(join.outboard));
            let [[first, before], [after, last]] = [inboard, outboard].map(|part| match part {
                Part::Chunk(chunk) => [chunk; 2],
                Part::Join(join) => spans[join],
            });
            spans.push([first, last]);
            self.chunks[before].ends[1] = Some(index);
            self.chunks[after].ends[0] = Some(index);
            let head = match inboard {
                Part::Chunk(chunk) => self.chunks[chunk].head(firsts[chunk]),
                Part::Join(join) => self.joins[join].head,
            };
            for (part, outboard) in [(inboard, false), (outboard, true)] {
                let parent = Some(Parent {
                    join: index,
                    outboard,
                });
                match part {
                    Part::Chunk(chunk) => self.chunks[chunk].parent = parent,
                    Part::Join(join) => self.joins[join].parent = parent,
                }
            }
            self.joins.push(JoinPlan {
                inboard,
                outboard,
                head,
                parent: None,
                last: 0,
                chunks: [before, after],
                cut: self.slots[join.cut.index()] as usize,
            });
        }
        for round in (0..self.schedule.round_count()).rev() {
            for index in self.schedule.joins_in(round) {
                let parent = self.joins[index].parent;
                self.joins[index].last = parent.map_or(round, |above| self.joins[above.join].last);
            }
        }
    }

    fn place_rakes(&mut self) {
        for (chunk, plan) in self.schedule.chunks().iter().zip(&self.chunks) {
            let mut extent = *self.extents.last().unwrap_or(&Extent::default());
            extent.chunk += 1;
            extent.slot += chunk.joints().len();
            extent.inner += usize::from(plan.is_inner());
            extent.leaf += usize::from(plan.outboard == Outboard::Leaf);
            extent.node += usize::from(plan.parent.is_some());
            let raked = plan.parent.is_none() && matches!(plan.inboard, Inboard::Carrier(_));
            extent.rake += usize::from(raked);
            self.extents.push(extent);
        }
        let raked = |node: NodeId| match self.schedule.node(node) {
            Some(Node::Join(_)) => {
                let join = node.index() - self.chunks.len();
                Raked::Join {
                    join,
                    head: self.joins[join].head.map_or(0, |head| head.slot),
                }
            }
            Some(Node::RakeSum(_)) => {
                Raked::Sum(node.index() - self.chunks.len() - self.joins.len())
            }
            _ => Raked::Chunk {
                rake: self.extents[node.index()].rake,
                head: self.extents[node.index()].slot,
            },
        };
        self.rakes = self
            .bodies
            .iter()
            .map(|&body| {
                let mut taken = [None; 2];
                let rakes = self.schedule.rakes(vertebra_assembly::BodyId(body));
                for (taken, &node) in taken.iter_mut().zip(rakes) {
                    *taken = Some(raked(node));
                }
                taken
            })
            .collect();
        self.sums = (self.schedule.sums().iter())
            .map(|sum| sum.parts.map(raked))
            .collect();
    }

    /// Takes the constants of the bodies, each about its handle point, each joint from the handle
    /// point it hangs from.
    fn place_links(&mut self, model: &Model) {
        let units = model.units();
        let link = |(&body, &at_center): (&u32, &bool)| {
            let body = &model.bodies()[body as usize];
            let mut link = Link::<T::Wide>::new(body, model);
            if let Some(parent) = link.parent
                && self.at_center[self.slots[parent] as usize]
            {
                let parent = BodyFrame::<T::Wide>::new(&model.bodies()[parent], units);
                link.placement.translation -= parent.center;
            }
            if at_center {
                link.refer_to_center(body, units);
            }
            link.map(T::narrow)
        };
        self.links = self.bodies.iter().zip(&self.at_center).map(link).collect();
        let frame = |&body: &u32| BodyFrame::rounded(&model.bodies()[body as usize], units);
        self.frames = self.bodies.iter().map(frame).collect();
        let mut dof = 0;
        for link in &self.links {
            let count = link.kind.dof_count();
            self.model_dofs.extend((link.v..link.v + count).map(small));
            dof += small(count);
            self.dofs.push(dof);
        }
        for extent in &mut self.extents {
            extent.dof = self.dofs[extent.slot] as usize;
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a model has fewer freedoms than 32 bits count"
)]
const fn small(index: usize) -> u32 {
    index as u32
}
