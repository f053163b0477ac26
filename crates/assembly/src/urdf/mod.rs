//! URDF import: the robot files of ROS.
//!
//! [`read`] and [`parse`] give a [`Robot`]: the [`Model`], the geometry of its links, and a list of
//! everything in the file that has no effect. A body bears the name of its link. Bodies stand limb
//! by limb (depth first), siblings in the order in which the file gives their joints.
//!
//! By default the root link is welded to the world, and links on fixed joints are folded into the
//! link that carries them: their mass is merged and their name stays as a [`Frame`](crate::Frame).
//! [`Options`] changes both. A link without `<inertial>` has no mass. Roll, pitch and yaw turn
//! about fixed axes, in this order. A planar joint is a [`Compound`](crate::Compound): two slides across its
//! axis and a turn about it, with bodies `link.1` and `link.2` of no mass between.
//!
//! [`write()`] makes a URDF file of a model, from which [`parse`] gives the model back to the last bit.
//!
//! A bound of 1e16 or more is none. Revolute and prismatic joints without `<limit>`, which the format asks for, are
//! listed and move without bounds.
//!
//! Ranges, efforts, damping, friction and mimics are kept in the model's joints, where simulations let them
//! act; largest speeds are kept too, and [`Model::not_simulated`] lists them.
//!
//! ```
//! use vertebra_assembly::urdf::{self, Options};
//!
//! let robot = urdf::parse(
//!     r#"<robot name="pendulum">
//!          <link name="base"/>
//!          <link name="bob">
//!            <inertial>
//!              <origin xyz="0 0 -1"/>
//!              <mass value="2"/>
//!              <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
//!            </inertial>
//!          </link>
//!          <joint name="hinge" type="continuous">
//!            <parent link="base"/>
//!            <child link="bob"/>
//!            <axis xyz="0 1 0"/>
//!          </joint>
//!        </robot>"#,
//!     &Options::default(),
//! )?;
//! let bob = robot.joints["hinge"];
//! assert_eq!(robot.model.body(bob).map(|body| body.mass.mass), Some(2.0));
//! assert_eq!(robot.model.frames()[0].name, "base");
//! # Ok::<(), vertebra_assembly::urdf::UrdfError>(())
//! ```

mod error;
mod fold;
mod geometry;
mod joint;
mod link;
mod mesh_path;
mod robot;
mod tree;
mod write;

pub use crate::{Ignored, Location};
pub use error::{Problem, UrdfError};
pub use geometry::{Geometry, Mesh, Role, Shape};
pub use robot::{DoubtfulInertia, Robot, parse, read};
pub use write::{WriteError, write};

use crate::{Model, description::STANDARD_GRAVITY};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// How a URDF file becomes a model.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// Whether the root link moves freely. If not, it is welded to the world, and it and all that
    /// is fixed to it become frames of the world, whose mass has no effect.
    pub floating_base: bool,
    /// Whether every link stays a body, on a [`Fixed`](crate::JointKind::Fixed) joint where it does
    /// not move, the root link of a fixed base included. If not, such links are folded away.
    pub keep_fixed: bool,
    /// Gravity in world axes [m/s^2], which URDF does not state; 9.81 along -z by default.
    pub gravity: DVec3,
    /// Folders in which packages and meshes are looked for, before those around the file.
    pub search_paths: Vec<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            floating_base: false,
            keep_fixed: false,
            gravity: STANDARD_GRAVITY,
            search_paths: Vec::new(),
        }
    }
}

impl Options {
    /// The root link moves freely.
    #[must_use]
    pub fn floating_base(mut self) -> Self {
        self.floating_base = true;
        self
    }

    /// Links on fixed joints stay bodies.
    #[must_use]
    pub fn keep_fixed(mut self) -> Self {
        self.keep_fixed = true;
        self
    }

    /// Sets gravity, in world axes [m/s^2].
    #[must_use]
    pub fn gravity(mut self, gravity: DVec3) -> Self {
        self.gravity = gravity;
        self
    }

    /// Adds a folder in which packages and meshes are looked for.
    #[must_use]
    pub fn search_path(mut self, folder: impl Into<PathBuf>) -> Self {
        self.search_paths.push(folder.into());
        self
    }
}

impl Model {
    /// The model of a URDF file: fixed base, fixed joints folded, standard gravity.
    /// [`urdf::read`](read) has the options and gives the geometry too.
    ///
    /// # Errors
    /// [`UrdfError`], naming the file, line and element that is wrong and what to do.
    pub fn from_urdf(path: impl AsRef<Path>) -> Result<Self, UrdfError> {
        read(path, &Options::default()).map(|robot| robot.model)
    }
}
