//! How the kernels number what a plan has: chunks, slots, joins, and what is raked onto bodies.

use super::layers::{Item, Places, Record};
use super::tables::{NONE, small};
use crate::dca::plan::{Inboard, Parent, Part, Plan, Raked};
use core::ops::Range;
use vertebra_shaders::dca::NOWHERE;

/// How the kernels number chunks and slots, against the plan.
pub(super) struct Order {
    pub(super) old_chunks: Vec<usize>,
    pub(super) new_chunks: Vec<u32>,
    pub(super) old_slots: Vec<usize>,
    pub(super) new_slots: Vec<u32>,
    /// For each round, the first slot of each place in its chunks.
    pub(super) jags: Vec<u32>,
    /// By new numbers: where a chunk's round starts in `jags`, and its place in the round.
    pub(super) jag_of: Vec<usize>,
    pub(super) rank_of: Vec<usize>,
}

impl Order {
    pub(super) fn new(plan: &Plan<f64>) -> Self {
        let (chunks, slots) = (plan.chunks.len(), plan.len());
        let mut order = Self {
            old_chunks: Vec::with_capacity(chunks),
            new_chunks: vec![0; chunks],
            old_slots: Vec::with_capacity(slots),
            new_slots: vec![0; slots],
            jags: Vec::new(),
            jag_of: Vec::with_capacity(chunks),
            rank_of: Vec::with_capacity(chunks),
        };
        for round in 0..plan.schedule.round_count() {
            order.put_round(plan, plan.schedule.chunks_in(round));
        }
        order
    }

    /// Where kinematics has what is across a part.
    pub(super) fn turn(&self, plan: &Plan<f64>, part: Part) -> u32 {
        match part {
            Part::Chunk(chunk) => self.new_chunks[chunk],
            Part::Join(join) => small(plan.chunks.len() + join),
        }
    }

    /// What a part hangs from: what a join hangs from, then what is across another part.
    pub(super) fn under(&self, plan: &Plan<f64>, parent: Option<Parent>) -> [u32; 2] {
        let Some(Parent { join, outboard }) = parent else {
            return [NONE; 2];
        };
        let across = if outboard {
            self.turn(plan, plan.joins[join].inboard)
        } else {
            NONE
        };
        [small(join), across]
    }

    pub(super) fn put_round(&mut self, plan: &Plan<f64>, round: Range<usize>) {
        let mut chunks: Vec<usize> = round.collect();
        chunks.sort_by_key(|&chunk| core::cmp::Reverse(plan.slots_of(chunk).len()));
        let jag = self.jags.len();
        let longest = chunks
            .first()
            .map_or(0, |&chunk| plan.slots_of(chunk).len());
        for place in 0..longest {
            self.jags.push(small(self.old_slots.len()));
            let with_place = chunks.iter().map(|&chunk| plan.slots_of(chunk));
            for slots in with_place.take_while(|slots| slots.len() > place) {
                self.new_slots[slots.start + place] = small(self.old_slots.len());
                self.old_slots.push(slots.start + place);
            }
        }
        for (rank, &chunk) in chunks.iter().enumerate() {
            self.new_chunks[chunk] = small(self.old_chunks.len());
            self.old_chunks.push(chunk);
            self.jag_of.push(jag);
            self.rank_of.push(rank);
        }
    }
}

/// For each join, those at the cut bodies at the ends of what it puts together.
pub(super) struct Seams {
    /// The join at each cut body, by its slot.
    pub(super) at: Vec<u32>,
    pub(super) of_joins: Vec<[u32; 2]>,
}

impl Seams {
    pub(super) fn new(plan: &Plan<f64>) -> Self {
        let mut seams = Self {
            at: vec![NONE; plan.len()],
            of_joins: Vec::with_capacity(plan.joins.len()),
        };
        for (index, join) in plan.joins.iter().enumerate() {
            seams.at[join.cut] = small(index);
        }
        for join in &plan.joins {
            let [before, _] = seams.of(plan, join.inboard);
            let [_, after] = seams.of(plan, join.outboard);
            seams.of_joins.push([before, after]);
        }
        seams
    }

    /// The joins before and after a part, joins only of those that are known.
    pub(super) fn of(&self, plan: &Plan<f64>, part: Part) -> [u32; 2] {
        let chunk = match part {
            Part::Chunk(chunk) => chunk,
            Part::Join(join) => return self.of_joins[join],
        };
        let before = match plan.chunks[chunk].inboard {
            Inboard::Cut(slot) => self.at[slot],
            _ => NONE,
        };
        [before, self.at[plan.slots_of(chunk).end - 1]]
    }
}

/// What tables say of joins.
pub(super) struct Joins<'a> {
    pub(super) plan: &'a Plan<f64>,
    pub(super) order: &'a Order,
    pub(super) rakes: &'a Rakes,
    pub(super) seams: &'a Seams,
}

impl Joins<'_> {
    /// As `Seam` of the kernels' rounds of teams has it.
    pub(super) fn in_dynamics(&self, index: usize, places: &Places) -> Record {
        let (plan, order) = (self.plan, self.order);
        let join = &plan.joins[index];
        let end = &plan.extents[plan.chunks.len()];
        let node = |part| match part {
            Part::Chunk(chunk) => small(plan.extents[chunk].node),
            Part::Join(join) => small(end.node + join),
        };
        let slot = |slot: usize| order.new_slots[slot];
        let [before, after] = self.seams.of(plan, Part::Join(index));
        let of_part = |part| match part {
            Part::Chunk(_) => NOWHERE,
            Part::Join(join) => places.of(join),
        };
        let others = [
            of_part(join.inboard),
            of_part(join.outboard),
            places.of(before as usize),
            places.of(after as usize),
        ];
        let packed = |packed, place| packed << 8 | place;
        [
            small(index),
            node(join.inboard),
            node(join.outboard),
            before,
            after,
            join.head.map_or(NONE, |head| slot(head.slot)),
            join.head.and_then(|head| head.carrier).map_or(NONE, slot),
            self.rakes.of_joins[index],
            others.into_iter().rev().fold(0, packed),
            places.of(index),
        ]
    }

    /// As `Seam` of the kernels' rounds of lanes has it.
    pub(super) fn in_kinematics(&self, index: usize) -> Record {
        let (plan, order) = (self.plan, self.order);
        let join = &plan.joins[index];
        let [under, across] = order.under(plan, join.parent);
        let carrier = join.head.and_then(|head| head.carrier);
        [
            small(index),
            order.turn(plan, join.inboard),
            order.turn(plan, join.outboard),
            under,
            across,
            carrier.map_or(NONE, |slot| order.new_slots[slot]),
            NONE,
            NONE,
            NONE,
            NONE,
        ]
    }
}

/// How the kernels number what is raked onto bodies: chunks, joins, sums.
pub(super) struct Rakes {
    pub(super) chunks: usize,
    /// Number of each join that is raked, else none; the same by its head's slot.
    pub(super) of_joins: Vec<u32>,
    pub(super) of_paths: Vec<u32>,
    pub(super) first_sum: usize,
    /// The head's slot of each, none for sums.
    pub(super) heads: Vec<u32>,
    /// What makes each.
    pub(super) makers: Vec<Part>,
}

impl Rakes {
    pub(super) fn new(plan: &Plan<f64>, order: &Order) -> Self {
        let raked_chunks = |chunk: &usize| plan.extents[chunk + 1].rake > plan.extents[*chunk].rake;
        let chunks: Vec<usize> = (0..plan.chunks.len()).filter(raked_chunks).collect();
        let mut rakes = Self {
            chunks: chunks.len(),
            of_joins: vec![NONE; plan.joins.len()],
            of_paths: vec![NONE; plan.len()],
            first_sum: 0,
            heads: chunks
                .iter()
                .map(|&c| order.new_slots[plan.extents[c].slot])
                .collect(),
            makers: chunks.iter().map(|&chunk| Part::Chunk(chunk)).collect(),
        };
        for (index, join) in plan.joins.iter().enumerate() {
            if let (None, Some(head)) = (join.parent, join.head)
                && head.carrier.is_some()
            {
                let slot = order.new_slots[head.slot];
                rakes.of_joins[index] = small(rakes.heads.len());
                rakes.of_paths[slot as usize] = small(rakes.heads.len());
                rakes.heads.push(slot);
                rakes.makers.push(Part::Join(index));
            }
        }
        rakes.first_sum = rakes.heads.len();
        rakes.heads.extend(plan.sums.iter().map(|_| NONE));
        rakes
    }

    pub(super) fn number(&self, raked: Raked) -> u32 {
        match raked {
            Raked::Chunk { rake, .. } => {
                debug_assert!(rake < self.chunks, "rakes of chunks come first");
                small(rake)
            }
            Raked::Join { join, .. } => self.of_joins[join],
            Raked::Sum(sum) => small(self.first_sum + sum),
        }
    }

    /// What makes a rake.
    pub(super) fn item(&self, raked: Raked, order: &Order) -> Item {
        match raked {
            Raked::Sum(sum) => Item::Sum(sum),
            _ => match self.makers[self.number(raked) as usize] {
                Part::Chunk(chunk) => Item::Chunk(order.new_chunks[chunk] as usize),
                Part::Join(join) => Item::Join(join),
            },
        }
    }
}
