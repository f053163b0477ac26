//! What acts in the joints and loops of a model in motion.

use super::Simulation;
use super::runs::Runs;
use crate::{Elements, Error, LoopForces, LoopViolation, Motor, SphericalMotor, Stored, Work};
use vertebra_assembly::BodyId;

impl Simulation {
    /// Sets the motor of a body's joint; a GPU is given it with the next step. Nothing is allocated but by the
    /// first motor of a model without elements.
    ///
    /// # Errors
    /// [`Error::UnknownBody`], [`Error::NoMotor`], [`Error::BadMotor`]; of the first motor on a GPU also
    /// [`Error::ModelTooLarge`] and `Error::Gpu`. The motor is then as it was.
    pub fn set_motor(&mut self, body: BodyId, motor: Motor) -> Result<(), Error> {
        match &mut self.runs {
            Runs::Host(host) => {
                let new = || Elements::new(&self.model).into();
                host.elements.get_or_insert_with(new).set_motor(body, motor)
            }
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.simulation.set_motor(body, motor),
        }
    }

    /// Sets the motor of a spherical joint, as [`set_motor`](Self::set_motor) does of others.
    ///
    /// # Errors
    /// As [`set_motor`](Self::set_motor)'s.
    pub fn set_spherical_motor(
        &mut self,
        body: BodyId,
        motor: SphericalMotor,
    ) -> Result<(), Error> {
        match &mut self.runs {
            Runs::Host(host) => {
                let new = || Elements::new(&self.model).into();
                let elements = host.elements.get_or_insert_with(new);
                elements.set_spherical_motor(body, motor)
            }
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.simulation.set_spherical_motor(body, motor),
        }
    }

    /// Work done by springs, dampers, friction, stops, motors and closed loops in the steps taken so far.
    ///
    /// # Errors
    /// [`Error::Overflow`] if the sums overflowed. On a GPU, from which it is read back, `Error::Gpu`.
    pub fn work(&mut self) -> Result<Work, Error> {
        let work = match &mut self.runs {
            Runs::Host(host) => host.work(),
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.simulation.work()?,
        };
        self.refuse_overflow("work of elements", work.total().is_finite())?;
        Ok(work)
    }

    /// What acts in joints and loops has sums and no body of its own: the first one concerned is named.
    fn refuse_overflow(&self, quantity: &'static str, is_finite: bool) -> Result<(), Error> {
        if is_finite {
            return Ok(());
        }
        let looped = self.model.loops().iter().flat_map(|closed| closed.bodies);
        let body = (self.model.first_element())
            .or_else(|| looped.flatten().next())
            .unwrap_or(self.model.last_body());
        Err(Error::Overflow {
            quantity,
            body: self.model.bodies()[body.index()].name.clone(),
            time: self.time(),
        })
    }

    /// Energy that springs and rotors hold.
    ///
    /// # Errors
    /// [`Error::Overflow`] if it overflows. On a GPU, from which the state is read back, `Error::Gpu`.
    pub fn stored(&mut self) -> Result<Stored, Error> {
        self.fetch_state()?;
        let stored = match self.elements() {
            Some(elements) => elements.stored(&self.state)?,
            None => Stored::default(),
        };
        let is_finite = stored.springs.is_finite() && stored.rotors.is_finite();
        self.refuse_overflow("energy of springs and rotors", is_finite)?;
        Ok(stored)
    }

    /// What acts in the joints; none where nothing does. What steps on a GPU make of it [`work`](Self::work) says.
    #[must_use]
    pub fn elements(&self) -> Option<&Elements> {
        match &self.runs {
            Runs::Host(host) => host.elements.as_deref(),
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.simulation.elements(),
        }
    }

    /// Moves the state until the loops of the model are closed: positions by the least motion in the mass metric
    /// that Newton's method finds, then rates. To be called on states that do not satisfy them; steps keep them
    /// closed by themselves.
    ///
    /// # Errors
    /// [`Error::LoopNotClosed`] if that cannot be reached from here; [`Error`] as for a step. The state is then as
    /// it was.
    pub fn close_loops(&mut self) -> Result<(), Error> {
        self.fetch_state()?;
        self.posed = false;
        match &mut self.runs {
            Runs::Host(host) => host.close_loops(&self.model, &mut self.state, &self.forces),
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => {
                let mut closed = self.state.clone();
                let host = remote.host(&self.model)?;
                host.close_loops(&self.model, &mut closed, &self.forces)?;
                remote.set_state(&closed)?;
                self.state = closed;
                Ok(())
            }
        }
    }

    /// How far the state is from closed loops and kept couplings, of the worst of them; none if the model has none.
    ///
    /// # Errors
    /// On a GPU, `Error::Gpu`.
    pub fn loop_violation(&mut self) -> Result<Option<LoopViolation>, Error> {
        self.fetch_state()?;
        let host = match &mut self.runs {
            Runs::Host(host) => &mut **host,
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.host(&self.model)?,
        };
        Ok(host.solver.loop_violation(&self.model, &self.state))
    }

    /// The forces that keep the loops closed and the joints coupled in the current state, under the current forces.
    ///
    /// Where loops ask for the same thing twice, those of least norm, a loop's moments counted over the length of its
    /// longest link and each loop by the compliance it meets: they share alike. Of loops that are open
    /// ([`loop_violation`](Self::loop_violation)) they are those that would keep them as far open.
    ///
    /// # Errors
    /// [`Error`] as for a step, open loops excepted.
    pub fn loop_forces(&mut self) -> Result<LoopForces, Error> {
        self.fetch_state()?;
        self.posed = false;
        let host = match &mut self.runs {
            Runs::Host(host) => &mut **host,
            #[cfg(feature = "gpu")]
            Runs::Gpu(remote) => remote.host(&self.model)?,
        };
        let found = host.loop_forces(&self.model, &self.state, &self.forces)?;
        let of_loops =
            (found.loops.iter()).all(|load| load.force.is_finite() && load.moment.is_finite());
        let of_couplings = found.couplings.iter().all(|force| force.is_finite());
        self.refuse_overflow("loops' forces", of_loops && of_couplings)?;
        Ok(found)
    }
}
