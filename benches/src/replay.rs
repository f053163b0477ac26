//! Computes what a [`Capture`] holds on both sides, so that what went wrong on one machine is studied
//! on another.

use crate::suite::gpu;
use anyhow::Context;
use std::fmt::Write as _;
use std::path::Path;
use vertebra_gpu::capture::Capture;
use vertebra_gpu::twin::{Comparison, Named, Twin, Values};
use vertebra_gpu::{Device, Failure};
use vertebra_shaders::twins;

/// What captures are of: each kind names its computations, and reads its inputs from a file.
enum Computation {
    /// A primitive, whose inputs are named arrays.
    Primitive(&'static Twin),
    /// What a check computes of named arrays.
    Check(&'static gpu::Computation),
    /// Accelerations of a model in a state under forces.
    Dynamics,
}

impl Computation {
    fn of(capture: &Capture) -> anyhow::Result<Self> {
        let name = &capture.computation;
        let primitive = twins::ALL.iter().find(|twin| twin.name == name);
        let check = || gpu::COMPUTATIONS.iter().find(|check| check.name == name);
        let dynamics = || (name == gpu::Problem::NAME).then_some(Self::Dynamics);
        let found = primitive.map(Self::Primitive);
        let found = found.or_else(|| check().map(Self::Check)).or_else(dynamics);
        found.with_context(|| {
            let names = twins::ALL.iter().map(|twin| twin.name);
            let names = names.chain(gpu::COMPUTATIONS.iter().map(|check| check.name));
            let names = names.chain([gpu::Problem::NAME]);
            let names: Vec<_> = names.collect();
            format!(
                "nothing is called `{name}`; there are: {}",
                names.join(", ")
            )
        })
    }

    /// Computes the inputs on the CPU and on a device.
    fn compare(&self, capture: &Capture, device: &Device) -> gpu::Compared {
        match self {
            Self::Primitive(twin) => Ok(twin.compare(device, &arrays(capture)?)?),
            Self::Check(check) => (check.compare)(device, &arrays(capture)?),
            Self::Dynamics => capture.inputs::<gpu::Problem>()?.compare(device),
        }
    }
}

/// Inputs that are named arrays.
fn arrays(capture: &Capture) -> anyhow::Result<Vec<Named>> {
    let inputs: Vec<Named> = capture.inputs()?;
    for Named { name, values } in &inputs {
        println!("input {name}: {} elements", values.len());
    }
    Ok(inputs)
}

/// What is wrong with a comparison in a sentence; none if nothing is.
#[must_use]
pub fn fault(comparisons: &[Comparison], failures: &[Failure]) -> Option<String> {
    let wrong = comparisons.iter().filter(|c| !c.passes()).map(|c| {
        let first = c.first_difference.unwrap_or(0);
        let Comparison { stage, error, .. } = c;
        format!("stage {stage} is off by {error:e}, first at element {first}")
    });
    let failed = failures.iter().map(|failure| format!("{failure} failed"));
    let all: Vec<String> = failed.chain(wrong).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// Computes a file's inputs on both sides and prints how they compare; returns whether they agree.
/// The elements of the stage `dump` are printed, `rows` from the first that differs.
///
/// # Errors
/// If the file is no capture, there is no such stage, or no device; if the device cannot compute it.
pub fn replay(path: &Path, dump: Option<&str>, rows: usize) -> anyhow::Result<bool> {
    let capture = Capture::read(path)?;
    let computation = Computation::of(&capture).with_context(|| path.display().to_string())?;
    let device = gpu::device()?;
    println!("{}: written on {}", capture.computation, capture.device);
    println!("because {}", capture.reason);
    println!("computed here on {}", device.description());
    let (comparisons, failures) = computation.compare(&capture, &device)?;
    for comparison in &comparisons {
        println!("{}", summary(comparison));
    }
    for failure in &failures {
        println!("FAIL  {failure}");
    }
    if let Some(stage) = dump {
        let names: Vec<_> = comparisons.iter().map(|c| c.stage.as_str()).collect();
        let found = comparisons.iter().find(|c| c.stage == stage);
        let found = found
            .with_context(|| format!("no stage `{stage}`; the stages are: {}", names.join(", ")))?;
        print!("{}", table(found, rows));
    }
    Ok(fault(&comparisons, &failures).is_none())
}

fn summary(comparison: &Comparison) -> String {
    let verdict = if comparison.passes() { "pass" } else { "FAIL" };
    let first = match comparison.first_difference {
        Some(element) => format!("first difference at element {element}"),
        None => "the same bits".to_owned(),
    };
    format!(
        "{verdict}  stage {}: {} elements, error {:.3e} of {:.3e}, {first}",
        comparison.stage,
        comparison.cpu.len(),
        comparison.error,
        comparison.tolerance
    )
}

/// Elements side by side, from the first that differs.
fn table(comparison: &Comparison, rows: usize) -> String {
    let mut text = format!("{:>10}  {:>24}  {:>24}\n", "element", "CPU", "GPU");
    let start = comparison.first_difference.unwrap_or(0);
    let end = comparison.cpu.len().max(comparison.gpu.len());
    for i in (start..end).take(rows) {
        let side = |values: &Values| match (values, values.get(i)) {
            (_, None) => "-".to_owned(),
            (Values::U32(_), Some(word)) => word.to_string(),
            (_, Some(number)) => format!("{number:e}"),
        };
        let (cpu, gpu) = (side(&comparison.cpu), side(&comparison.gpu));
        let mark = if cpu == gpu { "" } else { "  *" };
        _ = writeln!(text, "{i:>10}  {cpu:>24}  {gpu:>24}{mark}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nothing_computes_is_refused_by_name() {
        let capture = Capture::new("nothing", "", "", &()).unwrap();
        let refusal = Computation::of(&capture).err().unwrap().to_string();
        assert!(refusal.contains("`nothing`") && refusal.contains("scan_f32"));
        assert!(refusal.contains("own_operator"), "{refusal}");
        for name in ["sort", "finite", "dca"] {
            let capture = Capture::new(name, "", "", &()).unwrap();
            assert!(Computation::of(&capture).is_ok());
        }
    }

    #[test]
    fn elements_stand_side_by_side_from_the_first_that_differs() {
        let (cpu, gpu) = (vec![1.0_f32, 2.0, 3.0], vec![1.0_f32, f32::NAN, 3.0]);
        let comparison = Comparison::new("sum", cpu.into(), gpu.into(), 0.0);
        let text = table(&comparison, 5);
        let rows: Vec<&str> = text.lines().skip(1).map(str::trim).collect();
        let [wrong, right] = rows[..] else {
            panic!("{text}");
        };
        assert!(
            wrong.starts_with("1 ") && wrong.ends_with("NaN  *"),
            "{wrong}"
        );
        assert!(right.starts_with("2 ") && !right.ends_with('*'), "{right}");
        let sentence = fault(&[comparison], &[]).unwrap();
        assert!(
            sentence.contains("sum") && sentence.contains("element 1"),
            "{sentence}"
        );
        assert_eq!(fault(&[], &[]), None);
    }
}
