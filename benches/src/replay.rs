//! Inputs of a computation in a file, so that what went wrong on one machine is studied on another.

use crate::results::write_atomically;
use crate::suite::gpu;
use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use vertebra_gpu::Device;
use vertebra_gpu::twin::{Comparison, Named, Twin, Values};
use vertebra_shaders::twins;

/// Version of the format.
const FORMAT: u32 = 1;

/// What a replay file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Replay {
    /// Version of the format.
    pub format: u32,
    /// Name of the twin that computes it on both sides.
    pub recording: String,
    /// The device it was computed on.
    pub device: String,
    /// The inputs.
    pub inputs: Vec<Input>,
}

/// A named array, bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Its name.
    pub name: String,
    /// `u32`, `f32` or `f64`.
    pub r#type: String,
    /// Hexadecimal digits of the elements, 8 or 16 each: JSON has no NaN.
    pub bits: String,
}

impl Replay {
    /// What a twin was given.
    #[must_use]
    pub fn new(twin: &Twin, device: &Device, inputs: Vec<Named>) -> Self {
        Self {
            format: FORMAT,
            recording: twin.name.to_owned(),
            device: device.description(),
            inputs: inputs.iter().filter_map(Input::of).collect(),
        }
    }

    /// The twin and its inputs.
    fn open(&self) -> anyhow::Result<(&'static Twin, Vec<Named>)> {
        ensure!(
            self.format == FORMAT,
            "the file has format {}, this program reads {FORMAT}",
            self.format
        );
        let twin = twins::ALL.iter().find(|twin| twin.name == self.recording);
        let twin = twin.with_context(|| format!("nothing is called `{}`", self.recording))?;
        let inputs = self.inputs.iter().map(Input::values);
        Ok((twin, inputs.collect::<anyhow::Result<_>>()?))
    }
}

impl Input {
    /// None of a type that files do not know.
    fn of(named: &Named) -> Option<Self> {
        let mut bits = String::new();
        let r#type = match &named.values {
            Values::U32(values) => {
                values.iter().for_each(|x| _ = write!(bits, "{x:08x}"));
                "u32"
            }
            Values::F32(values) => {
                let words = values.iter().map(|x| x.to_bits());
                words.for_each(|x| _ = write!(bits, "{x:08x}"));
                "f32"
            }
            Values::F64(values) => {
                let words = values.iter().map(|x| x.to_bits());
                words.for_each(|x| _ = write!(bits, "{x:016x}"));
                "f64"
            }
            _ => return None,
        };
        Some(Self {
            name: named.name.clone(),
            r#type: r#type.to_owned(),
            bits,
        })
    }

    fn values(&self) -> anyhow::Result<Named> {
        let context = || format!("input `{}`", self.name);
        let values = match self.r#type.as_str() {
            "u32" => Values::U32(elements(&self.bits, |bits| u32::from_str_radix(bits, 16))?),
            "f32" => Values::F32(elements(&self.bits, |bits| {
                u32::from_str_radix(bits, 16).map(f32::from_bits)
            })?),
            "f64" => Values::F64(elements(&self.bits, |bits| {
                u64::from_str_radix(bits, 16).map(f64::from_bits)
            })?),
            other => anyhow::bail!("{}: `{other}` is none of u32, f32, f64", context()),
        };
        Ok(Named::new(&self.name, values))
    }
}

/// Elements of equally many digits.
fn elements<T>(
    bits: &str,
    read: impl Fn(&str) -> Result<T, std::num::ParseIntError>,
) -> anyhow::Result<Vec<T>> {
    let width = 2 * size_of::<T>();
    ensure!(
        bits.len().is_multiple_of(width) && bits.is_ascii(),
        "{} hexadecimal digits are no whole number of elements of {width}",
        bits.len()
    );
    let starts = (0..bits.len()).step_by(width);
    let read = |at| read(&bits[at..at + width]).context("not hexadecimal");
    starts.map(read).collect()
}

/// Writes a failure beside other temporary files; returns where.
///
/// # Errors
/// If it cannot be written.
pub fn write_failure(replay: &Replay) -> anyhow::Result<PathBuf> {
    // One file for each failure of a process.
    static WRITTEN: AtomicU32 = AtomicU32::new(0);
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    let process = std::process::id();
    let name = format!("vertebra-{}-{process}-{number}.json", replay.recording);
    let path = std::env::temp_dir().join(name);
    write_atomically(&path, &serde_json::to_vec(replay)?)?;
    Ok(path)
}

/// Computes a file's inputs on both sides and prints how they compare; returns whether they agree.
/// The elements of the stage `dump` are printed, `rows` from the first that differs.
///
/// # Errors
/// If the file is no replay, there is no such stage, or no device.
pub fn replay(path: &Path, dump: Option<&str>, rows: usize) -> anyhow::Result<bool> {
    let context = || path.display().to_string();
    let text = std::fs::read(path).with_context(context)?;
    let file: Replay = serde_json::from_slice(&text).with_context(context)?;
    let (twin, inputs) = file.open().with_context(context)?;
    let device = gpu::device()?;
    println!("{}: written on {}", file.recording, file.device);
    println!("computed here on {}", device.description());
    for Named { name, values } in &inputs {
        println!("input {name}: {} elements", values.len());
    }
    let (comparisons, failures) = twin.compare(&device, &inputs)?;
    for comparison in &comparisons {
        println!("{}", summary(comparison));
    }
    for failure in &failures {
        println!("{failure} failed");
    }
    if let Some(stage) = dump {
        let names: Vec<_> = comparisons.iter().map(|c| c.stage.as_str()).collect();
        let found = comparisons.iter().find(|c| c.stage == stage);
        let found = found
            .with_context(|| format!("no stage `{stage}`; the stages are: {}", names.join(", ")))?;
        print!("{}", table(found, rows));
    }
    Ok(failures.is_empty() && comparisons.iter().all(Comparison::passes))
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
    fn files_keep_every_bit() {
        let inputs = vec![
            Named::new("words", vec![0_u32, 7, u32::MAX]),
            Named::new("singles", vec![1.5_f32, -0.0, f32::MIN_POSITIVE]),
            Named::new("doubles", vec![f64::MAX, f64::INFINITY]),
        ];
        let file = Replay {
            format: FORMAT,
            recording: "scan".to_owned(),
            device: "Test GPU".to_owned(),
            inputs: inputs.iter().filter_map(Input::of).collect(),
        };
        let text = serde_json::to_string(&file).unwrap();
        let read: Replay = serde_json::from_str(&text).unwrap();
        assert_eq!(read, file);
        assert_eq!(read.open().unwrap().1, inputs);
        let nan = Input::of(&Named::new("nan", vec![f32::NAN])).unwrap();
        assert_eq!(nan.bits, "7fc00000");
    }

    #[test]
    fn what_is_no_replay_is_refused_by_name() {
        let file = |recording: &str, kind: &str, bits: &str| Replay {
            format: FORMAT,
            recording: recording.to_owned(),
            device: String::new(),
            inputs: vec![Input {
                name: "data".to_owned(),
                r#type: kind.to_owned(),
                bits: bits.to_owned(),
            }],
        };
        let refusal = |file: Replay| format!("{:#}", file.open().unwrap_err());
        assert!(refusal(file("nothing", "u32", "")).contains("`nothing`"));
        assert!(refusal(file("scan", "i8", "")).contains("`i8`"));
        assert!(refusal(file("scan", "u32", "123")).contains("whole number"));
        assert!(refusal(file("scan", "u32", "0000000g")).contains("hexadecimal"));
        let newer = Replay {
            format: 2,
            ..file("scan", "u32", "")
        };
        assert!(refusal(newer).contains("format 2"));
    }
}
