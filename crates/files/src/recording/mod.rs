//! Poses over time, written as glTF or JSON.
//!
//! A [`Recording`] gathers the poses of all bodies frame by frame. [`write_glb`](Recording::write_glb)
//! makes a binary glTF 2.0 file of it, a node a body with its shapes and an animation, which common
//! viewers play; [`write_json`](Recording::write_json) a plain table.
//!
//! ```
//! use vertebra_assembly::{Joint, generate};
//! use vertebra_files::recording::{Recording, sticks};
//! use vertebra_spatial::Pose;
//!
//! let rod = generate::Rod::default();
//! let model = generate::chain(2, &Joint::spherical(), &rod)?;
//! let mut recording = Recording::new(&model, sticks(&model));
//! recording.push(0.0, &[Pose::IDENTITY; 2])?;
//! let mut file = Vec::new();
//! recording.write_glb(&mut file)?;
//! assert_eq!(&file[..4], b"glTF");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod glb;
mod tessellate;

use crate::{Part, Shape};
use glam::{DQuat, DVec3};
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;
use vertebra_assembly::{Model, ModelError};
use vertebra_spatial::Pose;

/// Poses of a model's bodies over time.
#[derive(Clone, Debug)]
pub struct Recording {
    model: Model,
    parts: Vec<Part>,
    times: Vec<f64>,
    /// Frame by frame, shape [frames, bodies].
    poses: Vec<Pose>,
}

/// The table as it is written: the layout that `vertebra-bench --frames` writes too.
#[derive(Serialize)]
struct Table<'a> {
    model: &'a str,
    bodies: Vec<&'a str>,
    parents: Vec<Option<u32>>,
    layout: &'static str,
    frames: Vec<Frame>,
}

#[derive(Serialize)]
struct Frame {
    time: f64,
    poses: Vec<[f64; 7]>,
}

impl Recording {
    /// An empty recording of a model whose bodies look like `parts`.
    #[must_use]
    pub fn new(model: &Model, parts: Vec<Part>) -> Self {
        Self {
            model: model.clone(),
            parts,
            times: Vec::new(),
            poses: Vec::new(),
        }
    }

    /// Number of frames.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are no frames yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Adds a frame: a time \[s\], later than that of the frame before, and where every body is in the
    /// world, in the order of [`Model::bodies`].
    ///
    /// # Errors
    /// [`ModelError`] for another number of poses, a pose that is none, or a time that does not go
    /// on; nothing is added then.
    pub fn push(&mut self, time: f64, poses: &[Pose]) -> Result<(), ModelError> {
        let bodies = self.model.bodies();
        if poses.len() != bodies.len() {
            return Err(ModelError::WrongLength {
                quantity: "poses of a frame",
                expected: bodies.len(),
                found: poses.len(),
            });
        }
        let goes_on = self.times.last().is_none_or(|&last| time > last);
        if !(time.is_finite() && goes_on) {
            return Err(ModelError::BadParameter {
                parameter: "the time of a frame",
                requirement: "a number above that of the frame before",
            });
        }
        for (pose, body) in poses.iter().zip(bodies) {
            if !pose.is_valid() {
                return Err(ModelError::NonUnitQuaternion {
                    quantity: "the pose in a frame",
                    element: body.name.clone(),
                    length: pose.rotation.length(),
                });
            }
        }
        self.times.push(time);
        self.poses.extend_from_slice(poses);
        Ok(())
    }

    /// The frames: times and the poses of all bodies.
    fn frames(&self) -> impl Iterator<Item = (f64, &[Pose])> {
        let frames = self.poses.chunks_exact(self.model.bodies().len());
        self.times.iter().copied().zip(frames)
    }

    /// Writes the poses as JSON: x, y, z, qx, qy, qz, qw of every body, frame by frame.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write_json(&self, writer: impl Write) -> io::Result<()> {
        let table = Table {
            model: self.model.name(),
            bodies: self
                .model
                .bodies()
                .iter()
                .map(|body| body.name.as_str())
                .collect(),
            parents: self
                .model
                .bodies()
                .iter()
                .map(|body| body.parent.map(|id| id.0))
                .collect(),
            layout: "x, y, z, qx, qy, qz, qw",
            frames: self
                .frames()
                .map(|(time, poses)| Frame {
                    time,
                    poses: poses.iter().map(numbers).collect(),
                })
                .collect(),
        };
        serde_json::to_writer(writer, &table).map_err(io::Error::from)
    }

    /// Writes a binary glTF 2.0 file: y up, a node and an animation a body.
    ///
    /// # Errors
    /// What the writer says, or that the file would exceed the 4 GiB of the format.
    pub fn write_glb(&self, mut writer: impl Write) -> io::Result<()> {
        glb::write(self, &mut writer)
    }

    /// Writes a file: JSON where its name ends in `.json`, else binary glTF, whose ending is `.glb`.
    ///
    /// # Errors
    /// What the file system says, with the path, or [`io::ErrorKind::InvalidInput`] where the name ends in `.gltf`:
    /// that of glTF as text, which is not written.
    pub fn save(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let path = path.as_ref();
        let of_path =
            |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
        let ends_in = |wanted: &str| {
            let ending = path.extension();
            ending.is_some_and(|ending| ending.eq_ignore_ascii_case(wanted))
        };
        if ends_in("gltf") {
            let text = ".gltf is the ending of glTF as text, which is not written; let the name end in .glb";
            return Err(of_path(io::Error::new(io::ErrorKind::InvalidInput, text)));
        }
        let write = || {
            let mut file = io::BufWriter::new(std::fs::File::create(path)?);
            match ends_in("json") {
                true => self.write_json(&mut file)?,
                false => self.write_glb(&mut file)?,
            }
            file.flush()
        };
        write().map_err(of_path)
    }
}

fn numbers(pose: &Pose) -> [f64; 7] {
    let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, qx, qy, qz, qw]
}

/// Shapes for a model that has none: a stick from the joint of each body to every joint it carries, or
/// through its centre of mass where it carries none.
#[must_use]
pub fn sticks(model: &Model) -> Vec<Part> {
    let mut ends: Vec<Vec<DVec3>> = vec![Vec::new(); model.bodies().len()];
    for body in model.bodies() {
        if let Some(parent) = body.parent {
            ends[parent.index()].push(body.joint.parent_placement.translation);
        }
    }
    let mut parts = Vec::new();
    for ((id, body), ends) in model.body_ids().zip(model.bodies()).zip(&mut ends) {
        let from = body.joint.child_placement.translation;
        if ends.is_empty() {
            ends.push(body.mass.center * 2.0 - from);
        }
        let sticks = ends.iter().filter_map(|&to| {
            let length = (to - from).length();
            (length > 1e-100).then(|| Part {
                body: Some(id),
                placement: Pose::new(
                    DQuat::from_rotation_arc(DVec3::Z, (to - from) / length),
                    (from + to) * 0.5,
                ),
                shape: Shape::Capsule {
                    radius: 0.1 * length,
                    length: 0.8 * length,
                },
            })
        });
        parts.extend(sticks);
    }
    parts
}
