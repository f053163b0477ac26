//! Twins: a computation on both sides, compared element by element.
//!
//! A twin computes named stages from named inputs, once on the CPU and once as a recording. The
//! tests of a backend, and the replay of a failure on another machine, are comparisons of twins.

use crate::capture::{Capture, CaptureError};
use crate::device::Device;
use crate::error::{Error, Failure};
use crate::recording::{Recording, Slot};

mod values;

pub use values::{Named, Values};

/// A buffer of a recording that holds a stage.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum StageSlot {
    /// Words.
    U32(Slot<u32>),
    /// Single precision.
    F32(Slot<f32>),
    /// Double precision.
    F64(Slot<f64>),
}

/// What a stage is called, where it lies, and how many of its first elements mean something.
#[derive(Clone, Debug)]
pub struct RecordedStage {
    /// Name of the stage.
    pub name: &'static str,
    /// Its buffer.
    pub slot: StageSlot,
    /// Number of elements.
    pub len: usize,
}

/// A computation that exists on the CPU and as a recording.
#[derive(Clone, Copy, Debug)]
pub struct Twin {
    /// Name, the same as the recording's.
    pub name: &'static str,
    /// Features of a device that the recording needs.
    pub features: wgpu::Features,
    /// Computes the stages on the CPU. Inputs that are missing or of another type are empty.
    pub cpu: fn(&[Named]) -> Vec<Named>,
    /// Records the same; the stages must not be written again after they are computed.
    pub gpu: fn(&mut Recording, &[Named], &Device) -> Vec<RecordedStage>,
    /// How far an element of a stage may be off \[1\], relative to the largest of the stage.
    pub tolerance: fn(stage: &str, inputs: &[Named]) -> f64,
}

/// A stage computed twice.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Name of the stage.
    pub stage: String,
    /// On the CPU.
    pub cpu: Values,
    /// On the GPU.
    pub gpu: Values,
    /// Largest difference of two elements, over the largest finite one of the CPU's \[1\]. Infinite
    /// where either side has NaN, one has an infinity and not the other the same, or types or
    /// lengths differ.
    pub error: f64,
    /// The first element that differs in any bit.
    pub first_difference: Option<usize>,
    /// What [`error`](Self::error) may be \[1\].
    pub tolerance: f64,
}

impl Twin {
    /// Computes the stages on both sides.
    ///
    /// # Errors
    /// Those of [`Device::prepare`] and of [`Pending::wait`](crate::Pending::wait) but for failures
    /// of stages, which are returned beside the comparisons.
    pub fn compare(
        &self,
        device: &Device,
        inputs: &[Named],
    ) -> Result<(Vec<Comparison>, Vec<Failure>), Error> {
        let mut recording = Recording::new(self.name);
        let stages = (self.gpu)(&mut recording, inputs, device);
        for stage in &stages {
            match stage.slot {
                StageSlot::U32(slot) => recording.download(slot),
                StageSlot::F32(slot) => recording.download(slot),
                StageSlot::F64(slot) => recording.download(slot),
            }
        }
        let (output, failures) = device.prepare(&recording)?.run()?.wait_for_all()?;
        let expected = (self.cpu)(inputs);
        let mut comparisons = Vec::with_capacity(stages.len());
        for stage in stages {
            let gpu = match stage.slot {
                StageSlot::U32(slot) => Values::U32(first(output.read(slot)?, stage.len)),
                StageSlot::F32(slot) => Values::F32(first(output.read(slot)?, stage.len)),
                StageSlot::F64(slot) => Values::F64(first(output.read(slot)?, stage.len)),
            };
            let cpu = expected.iter().find(|named| named.name == stage.name);
            let cpu = cpu.map_or_else(|| Values::U32(Vec::new()), |named| named.values.clone());
            comparisons.push(Comparison::new(
                stage.name,
                cpu,
                gpu,
                (self.tolerance)(stage.name, inputs),
            ));
        }
        // What only one side computes is not the same.
        for Named { name, values } in expected {
            if comparisons.iter().all(|c: &Comparison| c.stage != name) {
                let nothing = Values::U32(Vec::new());
                comparisons.push(Comparison::new(&name, values, nothing, 0.0));
            }
        }
        Ok((comparisons, failures))
    }

    /// What it was given, to be written to a file.
    ///
    /// # Errors
    /// [`CaptureError::Inputs`], which arrays do not cause.
    pub fn capture(
        &self,
        device: &Device,
        inputs: &[Named],
        reason: &str,
    ) -> Result<Capture, CaptureError> {
        Capture::new(self.name, &device.description(), reason, &inputs)
    }
}

impl Comparison {
    /// Compares a stage element by element.
    #[must_use]
    pub fn new(stage: &str, cpu: Values, gpu: Values, tolerance: f64) -> Self {
        let numbers = |values: &Values| -> Vec<f64> {
            (0..values.len()).filter_map(|i| values.get(i)).collect()
        };
        let pairs: Vec<_> = numbers(&cpu).into_iter().zip(numbers(&gpu)).collect();
        let finite = pairs.iter().map(|(a, _)| a.abs()).filter(|a| a.is_finite());
        let largest = finite.fold(0.0, f64::max);
        let is_alike =
            std::mem::discriminant(&cpu) == std::mem::discriminant(&gpu) && cpu.len() == gpu.len();
        let mut error = if is_alike { 0.0 } else { f64::INFINITY };
        let mut first_difference = None;
        for (i, (a, b)) in pairs.iter().enumerate() {
            if a.to_bits() != b.to_bits() && first_difference.is_none() {
                first_difference = Some(i);
            }
            error = error.max(difference(*a, *b, largest));
        }
        if cpu.len() != gpu.len() {
            first_difference = first_difference.or(Some(pairs.len()));
        }
        Self {
            stage: stage.to_owned(),
            cpu,
            gpu,
            error,
            first_difference,
            tolerance,
        }
    }

    /// Whether the two sides agree.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.error <= self.tolerance
    }
}

/// Difference of two numbers relative to the largest of many, which no arithmetic with infinities or
/// NaN can make small.
fn difference(a: f64, b: f64, largest: f64) -> f64 {
    if a == b {
        // Equal infinities too, and zeros, whose signs differ in bits alone.
        return 0.0;
    }
    let relative = (a - b).abs() / largest;
    if a.is_finite() && b.is_finite() && relative.is_finite() {
        return relative;
    }
    f64::INFINITY
}

fn first<T>(mut values: Vec<T>, len: usize) -> Vec<T> {
    values.truncate(len);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare(cpu: Vec<f64>, gpu: Vec<f64>) -> Comparison {
        Comparison::new("stage", cpu.into(), gpu.into(), 1e-12)
    }

    #[test]
    fn what_differs_does_not_pass() {
        assert!(compare(vec![1.0, 2.0], vec![1.0, 2.0]).passes());
        assert!(compare(vec![1.0, 2.0], vec![1.0, 2.0 + 1e-12]).passes());
        let planted = compare(vec![1.0, 2.0], vec![1.0, 2.1]);
        assert!(!planted.passes() && planted.first_difference == Some(1));
        assert!(!compare(vec![1.0, 2.0], vec![1.0]).passes());
        assert!(!compare(vec![1.0], vec![1.0, 2.0]).passes());
        assert!(!compare(vec![0.0], vec![1e-300]).passes());
        let signs = compare(vec![0.0], vec![-0.0]);
        assert!(signs.passes() && signs.first_difference == Some(0));
        let types = Comparison::new("stage", vec![1_u32].into(), vec![1.0_f32].into(), 1e-12);
        assert!(!types.passes());
    }

    #[test]
    fn infinities_hide_nothing() {
        const INF: f64 = f64::INFINITY;
        assert!(compare(vec![INF, 1.0], vec![INF, 1.0]).passes());
        // Behind an infinity every difference would be relatively small.
        let behind = compare(vec![INF, 1.0], vec![INF, 2.0]);
        assert!(!behind.passes() && behind.first_difference == Some(1));
        for (cpu, gpu) in [(INF, -INF), (INF, f64::MAX), (1.0, INF), (INF, 0.0)] {
            assert!(
                !compare(vec![cpu, 1.0], vec![gpu, 1.0]).passes(),
                "{cpu} {gpu}"
            );
        }
        // Their difference overflows.
        assert!(!compare(vec![f64::MAX], vec![-f64::MAX]).passes());
        // Only infinities: nothing to be relative to.
        assert!(compare(vec![INF], vec![INF]).passes());
        assert!(!compare(vec![INF, 0.0], vec![INF, 1e-300]).passes());
    }

    #[test]
    fn nan_never_passes() {
        const NAN: f64 = f64::NAN;
        for (cpu, gpu) in [(NAN, NAN), (1.0, NAN), (NAN, 1.0)] {
            // Nor does a later element make up for it.
            let found = compare(vec![cpu, 1.0], vec![gpu, 1.0]);
            assert!(!found.passes() && found.error == f64::INFINITY);
        }
        let singles = vec![1.0_f32, f32::NAN];
        let same = Comparison::new("stage", singles.clone().into(), singles.into(), 1.0);
        assert!(!same.passes());
    }
}
