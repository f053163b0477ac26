//! The model: checked, ordered, constant.

use crate::body::{Bodies, Named, body_id};
use crate::{
    Body, BodyDescription, BodyId, BodyProperties, Coupling, CouplingDescription, Edit,
    FrameDescription, Joint, Loop, LoopDescription, ModelDescription, ModelError, State, Units,
    closure, description::MODEL_VERSION, massless, not_simulated::NotSimulated, units::Sizes,
    validate,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};
use vertebra_spatial::Pose;

/// An articulated model, or several side by side: bodies, the joints that carry them, gravity.
///
/// Constant once built, and cheap to clone: clones share their data. Every parent stands before
/// its children. Serialises as a [`ModelDescription`]; numbers come back to the last bit where the
/// parser rounds correctly (`serde_json` does so with its feature `float_roundtrip` only).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "ModelDescription", into = "ModelDescription")]
pub struct Model {
    pub(crate) inner: Arc<Inner>,
}

#[derive(Clone, Debug)]
pub(crate) struct Inner {
    name: String,
    gravity: DVec3,
    units: Units,
    /// What the units are the medians of.
    pub(crate) sizes: Sizes,
    bodies: Vec<Body>,
    frames: Vec<Frame>,
    pub(crate) loops: Vec<Loop>,
    pub(crate) couplings: Vec<Coupling>,
    /// Made when it is first asked for.
    by_name: OnceLock<HashMap<Named, BodyId>>,
    position_count: usize,
    dof_count: usize,
    depth: usize,
}

/// A named place on a body or in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Name, unique among bodies and frames.
    pub name: String,
    /// The body it is fixed to; none for the world.
    pub body: Option<BodyId>,
    /// Where it is in that body's frame.
    pub placement: Pose,
}

impl Model {
    /// Name of the model.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// Gravity in world axes [m/s^2].
    #[must_use]
    pub fn gravity(&self) -> DVec3 {
        self.inner.gravity
    }

    /// The units its solvers compute in.
    #[must_use]
    pub fn units(&self) -> &Units {
        &self.inner.units
    }

    /// The bodies, parents before children, indexed by [`BodyId`].
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.inner.bodies
    }

    /// The named places.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        &self.inner.frames
    }

    /// One body, if the model has it.
    #[must_use]
    pub fn body(&self, id: BodyId) -> Option<&Body> {
        self.inner.bodies.get(id.index())
    }

    /// The body of that name. Links of a file that were folded into another body are no bodies but
    /// frames: see [`find_frame`](Self::find_frame).
    #[must_use]
    pub fn find(&self, name: &str) -> Option<BodyId> {
        let names = || {
            let bodies = self.body_ids().zip(self.bodies());
            bodies
                .map(|(id, body)| (Named(Arc::clone(&body.properties)), id))
                .collect()
        };
        self.inner.by_name.get_or_init(names).get(name).copied()
    }

    /// The named place of that name, looked for one by one.
    #[must_use]
    pub fn find_frame(&self, name: &str) -> Option<&Frame> {
        self.inner.frames.iter().find(|frame| frame.name == name)
    }

    /// The body that stands last; of a chain, its tip.
    #[must_use]
    pub fn last_body(&self) -> BodyId {
        body_id(self.inner.bodies.len() - 1)
    }

    /// Every body's id, parents before children.
    pub fn body_ids(&self) -> impl DoubleEndedIterator<Item = BodyId> + ExactSizeIterator + use<> {
        (0..self.inner.bodies.len()).map(body_id)
    }

    /// Length of positions q.
    #[must_use]
    pub fn position_count(&self) -> usize {
        self.inner.position_count
    }

    /// Degrees of freedom: length of rates qd, accelerations qdd and joint forces.
    #[must_use]
    pub fn dof_count(&self) -> usize {
        self.inner.dof_count
    }

    /// Bodies on the longest way from the world to a body.
    #[must_use]
    pub fn depth(&self) -> usize {
        self.inner.depth
    }

    /// Whether two models are the same one: clones of each other.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.inner, &other.inner)
    }

    /// What the model states that this version does not simulate: largest speeds, mimics of joints of several
    /// freedoms, and elements in joints that cannot have them.
    #[must_use]
    pub fn not_simulated(&self) -> Vec<NotSimulated> {
        NotSimulated::of_model(self)
    }

    /// The first body whose joint has elements that act of their own accord: range, damping, friction,
    /// rotor or spring.
    #[must_use]
    pub fn first_element(&self) -> Option<BodyId> {
        let has = |body: &Body| body.joint.has_elements();
        self.bodies().iter().position(has).map(body_id)
    }

    /// The same model without elements in its joints: bodies, frames, the motions that joints allow, and the
    /// loops and couplings (mimics too) that bind them.
    #[must_use]
    pub fn bare(&self) -> Self {
        let mut inner = Inner::clone(&self.inner);
        for body in &mut inner.bodies {
            let Joint {
                kind,
                parent_placement,
                child_placement,
                ..
            } = body.joint;
            let joint = Joint {
                parent_placement,
                child_placement,
                mimic: body.joint.mimic.clone(),
                ..Joint::new(kind)
            };
            body.properties = Arc::new(BodyProperties {
                name: body.name.clone(),
                joint,
                ..*body.properties
            });
        }
        Self {
            inner: Arc::new(inner),
        }
    }

    /// Starts a change of the model while it moves: bodies added and taken away, welded, cut loose and
    /// attached elsewhere, the state carried over.
    ///
    /// # Errors
    /// [`ModelError`] if the state does not fit the model.
    pub fn edit<'a>(&'a self, state: &'a State) -> Result<Edit<'a>, ModelError> {
        state.check(self)?;
        Ok(Edit::new(self, state))
    }

    /// The model as plain data.
    #[must_use]
    pub fn describe(&self) -> ModelDescription {
        let name_of = |id: Option<BodyId>| id.map(|id| self.inner.bodies[id.index()].name.clone());
        ModelDescription {
            version: MODEL_VERSION,
            name: self.inner.name.clone(),
            gravity: self.inner.gravity,
            bodies: self
                .bodies()
                .iter()
                .map(|body| BodyDescription {
                    name: body.name.clone(),
                    parent: name_of(body.parent),
                    joint: body.joint.clone(),
                    mass: body.mass,
                })
                .collect(),
            frames: self
                .frames()
                .iter()
                .map(|frame| FrameDescription {
                    name: frame.name.clone(),
                    body: name_of(frame.body),
                    placement: frame.placement,
                })
                .collect(),
            loops: (self.loops().iter())
                .map(|closed| LoopDescription {
                    name: closed.name.clone(),
                    bodies: closed.bodies.map(name_of),
                    placements: closed.placements,
                    closure: closed.closure,
                })
                .collect(),
            couplings: (self.inner.couplings.iter())
                .map(|coupling| CouplingDescription {
                    name: coupling.name.clone(),
                    body: self.inner.bodies[coupling.body.index()].name.clone(),
                    other: self.inner.bodies[coupling.other.index()].name.clone(),
                    ratio: coupling.ratio,
                    offset: coupling.offset,
                })
                .collect(),
        }
    }
}

impl From<Model> for ModelDescription {
    fn from(model: Model) -> Self {
        model.describe()
    }
}

impl TryFrom<ModelDescription> for Model {
    type Error = ModelError;

    fn try_from(description: ModelDescription) -> Result<Self, ModelError> {
        let order = validate::check(&description)?;
        let model = Self::unchecked(description, order);
        massless::check(&model)?;
        Ok(model)
    }
}

impl Model {
    /// The model of a description that was checked, in an order with parents first.
    pub(crate) fn unchecked(description: ModelDescription, order: Vec<usize>) -> Self {
        let ModelDescription {
            name,
            gravity,
            bodies: written,
            frames,
            loops,
            couplings,
            ..
        } = description;
        let mut by_name = HashMap::with_capacity(written.len());
        let mut bodies = Bodies::with_capacity(written.len());
        let mut slots: Vec<Option<BodyDescription>> = written.into_iter().map(Some).collect();
        for body in order.into_iter().filter_map(|index| slots[index].take()) {
            let parent = body.parent.and_then(|name| by_name.get(&*name).copied());
            bodies.sizes.add(&body.joint, &body.mass);
            let properties =
                BodyProperties::new(body.name, validate::normalized(body.joint), body.mass);
            by_name.insert(Named(Arc::clone(&properties)), body_id(bodies.list.len()));
            bodies.push(properties, parent);
        }
        let frames = frames
            .into_iter()
            .map(|frame| Frame {
                name: frame.name,
                body: frame.body.and_then(|name| by_name.get(&*name).copied()),
                placement: frame.placement,
            })
            .collect();
        let find = |name: &str| by_name.get(name).copied();
        let closed = closure::resolve(loops, couplings, find);
        Self::of_bodies(
            (name, gravity),
            bodies,
            frames,
            closed,
            OnceLock::from(by_name),
        )
    }

    /// The model of bodies that were checked.
    pub(crate) fn of_bodies(
        (name, gravity): (String, DVec3),
        bodies: Bodies,
        frames: Vec<Frame>,
        (loops, couplings): (Vec<Loop>, Vec<Coupling>),
        by_name: OnceLock<HashMap<Named, BodyId>>,
    ) -> Self {
        Self {
            inner: Arc::new(Inner {
                name,
                gravity,
                units: Units::of_sizes(&bodies.sizes, gravity),
                depth: bodies.depths.into_iter().max().unwrap_or(0) as usize,
                sizes: bodies.sizes,
                bodies: bodies.list,
                frames,
                loops,
                couplings,
                by_name,
                position_count: bodies.position_count,
                dof_count: bodies.dof_count,
            }),
        }
    }
}
