//! Closed loops and couplings of models in the making.

use super::mirror::Mirror;
use super::{Builder, Part};
use crate::{Closure, CouplingDescription, LoopDescription, ModelDescription};
use vertebra_spatial::Pose;

impl Builder {
    /// A builder with all of a description's bodies, frames, loops and couplings, to be inserted in others. It
    /// stands in the world.
    ///
    /// ```
    /// use vertebra_assembly::{Builder, mechanism};
    /// use glam::DVec3;
    /// use vertebra_spatial::Pose;
    ///
    /// let (linkage, _) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4)?;
    /// let linkage = Builder::of_description(linkage.describe());
    /// let pair = Builder::new("pair")
    ///     .attach("left", &linkage, Pose::IDENTITY)
    ///     .mirror("right", &linkage, DVec3::Y, Pose::from_translation(DVec3::Y))
    ///     .build()?;
    /// assert_eq!(pair.model.loops().len(), 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn of_description(description: ModelDescription) -> Self {
        let mut builder = Self::new(description.name).gravity(description.gravity);
        for body in description.bodies {
            builder.push(Part {
                name: body.name,
                parent: body.parent,
                joint: body.joint.into(),
                mass: body.mass,
                tags: Vec::new(),
                joint_name: None,
            });
        }
        builder.frames = description.frames;
        builder.loops = description.loops;
        builder.couplings = description.couplings;
        builder.from_world()
    }

    /// Closes a loop: connects two bodies (none for the world) by one more joint, whose frames are at
    /// `placements` on them. The bodies may be added later. The builder stays where it is.
    #[must_use]
    pub fn close(
        mut self,
        name: impl Into<String>,
        bodies: [Option<&str>; 2],
        placements: [Pose; 2],
        closure: Closure,
    ) -> Self {
        let closed = LoopDescription::new(name, bodies, placements, closure);
        self.loops.push(closed);
        self
    }

    /// Couples two joints of one freedom each, named by the bodies they carry: q = ratio * q_other + offset.
    #[must_use]
    pub fn couple(
        mut self,
        name: impl Into<String>,
        body: impl Into<String>,
        other: impl Into<String>,
        ratio: f64,
        offset: f64,
    ) -> Self {
        let coupled = CouplingDescription::new(name, body, other, ratio, offset);
        self.couplings.push(coupled);
        self
    }

    /// Inserts another builder's loops and couplings, as its bodies are: what it ties to its world is tied here.
    pub(super) fn insert_closures(
        &mut self,
        prefix: &str,
        other: &Self,
        placement: Pose,
        mirror: Option<&Mirror>,
    ) {
        let here = self.at.map(|part| self.parts[part].name.clone());
        let renamed = |name: &String| format!("{prefix}/{name}");
        for closed in &other.loops {
            let mut placements = closed.placements;
            for (own, body) in placements.iter_mut().zip(&closed.bodies) {
                *own = mirror.map_or(*own, |mirror| mirror.pose(own));
                if body.is_none() {
                    *own = placement * *own;
                }
            }
            self.loops.push(LoopDescription {
                name: renamed(&closed.name),
                bodies: (closed.bodies.each_ref()).map(|body| {
                    body.as_ref()
                        .map_or_else(|| here.clone(), |name| Some(renamed(name)))
                }),
                placements,
                closure: mirror.map_or(closed.closure, |mirror| mirror.closure(closed.closure)),
            });
        }
        // Coordinates of one freedom keep their signs in a mirror.
        let couplings = other.couplings.iter().map(|coupling| CouplingDescription {
            name: renamed(&coupling.name),
            body: renamed(&coupling.body),
            other: renamed(&coupling.other),
            ..*coupling
        });
        self.couplings.extend(couplings);
    }
}
