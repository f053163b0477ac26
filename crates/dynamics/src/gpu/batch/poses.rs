//! Poses of all bodies of a batch.

use super::memory::{Word, index, kind, read};
use crate::Error;
use crate::link::Link;
use bytemuck::Pod;
use glam::{DQuat, DVec3};
use vertebra_assembly::Model;
use vertebra_gpu::{Buffer, Device, Program, Recording, workgroups};
use vertebra_shaders::{BatchLink, BatchPlan, batch_poses};
use vertebra_spatial::{Pose, Transform};

/// The program that computes poses, and where it leaves them.
pub(super) struct Poses<W: Pod> {
    program: Program,
    plan: Buffer<BatchPlan>,
    poses: Buffer<[W; 8]>,
}

impl<W: Word> Poses<W> {
    pub(super) fn new(
        device: &Device,
        model: &Model,
        stride: usize,
        state: &Buffer<W>,
    ) -> Result<Self, Error> {
        let bodies = model.bodies().len();
        let plan = device.buffer::<BatchPlan>("plan of poses", 1)?;
        let poses = device.buffer::<[W; 8]>("poses", bodies * stride)?;
        let mut recording = Recording::new("batch poses");
        let slots = (
            recording.shared::<BatchPlan>("plan", 1),
            recording.buffer_from("bodies", &bodies_of(model)),
            recording.buffer_from("placements", &placements::<W>(model)),
            recording.shared::<W>("state", state.len()),
            recording.shared::<[W; 8]>("poses", poses.len()),
        );
        recording.dispatch(
            &batch_poses(W::PRECISION),
            &[
                slots.0.any(),
                slots.1.any(),
                slots.2.any(),
                slots.3.any(),
                slots.4.any(),
            ],
            workgroups(index(stride), 64),
        );
        let shared = [slots.0.is(&plan), slots.3.is(state), slots.4.is(&poses)];
        Ok(Self {
            program: device.prepare_with(&recording, &shared)?,
            plan,
            poses,
        })
    }

    /// Computes the poses of the state that `plan` points to.
    pub(super) fn update(&self, plan: BatchPlan, bodies: usize) -> Result<(), Error> {
        self.plan.write(&[BatchPlan {
            levels: index(bodies),
            ..plan
        }])?;
        drop(self.program.run()?);
        Ok(())
    }

    /// Poses, item by item.
    pub(super) fn read(&self, device: &Device, items: usize) -> Result<Vec<Pose>, Error> {
        let found = read(device, &self.poses)?;
        let stride = super::memory::stride(items);
        let pose = |[x, y, z, w, px, py, pz, _]: [W; 8]| {
            let [x, y, z, w, px, py, pz] = [x, y, z, w, px, py, pz].map(Word::get);
            Pose::new(
                DQuat::from_xyzw(x, y, z, w).normalize(),
                DVec3::new(px, py, pz),
            )
        };
        let bodies = found.len() / stride;
        let of_item = |item: usize| (0..bodies).map(move |body| body * stride + item);
        let places = (0..items).flat_map(of_item);
        Ok(places.map(|place| pose(found[place])).collect())
    }

    pub(super) fn raw(&self) -> &vertebra_gpu::wgpu::Buffer {
        self.poses.raw()
    }
}

fn bodies_of(model: &Model) -> Vec<BatchLink> {
    let (links, _) = Link::<f64>::of_model(model);
    let body = |link: Link<f64>| BatchLink {
        kind: kind(link.kind),
        parent: link.parent.map_or(u32::MAX, index),
        position: index(link.q),
        dof: index(link.v),
        flags: 0,
        handoff: 0,
        first: 0,
        gathered: 0,
        pushed: u32::MAX,
    };
    links.into_iter().map(body).collect()
}

/// The unit of length, then of each body where its joint is on the parent's body and where its own frame
/// is against the joint [m].
fn placements<W: Word>(model: &Model) -> Vec<[W; 4]> {
    let length = model.units().length;
    let mut placements = vec![[length, 0.0, 0.0, 0.0].map(W::new)];
    let mut put = |placement: Transform<f64>| {
        let rotation = DQuat::from_mat3(&placement.rotation.to_glam()).normalize();
        let [x, y, z] = placement.translation.to_array().map(|x| x * length);
        placements.push(rotation.to_array().map(W::new));
        placements.push([x, y, z, 0.0].map(W::new));
    };
    let (links, frames) = Link::<f64>::of_model(model);
    for (link, frame) in links.iter().zip(&frames) {
        put(match link.parent {
            Some(parent) => frames[parent].placement.inverse() * link.placement,
            None => link.placement,
        });
        put(frame.placement);
    }
    placements
}
