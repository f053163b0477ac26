//! The buffers of a batch on its device, and what is read from and written to them.

use super::schedule::Schedule;
use super::tree::{PUSH, Tree};
use crate::Error;
use crate::link::{Kind, Scales};
use bytemuck::Pod;
use vertebra_assembly::{Model, State};
use vertebra_gpu::wgpu::Limits;
use vertebra_gpu::{Buffer, Device, Recording};
use vertebra_shaders::{
    BATCH_HANDOFF, BATCH_ITEMS, BatchFeatures, BatchLink, BatchPlan, Precision,
};
use vertebra_spatial::{Vec3, vec3};

/// A number of a kernel.
pub(super) trait Word: Pod + Send + Sync {
    const PRECISION: Precision;
    fn new(x: f64) -> Self;
    fn get(self) -> f64;
}

impl Word for f32 {
    const PRECISION: Precision = Precision::F32;

    #[expect(clippy::cast_possible_truncation, reason = "rounded to the precision")]
    fn new(x: f64) -> Self {
        x as Self
    }

    fn get(self) -> f64 {
        self.into()
    }
}

impl Word for f64 {
    const PRECISION: Precision = Precision::F64;

    fn new(x: f64) -> Self {
        x
    }

    fn get(self) -> f64 {
        self
    }
}

/// The buffers. Arrays over items are component-major, padded to whole workgroups.
pub(super) struct Memory<W: Pod> {
    pub(super) plan: Buffer<BatchPlan>,
    pub(super) links: Buffer<BatchLink>,
    pub(super) constants: Buffer<[W; 4]>,
    pub(super) forces: Buffer<W>,
    pub(super) state: Buffer<W>,
    /// Accelerations, or what the integrator needs.
    pub(super) accelerations: Buffer<W>,
    pub(super) work: Buffer<W>,
    pub(super) scratch: Buffer<[W; 4]>,
    /// Of the accelerations, and of the steps.
    pub(super) status: [Buffer<u32>; 2],
    constants_on_host: Vec<[W; 4]>,
}

/// Sizes of the buffers that grow with the items, in elements an item.
struct Sizes {
    forces: usize,
    state: usize,
    accelerations: usize,
    work: usize,
    /// Of four numbers.
    scratch: usize,
}

/// Padded number of items.
pub(super) fn stride(items: usize) -> usize {
    items.max(1).next_multiple_of(BATCH_ITEMS as usize)
}

impl<W: Word> Memory<W> {
    pub(super) fn new(
        device: &Device,
        model: &Model,
        (tree, schedule): (&Tree, &Schedule),
        pushed: &[usize],
        features: BatchFeatures,
        (items, runge_kutta): (usize, bool),
    ) -> Result<Self, Error> {
        let (positions, dofs) = (model.position_count(), model.dof_count());
        let slots = schedule.slots.len();
        let sizes = Sizes {
            forces: dofs + PUSH * pushed.len(),
            state: 2 * (positions + dofs),
            accelerations: dofs,
            work: if runge_kutta { 3 * dofs } else { 0 },
            scratch: slots * features.record() as usize
                + schedule.handoff_count * BATCH_HANDOFF as usize,
        };
        check_limits::<W>(&sizes, items, &device.limits())?;
        let stride = stride(items);
        let constants = constants(model, tree, schedule);
        let links = links(tree, schedule, pushed);
        let buffer = |name: &str, each: usize| device.buffer::<W>(name, each * stride);
        Ok(Self {
            plan: device.buffer("plan", 1)?,
            links: device.buffer_from("links", &links)?,
            constants: device.buffer_from("constants", &constants)?,
            forces: buffer("forces", sizes.forces)?,
            state: buffer("state", sizes.state)?,
            accelerations: buffer("accelerations", sizes.accelerations)?,
            work: buffer("work", sizes.work)?,
            scratch: device.buffer("scratch", sizes.scratch * stride)?,
            status: [
                device.buffer("failures of accelerations", 2 * stride)?,
                device.buffer("failures of steps", 2 * stride)?,
            ],
            constants_on_host: constants,
        })
    }

    /// Sets the length of the step, in the model's units.
    pub(super) fn set_step(&mut self, h: f64) -> Result<(), Error> {
        let h = W::new(h);
        if let Some(header) = self.constants_on_host.first_mut() {
            header[3] = h;
        }
        Ok(self.constants.write(&self.constants_on_host)?)
    }
}

/// Refuses a batch that no buffer of the device can hold, and says how many items one can.
fn check_limits<W: Word>(sizes: &Sizes, items: usize, limits: &Limits) -> Result<(), Error> {
    let word = u64::from(W::PRECISION.bytes());
    let numbers = [sizes.forces, sizes.state, sizes.accelerations, sizes.work]
        .into_iter()
        .chain([4 * sizes.scratch]);
    let bytes = word * numbers.max().unwrap_or(0).max(1) as u64;
    for (limit, available) in [
        (
            "max_storage_buffer_binding_size",
            limits.max_storage_buffer_binding_size,
        ),
        ("max_buffer_size", limits.max_buffer_size),
    ] {
        let groups = available / (bytes * u64::from(BATCH_ITEMS));
        let fit = groups * u64::from(BATCH_ITEMS);
        if items as u64 > fit {
            return Err(Error::BatchTooLarge {
                items,
                fit: usize::try_from(fit).unwrap_or(usize::MAX),
                limit,
                available,
            });
        }
    }
    Ok(())
}

/// Minus gravity and the step, then six times four numbers a slot.
fn constants<W: Word>(model: &Model, tree: &Tree, schedule: &Schedule) -> Vec<[W; 4]> {
    let gravity = model.gravity() / model.units().acceleration();
    let with = |v: Vec3<f64>, last: f64| {
        let [x, y, z] = v.to_array();
        [x, y, z, last].map(W::new)
    };
    let mut constants = vec![with(-Vec3::from_glam(gravity), 0.0)];
    for slot in &schedule.slots {
        let Some(node) = slot else {
            constants.extend([[0.0; 4].map(W::new); 6]);
            continue;
        };
        let node = &tree.nodes[*node];
        let (axes, origin) = (node.placement.rotation, node.placement.translation);
        let inertia = &node.inertia;
        let rotational = &inertia.rotational;
        constants.extend([
            with(axes.x_axis, origin.x),
            with(axes.y_axis, origin.y),
            with(axes.z_axis, origin.z),
            with(inertia.moment, inertia.mass),
            with(vec3(rotational.xx, rotational.yy, rotational.zz), 0.0),
            with(vec3(rotational.yz, rotational.xz, rotational.xy), 0.0),
        ]);
    }
    constants
}

/// As in `batch/plan.wgsl`.
const IDLE: u32 = 5;
const NONE: u32 = u32::MAX;
const FOLLOWS: u32 = 1;
const KEPT: u32 = 2;

pub(super) const fn kind(kind: Kind) -> u32 {
    match kind {
        Kind::Fixed => 0,
        Kind::Revolute => 1,
        Kind::Prismatic => 2,
        Kind::Spherical => 3,
        Kind::Free => 4,
        // Refused before.
        Kind::Screw => IDLE,
    }
}

/// Indices are below 2^32: models have no more bodies.
#[expect(clippy::cast_possible_truncation, reason = "see above")]
pub(super) const fn index(x: usize) -> u32 {
    x as u32
}

fn links(tree: &Tree, schedule: &Schedule, pushed: &[usize]) -> Vec<BatchLink> {
    let children = tree.children();
    let link = |slot: &Option<usize>| {
        let Some(id) = *slot else {
            return BatchLink {
                kind: IDLE,
                parent: NONE,
                position: 0,
                dof: 0,
                flags: 0,
                handoff: 0,
                first: 0,
                gathered: 0,
                pushed: NONE,
            };
        };
        let node = &tree.nodes[id];
        let is_read = children[id].iter().any(|&child| !schedule.follows[child]);
        let (first, count) = schedule.gather[id];
        BatchLink {
            kind: kind(node.kind),
            parent: node.parent.map_or(NONE, |p| index(schedule.slot_of[p])),
            position: index(node.position),
            dof: index(node.dof),
            flags: if schedule.follows[id] { FOLLOWS } else { 0 } | if is_read { KEPT } else { 0 },
            handoff: index(schedule.handoffs[id]),
            first: index(first),
            gathered: index(count),
            pushed: pushed.iter().position(|&p| p == id).map_or(NONE, index),
        }
    };
    schedule.slots.iter().map(link).collect()
}

/// Numbers of all items, item by item, as the device has them.
pub(super) fn packed<W: Word>(
    rows: usize,
    items: usize,
    padding: &[f64],
    row_of: impl Fn(usize, usize) -> f64,
) -> Vec<W> {
    let stride = stride(items);
    let mut numbers = vec![W::new(0.0); rows * stride];
    for (row, numbers) in numbers.chunks_exact_mut(stride).enumerate() {
        for (item, number) in numbers.iter_mut().enumerate() {
            *number = W::new(if item < items {
                row_of(row, item)
            } else {
                padding.get(row).copied().unwrap_or(0.0)
            });
        }
    }
    numbers
}

/// Factors from SI to the model's units of each coordinate in q.
pub(super) fn position_scales(model: &Model) -> Vec<f64> {
    let per_length = 1.0 / model.units().length;
    let mut scales = Vec::with_capacity(model.position_count());
    for body in model.bodies() {
        for coordinate in 0..body.joint.kind.position_count() {
            scales.push(match body.joint.kind {
                vertebra_assembly::JointKind::Prismatic { .. } => per_length,
                vertebra_assembly::JointKind::Free if coordinate < 3 => per_length,
                _ => 1.0,
            });
        }
    }
    scales
}

/// q and qd in the model's units.
pub(super) fn state_number(
    state: &State,
    (positions, scales): (&[f64], &Scales),
    row: usize,
) -> f64 {
    match row.checked_sub(state.q.len()) {
        None => state.q[row] * positions[row],
        Some(dof) => state.qd[dof] * scales.rate[dof],
    }
}

/// A program that only downloads a buffer.
pub(super) fn read<T: Pod>(device: &Device, buffer: &Buffer<T>) -> Result<Vec<T>, Error> {
    let mut recording = Recording::new("read");
    let slot = recording.shared::<T>("buffer", buffer.len());
    recording.download(slot);
    let program = device.prepare_with(&recording, &[slot.is(buffer)])?;
    Ok(program.run()?.wait()?.read(slot)?)
}
