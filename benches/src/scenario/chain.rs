//! The source's scenario `dynamics`: chains of rods with random joint axes and positions, a random
//! force on a random body.

use super::Selection;
use super::model::Subject;
use super::published;
use vertebra::generate::{self, Rod};

/// Name of the scenario in the rows.
pub const NAME: &str = "dynamics";

/// The chains asked for; the source's sizes by default.
///
/// # Errors
/// If a size is zero.
pub fn subjects(selection: &Selection) -> anyhow::Result<Vec<Subject>> {
    let sizes = if selection.sizes.is_empty() {
        published::CHAIN_STEP.map(|(size, _)| size).to_vec()
    } else {
        selection.sizes.clone()
    };
    sizes
        .into_iter()
        .map(|size| {
            let model = generate::random_chain(size, &Rod::default(), selection.seed)?;
            Ok(Subject {
                published_step_s: published::chain_step(size),
                ..Subject::new(NAME, model, selection.seed)
            })
        })
        .collect()
}
