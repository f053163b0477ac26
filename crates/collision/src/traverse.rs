//! Two hierarchies against each other.
//!
//! One tree is descended depth first. With each of its nodes goes a list of nodes of the other tree, of one level, and of
//! which of their children may meet it; the list for a child is made from that. So each box of the descended tree is
//! posed once, and each of its triangles once and only if something is near.
//!
//! The listed nodes are one level above the descended one, as far as the trees' heights allow: a child that is tested
//! against a listed node first, and then against only those of its children that are left, is tested against less than
//! all of them.

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

/// How many times as many triangles B must have for A to be descended, if B's triangles are then posed for each pair.
const WORTH_POSING: usize = 16;

/// A mesh and a tree over those of its triangles that matter.
#[derive(Debug)]
pub(crate) struct Tree<'a> {
    pub(crate) mesh: &'a TriangleMesh,
    pub(crate) bvh: Cow<'a, Bvh>,
}

impl Tree<'_> {
    /// The same tree.
    fn borrowed(&self) -> Tree<'_> {
        Tree {
            mesh: self.mesh,
            bvh: Cow::Borrowed(&*self.bvh),
        }
    }
}

/// The exact test behind two trees.
pub(crate) struct TreeTest<'a> {
    listed: Tree<'a>,
    descended: Tree<'a>,
    /// Whether A is descended, not B.
    descends_a: bool,
    /// Whether both trees are the same one, and each pair is wanted in one order only.
    itself: bool,
    pose: &'a RelativePose,
    criterion: Criterion,
    /// Where the boxes of the descended tree are in the frame of the other; None if they are good as they are.
    boxes: Option<BoxPose>,
    tasks: Vec<Task>,
}

/// A node of the descended tree, and a list for it.
struct Task {
    level: usize,
    node: usize,
    listed_level: usize,
    list: Vec<Listed>,
}

impl Task {
    fn is_smallest(&self) -> bool {
        self.level == 0 && self.listed_level <= 1 && self.list.len() == 1
    }
}

/// A node of the listed tree, and a bit for each of its children that may meet what the list is for.
#[derive(Clone, Copy)]
pub(crate) struct Listed {
    node: usize,
    children: u32,
}

/// A list: nodes of one level, somewhere among the lists of all ancestors.
#[derive(Clone)]
struct Span {
    level: usize,
    range: Range<usize>,
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
        // Descending the smaller tree makes for fewer and longer lists; but rounded bounds on distances should be those
        // from A to B, whatever is descended.
        let worth = if in_place { 1 } else { WORTH_POSING };
        let descends_a = criterion == Criterion::Meet && a.mesh.len() * worth < b.mesh.len();
        let boxes = (!in_place).then(|| {
            if descends_a {
                pose.inverse_boxes()
            } else {
                pose.boxes()
            }
        });
        let (listed, descended) = if descends_a { (b, a) } else { (a, b) };
        let test = Self {
            listed,
            descended,
            descends_a,
            itself: false,
            pose,
            criterion,
            boxes,
            tasks: Vec::new(),
        };
        test.divided(threads)
    }

    /// The pairs of different triangles of one tree, each once, the lesser index first.
    pub(crate) fn of_itself(tree: &'a Tree<'a>, threads: usize) -> Self {
        let test = Self {
            listed: tree.borrowed(),
            descended: tree.borrowed(),
            descends_a: false,
            itself: true,
            pose: &RelativePose::IDENTITY,
            criterion: Criterion::Meet,
            boxes: None,
            tasks: Vec::new(),
        };
        test.divided(threads)
    }

    /// Finds tasks, as many as the threads want, from the roots down.
    fn divided(mut self, threads: usize) -> Self {
        let wanted = if threads > 1 {
            threads * TASKS_A_THREAD
        } else {
            1
        };
        let (listed, descended) = (&self.listed.bvh, &self.descended.bvh);
        if listed.len() > 0 && descended.len() > 0 {
            self.tasks.push(Task {
                level: descended.top(),
                node: 0,
                listed_level: listed.top(),
                list: vec![Listed {
                    node: 0,
                    children: listed.children(listed.top(), 0),
                }],
            });
        }
        while self.tasks.len() < wanted && !self.tasks.iter().all(Task::is_smallest) {
            self.tasks = self.tasks.iter().flat_map(|t| self.parts(t)).collect();
        }
        self
    }

    /// A task as several: one for each child of its node; at a leaf, one for each half of its list.
    fn parts(&self, task: &Task) -> Vec<Task> {
        let packet = self.posed(&self.descended.bvh.level(task.level)[task.node]);
        let narrowed = |bounds: &Bounds, level, node| {
            let mut list = task.list.clone();
            let span = Span {
                level: task.listed_level,
                range: 0..list.len(),
            };
            let span = self.narrow(&mut list, &span, bounds, [level, node]);
            list.drain(..span.range.start);
            Task {
                level,
                node,
                listed_level: span.level,
                list,
            }
        };
        let children = self.descended.bvh.children(task.level, task.node);
        let mut parts: Vec<Task> = if task.level > 0 {
            let child = |lane| task.node * LANES + lane;
            lanes(children)
                .map(|lane| narrowed(&packet.lane(lane), task.level - 1, child(lane)))
                .collect()
        } else {
            let mut whole = narrowed(&union(&packet, children), 0, task.node);
            let list = whole.list.split_off(whole.list.len() / 2);
            let half = Task { list, ..whole };
            vec![whole, half]
        };
        parts.retain(|part| !part.list.is_empty());
        parts
    }

    /// Appends what is left of a list for a node of the descended tree, given by its level and number, or for something
    /// in it: the listed nodes' children, unless the listed nodes are as close to the leaves as they should be.
    fn narrow(
        &self,
        lists: &mut Vec<Listed>,
        span: &Span,
        bounds: &Bounds,
        [level, node]: [usize; 2],
    ) -> Span {
        let tree = &self.listed.bvh;
        let nodes = tree.level(span.level);
        let down = span.level > level + 1;
        let start = lists.len();
        for index in span.range.clone() {
            let mut listed = lists[index];
            if !down {
                listed.children &= nodes[listed.node].overlaps(bounds);
                listed.children &= self.from(node, listed.node);
                if listed.children != 0 {
                    lists.push(listed);
                }
                continue;
            }
            let below = span.level - 1;
            for lane in lanes(near(listed.children, &nodes[listed.node], bounds)) {
                let child = listed.node * LANES + lane;
                let children = tree.level(below)[child].overlaps(bounds)
                    & tree.children(below, child)
                    & self.from(node, child);
                if children != 0 {
                    lists.push(Listed {
                        node: child,
                        children,
                    });
                }
            }
        }
        Span {
            level: span.level - usize::from(down),
            range: start..lists.len(),
        }
    }

    /// Which children of a node are to be paired with the node (or triangle) `first` of their level: those from there
    /// on, if the trees are the same. Then the two trees are descended in step.
    #[inline]
    fn from(&self, first: usize, parent: usize) -> u32 {
        let before = if self.itself {
            first.saturating_sub(parent * LANES).min(LANES)
        } else {
            0
        };
        u32::MAX << before
    }

    /// Boxes of the descended tree as the other sees them, by the reach of the criterion larger.
    ///
    /// In B's frame distances are those of A's frame to a few roundings, much less than boxes posed are larger.
    fn posed(&self, packet: &Packet) -> Packet {
        let posed = match &self.boxes {
            None => *packet,
            Some(pose) => pose.apply_packet(packet),
        };
        self.criterion
            .reach()
            .map_or(posed, |reach| posed.grown(reach))
    }

    /// The corners of a triangle, in the frame of A.
    #[inline]
    fn corners(&self, mesh: &TriangleMesh, of_a: bool, triangle: u32) -> [DVec3; 3] {
        let [a, b, c] = mesh.wide_triangle(triangle);
        if of_a || self.boxes.is_none() {
            return [a, b, c];
        }
        let pose = self.pose;
        [pose.apply_wide(a), pose.apply_wide(b), pose.apply_wide(c)]
    }

    /// The box of a triangle of the descended tree as the other sees it, closer than that of its posed box.
    fn close_bounds(&self, triangle: u32, corners: &[DVec3; 3]) -> Bounds {
        if self.descends_a {
            let points = self.descended.mesh.triangle(triangle as usize);
            let points = Packet::new(points.iter().map(|&p| Bounds::of(&[p])));
            return union(&self.posed(&points), 0b111);
        }
        let bounds = Bounds::around(corners);
        self.criterion
            .reach()
            .map_or(bounds, |reach| bounds.grown(reach))
    }
}

/// Those of a node's listed children that may meet a box; all of them if they are few, and each as soon looked into.
#[inline]
fn near(children: u32, node: &Packet, bounds: &Bounds) -> u32 {
    let without_lowest = |mask: u32| mask & mask.wrapping_sub(1);
    if without_lowest(without_lowest(without_lowest(children))) == 0 {
        return children;
    }
    children & node.overlaps(bounds)
}

/// The box of some lanes.
fn union(packet: &Packet, mask: u32) -> Bounds {
    lanes(mask).fold(Bounds::EMPTY, |all, lane| all.union(&packet.lane(lane)))
}

impl PairTest for TreeTest<'_> {
    /// The lists of all ancestors of a node, and then its own.
    type Scratch = Vec<Listed>;

    fn tasks(&self) -> usize {
        self.tasks.len()
    }

    fn visit(&self, task: usize, lists: &mut Vec<Listed>, sink: &mut impl Sink) -> ControlFlow<()> {
        let task = &self.tasks[task];
        lists.clear();
        lists.extend_from_slice(&task.list);
        let span = Span {
            level: task.listed_level,
            range: 0..lists.len(),
        };
        Descent {
            test: self,
            lists,
            sink,
        }
        .visit(task.level, task.node, &span)
    }
}

/// One thread's way through the descended tree.
struct Descent<'a, S> {
    test: &'a TreeTest<'a>,
    lists: &'a mut Vec<Listed>,
    sink: &'a mut S,
}

impl<S: Sink> Descent<'_, S> {
    /// A node against a list.
    fn visit(&mut self, level: usize, node: usize, span: &Span) -> ControlFlow<()> {
        let test = self.test;
        let tree = &test.descended.bvh;
        let packet = test.posed(&tree.level(level)[node]);
        let children = tree.children(level, node);
        let start = self.lists.len();
        if level == 0 {
            return self.visit_leaf(node, &packet, span.clone());
        }
        for lane in lanes(children) {
            let child = [level - 1, node * LANES + lane];
            let span = test.narrow(self.lists, span, &packet.lane(lane), child);
            if !span.range.is_empty() {
                self.visit(child[0], child[1], &span)?;
            }
            self.lists.truncate(start);
        }
        ControlFlow::Continue(())
    }

    /// The triangles of a leaf against a list.
    fn visit_leaf(&mut self, leaf: usize, packet: &Packet, mut span: Span) -> ControlFlow<()> {
        let tree = &self.test.descended.bvh;
        let children = tree.children(0, leaf);
        if span.level > 1 {
            let bounds = union(packet, children);
            while span.level > 1 {
                span = self.test.narrow(self.lists, &span, &bounds, [0, leaf]);
            }
        }
        lanes(children).try_for_each(|lane| {
            let triangle = tree.leaf(leaf)[lane];
            self.visit_triangle(triangle, leaf * LANES + lane, packet.lane(lane), &span)
        })
    }

    /// A triangle, by its index and its place in the tree, against a list of leaves or of their parents.
    fn visit_triangle(
        &mut self,
        triangle: u32,
        place: usize,
        mut bounds: Bounds,
        span: &Span,
    ) -> ControlFlow<()> {
        let test = self.test;
        let TreeTest {
            listed, descended, ..
        } = test;
        let mut seen = None;
        for &Listed { node, children } in &self.lists[span.range.clone()] {
            let (first, leaves, kept) = match span.level {
                0 => (node, 1, children),
                _ => {
                    let near = near(children, &listed.bvh.level(1)[node], &bounds);
                    (node * LANES, near, u32::MAX)
                }
            };
            for leaf in lanes(leaves).map(|lane| first + lane) {
                let boxes = &listed.bvh.level(0)[leaf];
                let mut mask = boxes.overlaps(&bounds) & kept;
                if mask == 0 {
                    continue;
                }
                mask &= listed.bvh.children(0, leaf) & test.from(place + 1, leaf);
                if mask == 0 {
                    continue;
                }
                let (corners, plane) = seen.get_or_insert_with(|| {
                    let corners = test.corners(descended.mesh, test.descends_a, triangle);
                    if test.boxes.is_some() {
                        bounds = test.close_bounds(triangle, &corners);
                        mask &= boxes.overlaps(&bounds);
                    }
                    (corners, Plane::through(corners))
                });
                for lane in lanes(mask) {
                    let other = listed.bvh.leaf(leaf)[lane];
                    let pair = if test.itself {
                        [triangle.min(other), triangle.max(other)]
                    } else if test.descends_a {
                        [triangle, other]
                    } else {
                        [other, triangle]
                    };
                    if self.sink.wants(pair) {
                        let other = test.corners(listed.mesh, !test.descends_a, other);
                        let decision = test.criterion.decide(&other, corners, plane);
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
