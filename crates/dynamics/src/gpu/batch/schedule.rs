//! Which lane of an item does which body, and when.

use super::tree::Tree;

/// Bodies in slots: level by level, in each level a slot a lane.
pub(super) struct Schedule {
    pub(super) lanes: usize,
    pub(super) levels: usize,
    /// The node in each slot.
    pub(super) slots: Vec<Option<usize>>,
    /// The slot of each node.
    pub(super) slot_of: Vec<usize>,
    /// Whether the lane of a node did its parent just before.
    pub(super) follows: Vec<bool>,
    /// Of each node that does not follow and has a parent: where it leaves what it hands on.
    pub(super) handoffs: Vec<usize>,
    /// The first of the places that children of a node use, and how many.
    pub(super) gather: Vec<(usize, usize)>,
    pub(super) handoff_count: usize,
}

impl Schedule {
    /// Shares nodes out among lanes: in each level those with the longest way to a tip go first (Hu,
    /// "Parallel sequencing and assembly line problems", 1961: no level is wasted on trees, up to their
    /// mirror image), and stay with the lane that did their parent if they can.
    ///
    /// One lane goes depth first instead: most bodies then find their parent in registers.
    pub(super) fn new(tree: &Tree, lanes: usize) -> Self {
        let count = tree.nodes.len();
        let children = tree.children();
        let mut height = vec![0; count];
        for node in (0..count).rev() {
            height[node] = children[node]
                .iter()
                .map(|&c| height[c] + 1)
                .max()
                .unwrap_or(0);
        }
        let mut ready: Vec<usize> = (0..count)
            .filter(|&n| tree.nodes[n].parent.is_none())
            .collect();
        let mut last: Vec<Option<usize>> = vec![None; lanes];
        let mut slots: Vec<Option<usize>> = Vec::new();
        let (mut slot_of, mut follows) = (vec![0; count], vec![false; count]);
        while !ready.is_empty() {
            let parent = |node: usize| tree.nodes[node].parent;
            if lanes > 1 {
                ready.sort_by_key(|&node| (height[node], core::cmp::Reverse(node)));
            }
            let mut now = ready.split_off(ready.len().saturating_sub(lanes));
            now.reverse();
            let first = slots.len();
            slots.resize(first + lanes, None);
            let mut homeless = Vec::new();
            for &node in &now {
                let lane = (0..lanes).find(|&lane| {
                    parent(node).is_some()
                        && last[lane] == parent(node)
                        && slots[first + lane].is_none()
                });
                match lane {
                    Some(lane) => {
                        slots[first + lane] = Some(node);
                        follows[node] = true;
                    }
                    None => homeless.push(node),
                }
            }
            for node in homeless {
                // A lane whose last body has no children left is not missed.
                let free = (0..lanes).filter(|&lane| slots[first + lane].is_none());
                let wanted = |lane: usize| {
                    last[lane].is_some_and(|p| ready.iter().any(|&n| parent(n) == Some(p)))
                };
                if let Some(lane) = free.min_by_key(|&lane| (wanted(lane), lane)) {
                    slots[first + lane] = Some(node);
                }
            }
            for lane in 0..lanes {
                if let Some(node) = slots[first + lane] {
                    slot_of[node] = first + lane;
                    last[lane] = Some(node);
                    ready.extend(&children[node]);
                }
            }
        }
        let (mut handoffs, mut gather) = (vec![0; count], vec![(0, 0); count]);
        let mut handoff_count = 0;
        for node in 0..count {
            let first = handoff_count;
            for &child in children[node].iter().filter(|&&child| !follows[child]) {
                handoffs[child] = handoff_count;
                handoff_count += 1;
            }
            gather[node] = (first, handoff_count - first);
        }
        Self {
            lanes,
            levels: slots.len() / lanes,
            slots,
            slot_of,
            follows,
            handoffs,
            gather,
            handoff_count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra_assembly::generate::{self, RandomTree, Rod};

    fn tree(count: usize, reach: usize, seed: u64) -> Tree {
        let shape = RandomTree {
            reach,
            ..RandomTree::mixed(count)
        };
        Tree::new(&generate::random_tree(&shape, seed).unwrap())
    }

    #[test]
    fn parents_come_first_and_followers_find_them() {
        for (count, reach, seed) in [(1, 1, 1), (30, 1, 2), (40, 4, 3), (60, 60, 4), (7, 2, 5)] {
            let tree = tree(count, reach, seed);
            for lanes in [1, 2, 4, 8] {
                let schedule = Schedule::new(&tree, lanes);
                let mut seen: Vec<usize> = schedule.slots.iter().flatten().copied().collect();
                seen.sort_unstable();
                assert!(seen.into_iter().eq(0..tree.nodes.len()));
                let mut left = vec![false; schedule.handoff_count];
                for (id, node) in tree.nodes.iter().enumerate() {
                    let slot = schedule.slot_of[id];
                    let Some(parent) = node.parent else {
                        assert!(!schedule.follows[id]);
                        continue;
                    };
                    let above = schedule.slot_of[parent];
                    assert!(above / lanes < slot / lanes);
                    let lane = slot % lanes;
                    let mut between = (above + 1..slot).filter(|other| other % lanes == lane);
                    let free = between.all(|other| schedule.slots[other].is_none());
                    // Whoever can follow does.
                    assert_eq!(schedule.follows[id], above % lanes == lane && free);
                    if !schedule.follows[id] {
                        let place = schedule.handoffs[id];
                        assert!(!core::mem::replace(&mut left[place], true));
                        let (first, count) = schedule.gather[parent];
                        assert!((first..first + count).contains(&place));
                    }
                }
                assert!(left.into_iter().all(|taken| taken));
            }
        }
    }

    #[test]
    fn levels_are_as_few_as_the_tree_allows() {
        let chain = Tree::new(&generate::random_chain(20, &Rod::default(), 1).unwrap());
        let schedule = Schedule::new(&chain, 4);
        assert_eq!((schedule.levels, schedule.handoff_count), (20, 0));
        for seed in 0..10 {
            let tree = tree(50, 50, seed);
            let mut depth = vec![1; tree.nodes.len()];
            for (id, node) in tree.nodes.iter().enumerate() {
                depth[id] += node.parent.map_or(0, |parent| depth[parent]);
            }
            let depth = depth.into_iter().max().unwrap_or(0);
            assert_eq!(Schedule::new(&tree, 1).levels, tree.nodes.len());
            // What any schedule needs, but for levels in which lanes wait for the first bodies.
            let least = depth.max(tree.nodes.len().div_ceil(4));
            let levels = Schedule::new(&tree, 4).levels;
            assert!(levels >= least && levels <= least + 3, "{levels}, {least}");
        }
    }
}
