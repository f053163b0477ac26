//! What a question costs: at which level of the trees to begin, and where to ask.

use vertebra_shaders::collision::{Job, MOLLER_TILE, TILE, WIDTH};

use super::collider::count;
use super::search::Way;
use crate::culling::Culling;

/// Holding the boxes of 64 nodes against those of 64 \[ns].
const TILE_COST: f64 = 4.6;

/// Going down a level of both trees \[ns].
const LEVEL_COST: f64 = 5e3;

/// Submitting, waiting, and reading a short list back \[s].
const SUBMISSION: f64 = 130e-6;

/// A question on one thread about resident meshes that cross, for the root of their triangles: as many are near the
/// curve where they do \[s].
const CROSSING: f64 = 2.5e-6;

/// Waking threads, for each doubling of their number \[s].
const WAKING: f64 = 0.2e-3;

/// Expected time of a question about resident meshes of so many triangles on at most so many threads \[s], and on how
/// many of them. Measured: `docs/performance.md`.
pub(super) fn on_cpu(triangles: [usize; 2], threads: usize) -> (usize, f64) {
    let alone = CROSSING * (triangles[0] as f64 + triangles[1] as f64).sqrt();
    let many = threads.max(1) as f64;
    let together = alone / many + WAKING * many.log2();
    if together < alone {
        (threads, together)
    } else {
        (1, alone)
    }
}

/// The same on a large device.
pub(super) fn on_gpu(triangles: [usize; 2]) -> f64 {
    let [a_blocks, b_blocks] = triangles.map(|count_of| count(count_of.div_ceil(WIDTH)));
    let job = Job {
        a_blocks,
        b_blocks,
        ..Job::default()
    };
    let level = |blocks: u32| blocks.max(1).ilog(count(WIDTH));
    let top = level(a_blocks).min(level(b_blocks));
    let levels = 0..=top;
    let search = levels
        .map(|level| cost(&[job], level))
        .fold(f64::INFINITY, f64::min);
    SUBMISSION + 1e-9 * search
}

/// Going through the nodes of a level of both trees, and down from there \[ns].
fn cost(jobs: &[Job], level: u32) -> f64 {
    let way = Way::Blocks { level };
    let tiles: f64 = jobs.iter().map(|job| f64::from(way.groups(job))).sum();
    TILE_COST * tiles + LEVEL_COST * f64::from(level)
}

/// How to find pairs, of meshes whose trees have so many levels above the blocks.
///
/// The costs that all ways have in common are left out. The constants were measured on an H100 (`docs/gpu.md`); on
/// smaller devices all are larger, much in proportion. Near where they balance a wrong choice costs microseconds.
pub(super) fn way(culling: Culling, jobs: &[Job], top: u32) -> Way {
    let levels = match culling {
        Culling::AllPairs => 0..=0,
        Culling::Bvh => top.min(1)..=top,
        Culling::Auto => 0..=top,
    };
    let level = levels.min_by(|one, other| cost(jobs, *one).total_cmp(&cost(jobs, *other)));
    Way::Blocks {
        level: level.unwrap_or(0),
    }
}

/// Number of nodes of a level that have any of these blocks below them: the kernels' `span_above`.
fn nodes(first: u32, blocks: u32, level: u32) -> u32 {
    let shift = 3 * level;
    ((first + blocks + (1 << shift) - 1) >> shift) - (first >> shift)
}

impl Way {
    /// Workgroups for a job.
    pub(super) fn groups(self, job: &Job) -> u32 {
        let ([a, b], tile) = match self {
            Self::Blocks { level } => (Self::nodes(job, level), [TILE; 2]),
            Self::Moller(_) => {
                let tile = MOLLER_TILE.map(|triangles| count(triangles / WIDTH));
                ([job.a_blocks, job.b_blocks], tile)
            }
        };
        a.div_ceil(tile[0]).saturating_mul(b.div_ceil(tile[1]))
    }

    /// Pairs of nodes, or of blocks, that are held against each other first.
    pub(super) fn node_pairs(self, jobs: &[Job]) -> u64 {
        let level = match self {
            Self::Blocks { level } => level,
            Self::Moller(_) => 0,
        };
        let pairs = |job: &Job| {
            Self::nodes(job, level)
                .map(u64::from)
                .iter()
                .product::<u64>()
        };
        jobs.iter().map(pairs).sum()
    }

    fn nodes(job: &Job, level: u32) -> [u32; 2] {
        [
            nodes(job.a_first, job.a_blocks, level),
            nodes(job.b_first, job.b_blocks, level),
        ]
    }
}
