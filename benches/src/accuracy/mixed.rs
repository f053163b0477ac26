//! Trees and forests of boxes on joints of all kinds: what chains and trees of hinges do not tell.

use vertebra::generate::{self, Masses, RandomTree};
use vertebra::{Model, ModelError};

/// Trees that a forest has.
const TREES: usize = 8;

/// What bodies stand on, and how they are joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mixed {
    /// A tree on the ground, each body on one of the four before it: hinges, slides, balls, free and fixed joints.
    Grounded,
    /// The same, its root free.
    Floating,
    /// Eight of them side by side, the roots free.
    Forest,
    /// A tree on the ground with screws, cylindrical, universal and planar joints too, between whose freedoms there is
    /// no mass.
    AllJoints,
}

impl Mixed {
    /// A model of so many bodies, and the massless ones between compound joints' freedoms.
    ///
    /// # Errors
    /// If there are none.
    pub(super) fn model(
        self,
        bodies: usize,
        masses: &Masses,
        seed: u64,
    ) -> Result<Model, ModelError> {
        let of = |floating, articulations: usize| RandomTree {
            floating,
            articulations: articulations.min(bodies.max(1)),
            ..RandomTree::mixed(bodies)
        };
        let model = match self {
            Self::Grounded => generate::random_tree(&of(false, 1), seed)?,
            Self::Floating => generate::random_tree(&of(true, 1), seed)?,
            Self::Forest => generate::random_tree(&of(true, TREES), seed)?,
            Self::AllJoints => generate::random_mechanism(bodies, false, seed)?,
        };
        generate::weighted(&model, masses, seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra::JointKind;

    #[test]
    fn they_stand_as_they_are_called() {
        let roots = |mixed: Mixed| {
            let model = mixed.model(64, &Masses::Equal, 3).unwrap();
            let roots = model.bodies().iter().filter(|body| body.parent.is_none());
            let free = roots
                .clone()
                .filter(|body| body.joint.kind == JointKind::Free);
            (roots.count(), free.count())
        };
        assert_eq!(roots(Mixed::Floating), (1, 1));
        assert_eq!(roots(Mixed::Forest), (8, 8));
        assert_eq!(roots(Mixed::AllJoints).0, 1);
    }
}
