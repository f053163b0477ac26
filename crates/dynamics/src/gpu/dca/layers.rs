//! Rounds of an assembly tree gathered into dispatches, several in each.
//!
//! Within a few rounds a tree falls into many parts that have nothing to do with each other; each is
//! given to one workgroup, which goes through its rounds without waiting for others. From where a
//! workgroup is wide enough for all that is left, one does the rest.

use super::tables::small;
use core::ops::Range;
use vertebra_shaders::dca::{NOWHERE, PLACES, RECORD, item};

/// What tables say of a join.
pub(super) type Record = [u32; RECORD as usize];

/// Places on chip of what the joins of a dispatch hand to others of their workgroup, by joins.
#[derive(Debug)]
pub(super) struct Places(Vec<u32>);

impl Places {
    pub(super) fn of(&self, join: usize) -> u32 {
        self.0.get(join).copied().unwrap_or(NOWHERE)
    }

    /// Numbers the joins of each workgroup, if there is nothing but joins and room for all of them.
    fn new(groups: &[Vec<Vec<Item>>], joins: usize, width: &Width) -> Option<Self> {
        let mut places = Self(vec![NOWHERE; joins]);
        for group in groups {
            if group.len() > PLACES as usize {
                return None;
            }
            let mut place = 0;
            for round in group {
                if round.len() * width.join > width.lanes {
                    return None;
                }
                for item in round {
                    let Item::Join(join) = *item else {
                        return None;
                    };
                    if place == PLACES {
                        return None;
                    }
                    places.0[join] = place;
                    place += 1;
                }
            }
        }
        Some(places)
    }
}

/// What is done in a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item {
    Chunk(usize),
    Join(usize),
    Sum(usize),
    /// A chunk of the first round, in kinematics.
    Leading(usize),
}

/// What is done in which rounds.
#[derive(Debug)]
pub(super) struct Rounds {
    chunks: usize,
    joins: usize,
    /// By rounds: items, and where their needs start in `needs`.
    items: Vec<Vec<(Item, usize)>>,
    /// What items need, one after the other, by numbers.
    needs: Vec<u32>,
}

/// What a workgroup has room for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Width {
    pub(super) lanes: usize,
    /// Lanes that a join takes; other items take one.
    pub(super) join: usize,
    /// Rounds that it goes through at most where there are others.
    pub(super) rounds: usize,
}

impl Width {
    fn of(&self, item: Item) -> usize {
        match item {
            Item::Join(_) => self.join,
            Item::Chunk(_) | Item::Sum(_) | Item::Leading(_) => 1,
        }
    }
}

/// A dispatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layered {
    /// Workgroups.
    pub(super) groups: u32,
    /// Rounds of each.
    pub(super) rounds: u32,
    /// First word of its table.
    pub(super) starts: u32,
    /// Whether there is anything but joins, or more of these in a workgroup than have a place, in a round than it has lanes, or in
    /// more rounds than are looked up at once.
    pub(super) mixed: bool,
    /// Whether anything is done on the way down.
    pub(super) down: bool,
}

impl Rounds {
    pub(super) const fn new(chunks: usize, joins: usize) -> Self {
        Self {
            chunks,
            joins,
            items: Vec::new(),
            needs: Vec::new(),
        }
    }

    /// Adds what a round does; rounds come in order.
    pub(super) fn push(&mut self, round: usize, item: Item, needs: &[Item]) {
        if self.items.len() <= round {
            self.items.resize(round + 1, Vec::new());
        }
        self.items[round].push((item, self.needs.len()));
        for &need in needs {
            self.needs.push(small(self.number(need)));
        }
    }

    /// Items are numbered chunks first, then joins, then sums.
    const fn number(&self, item: Item) -> usize {
        match item {
            Item::Chunk(chunk) | Item::Leading(chunk) => chunk,
            Item::Join(join) => self.chunks + join,
            Item::Sum(sum) => self.chunks + self.joins + sum,
        }
    }

    /// Tells the first round's chunks from others.
    pub(super) fn lead(&mut self) {
        for (item, _) in self.items.iter_mut().take(1).flatten() {
            if let Item::Chunk(chunk) = *item {
                *item = Item::Leading(chunk);
            }
        }
    }

    /// The rounds from `start` on in dispatches of a few rounds each, but for the last, which takes
    /// all that one workgroup is wide enough for. Their tables are added to `words`, with what `record`
    /// says of joins.
    pub(super) fn layers(
        &self,
        start: usize,
        width: &Width,
        record: &dyn Fn(usize, &Places) -> Record,
        words: &mut Vec<u32>,
    ) -> Vec<Layered> {
        let end = self.items.len();
        let wide = |round: &usize| {
            let items = self.items[*round].iter();
            items.map(|&(item, _)| width.of(item)).sum::<usize>() > width.lanes
        };
        let top = (start..end).rev().find(wide);
        let top = top.map_or(start, |round| round + 1);
        let mut layers = Vec::new();
        let count = (top - start).div_ceil(width.rounds);
        for layer in 0..count {
            let bound = |layer: usize| start + (top - start) * layer / count;
            layers.push(self.layer(bound(layer)..bound(layer + 1), width, record, words));
        }
        if top < end {
            layers.push(self.layer(top..end, width, record, words));
        }
        layers
    }

    fn layer(
        &self,
        rounds: Range<usize>,
        width: &Width,
        record: &dyn Fn(usize, &Places) -> Record,
        words: &mut Vec<u32>,
    ) -> Layered {
        let groups = self.groups(&rounds, width);
        let places = Places::new(&groups, self.joins, width);
        let others = |item: &&Item| !matches!(item, Item::Join(_));
        let joins = |item: &&Item| matches!(item, Item::Join(_));
        let layered = Layered {
            groups: small(groups.len()),
            rounds: small(rounds.len()),
            starts: small(words.len()),
            mixed: places.is_none(),
            down: (groups.iter().flatten().flatten())
                .any(|item| matches!(item, Item::Join(_) | Item::Chunk(_))),
        };
        let places = places.unwrap_or(Places(Vec::new()));
        let mut at = words.len() + groups.len() * (2 * rounds.len() + 1);
        for group in &groups {
            words.push(small(at));
            for round in group {
                at += round.iter().filter(others).count();
                words.push(small(at));
                at += RECORD as usize * round.iter().filter(joins).count();
                words.push(small(at));
            }
        }
        for round in groups.iter().flatten() {
            for &item in round {
                match item {
                    Item::Chunk(chunk) => words.push(small(chunk) << 2 | item::CHUNK),
                    Item::Sum(sum) => words.push(small(sum) << 2 | item::SUM),
                    Item::Leading(chunk) => words.push(small(chunk) << 2 | item::LEADING),
                    Item::Join(_) => {}
                }
            }
            for &item in round {
                if let Item::Join(join) = item {
                    words.extend(record(join, &places));
                }
            }
        }
        layered
    }

    /// For each workgroup, the items of each of some rounds.
    fn groups(&self, rounds: &Range<usize>, width: &Width) -> Vec<Vec<Vec<Item>>> {
        let parts = self.parts(rounds);
        let mut by_part: Vec<(usize, usize, Item)> = Vec::new();
        for round in rounds.clone() {
            let items = self.items[round].iter();
            by_part.extend(
                items.map(|&(item, _)| (parts.root(self.number(item)), round - rounds.start, item)),
            );
        }
        // A stable sort: items of a part stay in the order of their rounds.
        by_part.sort_by_key(|&(part, ..)| part);
        let empty = || vec![Vec::new(); rounds.len()];
        let (mut groups, mut group) = (Vec::new(), empty());
        let mut taken = vec![0; rounds.len()];
        for part in by_part.chunk_by(|a, b| a.0 == b.0) {
            let mut own = vec![0; rounds.len()];
            for &(_, round, item) in part {
                own[round] += width.of(item);
            }
            let is_full = taken.iter().zip(&own).any(|(a, b)| a + b > width.lanes);
            if is_full && taken.iter().any(|&taken| taken > 0) {
                groups.push(core::mem::replace(&mut group, empty()));
                taken.fill(0);
            }
            for (taken, own) in taken.iter_mut().zip(own) {
                *taken += own;
            }
            for &(_, round, item) in part {
                group[round].push(item);
            }
        }
        groups.push(group);
        groups
    }

    /// Which items of some rounds hang together within these.
    fn parts(&self, rounds: &Range<usize>) -> Parts {
        let mut within = vec![false; self.node_count()];
        for &(item, _) in self.items[rounds.clone()].iter().flatten() {
            within[self.number(item)] = true;
        }
        let mut parts = Parts((0..self.node_count()).collect());
        for round in rounds.clone() {
            for (index, &(item, start)) in self.items[round].iter().enumerate() {
                let next = self.items[round].get(index + 1).map(|&(_, start)| start);
                let next = next.or_else(|| self.first_need(round + 1));
                for &need in &self.needs[start..next.unwrap_or(self.needs.len())] {
                    if within[need as usize] {
                        parts.unite(self.number(item), need as usize);
                    }
                }
            }
        }
        parts
    }

    /// Where the needs of the rounds from here on start.
    fn first_need(&self, round: usize) -> Option<usize> {
        let rest = self.items.get(round..)?;
        rest.iter().flatten().next().map(|&(_, start)| start)
    }

    fn node_count(&self) -> usize {
        let sums = self.items.iter().flatten();
        let sums = sums.filter(|(item, _)| matches!(item, Item::Sum(_)));
        self.chunks + self.joins + sums.count()
    }
}

/// Disjoint sets, each named by its smallest member.
struct Parts(Vec<usize>);

impl Parts {
    fn root(&self, mut member: usize) -> usize {
        while self.0[member] != member {
            member = self.0[member];
        }
        member
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let root = a.min(b);
        // Two levels at most are left of the paths gone through.
        self.0[a] = root;
        self.0[b] = root;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A binary tree over `leaves` chunks, joins two by two, with a sum at the side.
    fn tree(leaves: usize) -> Rounds {
        let mut rounds = Rounds::new(leaves, leaves - 1);
        let mut parts: Vec<Item> = (0..leaves).map(Item::Chunk).collect();
        for &part in &parts {
            rounds.push(0, part, &[]);
        }
        let (mut round, mut next) = (1, 0);
        while parts.len() > 1 {
            let mut joined = Vec::new();
            for pair in parts.chunks(2) {
                if let [a, b] = pair {
                    rounds.push(round, Item::Join(next), &[*a, *b]);
                    joined.push(Item::Join(next));
                    next += 1;
                } else {
                    joined.extend(pair);
                }
            }
            if round == 2 {
                rounds.push(round, Item::Sum(0), &[Item::Chunk(0), Item::Chunk(1)]);
            }
            parts = joined;
            round += 1;
        }
        rounds
    }

    /// A workgroup with one round or one join more than there are places has none of them on chip, and its table is that of rounds
    /// of all kinds.
    #[test]
    fn joins_beyond_the_places_have_none() {
        let width = Width {
            lanes: 128,
            join: 1,
            rounds: 3,
        };
        let one_by_one = |joins: usize| (0..joins).map(|join| vec![Item::Join(join)]).collect();
        let at_once = |joins: usize| vec![(0..joins).map(Item::Join).collect::<Vec<_>>()];
        let most = PLACES as usize;
        for group in [one_by_one(most), at_once(most)] {
            let places = Places::new(&[group], most, &width).unwrap();
            assert!((0..PLACES).all(|place| places.of(place as usize) == place));
            assert_eq!(places.of(most), NOWHERE);
        }
        for group in [one_by_one(most + 1), at_once(most + 1)] {
            assert!(Places::new(&[group], most + 1, &width).is_none());
        }
        // Rounds without joins count too.
        let mut group = one_by_one(most);
        group.push(Vec::new());
        assert!(Places::new(&[group], most, &width).is_none());

        for joins in [most, most + 1] {
            let mut rounds = Rounds::new(1, joins);
            for join in 0..joins {
                let need = join.checked_sub(1).map_or(Item::Chunk(0), Item::Join);
                rounds.push(join, Item::Join(join), &[need]);
            }
            let record = |join, places: &Places| [places.of(join); RECORD as usize];
            let mut words = Vec::new();
            let layers = rounds.layers(0, &width, &record, &mut words);
            let [layer] = layers[..] else {
                panic!("{layers:?}");
            };
            let fits = joins == most;
            assert_eq!((layer.rounds as usize, layer.mixed), (joins, !fits));
            let records = words[2 * joins + 1..].chunks(RECORD as usize);
            assert_eq!(records.len(), joins);
            for (place, record) in (0..).zip(records) {
                assert_eq!(record[0], if fits { place } else { NOWHERE });
            }
        }
    }

    /// Every item is in one place, after what it needs, and what it needs within a dispatch is in its
    /// workgroup.
    #[test]
    fn items_follow_what_they_need() {
        for leaves in [2, 3, 17, 100, 1000] {
            let rounds = tree(leaves);
            let width = Width {
                lanes: 128,
                join: 16,
                rounds: 3,
            };
            let mut words = vec![7, 7, 7];
            let record = |join, _: &Places| [small(join); RECORD as usize];
            let layers = rounds.layers(1, &width, &record, &mut words);
            // Dispatch, group and round of each item that is done; chunks are done before.
            let mut done = vec![None; rounds.node_count()];
            done[..leaves].fill(Some((usize::MAX, 0, 0)));
            let needs = |number: usize| {
                let all = rounds.items.iter().flatten();
                let mut starts = all.map(|&(item, start)| (rounds.number(item), start));
                let (_, start) = starts.find(|&(n, _)| n == number).unwrap();
                let next = starts.next().map_or(rounds.needs.len(), |(_, start)| start);
                rounds.needs[start..next].to_vec()
            };
            for (dispatch, layer) in layers.iter().enumerate() {
                let table = 2 * layer.rounds as usize + 1;
                for group in 0..layer.groups as usize {
                    let starts = &words[layer.starts as usize + group * table..][..table];
                    for round in 0..layer.rounds as usize {
                        let [first, joins, end] = [0, 1, 2].map(|k| starts[2 * round + k]);
                        let others = (first..joins).map(|at| {
                            let word = words[at as usize];
                            let index = (word >> 2) as usize;
                            match word & 3 {
                                item::CHUNK => Item::Chunk(index),
                                _ => Item::Sum(index),
                            }
                        });
                        let joins = (joins..end).step_by(RECORD as usize);
                        let joins = joins.map(|at| Item::Join(words[at as usize] as usize));
                        for item in others.chain(joins) {
                            let number = rounds.number(item);
                            for need in needs(number) {
                                let (d, g, r) = done[need as usize].unwrap();
                                let earlier = d == usize::MAX || d < dispatch;
                                assert!(earlier || (g == group && r < round), "{item:?}");
                            }
                            assert_eq!(done[number], None, "{item:?} twice");
                            done[number] = Some((dispatch, group, round));
                        }
                    }
                }
            }
            assert!(done.iter().all(Option::is_some), "{leaves} leaves");
            assert_eq!(layers.last().unwrap().groups, 1);
        }
    }
}
