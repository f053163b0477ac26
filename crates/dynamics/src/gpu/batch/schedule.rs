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
