//! Captures: what a computation was given, in one file, so that what went wrong on one machine is
//! studied on another.
//!
//! A file is JSON: the version of the format, the name of the computation, the device, why it was
//! written, and the inputs as whoever computes defines them: any type of serde's, such as a model
//! with its state and forces, or meshes with their poses. Numbers of JSON keep every bit but know no
//! NaN; [arrays](crate::twin::Named) are written by their bits.
//!
//! ```
//! use vertebra_gpu::capture::Capture;
//! use vertebra_gpu::twin::Named;
//!
//! let inputs = vec![Named::new("data", vec![1.5_f32, f32::NAN])];
//! let capture = Capture::new("reduce_f32", "some GPU", "NaN at element 1", &inputs)?;
//! let path = capture.write(&std::env::temp_dir())?;
//! let read = Capture::read(&path)?;
//! assert_eq!(read, capture);
//! let inputs: Vec<Named> = read.inputs()?;
//! assert_eq!(inputs[0].name, "data");
//! # std::fs::remove_file(path).ok();
//! # Ok::<(), vertebra_gpu::capture::CaptureError>(())
//! ```

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Version of the format that is written and read.
pub const FORMAT: u32 = 2;

/// What a computation was given, and why that is worth keeping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Capture {
    /// Version of the format, [`FORMAT`].
    pub format: u32,
    /// Name of what computes it on both sides.
    pub computation: String,
    /// The device it was computed on.
    pub device: String,
    /// What went wrong.
    pub reason: String,
    /// The inputs, of a type that the computation defines.
    pub inputs: serde_json::Value,
}

/// Why a capture was not written or not read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The file system refused.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: String,
        /// What it says.
        source: std::io::Error,
    },
    /// Of another version.
    #[error(
        "{path} has format {found}, this program reads {FORMAT}; use the version that wrote it"
    )]
    Format {
        /// The file.
        path: String,
        /// Its version.
        found: u64,
    },
    /// Not a capture.
    #[error("{path} is no capture: {source}")]
    Content {
        /// The file.
        path: String,
        /// What does not fit.
        source: serde_json::Error,
    },
    /// Inputs that are not of the computation's type.
    #[error("inputs of `{computation}`: {source}")]
    Inputs {
        /// Name of the computation.
        computation: String,
        /// What does not fit.
        source: serde_json::Error,
    },
}

impl Capture {
    /// The inputs of a computation.
    ///
    /// # Errors
    /// [`CaptureError::Inputs`] of a type that JSON cannot say.
    pub fn new(
        computation: &str,
        device: &str,
        reason: &str,
        inputs: &impl Serialize,
    ) -> Result<Self, CaptureError> {
        let inputs = serde_json::to_value(inputs).map_err(|source| CaptureError::Inputs {
            computation: computation.to_owned(),
            source,
        })?;
        Ok(Self {
            format: FORMAT,
            computation: computation.to_owned(),
            device: device.to_owned(),
            reason: reason.to_owned(),
            inputs,
        })
    }

    /// The inputs as the computation's type.
    ///
    /// # Errors
    /// [`CaptureError::Inputs`] if they are of another.
    pub fn inputs<T: DeserializeOwned>(&self) -> Result<T, CaptureError> {
        T::deserialize(&self.inputs).map_err(|source| CaptureError::Inputs {
            computation: self.computation.clone(),
            source,
        })
    }

    /// Writes a new file, `vertebra-COMPUTATION-NUMBER.json`; returns where.
    ///
    /// # Errors
    /// [`CaptureError::File`].
    pub fn write(&self, directory: &Path) -> Result<PathBuf, CaptureError> {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let name = self.computation.replace(|c| !is_plain(c), "_");
        for number in 0_u32.. {
            let path = directory.join(format!("vertebra-{name}-{number}.json"));
            let mut file = match File::create_new(&path) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
                Err(source) => return Err(file_error(&path, source)),
                Ok(file) => BufWriter::new(file),
            };
            let text = serde_json::to_writer(&mut file, self).map_err(std::io::Error::from);
            text.and_then(|()| file.flush())
                .map_err(|source| file_error(&path, source))?;
            return Ok(path);
        }
        Err(file_error(directory, ErrorKind::AlreadyExists.into()))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`CaptureError::File`], [`CaptureError::Content`], [`CaptureError::Format`].
    pub fn read(path: &Path) -> Result<Self, CaptureError> {
        let text = std::fs::read(path).map_err(|source| file_error(path, source))?;
        let content = |source| CaptureError::Content {
            path: path.display().to_string(),
            source,
        };
        let value: serde_json::Value = serde_json::from_slice(&text).map_err(content)?;
        // Another version may have other fields.
        match value.get("format").and_then(serde_json::Value::as_u64) {
            Some(found) if found != u64::from(FORMAT) => Err(CaptureError::Format {
                path: path.display().to_string(),
                found,
            }),
            _ => serde_json::from_value(value).map_err(content),
        }
    }
}

fn file_error(path: &Path, source: std::io::Error) -> CaptureError {
    CaptureError::File {
        path: path.display().to_string(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::Named;

    fn read(text: &str) -> Result<Capture, CaptureError> {
        let name = format!("vertebra-capture-test-{}.json", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, text).unwrap();
        let read = Capture::read(&path);
        std::fs::remove_file(path).unwrap();
        read
    }

    #[test]
    fn what_is_no_capture_is_refused_by_name() {
        let capture = Capture::new("scan", "Test GPU", "planted", &[1, 2]).unwrap();
        let text = serde_json::to_string(&capture).unwrap();
        assert_eq!(read(&text).unwrap(), capture);
        let refusal = |text: &str| read(text).unwrap_err().to_string();
        let older = text.replace(r#""format":2"#, r#""format":1,"recording":"scan""#);
        assert!(refusal(&older).contains("format 1"), "{}", refusal(&older));
        let other = text.replace("reason", "season");
        assert!(refusal(&other).contains("season"), "{}", refusal(&other));
        assert!(refusal("{").contains("no capture"));
        assert!(refusal("[1]").contains("no capture"));
        let missing = Capture::read(Path::new("no such file")).unwrap_err();
        assert!(missing.to_string().contains("no such file"));
        let inputs = capture.inputs::<Vec<Named>>().unwrap_err();
        assert!(inputs.to_string().contains("`scan`"), "{inputs}");
    }
}
