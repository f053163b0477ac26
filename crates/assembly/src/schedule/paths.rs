//! Laying a tree out in paths.

use super::small;
use crate::BodyId;

/// The bodies path by path, and where each path starts, one entry more than paths.
pub(super) struct Layout {
    pub(super) order: Vec<BodyId>,
    pub(super) starts: Vec<u32>,
}

/// Where a path assembled from its tail to some body stands, as far as can be told before it is cut.
///
/// A result that is there after t rounds counts 2^t: joining results that count x_i takes about
/// log2 sum x_i rounds (the Kraft sum of a binary tree with leaves at those depths), and one more
/// for keeping them in order.
#[derive(Clone, Copy)]
struct Progress {
    /// What its complete chunks count together.
    closed: f64,
    /// What the chunk that is still growing counts: its latest body.
    open: f64,
    /// Joints of that chunk.
    joints: usize,
}

/// A chunk of bodies without rakes is there after one round.
const ONE_ROUND: f64 = 2.0;

impl Progress {
    /// A path's last body, raked by what counts `rakes`.
    const fn tail(rakes: f64) -> Self {
        Self {
            closed: 0.0,
            open: ONE_ROUND * rakes,
            joints: 1,
        }
    }

    /// One more body inboard, raked by what counts `rakes`.
    fn extended(self, rakes: f64, window: usize) -> Self {
        let open = ONE_ROUND * rakes;
        if self.joints < window {
            Self {
                open: self.open.max(open),
                joints: self.joints + 1,
                ..self
            }
        } else {
            Self {
                closed: self.total(),
                open,
                joints: 1,
            }
        }
    }

    fn total(self) -> f64 {
        self.closed + self.open
    }

    /// What the path counts when it is assembled.
    fn finished(self) -> f64 {
        if self.closed == 0.0 {
            self.open
        } else {
            2.0 * self.total()
        }
    }
}

/// What a body's children count together.
#[derive(Clone, Copy, Default)]
struct Children {
    /// The child that counts most, the first of several.
    latest: Option<u32>,
    largest: f64,
    second: f64,
    sum: f64,
}

impl Children {
    fn add(&mut self, child: usize, count: f64) {
        self.sum += count;
        if count >= self.largest {
            self.second = self.largest;
            self.largest = count;
            self.latest = Some(small(child));
        } else {
            self.second = self.second.max(count);
        }
    }

    /// Two of the sums go straight to the body: half the Kraft sum. Nothing raked counts 2^0.
    fn all(&self) -> f64 {
        self.largest.max(0.5 * self.sum).max(1.0)
    }

    fn but_the_latest(&self) -> f64 {
        self.second.max(0.5 * (self.sum - self.largest)).max(1.0)
    }
}

/// Chooses for every body the child with which its path goes on, if it does.
///
/// It goes on with the child that is there last, unless ending the path and raking all of them
/// promises less: 2 all against what goes on plus 2 others, where the others are late too. Ending it
/// where both children of every body are alike is what keeps bushes within 2 log2 n: a late rake in
/// the middle of a path costs a round for the chunk and two for the joins to either side.
pub(super) fn layout(parents: &[Option<BodyId>], window: usize) -> Layout {
    let n = parents.len();
    let mut children = vec![Children::default(); n];
    let mut progress = vec![Progress::tail(1.0); n];
    let mut next: Vec<Option<u32>> = vec![None; n];
    for body in (0..n).rev() {
        let below = children[body];
        if let Some(latest) = below.latest {
            let on = progress[latest as usize].extended(below.but_the_latest(), window);
            let end = Progress::tail(below.all());
            let ends = below.second > 0.0 && end.total() < on.total();
            progress[body] = if ends { end } else { on };
            next[body] = (!ends).then_some(latest);
        }
        if let Some(parent) = parents[body] {
            children[parent.index()].add(body, progress[body].finished());
        }
    }

    let mut order = Vec::with_capacity(n);
    let mut starts = vec![0];
    for head in 0..n {
        let carrier = parents[head];
        if carrier.is_some_and(|carrier| next[carrier.index()] == Some(small(head))) {
            continue;
        }
        let mut at = Some(small(head));
        while let Some(body) = at {
            order.push(BodyId(body));
            at = next[body as usize];
        }
        starts.push(small(order.len()));
    }
    Layout { order, starts }
}
