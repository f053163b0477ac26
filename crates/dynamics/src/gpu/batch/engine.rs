//! A batch on its device in one precision: buffers and programs.

use super::memory::{Memory, Word, index, packed, position_scales, read, state_number, stride};
use super::poses::Poses;
use super::schedule::Schedule;
use super::tree::{PUSH, Tree};
use crate::gpu::Explicit;
use crate::link::{Kind, Scales};
use crate::{Error, Forces, Precision};
use vertebra_assembly::{Model, State};
use vertebra_gpu::{AnySlot, Device, Output, Program, Recording, Timing, workgroups};
use vertebra_shaders::{BATCH_ITEMS, BatchFeatures, BatchFinish, BatchPlan, batch};
use vertebra_spatial::Pose;

/// Steps of one dispatch: a driver gives a dispatch about a second.
const STEPS: u32 = 64;

/// What does not change while a batch exists.
pub(super) struct Fixed {
    pub(super) device: Device,
    pub(super) model: Model,
    pub(super) tree: Tree,
    pub(super) schedule: Schedule,
    pub(super) scales: Scales,
    pub(super) positions: Vec<f64>,
    pub(super) integrator: Explicit,
    pub(super) items: usize,
}

impl Fixed {
    pub(super) fn new(
        device: &Device,
        model: &Model,
        (items, lanes, integrator): (usize, usize, Explicit),
    ) -> Self {
        let tree = Tree::new(model);
        Self {
            device: device.clone(),
            schedule: Schedule::new(&tree, lanes),
            tree,
            scales: Scales::of_model(model),
            positions: position_scales(model),
            integrator,
            items,
            model: model.clone(),
        }
    }
}

/// Why an item failed.
#[derive(Clone, Copy)]
pub(super) enum Why {
    Singular,
    Unjoined(Precision),
    /// What overflowed.
    Overflow(&'static str),
    /// By how much over its size the loop is open with which the step would begin.
    LoopOpen(f64),
    /// And with which it would end.
    LoopNotClosed(f64),
}

/// Which item failed: the body, or the loop or coupling, and why.
#[derive(Clone, Copy)]
pub(super) struct Failure {
    pub(super) item: usize,
    pub(super) body: usize,
    pub(super) why: Why,
    /// Steps that were taken before.
    pub(super) step: u32,
}

/// What came of steps.
pub(super) struct Ran {
    /// Those that were taken, by the items that have not failed.
    pub(super) steps: u32,
    /// Time on the device \[s\], if it is taken.
    pub(super) time: Option<f64>,
}

pub(super) struct Engine<W: Word> {
    memory: Memory<W>,
    features: BatchFeatures,
    /// Prepared when they are first asked for.
    accelerations: Option<Program>,
    steps: Option<Program>,
    poses: Option<Poses<W>>,
    /// Nodes on which forces may act.
    pushed: Vec<usize>,
    half: u32,
    done: u32,
    is_timed: bool,
}

impl<W: Word> Engine<W> {
    pub(super) fn new(fixed: &Fixed, pushed: Vec<usize>) -> Result<Self, Error> {
        let has = |kind: Kind| fixed.tree.nodes.iter().any(|node| node.kind == kind);
        let features = BatchFeatures {
            prismatic: has(Kind::Prismatic),
            spherical: has(Kind::Spherical),
            free: has(Kind::Free),
            forces: !pushed.is_empty(),
        };
        let (device, schedule) = (&fixed.device, &fixed.schedule);
        let memory = Memory::<W>::new(
            device,
            &fixed.model,
            (&fixed.tree, schedule),
            &pushed,
            features,
            (fixed.items, fixed.integrator == Explicit::RungeKutta4),
        )?;
        Ok(Self {
            memory,
            features,
            accelerations: None,
            steps: None,
            poses: None,
            pushed,
            half: 0,
            done: 0,
            is_timed: false,
        })
    }

    /// Goes on with kernels and buffers for forces on other bodies.
    pub(super) fn with_pushed(&self, fixed: &Fixed, pushed: Vec<usize>) -> Result<Self, Error> {
        let mut new = Self::new(fixed, pushed)?;
        let device = &fixed.device;
        new.memory.state.write(&read(device, &self.memory.state)?)?;
        let accelerations = read(device, &self.memory.accelerations)?;
        new.memory.accelerations.write(&accelerations)?;
        for (new, old) in new.memory.status.iter().zip(&self.memory.status) {
            new.write(&read(device, old)?)?;
        }
        new.half = self.half;
        new.done = self.done;
        new.is_timed = self.is_timed;
        Ok(new)
    }

    /// A program that does `finish` with accelerations.
    fn program(&self, fixed: &Fixed, finish: BatchFinish) -> Result<Program, Error> {
        let memory = &self.memory;
        let is_once = finish == BatchFinish::Accelerations;
        let (result, status) = if is_once {
            (&memory.accelerations, &memory.status[0])
        } else {
            (&memory.work, &memory.status[1])
        };
        let lanes = index(fixed.schedule.lanes);
        let kernel = batch(W::PRECISION, finish, self.features, lanes);
        let mut recording = Recording::new(kernel.name());
        let mut shared = Vec::new();
        let mut slots: Vec<AnySlot> = Vec::new();
        macro_rules! bind {
            ($name:literal, $buffer:expr) => {{
                let slot = recording.shared($name, $buffer.len());
                shared.push(slot.is($buffer));
                slots.push(slot.any());
                slot
            }};
        }
        bind!("plan", &memory.plan);
        bind!("links", &memory.links);
        bind!("constants", &memory.constants);
        bind!("forces", &memory.forces);
        bind!("state", &memory.state);
        bind!("result", result);
        bind!("scratch", &memory.scratch);
        let status = bind!("status", status);
        if is_once {
            recording.clear(status);
        }
        let groups = workgroups(index(stride(fixed.items)), BATCH_ITEMS);
        recording.dispatch(&kernel, &slots, groups);
        let mut program = fixed.device.prepare_with(&recording, &shared)?;
        if self.is_timed {
            program.take_times(Timing::Whole)?;
        }
        Ok(program)
    }

    /// Takes the time of runs from now on.
    pub(super) fn take_times(&mut self) -> Result<(), Error> {
        for program in self.accelerations.iter_mut().chain(&mut self.steps) {
            program.take_times(Timing::Whole)?;
        }
        self.is_timed = true;
        Ok(())
    }

    fn plan(&self, fixed: &Fixed, steps: u32) -> BatchPlan {
        let stride = stride(fixed.items);
        BatchPlan {
            groups: index(stride) / BATCH_ITEMS,
            stride: index(stride),
            levels: index(fixed.schedule.levels),
            steps,
            done: self.done,
            half: self.half,
            positions: index(fixed.model.position_count()),
            dofs: index(fixed.model.dof_count()),
        }
    }

    pub(super) fn set_states(&mut self, fixed: &Fixed, states: &[State]) -> Result<(), Error> {
        let rows = fixed.model.position_count() + fixed.model.dof_count();
        let neutral = State::neutral(&fixed.model);
        let scales = (&fixed.positions[..], &fixed.scales);
        let of = |state: &State, row| state_number(state, scales, row);
        let padding: Vec<f64> = (0..rows).map(|row| of(&neutral, row)).collect();
        let row_of = |row: usize, item: usize| of(&states[item], row);
        let mut numbers = packed(rows, fixed.items, &padding, row_of);
        numbers.extend_from_within(..);
        self.memory.state.write(&numbers)?;
        self.memory.status[1].write(&vec![0; self.memory.status[1].len()])?;
        (self.half, self.done) = (0, 0);
        Ok(())
    }

    pub(super) fn pushed(&self) -> &[usize] {
        &self.pushed
    }

    /// Forces of which all that act on bodies act on those it was made for.
    pub(super) fn set_forces(&mut self, fixed: &Fixed, forces: &[Forces]) -> Result<(), Error> {
        let dofs = fixed.model.dof_count();
        let rows = dofs + PUSH * self.pushed.len();
        let mut pushes = vec![[0.0; PUSH]; self.pushed.len() * fixed.items];
        for (item, forces) in forces.iter().enumerate() {
            for (body, wrench) in forces.acting() {
                let node = fixed.tree.carrier(body.index());
                let place = node.and_then(|n| self.pushed.iter().position(|&pushed| pushed == n));
                if let Some(place) = place {
                    let numbers = &mut pushes[item * self.pushed.len() + place];
                    fixed.tree.push(body.index(), wrench, numbers);
                }
            }
        }
        let row_of = |row: usize, item: usize| match row.checked_sub(dofs) {
            None => forces[item].joint[row] / fixed.scales.force[row],
            Some(row) => pushes[item * self.pushed.len() + row / PUSH][row % PUSH],
        };
        let numbers = packed(rows, fixed.items, &[], row_of);
        Ok(self.memory.forces.write(&numbers)?)
    }

    /// Computes accelerations; gives the time on the device \[s\] if it is taken.
    pub(super) fn solve(&mut self, fixed: &Fixed) -> Result<Option<f64>, Error> {
        let plan = self.plan(fixed, 1);
        let program = match self.accelerations.take() {
            Some(program) => program,
            None => self.program(fixed, BatchFinish::Accelerations)?,
        };
        let program = self.accelerations.insert(program);
        self.memory.plan.write(&[plan])?;
        let pending = program.run()?;
        if self.is_timed {
            return Ok(pending.wait()?.gpu_time());
        }
        Ok(None)
    }

    /// Takes steps of `h` \[s\].
    pub(super) fn steps(&mut self, fixed: &Fixed, h: f64, count: u32) -> Result<Ran, Error> {
        let program = match self.steps.take() {
            Some(program) => program,
            None => self.program(
                fixed,
                match fixed.integrator {
                    Explicit::SemiImplicitEuler => BatchFinish::Euler,
                    Explicit::RungeKutta4 => BatchFinish::RungeKutta,
                },
            )?,
        };
        self.memory.set_step(h / fixed.model.units().time)?;
        let mut time = None;
        let mut left = count;
        while left > 0 {
            let now = left.min(STEPS);
            self.memory.plan.write(&[self.plan(fixed, now)])?;
            let pending = program.run()?;
            if self.is_timed {
                let taken = Output::gpu_time(&pending.wait()?);
                time = taken.map(|taken| taken + time.unwrap_or(0.0));
            }
            self.half = (self.half + now) % 2;
            self.done += now;
            left -= now;
        }
        self.steps = Some(program);
        Ok(Ran { steps: count, time })
    }

    /// Joint accelerations in SI, item by item.
    pub(super) fn accelerations(&self, fixed: &Fixed) -> Result<Vec<f64>, Error> {
        let found = read(&fixed.device, &self.memory.accelerations)?;
        let (stride, scales) = (stride(fixed.items), &fixed.scales.acceleration);
        let of_item = |item: usize| {
            let scales = scales.iter().enumerate();
            let found = &found;
            scales.map(move |(dof, scale)| found[dof * stride + item].get() * scale)
        };
        Ok((0..fixed.items).flat_map(of_item).collect())
    }

    /// q and qd in SI of each item.
    pub(super) fn states(&self, fixed: &Fixed) -> Result<Vec<State>, Error> {
        let found = read(&fixed.device, &self.memory.state)?;
        let (positions, dofs) = (fixed.model.position_count(), fixed.model.dof_count());
        let stride = stride(fixed.items);
        let first = self.half as usize * (positions + dofs);
        let number = |row: usize, item: usize| found[(first + row) * stride + item].get();
        let of_item = |item: usize| State {
            q: (0..positions)
                .map(|row| number(row, item) / fixed.positions[row])
                .collect(),
            qd: (0..dofs)
                .map(|dof| number(positions + dof, item) / fixed.scales.rate[dof])
                .collect(),
            ..State::neutral(&fixed.model)
        };
        Ok((0..fixed.items).map(of_item).collect())
    }

    /// The items that failed, of the accelerations or of the steps, in order.
    pub(super) fn failures(&self, fixed: &Fixed, of_steps: bool) -> Result<Vec<Failure>, Error> {
        let found = read(&fixed.device, &self.memory.status[usize::from(of_steps)])?;
        let failure = |(item, words): (usize, &[u32])| {
            let word = !words[0];
            let node = fixed.schedule.slots.get((word / 8) as usize)?.as_ref()?;
            (words[0] != 0).then_some(Failure {
                item,
                body: fixed.tree.nodes[*node].body,
                why: match word % 8 {
                    1 => Why::Singular,
                    2 => Why::Overflow("joint acceleration"),
                    3 => Why::Overflow("joint position or rate"),
                    _ => Why::Overflow("angle"),
                },
                step: words[1],
            })
        };
        let words = found.chunks_exact(2).take(fixed.items);
        Ok(words.enumerate().filter_map(failure).collect())
    }

    /// Poses of all bodies, item by item.
    pub(super) fn poses(&mut self, fixed: &Fixed) -> Result<Vec<Pose>, Error> {
        self.update_poses(fixed)?.read(&fixed.device, fixed.items)
    }

    pub(super) fn update_poses(&mut self, fixed: &Fixed) -> Result<&Poses<W>, Error> {
        let plan = self.plan(fixed, 0);
        let (device, model) = (&fixed.device, &fixed.model);
        let poses = match self.poses.take() {
            Some(poses) => poses,
            None => Poses::new(device, model, stride(fixed.items), &self.memory.state)?,
        };
        poses.update(plan, model.bodies().len())?;
        Ok(self.poses.insert(poses))
    }
}
