//! Loops and couplings as tables for kernels; `shaders/wgsl/loops/memory.wgsl` says what they hold.
//!
//! Loops that move the same joints are solved together: they make up a group, with all bodies that these joints
//! carry. Bodies of a group are numbered level by level from the world, so that a level's are computed at once and
//! children of one body follow each other.

use super::tables::{NONE, Tables, quaternion, small};
use crate::Error;
use crate::link::Link;
use crate::loops::constraint::{Closing, Constraint, Kind};
use crate::loops::equation::Equation;
use crate::workspace::Sweeps;
use std::collections::{BTreeMap, BTreeSet};
use vertebra_assembly::Model;
use vertebra_shaders::dca::loops::{
    BODY_NUMBERS, FREEDOM_NUMBERS, MOST_ROWS, ON_CHIP, ROW_NUMBERS, equation,
};
use vertebra_spatial::Transform;

/// What is known of the groups of a model's loops.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoopTables {
    /// First of the words that say where groups start.
    pub(super) starts: u32,
    /// Groups that are small enough to be worked on on chip, which come first, and others.
    pub(super) on_chip: u32,
    pub(super) others: u32,
    /// Numbers that groups keep.
    pub(super) memory: usize,
}

/// A constraint and the bodies that it moves, by their numbers in the model.
struct Chained {
    constraint: Constraint,
    /// From both ends inwards to what carries both, and that up to the world.
    chains: [Vec<usize>; 3],
}

impl Chained {
    fn new(constraint: Constraint, s: &Sweeps<f64>, body_of_dof: &[usize]) -> Self {
        let paths = ends(&constraint, body_of_dof)
            .map(|end| end.map_or(Vec::new(), |body| s.path_to(body)));
        let common = (paths[0].iter().zip(&paths[1]))
            .take_while(|(a, b)| a == b)
            .count();
        let inwards = |path: &[usize]| path.iter().rev().copied().collect();
        let chains = [
            inwards(&paths[0][common..]),
            inwards(&paths[1][common..]),
            inwards(&paths[0][..common]),
        ];
        Self { constraint, chains }
    }

    fn bodies(&self) -> impl Iterator<Item = usize> + '_ {
        self.chains.iter().flatten().copied()
    }
}

/// The bodies at both ends, none for the world.
fn ends(constraint: &Constraint, body_of_dof: &[usize]) -> [Option<usize>; 2] {
    match &constraint.kind {
        Kind::Loop(closing) => {
            let Closing { ends, .. } = &**closing;
            ends.each_ref().map(|end| end.as_ref().map(|end| end.body))
        }
        Kind::Coupling { entries, .. } => {
            entries.map(|(slot, _)| Some(body_of_dof[constraint.dofs[slot]]))
        }
    }
}

impl LoopTables {
    /// Adds a model's loops to the tables, if it has any.
    pub(super) fn add_to(tables: &mut Tables, model: &Model) -> Result<Option<Self>, Error> {
        if !crate::loops::has_loops(model) {
            return Ok(None);
        }
        let s = Sweeps::<f64>::new(model);
        let (constraints, ..) = Constraint::of_model(model, &s);
        let mut body_of_dof = vec![0; model.dof_count()];
        for (body, link) in s.links.iter().enumerate() {
            body_of_dof[link.v..][..link.kind.dof_count()].fill(body);
        }
        let constraints: Vec<Chained> = (constraints.into_iter())
            .map(|constraint| Chained::new(constraint, &s, &body_of_dof))
            .collect();
        let roots = roots(&s.links);
        let mut carried: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (body, root) in roots.iter().enumerate() {
            if let Some(root) = root {
                carried.entry(*root).or_default().push(body);
            }
        }
        let (mut small_starts, mut starts) = (Vec::new(), Vec::new());
        let mut memory = 0;
        for group in groups(&constraints, &roots) {
            let group = Group::new(group, &s.links, &roots, &carried);
            group.check()?;
            let before = memory;
            let start = group.add_to(tables, &s.links, &mut memory);
            let (numbers, rows) = ON_CHIP;
            if memory - before <= numbers as usize && group.rows() <= rows as usize {
                small_starts.push(start);
            } else {
                starts.push(start);
            }
        }
        let at = small(tables.words.len());
        tables.words.extend(small_starts.iter().chain(&starts));
        Ok(Some(Self {
            starts: at,
            on_chip: small(small_starts.len()),
            others: small(starts.len()),
            memory,
        }))
    }
}

/// Of each body the outermost of those that carry it, itself among them, beyond which nothing moves.
fn roots(links: &[Link<f64>]) -> Vec<Option<usize>> {
    let mut roots: Vec<Option<usize>> = Vec::with_capacity(links.len());
    for (body, link) in links.iter().enumerate() {
        let carried = link.parent.and_then(|parent| roots[parent]);
        let moves = link.kind.dof_count() > 0;
        roots.push(carried.or(moves.then_some(body)));
    }
    roots
}

/// Constraints that move the same joints, directly or through others.
fn groups<'a>(constraints: &'a [Chained], roots: &[Option<usize>]) -> Vec<Vec<&'a Chained>> {
    // Each points to an earlier one of its group, the first of a group to itself.
    let mut earlier: Vec<usize> = (0..constraints.len()).collect();
    let mut first_of: BTreeMap<usize, usize> = BTreeMap::new();
    for (index, chained) in constraints.iter().enumerate() {
        for root in chained.bodies().filter_map(|body| roots[body]) {
            let other = *first_of.entry(root).or_insert(index);
            let firsts = [index, other].map(|one| first_of_group(&mut earlier, one));
            earlier[firsts[0].max(firsts[1])] = firsts[0].min(firsts[1]);
        }
    }
    let mut groups: BTreeMap<usize, Vec<&Chained>> = BTreeMap::new();
    for (index, chained) in constraints.iter().enumerate() {
        let first = first_of_group(&mut earlier, index);
        groups.entry(first).or_default().push(chained);
    }
    groups.into_values().collect()
}

/// The first constraint of a group; halves the way to it.
fn first_of_group(earlier: &mut [usize], mut index: usize) -> usize {
    while earlier[index] != index {
        earlier[index] = earlier[earlier[index]];
        index = earlier[index];
    }
    index
}

/// Constraints that are solved together, and the bodies that they know of.
struct Group<'a> {
    constraints: Vec<&'a Chained>,
    /// By numbers in the model, level by level.
    bodies: Vec<usize>,
    /// Where levels start, and the last one ends.
    levels: Vec<u32>,
    /// How many children each has.
    children: Vec<u32>,
    /// Number of each body in the group.
    number: BTreeMap<usize, u32>,
    /// First freedom of each of the group's bodies, and their number.
    dofs: Vec<u32>,
}

impl<'a> Group<'a> {
    fn new(
        constraints: Vec<&'a Chained>,
        links: &[Link<f64>],
        roots: &[Option<usize>],
        carried: &BTreeMap<usize, Vec<usize>>,
    ) -> Self {
        let (mut members, mut moved) = (BTreeSet::new(), BTreeSet::new());
        for body in constraints.iter().flat_map(|chained| chained.bodies()) {
            match roots[body] {
                Some(root) => moved.insert(root),
                None => members.insert(body),
            };
        }
        members.extend(moved.iter().filter_map(|root| carried.get(root)).flatten());
        let mut children: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut level = Vec::new();
        for &body in &members {
            match links[body].parent {
                Some(parent) => children.entry(parent).or_default().push(body),
                None => level.push(body),
            }
        }
        let children_of = |body: &usize| children.get(body).map_or(&[][..], Vec::as_slice);
        let (mut bodies, mut levels) = (Vec::new(), vec![0]);
        while !level.is_empty() {
            let next = level.iter().flat_map(children_of).copied().collect();
            bodies.append(&mut level);
            levels.push(small(bodies.len()));
            level = next;
        }
        let mut dofs = vec![0];
        for &body in &bodies {
            let before = dofs[dofs.len() - 1];
            dofs.push(before + small(links[body].kind.dof_count()));
        }
        Self {
            constraints,
            number: (0..)
                .zip(&bodies)
                .map(|(number, &body)| (body, number))
                .collect(),
            children: bodies
                .iter()
                .map(|body| small(children_of(body).len()))
                .collect(),
            bodies,
            levels,
            dofs,
        }
    }

    fn rows(&self) -> usize {
        (self.constraints.iter())
            .map(|chained| chained.constraint.rows.len())
            .sum()
    }

    fn check(&self) -> Result<(), Error> {
        let (rows, fit) = (self.rows(), MOST_ROWS as usize);
        match self.constraints.first() {
            Some(first) if rows > fit => Err(Error::TooManyLoops {
                name: first.constraint.name.clone(),
                rows,
                fit,
            }),
            _ => Ok(()),
        }
    }

    /// Adds its tables; gives where they start.
    fn add_to(&self, tables: &mut Tables, links: &[Link<f64>], memory: &mut usize) -> u32 {
        let constants = small(tables.links.len());
        for &body in &self.bodies {
            put_link(&mut tables.links, &links[body]);
        }
        let slots: Vec<u32> = self.bodies.iter().map(|&body| tables.slots[body]).collect();
        let levels_at = small(tables.words.len());
        tables.words.extend(&self.levels);
        let bodies_at = small(tables.words.len());
        // Children come in the order of their parents, after the first level.
        let mut next_child = self.levels.get(1).copied().unwrap_or(0);
        for (index, &body) in self.bodies.iter().enumerate() {
            let number = |body: Option<usize>| body.map_or(NONE, |body| self.number[&body]);
            let count = self.children[index];
            tables.words.extend([
                slots[index],
                number(links[body].parent),
                next_child,
                count,
                self.dofs[index],
            ]);
            next_child += count;
        }
        let memory_at = *memory;
        let dof_count = self.dofs[self.bodies.len()] as usize;
        *memory += self.bodies.len() * BODY_NUMBERS as usize
            + dof_count * FREEDOM_NUMBERS as usize
            + self.rows() * ROW_NUMBERS as usize;
        let records = self.put_constraints(tables, links);
        let pairs_at = self.put_pairs(tables, links, &records);
        let rows_at = self.put_rows(tables, links, &records, memory);
        let dofs_at = self.put_dofs(tables, links, &records, &slots);
        let most = (self.constraints.iter())
            .map(|chained| chained.bodies().count())
            .max();
        let at = small(tables.words.len());
        tables.words.extend([
            small(self.bodies.len()),
            small(self.levels.len() - 1),
            small(self.rows()),
            pairs_at.1,
            small(dof_count),
            small(most.unwrap_or(0)),
            bodies_at,
            levels_at,
            rows_at,
            pairs_at.0,
            dofs_at,
            constants,
            small(memory_at),
            small(*memory - memory_at),
        ]);
        at
    }

    /// The bodies of a constraint with where their entries start.
    fn entries<'b>(
        &self,
        chained: &'b Chained,
        links: &'b [Link<f64>],
    ) -> impl Iterator<Item = (usize, u32)> + 'b {
        chained.bodies().scan(0, |next, body| {
            let entry = *next;
            *next += small(links[body].kind.dof_count());
            Some((body, entry))
        })
    }

    /// Records of constraints, with their lists; gives where they are.
    fn put_constraints(&self, tables: &mut Tables, links: &[Link<f64>]) -> Vec<u32> {
        let mut records = Vec::new();
        let mut first_row = 0;
        for chained in &self.constraints {
            let dofs_at = small(tables.words.len());
            for body in chained.bodies() {
                let first = self.dofs[self.number[&body] as usize];
                tables
                    .words
                    .extend(first..first + small(links[body].kind.dof_count()));
            }
            let entries = small(tables.words.len()) - dofs_at;
            let chains_at = small(tables.words.len());
            let numbers = chained.bodies().map(|body| self.number[&body]);
            tables.words.extend(numbers);
            let constants = small(tables.links.len());
            let mut positions = [0, 0];
            let ends = match &chained.constraint.kind {
                Kind::Loop(closing) => {
                    for k in 0..2 {
                        let end = closing.ends[k].as_ref();
                        let frame = end.map_or(closing.placements[k], |end| end.frame);
                        put_frame(&mut tables.links, &frame);
                    }
                    (closing.ends.each_ref())
                        .map(|end| end.as_ref().map_or(NONE, |end| self.number[&end.body]))
                }
                Kind::Coupling {
                    positions: [own, other],
                    entries,
                    offset,
                    unit,
                    ..
                } => {
                    (tables.links).push([entries[1].1, offset / unit, 0.0, 0.0]);
                    let mut ends = [0, 0];
                    for (k, q) in [*own, *other].into_iter().enumerate() {
                        let has = |(body, _): &(usize, u32)| {
                            links[*body].q == q && links[*body].kind.dof_count() == 1
                        };
                        if let Some((body, entry)) = self.entries(chained, links).find(has) {
                            ends[k] = entry;
                            positions[k] = tables.position_start(tables.slots[body]);
                        }
                    }
                    ends
                }
            };
            let rows = small(chained.constraint.rows.len());
            records.push(small(tables.words.len()));
            let [first, second, carrying] =
                (chained.chains.each_ref()).map(|chain| small(chain.len()));
            tables.words.extend([
                rows,
                first_row,
                entries,
                dofs_at,
                chains_at,
                first,
                second,
                carrying,
                ends[0],
                ends[1],
                constants,
                positions[0],
                positions[1],
            ]);
            first_row += rows;
        }
        records
    }

    /// Which constraints move the same joints, and where the entries of these are; gives where that is, and the
    /// number of pairs.
    fn put_pairs(&self, tables: &mut Tables, links: &[Link<f64>], records: &[u32]) -> (u32, u32) {
        let mut through: BTreeMap<usize, Vec<(usize, u32)>> = BTreeMap::new();
        let mut pairs = Vec::new();
        for (index, chained) in self.constraints.iter().enumerate() {
            let mut runs: BTreeMap<usize, Vec<[u32; 3]>> = BTreeMap::new();
            for (body, entry) in self.entries(chained, links) {
                let freedoms = small(links[body].kind.dof_count());
                let others = through.entry(body).or_default();
                others.push((index, entry));
                for &(other, theirs) in others.iter().filter(|_| freedoms > 0) {
                    let runs = runs.entry(other).or_default();
                    match runs.last_mut() {
                        Some([a, b, length]) if *a + *length == entry && *b + *length == theirs => {
                            *length += freedoms;
                        }
                        _ => runs.push([entry, theirs, freedoms]),
                    }
                }
            }
            for (other, runs) in runs {
                let list = small(tables.words.len());
                pairs.push([records[index], records[other], list, small(runs.len())]);
                tables.words.extend(runs.concat());
            }
        }
        let at = small(tables.words.len());
        tables.words.extend(pairs.concat());
        (at, small(pairs.len()))
    }

    /// Equations, with where they are in J, Y and A.
    fn put_rows(
        &self,
        tables: &mut Tables,
        links: &[Link<f64>],
        records: &[u32],
        memory: &mut usize,
    ) -> u32 {
        let at = small(tables.words.len());
        let mut earliest: BTreeMap<usize, u32> = BTreeMap::new();
        let mut row = 0;
        for (chained, &record) in self.constraints.iter().zip(records) {
            let constraint = &chained.constraint;
            let moved = chained
                .bodies()
                .filter(|&body| links[body].kind.dof_count() > 0);
            let begin = moved.fold(row, |begin, body| {
                begin.min(*earliest.entry(body).or_insert(row))
            });
            let entries: usize = chained
                .bodies()
                .map(|body| links[body].kind.dof_count())
                .sum();
            for (index, own) in constraint.rows.clone().enumerate() {
                let (code, given) = match &constraint.kind {
                    Kind::Loop(closing) => code(closing.equations[index]),
                    Kind::Coupling { .. } => (equation::COUPLING, 0.0),
                };
                let jacobian = small(*memory);
                let whitened = small(*memory + entries);
                let matrix = small(*memory + 2 * entries);
                *memory += 2 * entries + (row + 1 - begin) as usize;
                let constants = small(tables.links.len());
                tables
                    .links
                    .push([given, constraint.size_of(own), 0.0, 0.0]);
                tables
                    .words
                    .extend([record, code, jacobian, whitened, matrix, begin, constants]);
                row += 1;
            }
        }
        at
    }

    /// Of each freedom its place among the model's, and which constraints' entries act along it.
    fn put_dofs(
        &self,
        tables: &mut Tables,
        links: &[Link<f64>],
        records: &[u32],
        slots: &[u32],
    ) -> u32 {
        let mut acting: Vec<Vec<[u32; 2]>> =
            vec![Vec::new(); self.dofs[self.bodies.len()] as usize];
        for (chained, &record) in self.constraints.iter().zip(records) {
            let own = chained.chains[0].len() + chained.chains[1].len();
            // Of loops what carries both ends does not move them against each other; couplings say by numbers.
            let taken = match chained.constraint.kind {
                Kind::Loop(_) => own,
                Kind::Coupling { .. } => usize::MAX,
            };
            for (body, entry) in self.entries(chained, links).take(taken) {
                let first = self.dofs[self.number[&body] as usize];
                for k in 0..small(links[body].kind.dof_count()) {
                    acting[(first + k) as usize].push([record, entry + k]);
                }
            }
        }
        let mut rows = Vec::new();
        for (&body, &slot) in self.bodies.iter().zip(slots) {
            for k in 0..small(links[body].kind.dof_count()) {
                let list = &acting[rows.len()];
                rows.push([
                    tables.dof_start(slot) + k,
                    small(tables.words.len()),
                    small(list.len()),
                ]);
                tables.words.extend(list.concat());
            }
        }
        let at = small(tables.words.len());
        tables.words.extend(rows.concat());
        at
    }
}

/// An equation's kind and axes, and the number that belongs to it.
fn code(equation: Equation) -> (u32, f64) {
    match equation {
        Equation::Point(axis) => (equation::POINT | small(axis) << 3, 0.0),
        Equation::Perpendicular(one, other) => (
            equation::PERPENDICULAR | small(one) << 3 | small(other) << 5,
            0.0,
        ),
        Equation::Screw(pitch) => (equation::SCREW, pitch),
        Equation::Distance(length) => (equation::DISTANCE, length),
    }
}

/// Placement and mass, moment and inertia about the joint's origin.
fn put_link(links: &mut Vec<[f64; 4]>, link: &Link<f64>) {
    let (at, inertia) = (link.placement.translation, &link.inertia);
    let (moment, rotational) = (inertia.moment, inertia.rotational);
    links.extend([
        quaternion(&link.placement.rotation),
        [at.x, at.y, at.z, inertia.mass],
        [moment.x, moment.y, moment.z, rotational.xx],
        [rotational.yy, rotational.zz, rotational.yz, rotational.xz],
        [rotational.xy, 0.0, 0.0, 0.0],
    ]);
}

fn put_frame(links: &mut Vec<[f64; 4]>, frame: &Transform<f64>) {
    let at = frame.translation;
    links.extend([quaternion(&frame.rotation), [at.x, at.y, at.z, 0.0]]);
}
