//! Twins: a computation on both sides, compared element by element.
//!
//! A twin computes named stages from named inputs, once on the CPU and once as a recording. The
//! tests of a backend, and the replay of a failure on another machine, are comparisons of twins.

use crate::device::Device;
use crate::error::{Error, Failure};
use crate::recording::{Recording, Slot};

/// A named array of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Its elements.
    pub values: Values,
}

impl Named {
    /// Names an array.
    pub fn new(name: &str, values: impl Into<Values>) -> Self {
        Self {
            name: name.to_owned(),
            values: values.into(),
        }
    }
}

/// An array of one of the types that kernels compute with.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Values {
    /// Words.
    U32(Vec<u32>),
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

impl From<Vec<u32>> for Values {
    fn from(values: Vec<u32>) -> Self {
        Self::U32(values)
    }
}

impl From<Vec<f32>> for Values {
    fn from(values: Vec<f32>) -> Self {
        Self::F32(values)
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Self::F64(values)
    }
}

impl Values {
    /// Number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::U32(values) => values.len(),
            Self::F32(values) => values.len(),
            Self::F64(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// An element as a number; none beyond the end.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            Self::U32(values) => values.get(index).map(|&value| value.into()),
            Self::F32(values) => values.get(index).map(|&value| value.into()),
            Self::F64(values) => values.get(index).copied(),
        }
    }

    /// The words of a `u32` array; none of another type's.
    #[must_use]
    pub fn words(&self) -> &[u32] {
        match self {
            Self::U32(values) => values,
            _ => &[],
        }
    }
}

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
    /// Largest difference of two elements, over the largest of the CPU's \[1\]; infinite where one
    /// side has NaN or another length.
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
        Ok((comparisons, failures))
    }
}

impl Comparison {
    fn new(stage: &str, cpu: Values, gpu: Values, tolerance: f64) -> Self {
        let largest = (0..cpu.len()).filter_map(|i| cpu.get(i));
        let largest = largest.fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut error = if cpu.len() == gpu.len() {
            0.0
        } else {
            f64::INFINITY
        };
        let mut first_difference = (cpu.len() != gpu.len()).then_some(cpu.len().min(gpu.len()));
        for (i, (a, b)) in (0..cpu.len()).filter_map(|i| Some((i, (cpu.get(i)?, gpu.get(i)?)))) {
            if a.to_bits() == b.to_bits() {
                continue;
            }
            first_difference = Some(first_difference.map_or(i, |first| first.min(i)));
            // Zeros of different signs differ in bits alone.
            let difference = if a == b { 0.0 } else { (a - b).abs() / largest };
            // NaN on either side.
            error = if difference.is_nan() {
                f64::INFINITY
            } else {
                error.max(difference)
            };
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
        let planted = compare(vec![1.0, 2.0], vec![1.0, 2.1]);
        assert!(!planted.passes() && planted.first_difference == Some(1));
        assert!(!compare(vec![1.0, 2.0], vec![1.0, f64::NAN]).passes());
        assert!(!compare(vec![1.0, 2.0], vec![1.0]).passes());
        assert!(!compare(vec![0.0], vec![1e-300]).passes());
        let signs = compare(vec![0.0], vec![-0.0]);
        assert!(signs.passes() && signs.first_difference == Some(0));
    }
}
