//! What the queries do with the pairs they find, each as little as its answer needs.

use std::ops::ControlFlow;

/// Receives the colliding pairs, in any order, each once.
pub(crate) trait Sink: Send {
    /// Whether the pair could still change the answer.
    fn wants(&self, _pair: [u32; 2]) -> bool {
        true
    }

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

/// All pairs.
#[derive(Default)]
pub(crate) struct Pairs(pub(crate) Vec<[u32; 2]>);

impl Sink for Pairs {
    fn hit(&mut self, pair: [u32; 2]) -> ControlFlow<()> {
        self.0.push(pair);
        ControlFlow::Continue(())
    }
}
