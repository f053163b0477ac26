//! Two hierarchies against each other.
//!
//! B's tree is descended depth first. With each of its nodes goes the list of those nodes of A's tree, of one level,
//! that may meet it; the list for a child is what is left of the children of its nodes. So each box of B is posed once,
//! each triangle of B once, and only if something of A is near.

use std::borrow::Cow;
use std::ops::{ControlFlow, Range};

use glam::DVec3;

use crate::bounds::{Bounds, LANES, Packet, lanes};
use crate::box_pose::BoxPose;
use crate::bvh::Bvh;
use crate::criterion::Criterion;
use crate::mesh::TriangleMesh;
use crate::predicates::Plane;
use crate::sink::{PairTest, Sink};
use crate::transform::RelativePose;

/// Tasks that each thread should find, so that all end at about the same time.
const TASKS_A_THREAD: usize = 32;

/// A mesh and a tree over those of its triangles that matter.
#[derive(Debug)]
pub(crate) struct Tree<'a> {
    pub(crate) mesh: &'a TriangleMesh,
    pub(crate) bvh: Cow<'a, Bvh>,
}

/// The exact test behind two trees.
pub(crate) struct TreeTest<'a> {
    a: Tree<'a>,
    b: Tree<'a>,
    pose: &'a RelativePose,
    criterion: Criterion,
    /// None if B's boxes are good for A's frame as they are.
    boxes: Option<BoxPose>,
    /// The level of B whose nodes are the tasks.
    task_level: usize,
    /// Whether A and B have changed places.
    swapped: bool,
}

impl<'a> TreeTest<'a> {
    pub(crate) fn new(
        a: Tree<'a>,
        b: Tree<'a>,
        pose: &'a RelativePose,
        criterion: Criterion,
        threads: usize,
    ) -> Self {
        let in_place = *pose == RelativePose::IDENTITY;
        // Descending the smaller tree makes for fewer and longer lists; but posed triangles should be those of B, and
        // rounded bounds on distances those from A to B.
        let swapped = in_place && criterion == Criterion::Meet && a.mesh.len() < b.mesh.len();
        let (a, b) = if swapped { (b, a) } else { (a, b) };
        let wanted = if threads > 1 {
            threads * TASKS_A_THREAD
        } else {
            1
        };
        let task_level = (0..=b.bvh.top())
            .rev()
            .find(|&level| b.bvh.level(level).len() >= wanted)
            .unwrap_or(0);
        Self {
            boxes: (!in_place).then(|| pose.boxes()),
            a,
            b,
            pose,
            criterion,
            task_level,
            swapped,
        }
    }

    /// The boxes of B as A sees them, by the reach of the criterion larger.
    fn posed(&self, packet: &Packet) -> Packet {
        let posed = match &self.boxes {
            None => *packet,
            Some(pose) => pose.apply_packet(packet),
        };
        self.criterion
            .reach()
            .map_or(posed, |reach| posed.grown(reach))
    }
}

/// Nodes of A, the lists of all ancestors of a node of B before its own.
type Candidates = Vec<usize>;

impl PairTest for TreeTest<'_> {
    type Scratch = Candidates;

    fn tasks(&self) -> usize {
        match self.a.bvh.bounds() {
            Bounds::EMPTY => 0,
            _ => self.b.bvh.level(self.task_level).len(),
        }
    }

    fn visit(
        &self,
        task: usize,
        candidates: &mut Candidates,
        sink: &mut impl Sink,
    ) -> ControlFlow<()> {
        candidates.clear();
        candidates.push(0);
        Descent {
            test: self,
            candidates,
            sink,
        }
        .visit(self.task_level, task, self.a.bvh.top(), 0..1)
    }
}

/// One thread's way through B's tree.
struct Descent<'a, S> {
    test: &'a TreeTest<'a>,
    candidates: &'a mut Candidates,
    sink: &'a mut S,
}

impl<S: Sink> Descent<'_, S> {
    /// A node of B against a range of candidates, nodes of A of one level.
    fn visit(
        &mut self,
        level: usize,
        node: usize,
        a_level: usize,
        range: Range<usize>,
    ) -> ControlFlow<()> {
        let start = self.candidates.len();
        if level == 0 {
            self.visit_leaf(node, a_level, range)?;
        } else {
            let b = &self.test.b.bvh;
            let packet = self.test.posed(&b.level(level)[node]);
            for lane in lanes(b.children(level, node)) {
                self.narrow(&packet.lane(lane), a_level, range.clone());
                let end = self.candidates.len();
                if start < end {
                    let below = a_level.saturating_sub(1);
                    self.visit(level - 1, node * LANES + lane, below, start..end)?;
                }
                self.candidates.truncate(start);
            }
        }
        self.candidates.truncate(start);
        ControlFlow::Continue(())
    }

    /// Appends the children of the candidates that may meet a box; of leaves, which have none, the leaves themselves.
    fn narrow(&mut self, bounds: &Bounds, level: usize, range: Range<usize>) {
        let tree = &self.test.a.bvh;
        let nodes = tree.level(level);
        for index in range {
            let node = self.candidates[index];
            let mask = nodes[node].overlaps(bounds) & tree.children(level, node);
            if level > 0 {
                self.candidates
                    .extend(lanes(mask).map(|lane| node * LANES + lane));
            } else if mask != 0 {
                self.candidates.push(node);
            }
        }
    }

    /// The triangles of a leaf of B against those of the candidates.
    fn visit_leaf(
        &mut self,
        leaf: usize,
        a_level: usize,
        mut range: Range<usize>,
    ) -> ControlFlow<()> {
        let TreeTest {
            a,
            b,
            pose,
            boxes,
            criterion,
            swapped,
            ..
        } = self.test;
        let packet = self.test.posed(&b.bvh.level(0)[leaf]);
        // A's tree may be the higher one.
        if a_level > 0 {
            let bounds = lanes(b.bvh.children(0, leaf))
                .fold(Bounds::EMPTY, |all, lane| all.union(&packet.lane(lane)));
            for level in (1..=a_level).rev() {
                let start = self.candidates.len();
                self.narrow(&bounds, level, range);
                range = start..self.candidates.len();
            }
        }
        let near = self.candidates[range.clone()]
            .iter()
            .fold(0, |near, &node| {
                near | packet.overlaps(&a.bvh.node_bounds(0, node))
            });
        for lane_b in lanes(near & b.bvh.children(0, leaf)) {
            let column = b.bvh.leaf(leaf)[lane_b];
            let mut bounds = packet.lane(lane_b);
            let mut posed = None;
            for &node in &self.candidates[range.clone()] {
                let boxes_a = &a.bvh.level(0)[node];
                let mut mask = boxes_a.overlaps(&bounds) & a.bvh.children(0, node);
                if mask == 0 {
                    continue;
                }
                let triangle = posed.get_or_insert_with(|| {
                    let triangle = PosedTriangle::new(b.mesh, column, pose);
                    if boxes.is_some() {
                        // The box of a posed box is larger than that of the posed triangle.
                        bounds = Bounds::around(&triangle.corners);
                        if let Some(reach) = criterion.reach() {
                            bounds = bounds.grown(reach);
                        }
                        mask &= boxes_a.overlaps(&bounds);
                    }
                    triangle
                });
                for lane_a in lanes(mask) {
                    let row = a.bvh.leaf(node)[lane_a];
                    let pair = if *swapped {
                        [column, row]
                    } else {
                        [row, column]
                    };
                    if self.sink.wants(pair) {
                        let corners = a.mesh.wide_triangle(row);
                        let decision =
                            criterion.decide(&corners, &triangle.corners, &triangle.plane);
                        self.sink.decided(&decision);
                        if decision.meet {
                            self.sink.hit(pair)?;
                        }
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// A triangle of B, seen from A.
struct PosedTriangle {
    corners: [DVec3; 3],
    plane: Plane,
}

impl PosedTriangle {
    #[inline]
    fn new(mesh: &TriangleMesh, index: u32, pose: &RelativePose) -> Self {
        let [a, b, c] = mesh.wide_triangle(index);
        let corners = [pose.apply_wide(a), pose.apply_wide(b), pose.apply_wide(c)];
        Self {
            corners,
            plane: Plane::through(corners),
        }
    }
}
