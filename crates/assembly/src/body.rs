//! The bodies of a model.

use crate::units::Sizes;
use crate::{Joint, MassProperties, massless};
use serde::{Deserialize, Serialize};
use std::borrow::Borrow;
use std::hash::{Hash, Hasher};
use std::ops::Deref;
use std::sync::Arc;

/// Names a body of one model, and the joint that carries it: its index in [`Model::bodies`](crate::Model::bodies).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BodyId(pub u32);

impl BodyId {
    /// The index as the size type of slices.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A body of a [`Model`](crate::Model) and the joint that carries it: [`BodyProperties`] at their place in the tree.
#[derive(Clone, Debug)]
pub struct Body {
    pub(crate) properties: Arc<BodyProperties>,
    /// The parent body; none for the world.
    pub parent: Option<BodyId>,
    /// Where the joint's coordinates start in positions q.
    pub position_start: usize,
    /// Where the joint's freedoms start in rates qd, accelerations qdd and joint forces.
    pub dof_start: usize,
}

impl Body {
    /// The joint's coordinates in positions q.
    #[must_use]
    pub fn position_range(&self) -> core::ops::Range<usize> {
        self.position_start..self.position_start + self.joint.kind.position_count()
    }

    /// The joint's freedoms in rates, accelerations and joint forces.
    #[must_use]
    pub fn dof_range(&self) -> core::ops::Range<usize> {
        self.dof_start..self.dof_start + self.joint.kind.dof_count()
    }
}

/// What a body is wherever it hangs. A model and those that [edits](crate::Model::edit) make of it share what they do not
/// change, so that an edit of a large model copies places alone.
#[derive(Clone, Debug)]
pub struct BodyProperties {
    /// Name, unique in the model.
    pub name: String,
    /// The joint to the parent; its axis has unit length.
    pub joint: Joint,
    /// Mass properties in the body's frame.
    pub mass: MassProperties,
    /// Whether it resists the motion of its joint by its own mass.
    pub(crate) resists: bool,
}

impl BodyProperties {
    /// Of a joint and a mass that were checked, the joint normalised.
    pub(crate) fn new(name: String, joint: Joint, mass: MassProperties) -> Arc<Self> {
        Arc::new(Self {
            resists: massless::resists_alone(&joint, &mass),
            name,
            joint,
            mass,
        })
    }
}

impl Deref for Body {
    type Target = BodyProperties;

    fn deref(&self) -> &BodyProperties {
        &self.properties
    }
}

/// A body to be found by its name.
#[derive(Clone, Debug)]
pub(crate) struct Named(pub(crate) Arc<BodyProperties>);

impl Borrow<str> for Named {
    fn borrow(&self) -> &str {
        &self.0.name
    }
}

impl PartialEq for Named {
    fn eq(&self, other: &Self) -> bool {
        self.0.name == other.0.name
    }
}

impl Eq for Named {}

impl Hash for Named {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.name.hash(state);
    }
}

/// The bodies of a model in the making, parents first.
pub(crate) struct Bodies {
    pub(crate) list: Vec<Body>,
    /// Bodies on the way from the world to each.
    pub(crate) depths: Vec<u32>,
    pub(crate) position_count: usize,
    pub(crate) dof_count: usize,
    pub(crate) sizes: Sizes,
}

impl Bodies {
    pub(crate) fn with_capacity(count: usize) -> Self {
        Self {
            list: Vec::with_capacity(count),
            depths: Vec::with_capacity(count),
            position_count: 0,
            dof_count: 0,
            sizes: Sizes::default(),
        }
    }

    /// Adds a body; its sizes are the caller's to count.
    pub(crate) fn push(&mut self, properties: Arc<BodyProperties>, parent: Option<BodyId>) {
        let above = parent.map_or(0, |parent| self.depths[parent.index()]);
        self.depths.push(above + 1);
        let (position_start, dof_start) = (self.position_count, self.dof_count);
        self.position_count += properties.joint.kind.position_count();
        self.dof_count += properties.joint.kind.dof_count();
        self.list.push(Body {
            properties,
            parent,
            position_start,
            dof_start,
        });
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "validation refuses models of more than u32::MAX bodies"
)]
pub(crate) const fn body_id(index: usize) -> BodyId {
    BodyId(index as u32)
}
