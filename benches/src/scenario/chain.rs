//! The source's scenario `dynamics`: chains of rods with random joint axes and positions, a random
//! force on a random body.

use super::Selection;
use super::model::Subject;
use super::published;
use vertebra::generate::{self, Rod};

/// Name of the scenario in the rows.
pub const NAME: &str = "dynamics";

/// Numbers of bodies beyond the source's, which quick runs leave out.
const LARGE: [usize; 3] = [8192, 65_536, 1_048_576];

/// The chains asked for; by default those of the source's sizes, and large ones.
///
/// # Errors
/// If a size is zero.
pub fn subjects(selection: &Selection) -> anyhow::Result<Vec<Subject>> {
    let sizes = if selection.sizes.is_empty() {
        let large: &[usize] = if selection.quick { &[] } else { &LARGE };
        let sizes = published::CHAIN_STEP.map(|(size, _)| size);
        [&sizes, large].concat()
    } else {
        selection.sizes.clone()
    };
    sizes
        .into_iter()
        .map(|size| {
            let model = generate::random_chain(size, &Rod::default(), selection.seed)?;
            let mut subject = Subject::new(NAME, model, selection.seed);
            subject.published_step_s = published::chain_step(size);
            Ok(subject)
        })
        .collect()
}
