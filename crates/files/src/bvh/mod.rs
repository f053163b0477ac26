//! BVH: motion-capture skeletons and their motion.
//!
//! [`read`] and [`parse`] give a [`Capture`]: the skeleton as a [`Model`], whose root is free and whose
//! joints are spherical, and its [`Motion`] as positions q over time. A file states neither units nor
//! masses: [`Options`] says how long its unit is and how thick and dense the bones are. Every bone is a
//! capsule from a joint to the next; a joint without any gets a ball.
//!
//! The motion is one of positions, and [`motors`] makes targets of it.
//!
//! BVH has y up. The root's joint is turned so that the model has z up, and positions q stay in the
//! file's axes.
//!
//! ```
//! use vertebra_files::bvh::{self, Options};
//!
//! let capture = bvh::parse(
//!     "HIERARCHY
//!      ROOT hips {
//!        OFFSET 0 0 0
//!        CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
//!        JOINT leg {
//!          OFFSET 0 -10 0
//!          CHANNELS 3 Zrotation Xrotation Yrotation
//!          End Site { OFFSET 0 -40 0 }
//!        }
//!      }
//!      MOTION
//!      Frames: 2
//!      Frame Time: 0.04
//!      0 90 0  0 0 0  0 0 0
//!      0 92 0  0 0 0  0 30 0",
//!     &Options::default(),
//! )?;
//! assert_eq!(capture.model.bodies().len(), 2);
//! let halfway = capture.motion.state(&capture.model, 0.02)?;
//! assert!((halfway.q[1] - 0.91).abs() < 1e-15); // [m]
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod motion;
mod skeleton;
mod words;

pub use motion::{Motion, motors};

use crate::{FileError, Part, Problem, read_text};
use std::path::Path;
use vertebra_assembly::{Ignored, Model};

/// What a BVH file does not say.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// Length of the file's unit \[m\]; a centimetre by default.
    pub unit: f64,
    /// Density of the bones [kg/m^3]; that of water by default.
    pub density: f64,
    /// Radius of a bone as part of its length; 0.15 by default.
    pub thickness: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            unit: 0.01,
            density: 1000.0,
            thickness: 0.15,
        }
    }
}

impl Options {
    /// Sets the length of the file's unit \[m\].
    #[must_use]
    pub fn unit(mut self, unit: f64) -> Self {
        self.unit = unit;
        self
    }

    fn check(&self) -> Result<(), FileError> {
        for (quantity, value) in [
            ("the unit [m] of the options", self.unit),
            ("the density [kg/m^3] of the options", self.density),
            ("the thickness of the options", self.thickness),
        ] {
            if !(value.is_finite() && value > 0.0) {
                let problem = Problem::OutOfRange {
                    quantity,
                    value,
                    requirement: "above zero",
                };
                return Err(FileError::on_line(0, "the skeleton", problem));
            }
        }
        Ok(())
    }
}

/// What a BVH file says.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The skeleton, every joint of the file a body.
    pub model: Model,
    /// The bones.
    pub parts: Vec<Part>,
    /// Positions over time.
    pub motion: Motion,
    /// Channels that have no effect: displacements of joints other than the root.
    pub ignored: Vec<Ignored>,
}

/// Reads a BVH file.
///
/// # Errors
/// [`FileError`], naming the file, line and element that is wrong and what to do.
pub fn read(path: impl AsRef<Path>, options: &Options) -> Result<Capture, FileError> {
    let path = path.as_ref();
    parse(&read_text(path)?, options).map_err(|error| error.in_file(path))
}

/// Reads BVH text.
///
/// # Errors
/// [`FileError`], naming the line and element that is wrong and what to do.
pub fn parse(text: &str, options: &Options) -> Result<Capture, FileError> {
    options.check()?;
    let mut words = words::Words::new(text);
    let skeleton = skeleton::Skeleton::read(&mut words)?;
    let (model, parts) = skeleton.build(options)?;
    let motion = motion::read(&mut words, &skeleton, options)?;
    Ok(Capture {
        model,
        parts,
        motion,
        ignored: skeleton.ignored,
    })
}
