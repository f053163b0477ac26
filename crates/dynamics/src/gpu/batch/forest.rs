//! A batch of few large items: copies of the model side by side, solved as one forest in as many rounds
//! as one of them takes.

use super::engine::{Failure, Fixed, Ran, Why};
use crate::gpu::dca::{Options, PoseBuffer, Simulation};
use crate::{Error, Forces, Integrator, Motor, Precision, SphericalMotor, loops};
use vertebra_assembly::{
    BodyDescription, BodyId, CouplingDescription, LoopDescription, Model, ModelDescription, State,
};
use vertebra_gpu::{Device, Timing};
use vertebra_spatial::Pose;

/// The forest on its device. An item that fails stops all of them before that step, since their
/// steps are one.
pub(super) struct Forest {
    simulation: Simulation,
    poses: PoseBuffer,
    /// Of the last accelerations, and of the last steps.
    failures: [Option<Failure>; 2],
    /// Steps since states were set.
    done: u32,
}

impl Forest {
    pub(super) fn new(
        device: &Device,
        model: &Model,
        items: usize,
        (precision, integrator): (Precision, Integrator),
    ) -> Result<Self, Error> {
        let options = Options {
            chunks: Some(precision),
            tree: Some(precision),
            integrator,
            ..Options::default()
        };
        let simulation = Simulation::on(device, &copies(model, items)?, &options);
        let simulation = simulation.map_err(|error| match error {
            Error::TooManyLoops { name, rows, fit } => Error::TooManyLoops {
                name: of_item(&name).map_or(name.clone(), |(one, _)| one.to_owned()),
                rows,
                fit,
            },
            Error::ModelTooLarge {
                fit,
                limit,
                available,
                ..
            } => Error::BatchTooLarge {
                items,
                fit: fit / model.bodies().len(),
                limit,
                available,
            },
            other => other,
        })?;
        Ok(Self {
            poses: simulation.pose_buffer(),
            simulation,
            failures: [None, None],
            done: 0,
        })
    }

    pub(super) fn set_states(&mut self, fixed: &Fixed, states: &[State]) -> Result<(), Error> {
        let mut all = State {
            q: Vec::with_capacity(fixed.items * fixed.model.position_count()),
            qd: Vec::with_capacity(fixed.items * fixed.model.dof_count()),
            ..State::neutral(self.simulation.model())
        };
        for state in states {
            all.q.extend(&state.q);
            all.qd.extend(&state.qd);
        }
        self.simulation.set_state(&all)?;
        self.failures = [None, None];
        self.done = 0;
        Ok(())
    }

    pub(super) fn set_forces(&mut self, fixed: &Fixed, forces: &[Forces]) -> Result<(), Error> {
        let mut all = Forces::none(self.simulation.model());
        let (dofs, bodies) = (fixed.model.dof_count(), fixed.model.bodies().len());
        for (item, forces) in forces.iter().enumerate() {
            all.joint[item * dofs..][..dofs].copy_from_slice(&forces.joint);
            if !forces.joint_inertia.is_empty() {
                all.joint_inertia.resize(all.joint.len(), 0.0);
                all.joint_inertia[item * dofs..][..dofs].copy_from_slice(&forces.joint_inertia);
            }
            for (body, wrench) in forces.acting() {
                all.push(BodyId(body.0 + small(item * bodies)), *wrench);
            }
        }
        self.simulation.set_forces(&all)
    }

    pub(super) fn set_motor(
        &mut self,
        fixed: &Fixed,
        (item, body): (usize, BodyId),
        motor: Motor,
    ) -> Result<(), Error> {
        let first = item * fixed.model.bodies().len();
        self.simulation
            .set_motor(BodyId(small(first + body.index())), motor)
    }

    pub(super) fn set_spherical_motor(
        &mut self,
        fixed: &Fixed,
        (item, body): (usize, BodyId),
        motor: SphericalMotor,
    ) -> Result<(), Error> {
        let first = item * fixed.model.bodies().len();
        self.simulation
            .set_spherical_motor(BodyId(small(first + body.index())), motor)
    }

    pub(super) fn solve(&mut self, fixed: &Fixed) -> Result<Option<f64>, Error> {
        self.failures[0] = None;
        if let Err(error) = self.simulation.solve() {
            self.failures[0] = Some(Self::failure(fixed, error, self.done)?);
        }
        Ok(self.simulation.gpu_time())
    }

    /// Steps of `h` \[s\].
    pub(super) fn steps(&mut self, fixed: &Fixed, h: f64, count: u32) -> Result<Ran, Error> {
        // An item that failed stands until states are set, and with it all others.
        if self.failures[1].is_some() {
            return Ok(Ran {
                steps: 0,
                time: None,
            });
        }
        let mut steps = count;
        match self.simulation.steps(h, count as usize) {
            Ok(()) => {}
            Err(Error::Step { step, source, .. }) => {
                steps = small(step);
                self.failures[1] = Some(Self::failure(fixed, *source, self.done + steps)?);
            }
            Err(other) => return Err(other),
        }
        self.done += steps;
        Ok(Ran {
            steps,
            time: self.simulation.gpu_time(),
        })
    }

    /// Which item's which body, loop or coupling an error names.
    fn failure(fixed: &Fixed, error: Error, step: u32) -> Result<Failure, Error> {
        let open = |name, why| (name, why, true);
        let (name, why, is_loop) = match &error {
            Error::SingularJoint { body } => (body, Why::Singular, false),
            Error::Unjoined { body, precision } => (body, Why::Unjoined(*precision), false),
            Error::Overflow { quantity, body, .. } => (body, Why::Overflow(quantity), false),
            Error::LoopOpen {
                name, violation, ..
            } => open(name, Why::LoopOpen(*violation)),
            Error::LoopNotClosed {
                name, violation, ..
            } => open(name, Why::LoopNotClosed(*violation)),
            _ => return Err(error),
        };
        let found = of_item(name).and_then(|(one, item)| {
            let number = if is_loop {
                loops::names(&fixed.model).position(|name| name == one)
            } else {
                fixed.model.find(one).map(BodyId::index)
            };
            Some((item, number?))
        });
        let Some((item, body)) = found else {
            return Err(error);
        };
        Ok(Failure {
            item,
            body,
            why,
            step,
        })
    }

    /// Joint accelerations in SI, item by item; after a failure of one item they mean nothing.
    pub(super) fn read_accelerations(&mut self) -> Result<Vec<f64>, Error> {
        self.simulation.read_accelerations()
    }

    pub(super) fn states(&mut self, fixed: &Fixed) -> Result<Vec<State>, Error> {
        let all = self.simulation.state()?;
        let (positions, dofs) = (fixed.model.position_count(), fixed.model.dof_count());
        let of_item = |item: usize| State {
            q: all.q[item * positions..][..positions].to_vec(),
            qd: all.qd[item * dofs..][..dofs].to_vec(),
            ..State::neutral(&fixed.model)
        };
        Ok((0..fixed.items).map(of_item).collect())
    }

    pub(super) fn failures(&self, of_steps: bool) -> Vec<Failure> {
        self.failures[usize::from(of_steps)]
            .iter()
            .copied()
            .collect()
    }

    pub(super) fn poses(&mut self) -> Result<Vec<Pose>, Error> {
        self.simulation.poses()
    }

    /// The buffer with all poses, those of an item one after the other.
    pub(super) fn pose_buffer(&mut self) -> Result<&vertebra_gpu::wgpu::Buffer, Error> {
        self.simulation.turn()?;
        Ok(match &self.poses {
            PoseBuffer::F32(buffer) => buffer.raw(),
            PoseBuffer::F64(buffer) => buffer.raw(),
        })
    }

    pub(super) fn take_times(&mut self) -> Result<(), Error> {
        self.simulation.take_times(Timing::Whole)
    }
}

/// What separates a name from the number of its item.
const NUMBER: &str = " #";

/// The name that something of an item has in the model, and the item.
fn of_item(name: &str) -> Option<(&str, usize)> {
    let (one, number) = name.rsplit_once(NUMBER)?;
    Some((one, number.parse().ok()?))
}

/// A model so many times, side by side; bodies, loops and couplings are numbered after their names.
fn copies(model: &Model, items: usize) -> Result<Model, Error> {
    let one = model.describe();
    let mut bodies = Vec::with_capacity(items * one.bodies.len());
    let mut loops = Vec::with_capacity(items * one.loops.len());
    let mut couplings = Vec::with_capacity(items * one.couplings.len());
    for item in 0..items {
        let numbered = |name: &str| format!("{name}{NUMBER}{item}");
        bodies.extend(one.bodies.iter().map(|body| {
            let mut joint = body.joint.clone();
            if let Some(mimic) = &mut joint.mimic {
                mimic.body = numbered(&mimic.body);
            }
            BodyDescription {
                name: numbered(&body.name),
                parent: body.parent.as_deref().map(numbered),
                joint,
                mass: body.mass,
            }
        }));
        loops.extend(one.loops.iter().map(|closed| LoopDescription {
            name: numbered(&closed.name),
            bodies: (closed.bodies.each_ref()).map(|body| body.as_deref().map(numbered)),
            ..closed.clone()
        }));
        couplings.extend(one.couplings.iter().map(|coupling| CouplingDescription {
            name: numbered(&coupling.name),
            body: numbered(&coupling.body),
            other: numbered(&coupling.other),
            ..coupling.clone()
        }));
    }
    Ok(ModelDescription {
        bodies,
        loops,
        couplings,
        frames: Vec::new(),
        ..one
    }
    .build()?)
}

/// Models have no more bodies than 32 bits count.
#[expect(clippy::cast_possible_truncation, reason = "see above")]
const fn small(x: usize) -> u32 {
    x as u32
}
