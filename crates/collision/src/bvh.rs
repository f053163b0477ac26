//! A bounding volume hierarchy over the triangles of a mesh, in the mesh's own frame.
//!
//! Every node has eight children and its boxes side by side. The tree has no pointers: triangles are put in an order,
//! eight in a row make a leaf, eight leaves in a row a node above, and so on; only the last node of a level may be
//! partly filled. So all that building decides is the order, and refitting is one pass over the levels.
//!
//! The order comes from the top down: triangles that exceed one node are cut in two at the boundary between two
//! children nearest the middle, along the longest axis of the box of their centres, until eight are left. For surfaces
//! of similar triangles that is close to what a surface-area heuristic chooses, at the cost of a selection.

use std::cmp::Ordering;

use crate::bounds::{Bounds, LANES, Packet, lanes};
use crate::mesh::TriangleMesh;
use crate::parallel;

/// Fewer triangles than this are not worth a second thread.
const WORTH_A_THREAD: usize = 4096;

/// A tree over all or some triangles of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    /// The triangles in the order of the leaves.
    triangles: Vec<u32>,
    /// The nodes, leaves first; the children of node k of a level are nodes 8 k .. 8 k + 8 of the level below.
    levels: Vec<Vec<Packet>>,
}

/// A triangle to be put in order.
#[derive(Clone, Copy)]
struct Item {
    center: [f32; 3],
    triangle: u32,
}

impl Bvh {
    /// A tree over the triangles whose boxes share a point with the region, if there is one.
    pub(crate) fn new(mesh: &TriangleMesh, region: Option<&Bounds>, threads: usize) -> Self {
        let mut items = items(mesh, region, threads);
        let mut unit = LANES;
        while unit * LANES < items.len() {
            unit *= LANES;
        }
        arrange(&mut items, unit, threads);
        let mut tree = Self {
            triangles: items.iter().map(|item| item.triangle).collect(),
            levels: Vec::new(),
        };
        tree.refit(mesh, threads);
        tree
    }

    /// Fits the boxes to where the vertices of the mesh are now; the order stays.
    pub(crate) fn refit(&mut self, mesh: &TriangleMesh, threads: usize) {
        let Self { triangles, levels } = self;
        levels.clear();
        let threads_for = |nodes: usize| {
            if nodes * LANES < WORTH_A_THREAD {
                1
            } else {
                threads
            }
        };
        let leaves = triangles.len().div_ceil(LANES);
        let mut level = parallel::map(threads_for(leaves), leaves, |leaf| {
            let row = &triangles[leaf * LANES..triangles.len().min((leaf + 1) * LANES)];
            Packet::new(
                row.iter()
                    .map(|&id| Bounds::of(&mesh.triangle(id as usize))),
            )
        });
        while level.len() > 1 {
            let nodes = level.len().div_ceil(LANES);
            let above = parallel::map(threads_for(nodes), nodes, |node| {
                let row = &level[node * LANES..level.len().min((node + 1) * LANES)];
                Packet::new(row.iter().map(Packet::union))
            });
            levels.push(level);
            level = above;
        }
        levels.push(level);
    }

    /// The number of triangles.
    pub(crate) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The level of the root; the leaves have level 0.
    pub(crate) fn top(&self) -> usize {
        self.levels.len() - 1
    }

    /// The nodes of a level; none if the tree has no triangles.
    pub(crate) fn level(&self, level: usize) -> &[Packet] {
        &self.levels[level]
    }

    /// A bit for each lane of a node that has a child.
    #[inline]
    pub(crate) fn children(&self, level: usize, node: usize) -> u32 {
        let below = match level {
            0 => self.triangles.len(),
            _ => self.levels[level - 1].len(),
        };
        let count = (below - node * LANES).min(LANES);
        (1 << count) - 1
    }

    /// The triangles of a leaf, lane by lane.
    pub(crate) fn leaf(&self, leaf: usize) -> &[u32] {
        let start = leaf * LANES;
        &self.triangles[start..self.triangles.len().min(start + LANES)]
    }

    /// The box of everything.
    pub(crate) fn bounds(&self) -> Bounds {
        self.levels[self.top()]
            .first()
            .map_or(Bounds::EMPTY, Packet::union)
    }

    /// How many children of a node a query enters that meets the node: the surface of their boxes in units of that of
    /// the node (Goldsmith & Salmon, Automatic creation of object hierarchies for ray tracing, IEEE CG&A 7(5), 1987), the
    /// mean over all nodes above the leaves; 1 if there are none of any surface.
    ///
    /// In units of the whole, a vertex far away would outweigh all others and hide what is wrong with them. Of leaves
    /// the children are triangles, whose order within a leaf is nobody's choice.
    pub(crate) fn entered(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (level, nodes) in self.levels.iter().enumerate().skip(1) {
            for (node, packet) in nodes.iter().enumerate() {
                let whole = packet.union().half_area();
                if whole > 0.0 {
                    let children = lanes(self.children(level, node));
                    sum += children
                        .map(|lane| packet.lane(lane).half_area() / whole)
                        .sum::<f64>();
                    count += 1.0;
                }
            }
        }
        if count > 0.0 { sum / count } else { 1.0 }
    }
}

/// The triangles that reach into the region, in the order of the mesh.
fn items(mesh: &TriangleMesh, region: Option<&Bounds>, threads: usize) -> Vec<Item> {
    let item = |(triangle, corners): (u32, &[u32; 3])| {
        let bounds = Bounds::of(&corners.map(|i| mesh.vertices()[i as usize]));
        let inside = region.is_none_or(|region| bounds.overlaps(region));
        inside.then(|| Item {
            // Halved first: the sum could overflow.
            center: std::array::from_fn(|k| 0.5 * bounds.min[k] + 0.5 * bounds.max[k]),
            triangle,
        })
    };
    if threads == 1 {
        return (0..).zip(mesh.triangles()).filter_map(item).collect();
    }
    let chunks: Vec<(u32, &[[u32; 3]])> = (0..)
        .step_by(WORTH_A_THREAD)
        .zip(mesh.triangles().chunks(WORTH_A_THREAD))
        .collect();
    let of_chunk = |index: usize| -> Vec<Item> {
        let (first, triangles) = chunks[index];
        (first..).zip(triangles).filter_map(item).collect()
    };
    parallel::map(threads, chunks.len(), of_chunk).concat()
}

/// Puts the triangles in order, for children of `unit` triangles each.
fn arrange(items: &mut [Item], mut unit: usize, threads: usize) {
    if items.len() <= LANES {
        return;
    }
    while unit >= items.len() {
        unit /= LANES;
    }
    let cut = items.len().div_ceil(unit) / 2 * unit;
    let axis = longest_axis(items);
    items.select_nth_unstable_by(cut, |left, right| {
        // Centres are finite, so they compare.
        left.center[axis]
            .partial_cmp(&right.center[axis])
            .unwrap_or(Ordering::Equal)
    });
    let count = items.len();
    let (left, right) = items.split_at_mut(cut);
    if count < WORTH_A_THREAD {
        arrange(left, unit, 1);
        arrange(right, unit, 1);
        return;
    }
    // As many threads as each part is worth; or all for each part in turn, where that comes out too uneven.
    let share = (threads * left.len() + count / 2) / count;
    let uneven = (threads * left.len()).abs_diff(share * count) > count / 8;
    let (at_once, threads) = if uneven || share == 0 || share == threads {
        (1, [threads; 2])
    } else {
        (2, [share, threads - share])
    };
    parallel::join(
        at_once,
        || arrange(left, unit, threads[0]),
        || arrange(right, unit, threads[1]),
    );
}

fn longest_axis(items: &[Item]) -> usize {
    let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items {
        for k in 0..3 {
            min[k] = min[k].min(item.center[k]);
            max[k] = max[k].max(item.center[k]);
        }
    }
    let extent: [f32; 3] = std::array::from_fn(|k| 0.5 * max[k] - 0.5 * min[k]);
    let longest = |best, k| if extent[k] > extent[best] { k } else { best };
    (1..3).fold(0, longest)
}
