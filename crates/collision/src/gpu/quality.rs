//! How well a tree sorts out.

use vertebra_gpu::{Buffer, Device, Program, Recording, Slot, workgroups};
use vertebra_shaders::collision::{QUALITY, Tree};
use vertebra_shaders::{Operator, Precision, Reduce};

use super::error::Error;

/// Measures a tree: of how many children of a node a query must look, the mean over the nodes above blocks.
#[derive(Debug)]
pub(super) struct Quality {
    /// None for a tree of one block.
    program: Option<Program>,
    sums: [Slot<f32>; 2],
}

impl Quality {
    /// Of a tree with so many nodes above its blocks.
    pub(super) fn new(
        device: &Device,
        tree: &Tree,
        boxes: &Buffer<[f32; 4]>,
        nodes: u32,
    ) -> Result<Self, Error> {
        let mut recording = Recording::new("quality of a tree");
        let tree = recording.buffer_from("tree", std::slice::from_ref(tree));
        let slot = recording.shared::<[f32; 4]>("boxes", boxes.len());
        let lists =
            ["entered", "counted"].map(|name| recording.buffer::<f32>(name, nodes as usize));
        let sums = ["sum", "count"].map(|name| recording.buffer::<f32>(name, 1));
        let buffers = [tree.any(), slot.any(), lists[0].any(), lists[1].any()];
        recording.dispatch(&QUALITY, &buffers, workgroups(nodes, 256));
        let reduce = Reduce::new(&Operator::add(Precision::F32));
        for (list, sum) in lists.into_iter().zip(sums) {
            reduce.record(&mut recording, list, sum);
            recording.download(sum);
        }
        let program = if nodes > 0 {
            Some(device.prepare_with(&recording, &[slot.is(boxes)])?)
        } else {
            None
        };
        Ok(Self { program, sums })
    }

    /// The measure of where the boxes are now; 1 if there is no node of any surface.
    pub(super) fn measure(&self) -> Result<f64, Error> {
        let Some(program) = &self.program else {
            return Ok(1.0);
        };
        let output = program.run()?.wait()?;
        let mut sums = [0.0; 2];
        for (sum, slot) in sums.iter_mut().zip(self.sums) {
            *sum = output.read(slot)?.first().copied().map_or(0.0, f64::from);
        }
        let [sum, count] = sums;
        Ok(if count > 0.0 { sum / count } else { 1.0 })
    }
}
