//! Rounds: when chunks, joins and rake sums can be done, and their numbers.

use super::{
    Chunk, Join, NodeId, Path, RakeSum, Schedule, ScheduleOptions, cuts, node_id, paths, small,
};
use crate::BodyId;
use core::cmp::Reverse;
use core::ops::Range;
use std::collections::BinaryHeap;

/// A result before its final number is known: its kind, and its index in order of creation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Draft {
    Chunk(u32),
    Join(u32),
    Sum(u32),
}

/// A result and the round that makes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Due {
    round: u32,
    draft: Draft,
}

/// Rakes a body takes itself; more are added up before.
const RAKES_A_BODY: usize = 2;

#[derive(Default)]
struct Builder {
    chunks: Vec<(u32, Chunk)>,
    joins: Vec<(u32, [Draft; 2], BodyId)>,
    sums: Vec<(u32, [Draft; 2], BodyId)>,
}

pub(super) fn schedule(
    parents: &[Option<BodyId>],
    weights: &[f64],
    options: &ScheduleOptions,
) -> Schedule {
    let n = parents.len();
    let layout = paths::layout(parents, options.window);
    let path_count = layout.starts.len() - 1;
    let bodies_of = |path: usize| layout.starts[path] as usize..layout.starts[path + 1] as usize;
    let carrier_of = |path: usize| parents[layout.order[bodies_of(path).start].index()];

    // Roots of the paths that each body carries, filled in as they are found.
    let mut root_starts = vec![0_usize; n + 1];
    for carrier in (0..path_count).filter_map(carrier_of) {
        root_starts[carrier.index() + 1] += 1;
    }
    for body in 0..n {
        root_starts[body + 1] += root_starts[body];
    }
    let mut filled = root_starts.clone();
    let placeholder = Due {
        round: 0,
        draft: Draft::Chunk(0),
    };
    let mut raked_roots = vec![placeholder; root_starts[n]];

    let mut builder = Builder::default();
    let mut roots = vec![placeholder; path_count];
    let mut rakes = vec![[None; RAKES_A_BODY]; n];
    let (mut ready, mut ends) = (Vec::new(), Vec::new());
    let mut path_weights = Vec::new();
    let mut joiner = Joiner::default();
    // Heads stand in the order of their bodies, hence after the path that carries them.
    for path in (0..path_count).rev() {
        let range = bodies_of(path);
        let bodies = &layout.order[range.clone()];
        ready.clear();
        path_weights.clear();
        for &body in bodies {
            let slots = root_starts[body.index()]..root_starts[body.index() + 1];
            let (taken, round) = builder.rake(body, &raked_roots[slots]);
            rakes[body.index()] = taken;
            ready.push(round);
            path_weights.push(weights[body.index()]);
        }
        cuts::chunk_ends(&path_weights, &ready, options, &mut ends);
        let first = builder.chunks.len();
        builder.assemble(&range, &ready, &ends);
        let root = joiner.join(&mut builder, first, &layout.order);
        roots[path] = root;
        if let Some(carrier) = carrier_of(path) {
            raked_roots[filled[carrier.index()]] = root;
            filled[carrier.index()] += 1;
        }
    }

    let last = roots.iter().map(|root| root.round + 1).max().unwrap_or(0);
    let numbers = Numbers::new(&builder, last as usize);
    let mut rake_starts = vec![0];
    let mut raked = Vec::new();
    for taken in &rakes {
        raked.extend(taken.iter().flatten().map(|&draft| numbers.of(draft)));
        rake_starts.push(small(raked.len()));
    }
    let paths = (0..path_count)
        .map(|path| Path {
            start: layout.starts[path],
            end: layout.starts[path + 1],
            carrier: carrier_of(path),
            root: numbers.of(roots[path].draft),
        })
        .collect();
    numbers.finish(&builder, layout.order, paths, rake_starts, raked)
}

impl Builder {
    /// Adds rakes up, the two that are there soonest first, until the body can take them (no other
    /// order is sooner: Golumbic, IEEE Trans. Computers C-25, 1976). Returns them and the first round
    /// in which they are there.
    fn rake(&mut self, body: BodyId, roots: &[Due]) -> ([Option<Draft>; RAKES_A_BODY], u32) {
        let mut taken = [None; RAKES_A_BODY];
        let mut heap: BinaryHeap<_> = roots.iter().map(|&root| Reverse(root)).collect();
        while heap.len() > RAKES_A_BODY {
            let (Some(Reverse(a)), Some(Reverse(b))) = (heap.pop(), heap.pop()) else {
                break;
            };
            let round = a.round.max(b.round) + 1;
            let draft = Draft::Sum(small(self.sums.len()));
            self.sums.push((round, [a.draft, b.draft], body));
            heap.push(Reverse(Due { round, draft }));
        }
        let mut ready = 0;
        for (slot, Reverse(due)) in taken.iter_mut().zip(heap) {
            *slot = Some(due.draft);
            ready = ready.max(due.round + 1);
        }
        (taken, ready)
    }

    /// The chunks of the path with these bodies, each in the first round in which all rakes onto its
    /// bodies are there.
    fn assemble(&mut self, bodies: &Range<usize>, ready: &[u32], ends: &[usize]) {
        let mut start = 0;
        for &end in ends {
            let read = start.max(1) - 1..end;
            let round = ready[read].iter().copied().max().unwrap_or(0);
            let chunk = Chunk {
                start: small(bodies.start + start),
                end: small(bodies.start + end),
                head: start == 0,
                tail: end == ready.len(),
            };
            self.chunks.push((round, chunk));
            start = end;
        }
    }
}

/// Joins the chunks of one path, neighbours as soon as both are there.
#[derive(Default)]
struct Joiner {
    /// What stands at each place, leftmost chunk's; a join stands where its inboard part stood.
    standing: Vec<Due>,
    /// One past the last chunk of what stands here; the place of its neighbour.
    next: Vec<usize>,
    /// Place of the neighbour before.
    previous: Vec<Option<usize>>,
    gone: Vec<bool>,
    /// Chunks by round.
    arrivals: Vec<usize>,
    fresh: Vec<usize>,
    made: Vec<usize>,
}

impl Joiner {
    fn join(&mut self, builder: &mut Builder, first: usize, order: &[BodyId]) -> Due {
        let count = builder.chunks.len() - first;
        self.start(builder, first, count);
        let mut arrived = 0;
        let mut left = count;
        let mut round = 0;
        while left > 1 {
            if self.made.is_empty() {
                // Nothing until the next chunk is there.
                round = round.max(self.standing[self.arrivals[arrived]].round + 1);
            }
            self.fresh.clear();
            self.fresh.append(&mut self.made);
            while arrived < count && self.standing[self.arrivals[arrived]].round < round {
                self.fresh.push(self.arrivals[arrived]);
                arrived += 1;
            }
            self.fresh.sort_unstable();
            for index in 0..self.fresh.len() {
                let place = self.fresh[index];
                let is_there = |at: usize| at < count && self.standing[at].round < round;
                if self.gone[place] || !is_there(place) {
                    continue;
                }
                let inboard = match self.previous[place] {
                    Some(previous) if is_there(previous) => previous,
                    _ if is_there(self.next[place]) => place,
                    _ => continue,
                };
                let outboard = self.next[inboard];
                // The cut body is the last one before the outboard part.
                let cut = order[builder.chunks[first + outboard].1.start as usize - 1];
                let parts = [self.standing[inboard].draft, self.standing[outboard].draft];
                let draft = Draft::Join(small(builder.joins.len()));
                builder.joins.push((round, parts, cut));
                self.standing[inboard] = Due { round, draft };
                self.next[inboard] = self.next[outboard];
                if self.next[inboard] < count {
                    self.previous[self.next[inboard]] = Some(inboard);
                }
                self.gone[outboard] = true;
                self.made.push(inboard);
                left -= 1;
            }
            round += 1;
        }
        self.standing[0]
    }

    fn start(&mut self, builder: &Builder, first: usize, count: usize) {
        self.standing.clear();
        self.standing
            .extend((first..first + count).map(|chunk| Due {
                round: builder.chunks[chunk].0,
                draft: Draft::Chunk(small(chunk)),
            }));
        self.next.clear();
        self.next.extend(1..=count);
        self.previous.clear();
        self.previous
            .extend((0..count).map(|place| place.checked_sub(1)));
        self.gone.clear();
        self.gone.resize(count, false);
        self.arrivals.clear();
        self.arrivals.extend(0..count);
        let standing = &self.standing;
        self.arrivals.sort_by_key(|&place| standing[place].round);
        self.made.clear();
    }
}

/// Final numbers of the drafts: each kind by rounds, within a round as created.
struct Numbers {
    chunks: Ranked,
    joins: Ranked,
    sums: Ranked,
}

/// A permutation that sorts by rounds.
struct Ranked {
    /// Final index of each draft.
    rank: Vec<u32>,
    /// Draft of each final index.
    drafts: Vec<u32>,
    /// Where each round starts, one entry more than rounds.
    starts: Vec<usize>,
}

impl Ranked {
    /// A counting sort.
    fn new(rounds: impl Iterator<Item = u32> + Clone, round_count: usize) -> Self {
        let mut starts = vec![0; round_count + 1];
        for round in rounds.clone() {
            starts[round as usize + 1] += 1;
        }
        for round in 0..round_count {
            starts[round + 1] += starts[round];
        }
        let mut free = starts.clone();
        let mut drafts = vec![0; starts[round_count]];
        let rank = rounds
            .enumerate()
            .map(|(draft, round)| {
                let place = free[round as usize];
                free[round as usize] += 1;
                drafts[place] = small(draft);
                small(place)
            })
            .collect();
        Self {
            rank,
            drafts,
            starts,
        }
    }
}

impl Numbers {
    fn new(builder: &Builder, rounds: usize) -> Self {
        Self {
            chunks: Ranked::new(builder.chunks.iter().map(|entry| entry.0), rounds),
            joins: Ranked::new(builder.joins.iter().map(|entry| entry.0), rounds),
            sums: Ranked::new(builder.sums.iter().map(|entry| entry.0), rounds),
        }
    }

    fn of(&self, draft: Draft) -> NodeId {
        let (chunks, joins) = (self.chunks.rank.len(), self.joins.rank.len());
        node_id(match draft {
            Draft::Chunk(chunk) => self.chunks.rank[chunk as usize] as usize,
            Draft::Join(join) => chunks + self.joins.rank[join as usize] as usize,
            Draft::Sum(sum) => chunks + joins + self.sums.rank[sum as usize] as usize,
        })
    }

    fn finish(
        self,
        builder: &Builder,
        order: Vec<BodyId>,
        paths: Vec<Path>,
        rake_starts: Vec<u32>,
        rakes: Vec<NodeId>,
    ) -> Schedule {
        let chunk = |&draft: &u32| builder.chunks[draft as usize].1;
        let join = |&draft: &u32| {
            let (_, [inboard, outboard], cut) = builder.joins[draft as usize];
            Join {
                inboard: self.of(inboard),
                outboard: self.of(outboard),
                cut,
            }
        };
        let sum = |&draft: &u32| {
            let (_, parts, body) = builder.sums[draft as usize];
            RakeSum {
                parts: parts.map(|part| self.of(part)),
                body,
            }
        };
        Schedule {
            chunks: self.chunks.drafts.iter().map(chunk).collect(),
            joins: self.joins.drafts.iter().map(join).collect(),
            sums: self.sums.drafts.iter().map(sum).collect(),
            order,
            paths,
            rake_starts,
            rakes,
            chunk_rounds: self.chunks.starts,
            join_rounds: self.joins.starts,
            sum_rounds: self.sums.starts,
        }
    }
}
