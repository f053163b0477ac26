//! What acts in the joints of a simulation on a GPU.

use super::{Engines, Simulation};
use crate::elements::{PASSES, Parts};
use crate::forces::check_step;
use crate::gpu::Explicit;
use crate::gpu::dca::Options;
use crate::gpu::dca::engine::{JOINT_FORCES, Task};
use crate::{Elements, Error, Forces, Motor, SphericalMotor, Work};
use vertebra_assembly::{BodyId, Model, State};
use vertebra_gpu::Timing;
use vertebra_shaders::dca::{DRIVEN_NUMBERS, MOST_ATTEMPTS, WORKS};

const _: () = assert!(MOST_ATTEMPTS as usize == PASSES);

/// Numbers of a freedom before those of its motor: joint force and inertia of its own.
const BEFORE_MOTORS: usize = 2;

impl Simulation {
    /// Sets the motor of a body's joint; the device is given it with the next step.
    ///
    /// # Errors
    /// [`Error::UnknownBody`], [`Error::NoMotor`], [`Error::BadMotor`]; the motor is then as it was. The first
    /// motor of a model without elements takes kernels and memory of its own, for which [`Error::ModelTooLarge`]
    /// and [`Error::Gpu`] are possible.
    pub fn set_motor(&mut self, body: BodyId, motor: Motor) -> Result<(), Error> {
        if let Some(elements) = &mut self.elements {
            elements.set_motor(body, motor)?;
            self.motors_changed = true;
            return Ok(());
        }
        let mut elements = Box::new(Elements::new(&self.model));
        elements.set_motor(body, motor)?;
        self.take_elements(elements, false)
    }

    /// Sets the motor of a spherical joint; the device is given it with the next step.
    ///
    /// # Errors
    /// As [`set_motor`](Self::set_motor)'s. The first motor of a model whose spherical joints have no ranges and no
    /// friction takes kernels and memory of its own.
    pub fn set_spherical_motor(
        &mut self,
        body: BodyId,
        motor: SphericalMotor,
    ) -> Result<(), Error> {
        if self.tables.balls.is_some()
            && let Some(elements) = &mut self.elements
        {
            elements.set_spherical_motor(body, motor)?;
            self.motors_changed = true;
            return Ok(());
        }
        self.collect_work()?;
        let elements = self.elements.clone();
        let mut elements = elements.unwrap_or_else(|| Elements::new(&self.model).into());
        elements.set_spherical_motor(body, motor)?;
        if elements.has_ball_laws() {
            return self.take_elements(elements, false);
        }
        Ok(())
    }

    /// What acts in the joints; none where nothing ever did. [`work`](Self::work) is done on the device, and not
    /// known to it.
    #[must_use]
    pub fn elements(&self) -> Option<&Elements> {
        self.elements.as_deref()
    }

    /// Work done by springs, dampers, friction, stops, motors and loops in the steps taken so far, in the precision of
    /// the state; read back.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn work(&mut self) -> Result<Work, Error> {
        self.collect_work()?;
        let elements = self.elements.as_ref();
        let elements = elements.map_or_else(Work::default, |elements| *elements.work());
        Ok(Work {
            loops: self.loop_work,
            ..elements
        })
    }

    /// The same model in the neutral state with other options and with what acts in the joints, its work included.
    pub(crate) fn with_options(&mut self, model: &Model, options: &Options) -> Result<Self, Error> {
        self.collect_work()?;
        let device = in_engine!(&self.engines, engine => engine.device().clone());
        let has_balls = self.tables.balls.is_some();
        let elements = self.elements.clone();
        let mut with = Self::with_elements(&device, model, options, elements, has_balls)?;
        with.loop_work = self.loop_work;
        Ok(with)
    }

    /// Takes what the device has summed up since it was collected last.
    pub(super) fn collect_work(&mut self) -> Result<(), Error> {
        let tables = &self.tables;
        if !self.has_worked || tables.works_len() == 0 {
            return Ok(());
        }
        let numbers =
            in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadState))?;
        let sums = &numbers[tables.works_at()..][..tables.works_len()];
        let (own, looped) = sums.split_at(WORKS * tables.dofs.len());
        let (own_before, looped_before) = self.works.split_at(own.len().min(self.works.len()));
        if let Some(elements) = &mut self.elements {
            elements.add_works(own, own_before);
        }
        let more = looped.iter().sum::<f64>() - looped_before.iter().sum::<f64>();
        self.loop_work += more * self.model.units().energy();
        self.works.clear();
        self.works.extend(sums);
        self.has_worked = false;
        Ok(())
    }

    /// Goes on with kernels for elements, and for what is not alike in all directions of spherical joints if those have
    /// it or are given it.
    pub(super) fn take_elements(
        &mut self,
        elements: Box<Elements>,
        has_balls: bool,
    ) -> Result<(), Error> {
        self.collect_work()?;
        let state = self.state()?;
        let device = in_engine!(&self.engines, engine => engine.device().clone());
        let timing = in_engine!(&self.engines, engine => engine.timing());
        let (model, options) = (&self.model, &self.options);
        let mut with = Self::with_elements(&device, model, options, Some(elements), has_balls)?;
        with.set_state(&state)?;
        with.set_forces(&self.forces)?;
        with.loop_work = self.loop_work;
        if timing != Timing::Off {
            with.take_times(timing)?;
        }
        *self = with;
        Ok(())
    }

    /// Solutions that a step may take: none in which elements are implicit where there are none or another method
    /// takes them as they are; one where no law has a bound. Refuses a step that is no number.
    pub(super) fn attempts(&self, h: f64) -> Result<u32, Error> {
        check_step("simulation", h)?;
        let Some(elements) = &self.elements else {
            return Ok(0);
        };
        if !elements.is_idle() {
            elements.check_step(h)?;
            elements.check_integrator(self.options.integrator)?;
        }
        Ok(match self.integrator {
            Explicit::RungeKutta4 => 0,
            Explicit::SemiImplicitEuler if elements.is_bounded() => MOST_ATTEMPTS,
            Explicit::SemiImplicitEuler => 1,
        })
    }

    /// Refuses a step that is no number, or that elements do not take.
    pub(crate) fn check_step(&self, h: f64) -> Result<(), Error> {
        self.attempts(h).map(drop)
    }

    /// The attempt as which a solution is made: the first one of a step that is implicit in elements, or none.
    pub(super) fn implicit_in(&self, step: Option<f64>) -> Result<u32, Error> {
        Ok(step.map_or(Ok(0), |h| self.attempts(h))?.min(1))
    }

    /// What acts in the solution that [`solved`](Self::solved) gave of this state, elements included, as the processor makes it of
    /// the parts of their laws; these are read back for it where any has a bound.
    pub(crate) fn acting<'a>(
        &'a mut self,
        state: &State,
        forces: &'a Forces,
        step: Option<f64>,
    ) -> Result<&'a Forces, Error> {
        let is_implicit = self.implicit_in(step)? > 0;
        let is_bounded = self.elements.as_ref().is_some_and(|own| own.is_bounded());
        let mut parts = Parts::default();
        if is_implicit && is_bounded {
            let tables = &self.tables;
            parts.single =
                in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadParts))?;
            if tables.balls.is_some() {
                parts.balls = in_engine!(&mut self.engines, engine => engine.read(tables, Task::ReadBallParts))?;
            }
        }
        let Some(elements) = &mut self.elements else {
            return Ok(forces);
        };
        parts.places = &self.tables.places;
        let h = step.filter(|_| is_implicit).unwrap_or(0.0);
        elements.load_on(&parts, state, forces, (h, self.precisions.1.epsilon()))
    }

    /// Inertia of freedoms' own, and motors, behind the joint forces.
    pub(super) fn put_elements(&self, forces: &Forces, numbers: &mut Vec<f64>) {
        let Some(elements) = &self.elements else {
            return;
        };
        let dofs = &self.tables.dofs;
        numbers.extend(dofs.iter().map(|&dof| {
            let dof = dof as usize;
            forces.inertia(dof) * self.scales.inertia(dof)
        }));
        let motors = numbers.len();
        numbers.resize(motors + (DRIVEN_NUMBERS - BEFORE_MOTORS) * dofs.len(), 0.0);
        elements.put_motors(&self.scales, &self.tables.places, &mut numbers[motors..]);
        if self.tables.balls.is_some() {
            let across = dofs.iter().map(|&dof| dof as usize);
            let scaled = |dof| forces.inertia_across(dof) * self.scales.inertia(dof);
            numbers.extend(across.map(scaled));
        }
    }

    /// Gives the device the motors that were set since.
    pub(super) fn upload_motors(&mut self) -> Result<(), Error> {
        let Some(elements) = self.elements.as_ref().filter(|_| self.motors_changed) else {
            return Ok(());
        };
        let count = self.tables.dofs.len();
        let start = JOINT_FORCES + BEFORE_MOTORS * count;
        let motors = &mut self.force_numbers[start..JOINT_FORCES + DRIVEN_NUMBERS * count];
        elements.put_motors(&self.scales, &self.tables.places, motors);
        let numbers = &self.force_numbers;
        in_engine!(&mut self.engines, engine => engine.write_forces(numbers))?;
        self.motors_changed = false;
        Ok(())
    }
}
