//! Buffers and programs of a simulation: everything that depends on the precisions.

use super::layers::Layered;
use super::scalar::Scalar;
use super::tables::{Balls, Tables, small};
use crate::gpu::Explicit;
use bytemuck::Pod;
use vertebra_gpu::{
    AnySlot, Buffer, Device, Error, Kernel, Output, Pending, Program, Recording, Shared, Slot,
    Timing, workgroups,
};
use vertebra_shaders::dca::balls;
use vertebra_shaders::dca::loops::{Closing, HALF_TURNING, STARTS};
use vertebra_shaders::dca::{Advance, Commit, Dca, Layer, Sizes, Way};

/// Entries of `control`.
pub(super) const STEPS: usize = 1;
pub(super) const PUSHED: usize = 2;
pub(super) const PUSHED_SLOTS: usize = 4;

/// Entries of `forces`.
pub(super) const STEP_SIZE: usize = 3;
pub(super) const JOINT_FORCES: usize = 4;
/// Numbers of what pushes a body.
pub(super) const PUSH: usize = 21;

/// Stages that can fail, in the order of the kernels' constants.
pub(super) const SINGULAR: &str = "singular";
pub(super) const UNJOINED: &str = "unjoined";
pub(super) const OVERFLOW: &str = "overflow";
/// A loop that stays open: only of models with loops.
pub(super) const OPEN: &str = "open";

/// Names of what becomes a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// So many steps, each of so many attempts at most where anything acts in joints, then all poses.
    Steps(Explicit, usize, u32),
    /// Accelerations in the present state: in the first attempt of a step, or, where that is 0, under forces as they
    /// are now.
    Accelerations(u32),
    /// The kinematics of the state, which is then worked on.
    Restore,
    ReadState,
    /// The parts of laws that solutions of steps are on, of joints of one freedom and of spherical ones.
    ReadParts,
    ReadBallParts,
    ReadPoses,
    ReadControl,
}

/// Memory on the device, in the precisions of chunks and of joins.
#[derive(Debug)]
pub(super) struct Engine<T, L> {
    device: Device,
    dca: Dca,
    sizes: Buffer<Sizes>,
    words: Buffer<u32>,
    links: Buffer<[T; 4]>,
    state: Buffer<T>,
    scratch: Buffer<[T; 4]>,
    control: Buffer<u32>,
    forces: Buffer<T>,
    poses: Buffer<[T; 4]>,
    nodes: Buffer<[L; 4]>,
    /// What loops keep, if there are any.
    loops: Option<Buffer<T>>,
    programs: Vec<(Task, Ready<T>)>,
    timing: Timing,
}

/// A program and what is read of it.
#[derive(Debug)]
struct Ready<T> {
    program: Program,
    dispatches: usize,
    numbers: Option<Slot<T>>,
    fours: Option<Slot<[T; 4]>>,
    control: Option<Slot<u32>>,
}

/// Numbers on their way to the host.
#[derive(Debug)]
pub(super) struct Reading<T> {
    pending: Pending,
    numbers: Option<Slot<T>>,
    fours: Option<Slot<[T; 4]>>,
}

impl<T: Scalar> Reading<T> {
    pub(super) fn is_done(&self) -> Result<bool, Error> {
        self.pending.is_done()
    }

    pub(super) fn wait(self) -> Result<Vec<f64>, Error> {
        let output = self.pending.wait()?;
        let mut found = Vec::new();
        if let Some(slot) = self.numbers {
            let numbers: Vec<T> = output.read(slot)?;
            found.extend(numbers.into_iter().map(Scalar::to_f64));
        }
        if let Some(slot) = self.fours {
            let fours: Vec<[T; 4]> = output.read(slot)?;
            found.extend(fours.into_iter().flatten().map(Scalar::to_f64));
        }
        Ok(found)
    }
}

/// The buffers of a recording.
struct Slots<T, L> {
    sizes: Slot<Sizes>,
    words: Slot<u32>,
    links: Slot<[T; 4]>,
    state: Slot<T>,
    scratch: Slot<[T; 4]>,
    control: Slot<u32>,
    status: Slot<u32>,
    forces: Slot<T>,
    poses: Slot<[T; 4]>,
    nodes: Slot<[L; 4]>,
    loops: Option<Slot<T>>,
}

impl<T: Scalar, L: Scalar> Engine<T, L> {
    pub(super) fn new(device: &Device, tables: &Tables) -> Result<Self, Error> {
        let links: Vec<[T; 4]> = tables.links.iter().map(|v| v.map(T::from_f64)).collect();
        let bodies = tables.bodies.len();
        let loops = tables
            .loops
            .map(|loops| device.buffer("loops", loops.memory.max(1)));
        Ok(Self {
            loops: loops.transpose()?,
            dca: Dca {
                chunks: T::PRECISION,
                tree: L::PRECISION,
                leaves: tables.sizes.leaves > 0,
                several: tables.several,
                elements: tables.elements,
                balls: tables.balls.is_some(),
                screws: tables.screws,
                loops: tables.loops.is_some(),
                refined: tables.sweeps > 0,
            },
            sizes: device.buffer_from("sizes", &[tables.sizes])?,
            words: device.buffer_from("words", &tables.words)?,
            links: device.buffer_from("links", &links)?,
            state: device.buffer("state", tables.state_len().max(4))?,
            scratch: device.buffer("scratch", tables.scratch_len())?,
            control: device.buffer("control", PUSHED_SLOTS + bodies)?,
            forces: device.buffer("forces", tables.sizes.pushes as usize)?,
            poses: device.buffer("poses", 2 * bodies)?,
            nodes: device.buffer("nodes", tables.nodes_len().max(1))?,
            programs: Vec::new(),
            timing: Timing::Off,
            device: device.clone(),
        })
    }

    pub(super) const fn device(&self) -> &Device {
        &self.device
    }

    pub(super) const fn timing(&self) -> Timing {
        self.timing
    }

    pub(super) fn write_state(&self, numbers: &[f64]) -> Result<(), Error> {
        let mut content = vec![T::zeroed(); self.state.len()];
        for (to, &from) in content.iter_mut().zip(numbers) {
            *to = T::from_f64(from);
        }
        self.state.write(&content)
    }

    /// Makes room first if there are more numbers than ever.
    pub(super) fn write_forces(&mut self, numbers: &[f64]) -> Result<(), Error> {
        if numbers.len() > self.forces.len() {
            let len = numbers.len().next_power_of_two();
            self.forces = self.device.buffer("forces", len)?;
            // They hold the old buffer.
            self.programs.clear();
        }
        let mut content = vec![T::zeroed(); self.forces.len()];
        for (to, &from) in content.iter_mut().zip(numbers) {
            *to = T::from_f64(from);
        }
        self.forces.write(&content)
    }

    pub(super) fn write_control(&self, words: &[u32]) -> Result<(), Error> {
        self.control.write(words)
    }

    pub(super) const fn pose_buffer(&self) -> &Buffer<[T; 4]> {
        &self.poses
    }

    pub(super) fn take_times(&mut self, timing: Timing) -> Result<(), Error> {
        self.timing = timing;
        for (_, ready) in &mut self.programs {
            ready.program.take_times(timing)?;
        }
        Ok(())
    }

    pub(super) fn dispatches(&mut self, tables: &Tables, task: Task) -> Result<usize, Error> {
        Ok(self.ready(tables, task)?.dispatches)
    }

    pub(super) fn run(&mut self, tables: &Tables, task: Task) -> Result<Pending, Error> {
        self.ready(tables, task)?.program.run()
    }

    /// What a task that reads numbers finds.
    pub(super) fn read(&mut self, tables: &Tables, task: Task) -> Result<Vec<f64>, Error> {
        self.begin(tables, task)?.wait()
    }

    /// Submits a task that reads numbers.
    pub(super) fn begin(&mut self, tables: &Tables, task: Task) -> Result<Reading<T>, Error> {
        let ready = self.ready(tables, task)?;
        Ok(Reading {
            pending: ready.program.run()?,
            numbers: ready.numbers,
            fours: ready.fours,
        })
    }

    pub(super) fn read_control(&mut self, tables: &Tables) -> Result<Vec<u32>, Error> {
        let ready = self.ready(tables, Task::ReadControl)?;
        let output: Output = ready.program.run()?.wait()?;
        ready
            .control
            .map_or(Ok(Vec::new()), |slot| output.read(slot))
    }

    fn ready(&mut self, tables: &Tables, task: Task) -> Result<&Ready<T>, Error> {
        let known = self.programs.iter().position(|(known, _)| *known == task);
        let index = match known {
            Some(index) => index,
            None => {
                let ready = self.prepare(tables, task)?;
                self.programs.push((task, ready));
                self.programs.len() - 1
            }
        };
        Ok(&self.programs[index].1)
    }

    fn prepare(&self, tables: &Tables, task: Task) -> Result<Ready<T>, Error> {
        let mut recording = Recording::new("divide and conquer");
        for stage in [SINGULAR, UNJOINED, OVERFLOW] {
            recording.stage(stage);
        }
        if tables.loops.is_some() {
            recording.stage(OPEN);
        }
        let (slots, shared) = self.slots(&mut recording);
        let (mut numbers, mut fours, mut control) = (None, None, None);
        let mut recorder = Recorder {
            recording: &mut recording,
            slots: &slots,
            dca: self.dca,
            tables,
        };
        match task {
            Task::Steps(integrator, count, attempts) => {
                recorder.steps(integrator, count, attempts);
            }
            Task::Accelerations(attempt) => recorder.solve(Advance::None, 0, attempt),
            Task::Restore => recorder.turn(Commit::Restore),
            Task::ReadState => {
                recording.download(slots.state);
                numbers = Some(slots.state);
            }
            Task::ReadParts => {
                recording.download_part(slots.scratch, tables.parts_at());
                fours = Some(slots.scratch);
            }
            Task::ReadBallParts => {
                recording.download_part(slots.scratch, tables.ball_parts_at());
                fours = Some(slots.scratch);
            }
            Task::ReadPoses => {
                recording.download(slots.poses);
                fours = Some(slots.poses);
            }
            Task::ReadControl => {
                recording.download(slots.control);
                control = Some(slots.control);
            }
        }
        let mut program = self.device.prepare_with(&recording, &shared)?;
        if self.timing != Timing::Off {
            program.take_times(self.timing)?;
        }
        Ok(Ready {
            program,
            dispatches: recording.dispatches(),
            numbers,
            fours,
            control,
        })
    }

    fn slots(&self, recording: &mut Recording) -> (Slots<T, L>, Vec<Shared>) {
        let mut shared = Vec::new();
        let mut names = Names {
            recording,
            shared: &mut shared,
        };
        let slots = Slots {
            sizes: names.share("sizes", &self.sizes),
            words: names.share("words", &self.words),
            links: names.share("links", &self.links),
            state: names.share("state", &self.state),
            scratch: names.share("scratch", &self.scratch),
            control: names.share("control", &self.control),
            forces: names.share("forces", &self.forces),
            poses: names.share("poses", &self.poses),
            nodes: names.share("nodes", &self.nodes),
            loops: self.loops.as_ref().map(|loops| names.share("loops", loops)),
            status: names.recording.status(),
        };
        (slots, shared)
    }
}

struct Names<'a> {
    recording: &'a mut Recording,
    shared: &'a mut Vec<Shared>,
}

impl Names<'_> {
    fn share<E: Pod>(&mut self, name: &str, buffer: &Buffer<E>) -> Slot<E> {
        let slot = self.recording.shared(name, buffer.len());
        self.shared.push(slot.is(buffer));
        slot
    }
}

struct Recorder<'a, T, L> {
    recording: &'a mut Recording,
    slots: &'a Slots<T, L>,
    dca: Dca,
    tables: &'a Tables,
}

impl<T: Pod, L: Pod> Recorder<'_, T, L> {
    fn steps(&mut self, integrator: Explicit, count: usize, attempts: u32) {
        for _ in 0..count {
            match integrator {
                Explicit::SemiImplicitEuler => {
                    let first = attempts.min(1);
                    for attempt in first..=attempts {
                        self.solve(Advance::Euler, 0, attempt);
                    }
                    self.close(Closing::Positions, 0, first);
                    // Closing has changed the rates.
                    if self.tables.loops.is_some() {
                        self.balls(balls::ACCOUNTS, first);
                    }
                    self.turn_parts(Commit::Step);
                }
                Explicit::RungeKutta4 => {
                    for stage in 0..4 {
                        self.solve(Advance::RungeKutta, stage, 0);
                        let commit = if stage == 3 {
                            self.close(Closing::Positions, 0, 0);
                            self.balls(balls::ACCOUNTS, 0);
                            Commit::Step
                        } else {
                            Commit::Keep
                        };
                        self.turn_parts(commit);
                    }
                }
            }
        }
        self.place();
    }

    /// Kinematics and poses of the state.
    fn turn(&mut self, commit: Commit) {
        self.turn_parts(commit);
        self.place();
    }

    fn turn_parts(&mut self, commit: Commit) {
        let dca = self.dca;
        let every = Layer {
            stage: commit as u32,
            ..Layer::default()
        };
        self.layers(&self.tables.turn, every, Self::motion, |_| dca.turn_parts());
    }

    fn place(&mut self) {
        let layer = self.leading(0);
        self.chunks(&self.dca.place_chunks(), layer, Self::motion);
    }

    /// Accelerations under what acts, and what comes of them.
    fn solve(&mut self, advance: Advance, stage: u32, attempt: u32) {
        // After the first attempt that is done with what it asks for.
        if attempt < 2 {
            self.balls(balls::LOADS, attempt);
        }
        self.solve_closed(advance, stage, attempt);
        // A question leaves the laws on the parts they are on.
        if attempt > 0 && advance != Advance::None {
            self.balls(balls::FOLLOWS | balls::ACCOUNTS | balls::LOADS, attempt);
        }
    }

    /// What acts in spherical joints by itself, if any does; `ways` has bits of [`balls`].
    fn balls(&mut self, ways: u32, attempt: u32) {
        let Some(Balls { starts, count }) = self.tables.balls else {
            return;
        };
        let layer = Layer {
            count,
            starts,
            ways,
            attempt,
            ..Layer::default()
        };
        self.chunks(&self.dca.load_balls(), layer, Self::acting);
    }

    /// Accelerations, loops kept, and what comes of them.
    fn solve_closed(&mut self, advance: Advance, stage: u32, attempt: u32) {
        if self.tables.loops.is_none() {
            return self.solve_tree(advance, stage, attempt);
        }
        self.solve_tree(Advance::None, stage, attempt);
        let how = match (advance, stage) {
            (Advance::None, _) => 0,
            (Advance::Euler, _) => HALF_TURNING | STARTS,
            (Advance::RungeKutta, 0) => STARTS,
            (Advance::RungeKutta, _) => 0,
        };
        self.close(Closing::Accelerations, how, attempt);
        if advance != Advance::None {
            let layer = Layer {
                count: self.tables.sizes.slots,
                stage,
                attempt,
                ..Layer::default()
            };
            self.chunks(&self.dca.advance_joints(advance), layer, Self::looped);
        }
    }

    /// Loops put right, if there are any, in this attempt of a step; `how` has bits of the kernel's.
    fn close(&mut self, what: Closing, how: u32, attempt: u32) {
        let Some(loops) = self.tables.loops else {
            return;
        };
        let groups = [
            (loops.on_chip, 0, true),
            (loops.others, loops.on_chip, false),
        ];
        for (count, first, on_chip) in groups.into_iter().filter(|(count, ..)| *count > 0) {
            let layer = Layer {
                count,
                starts: loops.starts + first,
                ways: what as u32,
                sweep: how,
                attempt,
                ..Layer::default()
            };
            let uniform = self.recording.buffer_from("layer", &[layer]);
            let buffers = self.looped(uniform);
            let kernel = self.dca.close_loops(on_chip);
            (self.recording).dispatch(&kernel, &buffers, workgroups(count, 1));
        }
    }

    fn solve_tree(&mut self, advance: Advance, stage: u32, attempt: u32) {
        let (dca, sweeps) = (self.dca, self.tables.sweeps);
        for sweep in 0..=sweeps {
            let layer = Layer {
                sweep: small(sweep),
                attempt,
                ..self.leading(stage)
            };
            let is_last = sweep == sweeps;
            let advance = if is_last { advance } else { Advance::None };
            if sweep == 0 {
                self.chunks(&dca.assemble_chunks(), layer, Self::dynamics);
            }
            self.layers(&self.tables.work, layer, Self::dynamics, |rounds| {
                match (rounds.mixed, sweep) {
                    (true, 0) => dca.work_parts(advance),
                    (true, _) => dca.rework_parts(advance),
                    (false, 0) => dca.join_parts(),
                    (false, _) => dca.rejoin_parts(),
                }
            });
            let chunks = if is_last {
                dca.solve_chunks(advance)
            } else {
                dca.resolve_chunks()
            };
            self.chunks(&chunks, layer, Self::dynamics);
        }
    }

    /// The chunks of the first round.
    fn leading(&self, stage: u32) -> Layer {
        Layer {
            count: self.tables.leading,
            stage,
            ..Layer::default()
        }
    }

    /// Up and down again over the layers of rounds; `every` has what they share.
    fn layers(
        &mut self,
        layers: &[Layered],
        every: Layer,
        buffers: impl Fn(&Self, Slot<Layer>) -> Vec<AnySlot>,
        kernel: impl Fn(&Layered) -> Kernel,
    ) {
        let Some((top, lower)) = layers.split_last() else {
            return;
        };
        let up = lower.iter().map(|layer| (Way::Up, layer));
        let down = lower.iter().rev().filter(|layer| layer.down);
        let down = down.map(|layer| (Way::Down, layer));
        for (way, layer) in up.chain([(Way::Both, top)]).chain(down) {
            let content = Layer {
                count: layer.groups,
                rounds: layer.rounds,
                starts: layer.starts,
                ways: way as u32,
                ..every
            };
            let uniform = self.recording.buffer_from("layer", &[content]);
            let buffers = buffers(self, uniform);
            let groups = workgroups(layer.groups, 1);
            self.recording.dispatch(&kernel(layer), &buffers, groups);
        }
    }

    /// A lane for each of the first chunks.
    fn chunks(
        &mut self,
        kernel: &Kernel,
        layer: Layer,
        buffers: impl Fn(&Self, Slot<Layer>) -> Vec<AnySlot>,
    ) {
        let uniform = self.recording.buffer_from("layer", &[layer]);
        let [lanes, ..] = kernel.workgroup_size();
        let buffers = buffers(self, uniform);
        self.recording
            .dispatch(kernel, &buffers, workgroups(layer.count, lanes));
    }

    fn motion(&self, layer: Slot<Layer>) -> Vec<AnySlot> {
        let mut buffers = self.common(layer);
        buffers.push(self.slots.poses.any());
        buffers
    }

    fn acting(&self, layer: Slot<Layer>) -> Vec<AnySlot> {
        let mut buffers = self.common(layer);
        buffers.push(self.slots.forces.any());
        buffers
    }

    fn dynamics(&self, layer: Slot<Layer>) -> Vec<AnySlot> {
        let mut buffers = self.acting(layer);
        buffers.push(self.slots.nodes.any());
        buffers
    }

    fn looped(&self, layer: Slot<Layer>) -> Vec<AnySlot> {
        let mut buffers = self.acting(layer);
        buffers.extend(self.slots.loops.map(|slot| slot.any()));
        buffers
    }

    /// What all kernels have.
    fn common(&self, layer: Slot<Layer>) -> Vec<AnySlot> {
        let s = self.slots;
        vec![
            s.sizes.any(),
            layer.any(),
            s.words.any(),
            s.links.any(),
            s.state.any(),
            s.scratch.any(),
            s.control.any(),
            s.status.any(),
        ]
    }
}

/// Body and stage of the failures that a run reports, gravest first.
pub(super) fn gravest(error: Error) -> Result<(String, usize), Error> {
    let Error::Failed { failures, .. } = &error else {
        return Err(error);
    };
    let order = [SINGULAR, UNJOINED, OVERFLOW, OPEN];
    let gravest = order.iter().find_map(|stage| {
        let failure = failures.iter().find(|failure| failure.stage == *stage)?;
        Some((failure.stage.clone(), failure.element as usize))
    });
    gravest.ok_or(error)
}

/// Number of a body as the kernels' tables count.
pub(super) const fn number(index: usize) -> u32 {
    small(index)
}
