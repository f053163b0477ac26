//! Content that is too large to go through the queue's own memory.

use super::holds;
use super::runtime::{STEP, step};
use crate::suite::Outcome;
use vertebra_gpu::{Device, Recording, workgroups};

/// Sizes around the one from which content takes a way of its own, each written again and again,
/// between runs that are under way.
pub(super) fn large_writes(device: &Device) -> Outcome {
    let mut figures = Vec::new();
    for len in [16_383_u32, 16_384, 16_385, 300_000] {
        let mut recording = Recording::new("large writes");
        let data = recording.buffer::<u32>("data", len as usize);
        recording.dispatch(&STEP, &[data.any()], workgroups(len, 64));
        recording.download(data);
        let program = device.prepare(&recording)?;
        let contents = (0..6).map(|round| (0..len).map(|i| i ^ round).collect());
        let mut contents: Vec<Vec<u32>> = contents.collect();
        let mut runs = Vec::new();
        for content in &contents {
            program.write(data, content)?;
            runs.push(program.run()?);
        }
        for (round, (run, content)) in runs.into_iter().zip(&mut contents).enumerate() {
            step(content);
            let right = run.wait()?.read(data)? == *content;
            figures.push(holds(format!("{len}, run {round}"), right));
        }
        // Of two the last counts, and what no run saw is read as it is.
        program.write(data, &contents[0])?;
        program.write(data, &contents[1])?;
        let right = program.run_times(0)?.wait()?.read(data)? == contents[1];
        figures.push(holds(format!("{len}, the last of two"), right));
    }
    Ok(figures)
}
