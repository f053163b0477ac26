//! Loops closed and opened, joints coupled and uncoupled, while a model moves.

use super::Edit;
use crate::kinematics::Placed;
use crate::{BodyId, Closure, Coupling, Loop, Model, ModelError, closure, validate};
use vertebra_spatial::Pose;

/// Loops and couplings of a model, but for joints that mimic others, which say so themselves.
pub(super) fn of_model(model: &Model) -> (Vec<Loop>, Vec<Coupling>) {
    (model.loops().to_vec(), model.inner.couplings.clone())
}

impl Edit<'_> {
    /// Closes a loop: connects two bodies (none for the world) by one more joint, whose frames are at `placements`
    /// on them. A tether is a [`Closure::Ball`] or a [`Closure::Distance`].
    ///
    /// The state stays as it is. Simulations refuse to step one that is far from closing the loop until
    /// `Simulation::close_loops` has moved it there; rates that open it are taken out by the first step, as an
    /// impact would.
    ///
    /// # Errors
    /// [`ModelError::NoSuchBody`], [`ModelError::SelfLoop`]; [`ModelError`] of a bad placement or closure, or of a
    /// name that another loop or coupling has. The edit is then as it was.
    pub fn close(
        &mut self,
        name: impl Into<String>,
        bodies: [Option<BodyId>; 2],
        placements: [Pose; 2],
        closure: Closure,
    ) -> Result<(), ModelError> {
        let name = self.fresh(name.into())?;
        for body in bodies.into_iter().flatten() {
            self.known(body)?;
        }
        if bodies[0] == bodies[1] {
            return Err(ModelError::SelfLoop { name });
        }
        validate::first(|problems| {
            closure::check_places(&name, &placements, problems);
            closure::check_closure(&name, &closure, problems);
        })?;
        let placements = placements.map(|placement| Pose {
            rotation: validate::unit_rotation(placement.rotation),
            ..placement
        });
        self.closed().0.push(Loop {
            name,
            bodies,
            placements,
            closure: closure.normalized(),
        });
        Ok(())
    }

    /// Closes a loop where it is closed already: both frames of its joint are at `at` in the world now.
    ///
    /// ```
    /// use glam::DVec3;
    /// use vertebra_assembly::{Closure, Joint, State, generate};
    /// use vertebra_spatial::Pose;
    ///
    /// // A rope is tied to the world by its last link's tip, and let go of again.
    /// let rod = generate::Rod::default();
    /// let rope = generate::chain(10, &Joint::spherical(), &rod)?;
    /// let state = State::neutral(&rope);
    /// let tip = Pose::from_translation(DVec3::new(0.0, 0.0, 10.0 * rod.length));
    /// let mut edit = rope.edit(&state)?;
    /// edit.close_at("knot", [Some(rope.last_body()), None], tip, Closure::Ball)?;
    /// let tied = edit.finish()?;
    /// assert_eq!(tied.model.loops().len(), 1);
    ///
    /// let mut edit = tied.model.edit(&tied.state)?;
    /// edit.open("knot")?;
    /// assert!(edit.finish()?.model.loops().is_empty());
    /// # Ok::<(), vertebra_assembly::ModelError>(())
    /// ```
    ///
    /// # Errors
    /// As [`close`](Self::close); [`ModelError::NotThere`] of a closure that does not let its frames coincide: a
    /// [`Closure::Distance`], or a [`Closure::Universal`] whose axes are not perpendicular.
    pub fn close_at(
        &mut self,
        name: impl Into<String>,
        bodies: [Option<BodyId>; 2],
        at: Pose,
        closure: Closure,
    ) -> Result<(), ModelError> {
        let name = name.into();
        validate::check_placement("placement", &name, &at)?;
        validate::first(|problems| closure::check_closure(&name, &closure, problems))?;
        if !closure.lets_frames_coincide() {
            return Err(ModelError::NotThere { name });
        }
        let mut placements = [at; 2];
        for (placement, body) in placements.iter_mut().zip(bodies) {
            let below = match body {
                Some(body) => {
                    let index = self.known(body)?;
                    self.place(index)
                }
                None => Placed::WORLD,
            };
            *placement = below.pose.inverse() * at;
        }
        self.close(name, bodies, placements, closure)
    }

    /// Opens a loop again: its bodies move on as they do.
    ///
    /// # Errors
    /// [`ModelError::NoSuchLoop`].
    pub fn open(&mut self, name: &str) -> Result<(), ModelError> {
        let loops = &mut self.closed().0;
        match loops.iter().position(|closed| closed.name == name) {
            Some(index) => {
                loops.remove(index);
                Ok(())
            }
            None => Err(self.no_loop(name)),
        }
    }

    /// Couples the joints of two bodies, of one freedom each, the first one following: q = ratio * q_other + offset.
    ///
    /// # Errors
    /// [`ModelError::NoSuchBody`], [`ModelError::CoupledFreedoms`], [`ModelError::SelfLoop`]; [`ModelError`] of a
    /// number that is not finite, or of a name that another loop or coupling has. The edit is then as it was.
    pub fn couple(
        &mut self,
        name: impl Into<String>,
        bodies: [BodyId; 2],
        ratio: f64,
        offset: f64,
    ) -> Result<(), ModelError> {
        let name = self.fresh(name.into())?;
        let [body, other] = bodies;
        validate::finite("coupling ratio", &name, ratio)?;
        validate::finite("coupling offset", &name, offset)?;
        for body in bodies {
            let index = self.known(body)?;
            let freedoms = self.joint(index).0.kind.dof_count();
            if freedoms != 1 {
                return Err(ModelError::CoupledFreedoms {
                    name,
                    body: self.name(index).to_owned(),
                    freedoms,
                });
            }
        }
        if body == other {
            return Err(ModelError::SelfLoop { name });
        }
        self.closed().1.push(Coupling {
            name,
            body,
            other,
            ratio,
            offset,
        });
        Ok(())
    }

    /// Takes a coupling away; of a joint that mimics another, by the name of its body.
    ///
    /// # Errors
    /// [`ModelError::NoSuchLoop`].
    pub fn uncouple(&mut self, name: &str) -> Result<(), ModelError> {
        let couplings = &mut self.closed().1;
        if let Some(index) = couplings.iter().position(|coupling| coupling.name == name) {
            couplings.remove(index);
            return Ok(());
        }
        let old = self.model.bodies().len();
        let added = || self.added.iter().position(|added| added.name == name);
        let body = self.model.find(name).map(BodyId::index);
        let body = body.or_else(|| Some(old + added()?));
        let Some(index) =
            body.filter(|&index| !self.removed[index] && self.joint(index).0.mimic.is_some())
        else {
            return Err(self.no_loop(name));
        };
        if !self.changed.contains_key(&index) {
            let known = &self.model.bodies()[index];
            let q = self.state.q[known.position_range()].to_vec();
            let qd = self.state.qd[known.dof_range()].to_vec();
            self.changed.insert(index, (known.joint.clone(), q, qd));
        }
        if let Some((joint, ..)) = self.changed.get_mut(&index) {
            joint.mimic = None;
        }
        Ok(())
    }

    /// Loops and couplings as they are by now.
    fn closed(&mut self) -> &mut (Vec<Loop>, Vec<Coupling>) {
        let model = self.model;
        self.closed.get_or_insert_with(|| of_model(model))
    }

    /// A name that no loop or coupling has.
    fn fresh(&mut self, name: String) -> Result<String, ModelError> {
        let (loops, couplings) = self.closed();
        validate::check_name("loop", loops.len() + couplings.len(), &name)?;
        let names = loops.iter().map(|closed| &closed.name);
        let mut names = names.chain(couplings.iter().map(|coupling| &coupling.name));
        match names.any(|known| *known == name) {
            true => Err(ModelError::DuplicateName { name }),
            false => Ok(name),
        }
    }

    fn no_loop(&self, name: &str) -> ModelError {
        ModelError::NoSuchLoop {
            model: self.model.name().to_owned(),
            name: name.to_owned(),
        }
    }
}
