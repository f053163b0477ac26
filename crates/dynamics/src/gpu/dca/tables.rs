//! An assembly tree as tables for kernels; `shaders/wgsl/dca/memory.wgsl` says what they hold.
//!
//! Within a round chunks are numbered from the longest to the shortest and their bodies' slots by
//! place in the chunk first, so that lanes that work on neighbouring chunks read neighbouring
//! memory, and nothing is padded.

use super::engine::JOINT_FORCES;
use super::layers::{Item, Layered, Rounds, Width};
use super::loops::LoopTables;
use super::order::{Joins, Order, Rakes, Seams};
use crate::dca::plan::{Inboard, Outboard, Part, Plan, Raked};
use crate::elements::Rows;
use crate::link::Kind;
use core::ops::Range;
use glam::DQuat;
use vertebra_assembly::Model;
use vertebra_shaders::dca::{
    BALL_FOURS, BALL_NUMBERS, BALL_ROWS, DRIVEN_NUMBERS, ELEMENT_ROWS, Sizes, TEAM, TURN_LANES,
    WORK_LANES, WORKS,
};
use vertebra_spatial::Mat3;

/// No number.
pub(super) const NONE: u32 = u32::MAX;

/// Rounds that one dispatch goes through at most, as far as several workgroups are needed.
const WORK_ROUNDS: usize = 5;
const TURN_ROUNDS: usize = 9;

/// Flags of slots beside the joint's kind.
const AT_CENTER: u32 = 8;
const CARRIES: u32 = 16;

/// Flags of chunks.
const FROM_CARRIER: u32 = 1;
const FROM_CUT: u32 = 2;
const TO_HALF: u32 = 4;
const TO_LEAF: u32 = 8;
const IS_HALVED: u32 = 16;

/// Everything that kernels know of a model.
#[derive(Debug)]
pub(super) struct Tables {
    pub(super) sizes: Sizes,
    pub(super) words: Vec<u32>,
    /// Constants of the bodies, in the order of the kernels.
    pub(super) links: Vec<[f64; 4]>,
    /// Whether joints have several freedoms, anything acts in them, and some are screws.
    pub(super) several: bool,
    pub(super) elements: bool,
    pub(super) screws: bool,
    /// Spherical joints, where some have ranges, friction or motors: whose slots start at a word.
    pub(super) balls: Option<Balls>,
    /// Corrections of each solution.
    pub(super) sweeps: usize,
    /// Chunks of the first round.
    pub(super) leading: u32,
    /// How dynamics and kinematics go through the rounds that follow.
    pub(super) work: Vec<Layered>,
    pub(super) turn: Vec<Layered>,
    /// Each slot's body and each body's slot.
    pub(super) bodies: Vec<u32>,
    pub(super) slots: Vec<u32>,
    /// Where each number of q and qd stands in the model's.
    pub(super) positions: Vec<u32>,
    pub(super) dofs: Vec<u32>,
    /// Where each freedom of the model's stands in `dofs`.
    pub(super) places: Vec<u32>,
    /// From a body's joint to its handle point, in joint axes; the body's frame in its joint frame.
    pub(super) at_center: Vec<bool>,
    /// Closed loops and couplings, if there are any.
    pub(super) loops: Option<LoopTables>,
}

/// A table of slots of spherical joints.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balls {
    pub(super) starts: u32,
    pub(super) count: u32,
}

impl Tables {
    pub(super) fn new(
        model: &Model,
        plan: &Plan<f64>,
        sweeps: usize,
        elements: Option<&[Rows]>,
        has_balls: bool,
    ) -> Self {
        let order = Order::new(plan);
        let rakes = Rakes::new(plan, &order);
        let mut tables = Self {
            sizes: Sizes::default(),
            words: Vec::new(),
            links: Vec::new(),
            several: plan.links.iter().any(|link| link.kind.dof_count() > 1),
            elements: elements.is_some(),
            screws: plan.links.iter().any(|link| link.kind == Kind::Screw),
            balls: None,
            sweeps,
            leading: small(plan.schedule.chunks_in(0).len()),
            work: Vec::new(),
            turn: Vec::new(),
            bodies: order
                .old_slots
                .iter()
                .map(|&old| plan.bodies[old])
                .collect(),
            slots: Vec::new(),
            positions: Vec::new(),
            dofs: Vec::new(),
            places: Vec::new(),
            at_center: order
                .old_slots
                .iter()
                .map(|&old| plan.at_center[old])
                .collect(),
            loops: None,
        };
        tables.slots = (plan.slots.iter())
            .map(|&old| order.new_slots[old as usize])
            .collect();
        tables.put_slots(model, plan, &order, &rakes);
        if has_balls {
            tables.balls = Some(tables.put_balls(plan, &order));
        }
        tables.put_elements(plan, &order, elements);
        tables.places = vec![0; tables.dofs.len()];
        for (place, &dof) in (0..).zip(&tables.dofs) {
            tables.places[dof as usize] = place;
        }
        let seams = Seams::new(plan);
        tables.put_chunks(plan, &order, &rakes, &seams);
        tables.put_joins(plan, &order, &rakes);
        let end = &plan.extents[plan.chunks.len()];
        tables.sizes = Sizes {
            slots: small(plan.len()),
            positions: small(tables.positions.len()),
            dofs: small(tables.dofs.len()),
            chunks: small(plan.chunks.len()),
            joins: small(plan.joins.len()),
            chunk_nodes: small(end.node),
            inners: small(end.inner),
            leaves: small(end.leaf),
            rakes: small(rakes.heads.len()),
            carriers: u32::from(!rakes.heads.is_empty()),
            single: u32::from(plan.links.iter().all(|link| link.kind.dof_count() == 1)),
            #[expect(clippy::cast_possible_truncation, reason = "a power of two")]
            length: model.units().length as f32,
            pushes: small(JOINT_FORCES + tables.driven_numbers() * tables.dofs.len()),
            ..tables.sizes
        };
        tables.sizes.balls = small(tables.scratch_len()) - tables.ball_fours();
        let mut rounds = rounds(plan, &order, &rakes);
        let work = Width {
            lanes: WORK_LANES as usize,
            join: TEAM as usize,
            rounds: WORK_ROUNDS,
        };
        let turn = Width {
            lanes: TURN_LANES as usize,
            join: 1,
            rounds: TURN_ROUNDS,
        };
        let joins = Joins {
            plan,
            order: &order,
            rakes: &rakes,
            seams: &seams,
        };
        let words = &mut tables.words;
        tables.work = rounds.layers(
            1,
            &work,
            &|join, places| joins.in_dynamics(join, places),
            words,
        );
        rounds.lead();
        tables.turn = rounds.layers(0, &turn, &|join, _| joins.in_kinematics(join), words);
        tables
    }

    /// Numbers of slots, and their constants.
    fn put_slots(&mut self, model: &Model, plan: &Plan<f64>, order: &Order, rakes: &Rakes) {
        let n = plan.len();
        let mut kinds = Vec::with_capacity(n);
        let (mut starts, mut dof_starts) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for &old in &order.old_slots {
            let link = &plan.links[old];
            let body = &model.bodies()[plan.bodies[old] as usize];
            let kind = match link.kind {
                Kind::Fixed => 0,
                Kind::Revolute => 1,
                Kind::Prismatic => 2,
                Kind::Spherical => 3,
                Kind::Free => 4,
                Kind::Screw => 5,
            };
            let flag = |is_set, flag| if is_set { flag } else { 0 };
            kinds.push(
                kind | flag(plan.at_center[old], AT_CENTER)
                    | flag(plan.rakes[old][0].is_some(), CARRIES),
            );
            starts.push(small(self.positions.len()));
            dof_starts.push(small(self.dofs.len()));
            self.positions.extend(body.position_range().map(small));
            self.dofs.extend(body.dof_range().map(small));
        }
        let bodies = self.bodies.clone();
        for table in [kinds, starts, dof_starts, bodies] {
            self.words.extend(table);
        }
        if !rakes.heads.is_empty() {
            for which in 0..2 {
                let onto = order
                    .old_slots
                    .iter()
                    .map(|&old| plan.rakes[old][which].map_or(NONE, |raked| rakes.number(raked)));
                self.words.extend(onto);
            }
        }
        self.put_links(plan, order);
    }

    /// Placement and mass; moment or centre, and inertia; the body's own frame.
    fn put_links(&mut self, plan: &Plan<f64>, order: &Order) {
        let mut columns: [Vec<[f64; 4]>; 6] = Default::default();
        for &old in &order.old_slots {
            let (link, frame) = (&plan.links[old], &plan.frames[old]);
            let at = link.placement.translation;
            let center = if plan.at_center[old] {
                frame.center
            } else {
                link.inertia.moment
            };
            let inertia = link.inertia.rotational;
            let origin = frame.placement.translation;
            let rows = [
                quaternion(&link.placement.rotation),
                [at.x, at.y, at.z, link.inertia.mass],
                [center.x, center.y, center.z, inertia.xx],
                [inertia.yy, inertia.zz, inertia.yz, inertia.xz],
                [inertia.xy, origin.x, origin.y, origin.z],
                quaternion(&frame.placement.rotation),
            ];
            for (column, row) in columns.iter_mut().zip(rows) {
                column.push(row);
            }
        }
        self.links = columns.concat();
    }

    /// Slots of spherical joints.
    fn put_balls(&mut self, plan: &Plan<f64>, order: &Order) -> Balls {
        let starts = small(self.words.len());
        let slots = (0..).zip(&order.old_slots);
        let balls = slots.filter(|&(_, &old)| plan.links[old].kind == Kind::Spherical);
        self.words.extend(balls.map(|(slot, _): (u32, _)| slot));
        Balls {
            starts,
            count: small(self.words.len()) - starts,
        }
    }

    /// Rows of what acts in joints, and pitches at the end of the third.
    fn put_elements(&mut self, plan: &Plan<f64>, order: &Order, elements: Option<&[Rows]>) {
        if !(self.elements || self.screws) {
            return;
        }
        let more = if self.balls.is_some() { BALL_ROWS } else { 0 };
        for row in 0..ELEMENT_ROWS + more {
            for &old in &order.old_slots {
                let own = elements.map(|rows| rows[plan.bodies[old] as usize][row]);
                let mut own = own.unwrap_or_default();
                if row == 2 {
                    own[3] = plan.links[old].pitch;
                }
                self.links.push(own);
            }
        }
    }

    /// Numbers of a freedom among the forces.
    pub(super) const fn driven_numbers(&self) -> usize {
        match (self.elements, self.balls) {
            (false, _) => 1,
            (true, None) => DRIVEN_NUMBERS,
            (true, Some(_)) => DRIVEN_NUMBERS + BALL_NUMBERS,
        }
    }

    /// Numbers of four that say what acts in spherical joints, which are the last in the scratch memory.
    const fn ball_fours(&self) -> u32 {
        match self.balls {
            Some(_) => BALL_FOURS * self.sizes.dofs,
            None => 0,
        }
    }

    fn put_chunks(&mut self, plan: &Plan<f64>, order: &Order, rakes: &Rakes, seams: &Seams) {
        let first_jag = self.words.len();
        self.words.extend(&order.jags);
        self.sizes.chunk_words = small(self.words.len());
        let mut columns: [Vec<u32>; 13] = Default::default();
        for (new, &old) in order.old_chunks.iter().enumerate() {
            let chunk = &plan.chunks[old];
            let (own, next) = (&plan.extents[old], &plan.extents[old + 1]);
            let owned = |start: usize, end: usize| if end > start { small(start) } else { NONE };
            let (from, inboard) = match chunk.inboard {
                Inboard::World => (0, NONE),
                Inboard::Carrier(slot) => (FROM_CARRIER, order.new_slots[slot]),
                Inboard::Cut(slot) => (FROM_CUT, order.new_slots[slot]),
            };
            let to = match chunk.outboard {
                Outboard::Free => 0,
                Outboard::Half => TO_HALF,
                Outboard::Leaf => TO_LEAF,
            };
            let halved = if chunk.last_share < 1.0 { IS_HALVED } else { 0 };
            let rake = if next.rake > own.rake {
                small(own.rake)
            } else {
                rakes.of_paths[order.new_slots[own.slot] as usize]
            };
            let [before, after] = seams.of(plan, Part::Chunk(old));
            let [under, across] = order.under(plan, chunk.parent);
            let row = [
                small(first_jag + order.jag_of[new]),
                small(order.rank_of[new]),
                small(next.slot - own.slot),
                inboard,
                from | to | halved,
                under,
                owned(own.node, next.node),
                owned(own.inner, next.inner),
                owned(own.leaf, next.leaf),
                rake,
                before,
                after,
                across,
            ];
            for (column, word) in columns.iter_mut().zip(row) {
                column.push(word);
            }
        }
        self.words.extend(columns.concat());
    }

    /// Cut bodies of joins, numbers of sums and rakes.
    fn put_joins(&mut self, plan: &Plan<f64>, order: &Order, rakes: &Rakes) {
        self.sizes.cut_words = small(self.words.len());
        let cuts = plan.joins.iter().map(|join| order.new_slots[join.cut]);
        self.words.extend(cuts);
        self.sizes.sum_words = small(self.words.len());
        for (index, parts) in plan.sums.iter().enumerate() {
            self.words.extend(parts.map(|raked| rakes.number(raked)));
            self.words.push(rakes.number(Raked::Sum(index)));
        }
        self.sizes.rake_words = small(self.words.len());
        self.words.extend(&rakes.heads);
    }

    /// Where a slot's coordinates start among those on the device.
    pub(super) fn position_start(&self, slot: u32) -> u32 {
        self.words[self.bodies.len() + slot as usize]
    }

    /// Where a slot's freedoms start among those on the device.
    pub(super) fn dof_start(&self, slot: u32) -> u32 {
        self.words[2 * self.bodies.len() + slot as usize]
    }

    /// Numbers of four in the kernels' scratch memory.
    pub(super) fn scratch_len(&self) -> usize {
        let s = &self.sizes;
        let of = |records: u32, each: usize| records as usize * each;
        self.freedoms_at()
            + of(s.dofs, 4)
            + of(s.inners, 16)
            + of(s.leaves, 32)
            + of(s.rakes, 8)
            + self.kept_len()
            + self.ball_fours() as usize
    }

    /// Where those of freedoms begin in it, four arrays of one each.
    fn freedoms_at(&self) -> usize {
        let s = &self.sizes;
        let of = |records: u32, each: usize| records as usize * each;
        of(s.slots, 4) + of(s.slots * s.carriers, 3) + of(s.chunks, 3) + of(s.joins, 6)
    }

    /// Where it has the parts of laws, by freedoms: those of joints of one freedom are the third number of each four.
    pub(super) fn parts_at(&self) -> Range<usize> {
        let (first, dofs) = (self.freedoms_at(), self.dofs.len());
        first + 3 * dofs..first + 4 * dofs
    }

    /// The same of spherical joints, in the fours of their three freedoms: the last number of the first are the parts of stops'
    /// laws, the first of the others the shares of motor and friction.
    pub(super) fn ball_parts_at(&self) -> Range<usize> {
        let (first, dofs) = (self.sizes.balls as usize, self.dofs.len());
        first + dofs..first + self.ball_fours() as usize
    }

    /// Numbers of four that corrections keep in it.
    fn kept_len(&self) -> usize {
        let s = &self.sizes;
        if self.sweeps == 0 {
            return 0;
        }
        let each = [
            (s.joins, 6),
            (s.slots * s.carriers, 2),
            (s.rakes, 4),
            (s.slots, 2),
        ];
        each.map(|(records, each)| records as usize * each)
            .into_iter()
            .sum()
    }

    /// Numbers of four in the memory of nodes.
    pub(super) fn nodes_len(&self) -> usize {
        let s = &self.sizes;
        let (nodes, joins) = (s.chunk_nodes as usize, s.joins as usize);
        let (changes, inverses) = if self.sweeps > 0 { (3, 14) } else { (0, 0) };
        nodes * (23 + changes) + joins * (23 + 24 + 2 + changes + inverses)
    }

    /// Where the state that is worked on ends, and accelerations begin.
    pub(super) fn accelerations_at(&self) -> usize {
        2 * (self.positions.len() + self.dofs.len())
    }

    /// Where sums of work begin, if there are any.
    pub(super) fn works_at(&self) -> usize {
        self.accelerations_at() + 4 * self.dofs.len()
    }

    /// How many they are: those of elements, then of loops.
    pub(super) fn works_len(&self) -> usize {
        let kinds = match (self.elements, self.loops.is_some()) {
            (false, false) => 0,
            (_, looped) => WORKS + usize::from(looped),
        };
        kinds * self.dofs.len()
    }

    /// Numbers of the state and all that integrators keep.
    pub(super) fn state_len(&self) -> usize {
        self.works_at() + 2 * self.works_len()
    }
}

pub(super) fn quaternion(rotation: &Mat3<f64>) -> [f64; 4] {
    DQuat::from_mat3(&rotation.to_glam()).normalize().to_array()
}

/// What is done in which round, and what it needs.
fn rounds(plan: &Plan<f64>, order: &Order, rakes: &Rakes) -> Rounds {
    let schedule = &plan.schedule;
    let mut rounds = Rounds::new(plan.chunks.len(), plan.joins.len());
    let part = |part| match part {
        Part::Chunk(chunk) => Item::Chunk(order.new_chunks[chunk] as usize),
        Part::Join(join) => Item::Join(join),
    };
    for round in 0..schedule.round_count() {
        for chunk in schedule.chunks_in(round) {
            let item = Item::Chunk(chunk);
            // Rounds own the same numbers in either order.
            let old = order.old_chunks[chunk];
            let cut = match plan.chunks[old].inboard {
                Inboard::Cut(slot) => Some(slot),
                _ => None,
            };
            let carriers = plan.slots_of(old).chain(cut);
            let raked = carriers.flat_map(|slot| plan.rakes[slot].into_iter().flatten());
            let needs: Vec<Item> = raked.map(|raked| rakes.item(raked, order)).collect();
            rounds.push(round, item, &needs);
        }
        for join in schedule.joins_in(round) {
            let plan = &plan.joins[join];
            rounds.push(
                round,
                Item::Join(join),
                &[part(plan.inboard), part(plan.outboard)],
            );
        }
        for sum in schedule.sums_in(round) {
            let needs = plan.sums[sum].map(|raked| rakes.item(raked, order));
            rounds.push(round, Item::Sum(sum), &needs);
        }
    }
    rounds
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a schedule has fewer nodes and freedoms than 32 bits count"
)]
pub(super) const fn small(index: usize) -> u32 {
    index as u32
}
