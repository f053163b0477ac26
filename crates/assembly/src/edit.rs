//! Models changed while they move: tethers, fracture, docking.

mod loops;

use self::loops::of_model;
use crate::body::{Bodies, body_id};
use crate::kinematics::{Placed, across, beyond, of_body, project};
use crate::{
    BodyId, BodyProperties, Compound, Coupling, Frame, Joint, JointKind, Loop, MassProperties,
    Matter, Model, ModelError, State, closure, massless, validate,
};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};
use std::sync::{Arc, OnceLock};

/// Of so many bodies on the way to one whose pose was asked for, one is remembered: a further question has as
/// far to go at most, and memory is not spent on all of a long chain.
const KEPT: usize = 32;

/// A change of a model and its state in the making ([`Model::edit`]); nothing happens to either.
///
/// Bodies that stay keep their poses and velocities; coordinates of joints that stay keep their bits. Loops
/// and couplings stay as long as their bodies do, or until they are [opened](Self::open); others can be
/// [closed](Self::close). Ids are those of the old model, and for bodies added those that [`add`](Self::add) gave.
///
/// ```
/// use glam::DVec3;
/// use vertebra_assembly::{Joint, State, generate};
///
/// // A rope of ten links breaks in the middle.
/// let rope = generate::chain(10, &Joint::spherical(), &generate::Rod::default())?;
/// let state = State::random(&rope, 1);
/// let middle = rope.find("body-5").ok_or("no such body")?;
/// let mut edit = rope.edit(&state)?;
/// edit.cut(middle)?;
/// let broken = edit.finish()?;
/// assert_eq!(broken.model.dof_count(), 9 * 3 + 6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Edit<'a> {
    model: &'a Model,
    state: &'a State,
    /// Poses and velocities of bodies that were asked for, and of some on the way to them.
    placed: HashMap<usize, Placed>,
    /// Parent of each body, those added after the model's; none for the world.
    parents: Vec<Option<usize>>,
    removed: Vec<bool>,
    /// Children that are left.
    children: Vec<u32>,
    /// Joints that are not, or no longer, the model's, and their coordinates.
    changed: HashMap<usize, (Joint, Vec<f64>, Vec<f64>)>,
    added: Vec<Added>,
    names: HashSet<String>,
    /// Loops and couplings by the old ids, once any was changed.
    closed: Option<(Vec<Loop>, Vec<Coupling>)>,
}

#[derive(Clone, Debug)]
struct Added {
    name: String,
    mass: MassProperties,
}

/// A model that was changed.
#[derive(Clone, Debug)]
pub struct Edited {
    /// The new model.
    pub model: Model,
    /// Its state, at the same time.
    pub state: State,
    /// The new id of each body by the id that it had in the edit: of the old ones, then of those added; none of those
    /// removed.
    pub bodies: Vec<Option<BodyId>>,
}

impl<'a> Edit<'a> {
    pub(crate) fn new(model: &'a Model, state: &'a State) -> Self {
        let bodies = model.bodies();
        let mut children = vec![0; bodies.len()];
        for parent in bodies.iter().filter_map(|body| body.parent) {
            children[parent.index()] += 1;
        }
        Self {
            parents: (bodies.iter())
                .map(|body| body.parent.map(BodyId::index))
                .collect(),
            removed: vec![false; bodies.len()],
            children,
            placed: HashMap::new(),
            changed: HashMap::new(),
            added: Vec::new(),
            names: HashSet::new(),
            closed: None,
            model,
            state,
        }
    }

    /// Takes a body away, with all that it carries when the edit is finished.
    ///
    /// # Errors
    /// [`ModelError::NoSuchBody`], of a body that was removed too.
    pub fn remove(&mut self, body: BodyId) -> Result<(), ModelError> {
        let index = self.known(body)?;
        self.removed[index] = true;
        self.leave(index);
        Ok(())
    }

    /// Fixes a body to its parent as it is now, all joints of a [`Compound`] together. The joint's rate is lost and all other rates stay, so that momentum
    /// is not kept where the joint was moving. To weld what moves as an impact would, which changes all rates and
    /// keeps momentum, stop the joint first: a very short step with a motor that wants no motion
    /// (`Motor::velocity(0.0, gain)`, the gain as large as it may be) takes its rate out by an impulse.
    ///
    /// # Errors
    /// [`ModelError::NoSuchBody`].
    pub fn weld(&mut self, body: BodyId) -> Result<(), ModelError> {
        let index = self.known(body)?;
        for index in self.row(index) {
            let (joint, q) = self.joint(index);
            let moved = across(&joint.kind, q);
            let mut welded = Joint::fixed().at(joint.parent_placement * moved);
            welded = welded.on_child(joint.child_placement);
            self.changed.insert(index, (welded, Vec::new(), Vec::new()));
        }
        Ok(())
    }

    /// Cuts a body, with all that it carries, from its parent: it then moves freely, as fast as it did.
    ///
    /// # Errors
    /// [`ModelError::NoSuchBody`].
    pub fn cut(&mut self, body: BodyId) -> Result<(), ModelError> {
        let index = self.known(body)?;
        let Placed {
            pose,
            spin,
            velocity,
        } = self.place(index);
        let to_body = pose.rotation.inverse();
        let (spin, slide) = (to_body * spin, to_body * velocity);
        let q = [
            &pose.translation.to_array()[..],
            &pose.rotation.to_array()[..],
        ];
        let qd = project(&JointKind::Free, spin, slide);
        self.leave(index);
        self.parents[index] = None;
        self.changed.insert(index, (Joint::free(), q.concat(), qd));
        Ok(())
    }

    /// Attaches a body, with all that it carries, to another one or the world by a joint whose place on
    /// the body is the joint's own and whose place on the parent is such that nothing moves: its position
    /// is zero now. Of the relative velocity that part is kept which the joint allows.
    ///
    /// # Errors
    /// [`ModelError::NoSuchBody`]; [`ModelError`] of a bad joint.
    pub fn reattach(
        &mut self,
        body: BodyId,
        parent: Option<BodyId>,
        joint: Joint,
    ) -> Result<(), ModelError> {
        let index = self.known(body)?;
        let parent = parent.map(|parent| self.known(parent)).transpose()?;
        validate::first(|problems| validate::check_joint(self.name(index), &joint, problems))?;
        let mut joint = validate::normalized(joint);
        let below = parent.map_or(Placed::WORLD, |parent| self.place(parent));
        let parent_pose = below.pose;
        let own = self.place(index);
        let own = own.carried(own.pose * joint.child_placement);
        let below = below.carried(own.pose);
        let to_joint = own.pose.rotation.inverse();
        let spin = to_joint * (own.spin - below.spin);
        let slide = to_joint * (own.velocity - below.velocity);
        joint.parent_placement = parent_pose.inverse() * own.pose;
        let qd = project(&joint.kind, spin, slide);
        self.leave(index);
        self.parents[index] = parent;
        if let Some(parent) = parent {
            self.children[parent] += 1;
        }
        let q = neutral(joint.kind);
        self.changed.insert(index, (joint, q, qd));
        Ok(())
    }

    /// Adds a body at rest against its parent, its joint at zero. A [`Compound`] joint adds bodies without mass
    /// before it.
    ///
    /// Returns the body's id in this edit, by which more can be attached to it and loops closed;
    /// [`Edited::bodies`] says what becomes of it.
    ///
    /// ```
    /// use glam::DVec3;
    /// use vertebra_assembly::{BodyShape, Closure, Joint, State, generate};
    /// use vertebra_spatial::Pose;
    ///
    /// // A line of twenty links is paid out from a drone, and hooked to the world.
    /// let drone = generate::chain(1, &Joint::free(), &generate::Rod::default())?;
    /// let state = State::neutral(&drone);
    /// let below = Pose::from_translation(DVec3::new(0.0, 0.0, -0.1));
    /// let link = BodyShape::capsule(0.01, 0.08).placed(&Pose::from_translation(DVec3::Z * -0.05));
    /// let mut edit = drone.edit(&state)?;
    /// let mut end = drone.last_body();
    /// for index in 0..20 {
    ///     let joint = Joint::universal(DVec3::X, DVec3::Y).at(below);
    ///     end = edit.add(format!("link-{index}"), Some(end), joint, link.clone())?;
    /// }
    /// let hook = Pose::from_translation(DVec3::Z * -2.1);
    /// edit.close_at("hook", [Some(end), None], hook, Closure::Ball)?;
    /// let edited = edit.finish()?;
    /// assert_eq!(edited.model.dof_count(), 6 + 2 * 20);
    /// assert_eq!(edited.bodies[end.index()], edited.model.find("link-19"));
    /// # Ok::<(), vertebra_assembly::ModelError>(())
    /// ```
    ///
    /// # Errors
    /// [`ModelError::NoSuchBody`] of the parent; [`ModelError`] of a bad joint, mass or shape, or of a name
    /// that is taken. The edit is then as it was.
    pub fn add(
        &mut self,
        name: impl Into<String>,
        parent: Option<BodyId>,
        joint: impl Into<Compound>,
        matter: impl Into<Matter>,
    ) -> Result<BodyId, ModelError> {
        let name = name.into();
        let mut parent = parent.map(|parent| self.known(parent)).transpose()?;
        let mass = match matter.into().mass_properties() {
            Ok(mass) => mass,
            Err(source) => {
                let source = Box::new(source);
                return Err(ModelError::BodyShape { body: name, source });
            }
        };
        let row: Vec<_> = joint.into().bodies(name, None, mass).collect();
        validate::check_count(self.parents.len() + row.len())?;
        for body in &row {
            self.check_name(&body.name)?;
            validate::first(|problems| {
                validate::check_joint(&body.name, &body.joint, problems);
                validate::check_mass(&body.name, &body.mass, problems);
            })?;
        }
        for body in row {
            let index = self.parents.len();
            let joint = validate::normalized(body.joint);
            let (q, qd) = (neutral(joint.kind), vec![0.0; joint.kind.dof_count()]);
            self.changed.insert(index, (joint, q, qd));
            if let Some(parent) = parent {
                self.children[parent] += 1;
            }
            self.parents.push(parent.replace(index));
            self.removed.push(false);
            self.children.push(0);
            self.names.insert(body.name.clone());
            self.added.push(Added {
                name: body.name,
                mass: body.mass,
            });
        }
        Ok(body_id(self.parents.len() - 1))
    }

    /// Checks that a body can be added under a name.
    fn check_name(&self, name: &str) -> Result<(), ModelError> {
        validate::check_name("body", self.parents.len(), name)?;
        let is_known = self.model.find(name).is_some() || self.model.find_frame(name).is_some();
        if is_known || self.names.contains(name) {
            let name = name.to_owned();
            return Err(ModelError::DuplicateName { name });
        }
        Ok(())
    }

    /// Makes the new model and its state. Bodies keep their order but where a parent would come after its
    /// children.
    ///
    /// # Errors
    /// [`ModelError::Cycle`] if bodies were attached to what they carry; [`ModelError::Empty`];
    /// [`ModelError::MasslessBody`].
    pub fn finish(mut self) -> Result<Edited, ModelError> {
        let order = self.order()?;
        if order.is_empty() {
            return Err(ModelError::Empty {
                model: self.model.name().to_owned(),
            });
        }
        let mut ids = vec![None; self.parents.len()];
        let mut state = State {
            q: Vec::with_capacity(self.state.q.len()),
            qd: Vec::with_capacity(self.state.qd.len()),
            time: self.state.time,
        };
        let old = self.model.bodies();
        // What most bodies have not changed is known of the old model.
        let mut bodies = Bodies::with_capacity(order.len());
        bodies.sizes = self.model.inner.sizes.clone();
        for (body, _) in old.iter().zip(&self.removed).filter(|(_, gone)| **gone) {
            bodies.sizes.remove(&body.joint, &body.mass);
        }
        for (place, index) in order.into_iter().enumerate() {
            ids[index] = Some(body_id(place));
            let parent = self.parents[index].and_then(|parent| ids[parent]);
            let known = old.get(index);
            let properties = if let Some((joint, q, qd)) = self.changed.remove(&index) {
                state.q.extend(q);
                state.qd.extend(qd);
                let (name, mass) = match known {
                    Some(body) => {
                        bodies.sizes.remove(&body.joint, &body.mass);
                        (body.name.clone(), body.mass)
                    }
                    None => {
                        let added = &mut self.added[index - old.len()];
                        (core::mem::take(&mut added.name), added.mass)
                    }
                };
                bodies.sizes.add(&joint, &mass);
                BodyProperties::new(name, joint, mass)
            } else {
                let Some(body) = known else { continue };
                state
                    .q
                    .extend_from_slice(&self.state.q[body.position_range()]);
                state.qd.extend_from_slice(&self.state.qd[body.dof_range()]);
                Arc::clone(&body.properties)
            };
            bodies.push(properties, parent);
        }
        let frames = self.model.frames().iter().filter_map(|frame| {
            let body = match frame.body {
                Some(body) => Some(ids[body.index()]?),
                None => None,
            };
            Some(Frame {
                body,
                ..frame.clone()
            })
        });
        let whole = (self.model.name().to_owned(), self.model.gravity());
        let closed = self.closed.take().unwrap_or_else(|| of_model(self.model));
        let closed = closure::carried_over(closed, &ids, &bodies.list);
        let frames = frames.collect();
        let model = Model::of_bodies(whole, bodies, frames, closed, OnceLock::new());
        massless::check(&model)?;
        Ok(Edited {
            model,
            state,
            bodies: ids,
        })
    }

    /// The bodies that are left, parents first, else in their old order; what hangs from one that was
    /// removed goes too.
    fn order(&mut self) -> Result<Vec<usize>, ModelError> {
        let count = self.parents.len();
        let is_before = |(index, parent): (usize, &Option<usize>)| parent.is_none_or(|p| p < index);
        if self.parents.iter().enumerate().all(is_before) {
            for index in 0..count {
                let gone = self.parents[index].is_some_and(|parent| self.removed[parent]);
                self.removed[index] |= gone;
            }
            return Ok((0..count).filter(|&index| !self.removed[index]).collect());
        }
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
        let mut ready = BinaryHeap::new();
        for (index, parent) in self.parents.iter().enumerate() {
            match parent {
                Some(parent) => children[*parent].push(index),
                None => ready.push(Reverse(index)),
            }
        }
        let mut order = Vec::with_capacity(count);
        let mut seen = vec![false; count];
        while let Some(Reverse(index)) = ready.pop() {
            seen[index] = true;
            if !self.removed[index] {
                order.push(index);
            }
            for &child in &children[index] {
                self.removed[child] |= self.removed[index];
                ready.push(Reverse(child));
            }
        }
        match seen.iter().position(|&seen| !seen) {
            None => Ok(order),
            // From an unplaced body towards its parents as often as there are bodies ends on the cycle.
            Some(unplaced) => {
                let up = |index: usize, _| self.parents[index].unwrap_or(index);
                Err(ModelError::Cycle {
                    body: self.name((0..count).fold(unplaced, up)).to_owned(),
                })
            }
        }
    }

    /// Takes a body from its parent, and with it the bodies without mass of a compound joint, which carry
    /// nothing else.
    fn leave(&mut self, body: usize) {
        let mut at = self.parents[body];
        while let Some(parent) = at {
            self.children[parent] -= 1;
            if self.children[parent] > 0 || *self.mass(parent) != MassProperties::MASSLESS {
                break;
            }
            self.removed[parent] = true;
            at = self.parents[parent];
        }
    }

    /// A body and those between whose joints make a compound one with its own, which are named after it.
    fn row(&self, body: usize) -> Vec<usize> {
        let number = |index: usize| -> Option<usize> {
            let rest = self.name(index).strip_prefix(self.name(body))?;
            rest.strip_prefix('.')?.parse().ok()
        };
        let (mut row, mut last) = (vec![body], None);
        let mut next = self.parents[body];
        while let Some(between) = next
            && *self.mass(between) == MassProperties::MASSLESS
            && self.children[between] == 1
            && let Some(number) = number(between)
            && last.is_none_or(|last| number + 1 == last)
        {
            row.push(between);
            last = Some(number);
            next = self.parents[between];
        }
        row
    }

    fn known(&self, body: BodyId) -> Result<usize, ModelError> {
        let index = body.index();
        if self.removed.get(index) == Some(&false) {
            return Ok(index);
        }
        Err(ModelError::NoSuchBody {
            model: self.model.name().to_owned(),
            body: index,
        })
    }

    fn name(&self, index: usize) -> &str {
        let old = self.model.bodies();
        match old.get(index) {
            Some(body) => &body.name,
            None => &self.added[index - old.len()].name,
        }
    }

    fn mass(&self, index: usize) -> &MassProperties {
        let old = self.model.bodies();
        match old.get(index) {
            Some(body) => &body.mass,
            None => &self.added[index - old.len()].mass,
        }
    }

    /// Where a body is and how it moves: an old one as in the state, one that was added as it was then, for whatever
    /// moves it to another parent asks for its place first.
    fn place(&mut self, index: usize) -> Placed {
        let bodies = self.model.bodies();
        let (mut path, mut next) = (Vec::new(), Some(index));
        let mut place = Placed::WORLD;
        while let Some(body) = next {
            if let Some(known) = self.placed.get(&body) {
                place = *known;
                break;
            }
            path.push(body);
            next = match bodies.get(body) {
                Some(old) => old.parent.map(BodyId::index),
                None => self.parents[body],
            };
        }
        for body in path.into_iter().rev() {
            place = match (bodies.get(body), self.changed.get(&body)) {
                (None, Some((joint, q, qd))) => beyond(&place, joint, q, qd),
                (Some(old), _) => of_body(&place, old, self.state),
                // Those that were added have their joints among the changed ones.
                (None, None) => place,
            };
            if body % KEPT == 0 || body == index {
                self.placed.insert(body, place);
            }
        }
        place
    }

    /// A body's joint as it is by now, and its positions.
    fn joint(&self, index: usize) -> (&Joint, &[f64]) {
        if let Some((joint, q, _)) = self.changed.get(&index) {
            return (joint, q);
        }
        let body = &self.model.bodies()[index];
        (&body.joint, &self.state.q[body.position_range()])
    }
}

/// Positions of a joint whose two frames coincide.
fn neutral(kind: JointKind) -> Vec<f64> {
    let mut q = vec![0.0; kind.position_count()];
    if let (JointKind::Spherical | JointKind::Free, [.., w]) = (kind, &mut q[..]) {
        *w = 1.0;
    }
    q
}
