//! What the queries do with the pairs they find, each as little as its answer needs.

use std::ops::ControlFlow;

use crate::exact::{Decision, Stage};
use crate::parallel;

/// A method, prepared for two meshes and a pose, that finds pairs in tasks of any order.
pub(crate) trait PairTest: Sync {
    /// What a thread keeps from task to task.
    type Scratch: Default + Send;

    /// The number of tasks.
    fn tasks(&self) -> usize;

    /// Hands the colliding pairs of one task to the sink.
    fn visit(
        &self,
        task: usize,
        scratch: &mut Self::Scratch,
        sink: &mut impl Sink,
    ) -> ControlFlow<()>;
}

/// Runs all tasks, with one sink a thread.
///
/// Which sink gets which tasks depends on timing, so callers merge sinks by operations that do not care.
pub(crate) fn run<T: PairTest, S: Sink>(
    test: &T,
    threads: usize,
    new_sink: impl Fn() -> S + Send + Sync,
) -> Vec<S> {
    let new_state = || (T::Scratch::default(), new_sink());
    let visit = |task, (scratch, sink): &mut (T::Scratch, S)| test.visit(task, scratch, sink);
    let states = parallel::share(threads, test.tasks(), new_state, visit);
    states.into_iter().map(|(_, sink)| sink).collect()
}

/// Receives the colliding pairs, in any order, each once.
pub(crate) trait Sink: Send {
    /// Whether the pair could still change the answer.
    fn wants(&self, _pair: [u32; 2]) -> bool {
        true
    }

    /// Learns how a pair was decided.
    fn decided(&mut self, _decision: &Decision) {}

    /// Takes a colliding pair; breaks when the answer is known.
    fn hit(&mut self, pair: [u32; 2]) -> ControlFlow<()>;
}

/// Whether there is a pair.
#[derive(Default)]
pub(crate) struct Any(pub(crate) bool);

impl Sink for Any {
    fn hit(&mut self, _pair: [u32; 2]) -> ControlFlow<()> {
        self.0 = true;
        ControlFlow::Break(())
    }
}

/// How many pairs there are.
#[derive(Default)]
pub(crate) struct Count(pub(crate) u64);

impl Sink for Count {
    fn hit(&mut self, _pair: [u32; 2]) -> ControlFlow<()> {
        self.0 += 1;
        ControlFlow::Continue(())
    }
}

/// Which triangles of A and of B are in a pair.
pub(crate) struct Mask {
    pub(crate) a: Vec<bool>,
    pub(crate) b: Vec<bool>,
}

impl Mask {
    pub(crate) fn new(a: usize, b: usize) -> Self {
        Self {
            a: vec![false; a],
            b: vec![false; b],
        }
    }

    pub(crate) fn merge(mut self, other: &Self) -> Self {
        let merge = |into: &mut [bool], from: &[bool]| {
            for (into, from) in into.iter_mut().zip(from) {
                *into |= from;
            }
        };
        merge(&mut self.a, &other.a);
        merge(&mut self.b, &other.b);
        self
    }
}

impl Sink for Mask {
    fn wants(&self, [i, j]: [u32; 2]) -> bool {
        !(self.a[i as usize] && self.b[j as usize])
    }

    fn hit(&mut self, [i, j]: [u32; 2]) -> ControlFlow<()> {
        self.a[i as usize] = true;
        self.b[j as usize] = true;
        ControlFlow::Continue(())
    }
}

/// All pairs, as one number each, in whose order they are in lexicographic order.
#[derive(Default)]
pub(crate) struct Pairs(Vec<u64>);

impl Pairs {
    /// The pairs of all sinks, sorted.
    pub(crate) fn sorted(sinks: Vec<Self>) -> Vec<[u32; 2]> {
        let mut keys: Vec<u64> = sinks.into_iter().flat_map(|pairs| pairs.0).collect();
        keys.sort_unstable();
        keys.into_iter().map(pair_of).collect()
    }
}

fn key_of([i, j]: [u32; 2]) -> u64 {
    u64::from(i) << 32 | u64::from(j)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "the two halves, each on its own"
)]
fn pair_of(key: u64) -> [u32; 2] {
    [(key >> 32) as u32, key as u32]
}

impl Sink for Pairs {
    fn hit(&mut self, pair: [u32; 2]) -> ControlFlow<()> {
        self.0.push(key_of(pair));
        ControlFlow::Continue(())
    }
}

/// How often each stage of the exact test decides.
///
/// A pair of triangles whose boxes overlap is decided by the first stage that can.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Statistics {
    /// Pairs whose boxes overlap.
    pub pairs: u64,
    /// Of these, pairs apart because one triangle is on one side of the plane of the other.
    pub apart_by_first_plane: u64,
    /// Pairs apart because the other is on one side of the plane of the one.
    pub apart_by_second_plane: u64,
    /// Pairs decided on the line where the planes meet.
    pub on_line: u64,
    /// Pairs in one plane, or with a triangle of zero area, decided in two dimensions.
    pub degenerate: u64,
    /// Pairs of which an orientation sign needed more than `f64`, in whatever stage.
    pub beyond_filter: u64,
    /// Orientation signs, of four points in space or three in a plane, that needed more than `f64`.
    pub signs_beyond_filter: u64,
    /// Pairs that meet.
    pub hits: u64,
}

impl Statistics {
    pub(crate) fn merge(mut self, other: &Self) -> Self {
        self.pairs += other.pairs;
        self.apart_by_first_plane += other.apart_by_first_plane;
        self.apart_by_second_plane += other.apart_by_second_plane;
        self.on_line += other.on_line;
        self.degenerate += other.degenerate;
        self.beyond_filter += other.beyond_filter;
        self.signs_beyond_filter += other.signs_beyond_filter;
        self.hits += other.hits;
        self
    }
}

impl Sink for Statistics {
    fn decided(&mut self, decision: &Decision) {
        self.pairs += 1;
        let stage = match decision.stage {
            Stage::PlaneOfB => &mut self.apart_by_first_plane,
            Stage::PlaneOfA => &mut self.apart_by_second_plane,
            Stage::Line => &mut self.on_line,
            Stage::Degenerate => &mut self.degenerate,
        };
        *stage += 1;
        self.beyond_filter += u64::from(decision.exact_signs > 0);
        self.signs_beyond_filter += u64::from(decision.exact_signs);
    }

    fn hit(&mut self, _pair: [u32; 2]) -> ControlFlow<()> {
        self.hits += 1;
        ControlFlow::Continue(())
    }
}
