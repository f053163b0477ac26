//! What acts in the joints: springs, dampers, dry friction, rotors, stops and motors.
//!
//! Every element comes down to two numbers a freedom, found at the start of a step: a joint force, and an
//! inertia of the freedom's own ([`Forces::joint_inertia`]) by which the step is implicit. With k, c the
//! sums of stiffness and damping and q0 the rest,
//!
//! tau = -k (q + h qd - q0) - c qd,   E = rotor + h c + h^2 k,
//!
//! which is the force at the end of the step, -k (q + h v - q0) - c v with v = qd + h qdd, so that no
//! spring or gain is too stiff (linearly implicit Euler). Friction, stops and motors are bounded too:
//! f(v) = min(max(at - slope v, least), most). Which part of this a joint is on is found by solving:
//! a solution whose rates belong to other parts is thrown away and those parts are taken (the iteration
//! of Newton for a piecewise linear system; steps remember their parts, so that most need one solution).
//!
//! - **Friction** F: Coulomb's law, with a slope of F over a rate of 1e-5 in the model's units, below
//!   which a joint that sticks creeps. It never reverses a motion.
//! - **Hard stops**: a step ends at the bound and not beyond it, by a force of whatever size that takes,
//!   which only ever points inwards; with restitution e > 0 a joint that would pass the bound leaves it
//!   with e times its rate. Rates are met to a part of about 1e-7 of what the stop takes out (f64). A joint
//!   that starts outside of its range is brought back at one unit of rate at most.
//! - **Soft stops**: a spring and a damper beyond the bound, never pulling.
//! - **Motors** ([`Motor`]): feed-forward, rate and position, within a limit.
//!
//! Spherical joints have all of these too ([`SphericalMotor`], [`BallRange`](vertebra_assembly::BallRange)). Spring,
//! damper, rotor, friction and motor act alike in all directions, friction and limited motors with a force of their
//! bound in the direction of what is wanted. Stops act along the gradient of the angle that has a range, to first order in what a
//! step turns: of a step that turns fast the end may be beyond the bound by half the square of its angle.
//!
//! Accelerations asked for without a step, and the stages of other integrators than
//! [`SemiImplicitEuler`](crate::Integrator::SemiImplicitEuler), have h = 0: forces as they are now, and
//! the inertia of rotors alone. Hard stops then do nothing, and those integrators refuse to step with them
//! or with friction, whose forces jump.

mod ball;
mod freedom;
#[cfg(feature = "gpu")]
mod kernels;
mod law;
mod motor;
mod round;
mod stop;

#[cfg(feature = "gpu")]
pub(crate) use kernels::{Parts, Rows};
pub use motor::{Motor, SphericalMotor};

use crate::{Error, Forces, Integrator, Solver};
use ball::{Ball, Turned};
use freedom::Freedom;
use stop::Moment;
use vertebra_assembly::{BodyId, JointKind, Model, State};
use vertebra_spatial::vec3;

/// Solutions of one step at most. Parts settle one after another where joints do not push each other
/// about, so a few do; what has not settled is taken as it is.
pub(crate) const PASSES: usize = 12;

/// Work done since the start \[J\], of all that neither masses nor gravity do: kinetic energy, that of rotors included,
/// and potential energy change by its sum. Of implicit steps by the forces at the end of each over the way that the
/// mean rate makes: exact for the kinetic energy of joints whose inertia is constant, and to first order in
/// the step for others. Of other integrators' by the mean of the forces before and after: to second order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Of motors.
    pub motors: f64,
    /// Of springs; what they store ([`Stored`]) is less this much, to first order in the step.
    pub springs: f64,
    /// Of dampers: never positive but for rounding where steps are short.
    pub dampers: f64,
    /// Of dry friction.
    pub friction: f64,
    /// Of stops.
    pub stops: f64,
    /// Of closed loops and couplings: what putting rates and positions back has changed of the energy, and of
    /// semi-implicit Euler the work of the loops' forces, which those of other integrators do not do, to their order.
    pub loops: f64,
}

impl Work {
    /// All of it \[J\].
    #[must_use]
    pub fn total(&self) -> f64 {
        self.motors + self.springs + self.dampers + self.friction + self.stops + self.loops
    }
}

/// Energy that elements hold \[J\], which [`Mechanics`](crate::Mechanics) does not know of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stored {
    /// Potential energy of springs.
    pub springs: f64,
    /// Kinetic energy of rotors.
    pub rotors: f64,
}

/// The elements of a model's joints, and its motors. [`Simulation`](crate::Simulation) has one where
/// there is something to do; the algorithms know no elements, and take what [`load`](Self::load) makes of
/// them.
///
/// ```
/// use glam::DVec3;
/// use vertebra_assembly::{Joint, MassProperties, ModelDescription, State};
/// use vertebra_dynamics::{Elements, Forces, Precision, Workspace, aba};
///
/// let joint = Joint::prismatic(DVec3::X).with_damping(3.0).with_armature(1.0);
/// let mass = MassProperties::sphere(2.0, 0.1);
/// let model = ModelDescription::new("slide").body("cart", None, joint, mass).build()?;
/// let mut state = State::neutral(&model);
/// state.qd[0] = 2.0;
///
/// let mut elements = Elements::new(&model);
/// let loaded = elements.load(&state, &Forces::none(&model), 0.0)?;
/// let mut workspace = Workspace::new(&model, Precision::F64);
/// let qdd = aba(&model, &state, loaded, &mut workspace)?;
/// assert_eq!(qdd, [-3.0 * 2.0 / (2.0 + 1.0)]);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Elements {
    model: Model,
    freedoms: Vec<Freedom>,
    balls: Vec<Ball>,
    /// Where what acts in each body's joint is.
    of_body: Vec<Place>,
    /// Those of the freedoms and of the balls that have anything to compute.
    active: Vec<u32>,
    active_balls: Vec<u32>,
    loaded: Forces,
    qdd: Vec<f64>,
    work: Work,
    solutions: usize,
}

/// Index of what acts in a joint.
#[derive(Clone, Copy, Debug)]
enum Place {
    Nowhere,
    Freedom(u32),
    Ball(u32),
}

impl Elements {
    /// The elements that the model's joints state, all motors off.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let moved = freedom::moved(model);
        let (mut freedoms, mut balls) = (Vec::new(), Vec::new());
        let mut of_body = vec![Place::Nowhere; model.bodies().len()];
        // There are no more of them than bodies, which indices of this width count.
        #[expect(clippy::cast_possible_truncation, reason = "bodies are counted by u32")]
        for (id, body) in model.body_ids().zip(model.bodies()) {
            let (place, moved) = (&mut of_body[id.index()], moved[id.index()]);
            if body.dof_range().len() == 1 {
                *place = Place::Freedom(freedoms.len() as u32);
                freedoms.push(Freedom::new(model, id, body, moved));
            } else if body.joint.kind == JointKind::Spherical {
                *place = Place::Ball(balls.len() as u32);
                balls.push(Ball::new(model, id, body, moved));
            }
        }
        let has_ranges = balls.iter().any(|ball| !ball.bounds.is_empty());
        let mut elements = Self {
            active: Vec::with_capacity(freedoms.len()),
            active_balls: Vec::with_capacity(balls.len()),
            balls,
            freedoms,
            of_body,
            loaded: Forces::none(model),
            qdd: vec![0.0; model.dof_count()],
            work: Work::default(),
            solutions: 0,
            model: model.clone(),
        };
        elements.loaded.joint_inertia = vec![0.0; model.dof_count()];
        if has_ranges {
            elements.loaded.joint_inertia_across = vec![0.0; model.dof_count()];
        }
        elements.list_active();
        elements
    }

    fn list_active(&mut self) {
        self.active.clear();
        let busy = (0..).zip(&self.freedoms);
        let busy = busy.filter(|(_, freedom)| !freedom.is_idle());
        self.active.extend(busy.map(|(index, _): (u32, _)| index));
        self.active_balls.clear();
        let busy = (0..).zip(&self.balls).filter(|(_, ball)| !ball.is_idle());
        let busy = busy.map(|(index, _): (u32, _)| index);
        self.active_balls.extend(busy);
    }

    /// Whether there is nothing to compute: no elements, all motors off.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.active.is_empty() && self.active_balls.is_empty()
    }

    /// Sets the motor of a body's joint, which must have one freedom.
    ///
    /// # Errors
    /// [`Error::UnknownBody`], [`Error::NoMotor`], [`Error::BadMotor`]; the motor is then as it was.
    pub fn set_motor(&mut self, body: BodyId, motor: Motor) -> Result<(), Error> {
        let index = self.freedom_of(body)?;
        motor.check(&self.model.bodies()[body.index()].name)?;
        let freedom = &mut self.freedoms[index];
        let was_idle = freedom.is_idle();
        freedom.motor = motor;
        if was_idle != freedom.is_idle() {
            self.list_active();
        }
        Ok(())
    }

    /// The motor of a body's joint.
    ///
    /// # Errors
    /// [`Error::UnknownBody`], [`Error::NoMotor`].
    pub fn motor(&self, body: BodyId) -> Result<&Motor, Error> {
        Ok(&self.freedoms[self.freedom_of(body)?].motor)
    }

    /// Sets the motor of a spherical joint.
    ///
    /// # Errors
    /// [`Error::UnknownBody`], [`Error::NoMotor`], [`Error::BadMotor`]; the motor is then as it was.
    pub fn set_spherical_motor(
        &mut self,
        body: BodyId,
        motor: SphericalMotor,
    ) -> Result<(), Error> {
        let index = self.ball_of(body)?;
        motor.check(&self.model.bodies()[body.index()].name)?;
        let ball = &mut self.balls[index];
        let was_idle = ball.is_idle();
        ball.motor = motor;
        if was_idle != ball.is_idle() {
            self.list_active();
        }
        Ok(())
    }

    /// The motor of a spherical joint.
    ///
    /// # Errors
    /// [`Error::UnknownBody`], [`Error::NoMotor`].
    pub fn spherical_motor(&self, body: BodyId) -> Result<&SphericalMotor, Error> {
        Ok(&self.balls[self.ball_of(body)?].motor)
    }

    fn freedom_of(&self, body: BodyId) -> Result<usize, Error> {
        match self.place_of(body)? {
            (Place::Freedom(index), _) => Ok(index as usize),
            (_, name) => Err(Error::NoMotor {
                body: name.to_owned(),
            }),
        }
    }

    fn ball_of(&self, body: BodyId) -> Result<usize, Error> {
        match self.place_of(body)? {
            (Place::Ball(index), _) => Ok(index as usize),
            (_, name) => Err(Error::NoMotor {
                body: name.to_owned(),
            }),
        }
    }

    fn place_of(&self, body: BodyId) -> Result<(Place, &str), Error> {
        let known = self.model.body(body).ok_or_else(|| Error::UnknownBody {
            model: self.model.name().to_owned(),
            body: body.index(),
        })?;
        Ok((self.of_body[body.index()], &known.name))
    }

    /// The given forces with what the elements make of a step of `h` \[s\] from a state, or with their
    /// forces as they are now for h = 0. Bounded elements are on the parts of their laws on which the last
    /// step ended.
    ///
    /// # Errors
    /// [`Error`] if state or forces do not fit the model, or the step is negative.
    pub fn load(&mut self, state: &State, forces: &Forces, h: f64) -> Result<&Forces, Error> {
        self.begin_load(state, forces, h, f64::EPSILON)?;
        self.gather(state, forces, h, f64::EPSILON);
        Ok(&self.loaded)
    }

    /// The same of a step whose laws are on parts that a device has found, with solutions rounded to `epsilon`.
    #[cfg(feature = "gpu")]
    pub(crate) fn load_on(
        &mut self,
        parts: &Parts<'_>,
        state: &State,
        forces: &Forces,
        (h, epsilon): (f64, f64),
    ) -> Result<&Forces, Error> {
        self.begin_load(state, forces, h, epsilon)?;
        self.take_parts(parts);
        self.gather(state, forces, h, epsilon);
        Ok(&self.loaded)
    }

    fn begin_load(
        &mut self,
        state: &State,
        forces: &Forces,
        h: f64,
        epsilon: f64,
    ) -> Result<(), Error> {
        state.check(&self.model)?;
        forces.check(&self.model)?;
        self.check_step(h)?;
        self.loaded.set_external(forces);
        self.begin(state, h, epsilon);
        Ok(())
    }

    /// The forces and inertias of the last solution.
    pub(crate) const fn loaded(&self) -> &Forces {
        &self.loaded
    }

    /// Work done by the elements in the steps taken so far; of loops [`Simulation`](crate::Simulation::work) knows.
    #[must_use]
    pub const fn work(&self) -> &Work {
        &self.work
    }

    /// Energy that springs and rotors hold.
    ///
    /// # Errors
    /// [`Error`] if the state does not fit the model.
    pub fn stored(&self, state: &State) -> Result<Stored, Error> {
        state.check(&self.model)?;
        Ok(self.held(state))
    }

    /// The same of a state that fits.
    pub(crate) fn held(&self, state: &State) -> Stored {
        let mut sum = Stored::default();
        let mut add = |[spring, rotor]: [f64; 2]| {
            sum.springs += spring;
            sum.rotors += rotor;
        };
        for freedom in self.freedoms.iter().filter(|freedom| !freedom.is_idle()) {
            add(freedom.stored(state.q[freedom.q], state.qd[freedom.dof]));
        }
        for ball in self.busy_balls() {
            add(ball.stored(&ball.turned(state, 0.0, 0.0)));
        }
        sum
    }

    /// Solutions that the last step took \[count\].
    #[must_use]
    pub const fn solutions(&self) -> usize {
        self.solutions
    }

    /// Refuses integrators that take elements at their stages where some jump.
    pub(crate) fn check_integrator(&self, integrator: Integrator) -> Result<(), Error> {
        if integrator == Integrator::SemiImplicitEuler {
            return Ok(());
        }
        let mut single = self.busy().filter(|freedom| freedom.is_rough());
        let mut several = self.busy_balls().filter(|ball| ball.is_rough());
        let of_single = single.next().map(|freedom| freedom.body);
        match of_single.or_else(|| several.next().map(|ball| ball.body)) {
            None => Ok(()),
            Some(body) => Err(Error::RoughElement {
                body: self.name(body),
                integrator,
            }),
        }
    }

    fn busy(&self) -> impl Iterator<Item = &Freedom> {
        let indices = self.active.iter();
        indices.map(|&index| &self.freedoms[index as usize])
    }

    fn busy_balls(&self) -> impl Iterator<Item = &Ball> {
        let indices = self.active_balls.iter();
        indices.map(|&index| &self.balls[index as usize])
    }

    /// Refuses steps back in time.
    pub(crate) fn check_step(&self, h: f64) -> Result<(), Error> {
        if h.is_finite() && h >= 0.0 {
            return Ok(());
        }
        let first = self.busy().next().map(|freedom| freedom.body);
        let first = first.or_else(|| self.busy_balls().next().map(|ball| ball.body));
        Err(Error::StepBack {
            body: first.map_or_else(|| self.model.name().to_owned(), |first| self.name(first)),
            step: h,
        })
    }

    fn name(&self, body: u32) -> String {
        self.model.bodies()[body as usize].name.clone()
    }

    /// Accelerations with the elements' part, implicit in a step of h, or explicit for h = 0.
    pub(crate) fn solve(
        &mut self,
        solver: &mut Solver,
        state: &State,
        forces: &Forces,
        h: f64,
    ) -> Result<&[f64], Error> {
        let epsilon = solver.choice().tree.epsilon();
        self.begin_load(state, forces, h, epsilon)?;
        self.solutions = 0;
        loop {
            self.gather(state, forces, h, epsilon);
            let qdd = solver.forward_dynamics(&self.model, state, &self.loaded)?;
            self.qdd.copy_from_slice(qdd);
            self.solutions += 1;
            if h == 0.0 || self.solutions == PASSES || !self.follow(state, h, epsilon) {
                return Ok(&self.qdd);
            }
        }
    }

    /// Adds the work of a step of h between two states.
    pub(crate) fn account(
        &mut self,
        (from, to): (&State, &State),
        (h, integrator): (f64, Integrator),
        epsilon: f64,
    ) {
        let implicit = integrator == Integrator::SemiImplicitEuler;
        for &index in &self.active {
            let freedom = &self.freedoms[index as usize];
            let (q, dof) = (freedom.q, freedom.dof);
            if implicit {
                let now = moment(freedom, from, h, epsilon);
                freedom.account(&now, to.qd[dof], &mut self.work);
            } else {
                let [from, to] = [from, to].map(|state| [state.q[q], state.qd[dof]]);
                freedom.account_between(from, to, &mut self.work);
            }
        }
        for &index in &self.active_balls {
            let ball = &self.balls[index as usize];
            let [now, end] = [from, to].map(|state| turned(ball, state, h, epsilon));
            if implicit {
                ball.account(&now, end.w, &mut self.work);
            } else {
                let ends = [now, end].map(|now| Turned { h: 0.0, ..now });
                ball.account_between(ends, h, &mut self.work);
            }
        }
    }

    fn begin(&mut self, state: &State, h: f64, epsilon: f64) {
        for &index in &self.active {
            let freedom = &mut self.freedoms[index as usize];
            let now = moment(freedom, state, h, epsilon);
            freedom.begin(&now);
        }
        for &index in &self.active_balls {
            let ball = &mut self.balls[index as usize];
            ball.begin(&turned(ball, state, h, epsilon));
        }
    }

    fn gather(&mut self, state: &State, forces: &Forces, h: f64, epsilon: f64) {
        let Forces {
            joint,
            joint_inertia,
            joint_inertia_across,
            ..
        } = &mut self.loaded;
        joint.copy_from_slice(&forces.joint);
        start_from(joint_inertia, &forces.joint_inertia);
        start_from(joint_inertia_across, &forces.joint_inertia_across);
        for &index in &self.active {
            let freedom = &self.freedoms[index as usize];
            let [force, inertia] = freedom.load(&moment(freedom, state, h, epsilon));
            joint[freedom.dof] += force;
            joint_inertia[freedom.dof] += inertia;
        }
        for &index in &self.active_balls {
            let ball = &self.balls[index as usize];
            let load = ball.load(&turned(ball, state, h, epsilon));
            for k in 0..3 {
                joint[ball.dof + k] += load.force[k];
                joint_inertia[ball.dof + k] += load.inertia[k];
            }
            if !ball.bounds.is_empty() {
                for (own, across) in joint_inertia_across[ball.dof..].iter_mut().zip(load.across) {
                    *own += across;
                }
            }
        }
    }

    /// Takes the parts that the solution asks for; whether they are others.
    fn follow(&mut self, state: &State, h: f64, epsilon: f64) -> bool {
        let mut changed = false;
        for &index in &self.active {
            let freedom = &mut self.freedoms[index as usize];
            let (qd, dv) = (state.qd[freedom.dof], h * self.qdd[freedom.dof]);
            let tolerance = 4.0 * epsilon * (qd.abs() + dv.abs());
            changed |= freedom.follow(qd + dv, tolerance);
        }
        for &index in &self.active_balls {
            let ball = &mut self.balls[index as usize];
            let [w, dw] =
                [&state.qd, &self.qdd].map(|v| vec3(v[ball.dof], v[ball.dof + 1], v[ball.dof + 2]));
            let dw = dw * h;
            let tolerance = 4.0 * epsilon * (w.length() + dw.length());
            changed |= ball.follow(w + dw, h, tolerance);
        }
        changed
    }
}

/// Makes sums begin with what is given, which may be nothing.
fn start_from(sums: &mut Vec<f64>, given: &[f64]) {
    if given.is_empty() {
        sums.fill(0.0);
    } else {
        sums.clear();
        sums.extend_from_slice(given);
    }
}

fn moment(freedom: &Freedom, state: &State, h: f64, epsilon: f64) -> Moment {
    Moment {
        q: state.q[freedom.q],
        qd: state.qd[freedom.dof],
        h,
        firmness: firmness(epsilon),
    }
}

fn turned(ball: &Ball, state: &State, h: f64, epsilon: f64) -> Turned {
    ball.turned(state, h, firmness(epsilon))
}

/// By what a hard stop exceeds the inertia that it stops, where solutions are rounded to epsilon, and rates to that of f64 at
/// least: a firmer stop would make forces, and work, of their rounding. A number that f32 holds, as which kernels are given it.
#[expect(clippy::cast_possible_truncation, reason = "to be rounded")]
fn firmness(epsilon: f64) -> f64 {
    f64::from((0.1 / epsilon.max(f64::EPSILON).sqrt()) as f32)
}

#[cfg(test)]
mod tests;
