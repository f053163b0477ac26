//! All against all, or down a tree.

use vertebra_shaders::collision::Job;

use super::search::Way;
use crate::culling::Culling;

/// Holding two boxes against each other \[ns].
const PAIR: f64 = 1e-3;

/// What a descent takes at least, of which one box by one follows \[ns].
const DESCENT: f64 = 10e3;

/// Descending a tree with one block \[ns].
const BLOCK: f64 = 0.5;

/// How to find pairs.
///
/// The costs that both ways have in common are left out. The constants are estimates for a large GPU; on others all are
/// larger, much in proportion. Near where they balance a wrong choice costs microseconds.
pub(super) fn way(culling: Culling, jobs: &[Job]) -> Way {
    match culling {
        Culling::AllPairs => Way::AllPairs,
        Culling::Bvh => Way::Tree,
        Culling::Auto => {
            let [mut all, mut tree] = [0.0, DESCENT];
            for job in jobs {
                all += PAIR * f64::from(job.a_blocks) * f64::from(job.b_blocks);
                tree += BLOCK * f64::from(job.b_blocks);
            }
            if all > tree { Way::Tree } else { Way::AllPairs }
        }
    }
}
