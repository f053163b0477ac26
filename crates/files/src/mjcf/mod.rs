//! MJCF: MuJoCo's robots and scenes.
//!
//! [`read`] and [`parse`] give a [`Robot`]: the [`Model`], shapes, actuators, couplings, and a list of
//! everything in the file that has no effect. A body keeps its name; one without is called `body_N` by
//! its place in the file. Of several joints in one body all but the last carry massless bodies, called
//! as the body with `.1`, `.2` behind, and a body without a joint is fixed. Sites become
//! [`Frame`](vertebra_assembly::Frame)s. Default classes, the `compiler` element, every way to state an
//! orientation, and inertia from geoms are understood as MuJoCo's documentation of MJCF states them.
//!
//! Positions count from the pose in the file: a hinge's or slide's q is MuJoCo's less its `ref`, and a
//! free joint's is the displacement from where the file puts the body.
//!
//! ```
//! use vertebra_files::mjcf::{self, Options};
//!
//! let robot = mjcf::parse(
//!     r#"<mujoco model="pendulum">
//!          <worldbody>
//!            <body name="bob" pos="0 0 1">
//!              <joint name="hinge" axis="0 1 0"/>
//!              <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02" mass="1"/>
//!            </body>
//!          </worldbody>
//!          <actuator><motor joint="hinge" gear="2"/></actuator>
//!        </mujoco>"#,
//!     &Options::default(),
//! )?;
//! assert_eq!(robot.model.dof_count(), 1);
//! assert_eq!(robot.actuators[0].gear, 2.0);
//! assert!(robot.ignored.is_empty());
//! # Ok::<(), vertebra_files::FileError>(())
//! ```

mod actuator;
mod body;
mod compiler;
mod coupling;
mod defaults;
mod geom;
mod joint;
mod mesh;

pub use actuator::{Actuator, Drive};
pub use coupling::Coupling;

use crate::{FileError, Part, Problem, TriangleSoup, read_text};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;
use vertebra_assembly::xml::{self, Document, Node, Reader};
use vertebra_assembly::{BodyId, Ignored, Model};

/// What an MJCF file is read with.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Options {
    /// The triangles of meshes in files of their own, by the file's name as the MJCF states it,
    /// before its scale.
    pub meshes: HashMap<String, Arc<TriangleSoup>>,
}

impl Options {
    /// Adds the triangles of a mesh file, by its name as the MJCF states it.
    #[must_use]
    pub fn mesh(mut self, file: impl Into<String>, triangles: TriangleSoup) -> Self {
        self.meshes.insert(file.into(), Arc::new(triangles));
        self
    }
}

/// What an MJCF file says.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Bodies, joints and frames.
    pub model: Model,
    /// The geoms, body by body. Planes, height fields and meshes in files that were not given are not
    /// among them.
    pub parts: Vec<Part>,
    /// The body that each joint carries, by the joint's name.
    pub joints: BTreeMap<String, BodyId>,
    /// Motors and servos.
    pub actuators: Vec<Actuator>,
    /// What holds bodies together beside their joints.
    ///
    /// The model does not hold them: close them by [`ModelDescription::close`](vertebra_assembly::ModelDescription::close).
    pub couplings: Vec<Coupling>,
    /// The step the file asks for \[s\].
    pub time_step: Option<f64>,
    /// Elements and attributes that have no effect, in the order of their lines.
    pub ignored: Vec<Ignored>,
}

/// Reads an MJCF file.
///
/// # Errors
/// [`FileError`], naming the file, line and element that is wrong and what to do.
pub fn read(path: impl AsRef<Path>, options: &Options) -> Result<Robot, FileError> {
    let path = path.as_ref();
    parse(&read_text(path)?, options).map_err(|error| error.in_file(path))
}

/// Reads MJCF text.
///
/// # Errors
/// [`FileError`], naming the line and element that is wrong and what to do.
pub fn parse(text: &str, options: &Options) -> Result<Robot, FileError> {
    let document = xml::document(text)?;
    let owners = &["mujoco", "body", "joint", "geom", "site", "mesh", "frame"];
    let mut reader = Reader::new(&document, owners);
    let sections = Sections::read(&mut reader, &document)?;
    body::assemble(reader, &sections, options)
}

/// The parts of a file, each of which may stand several times.
struct Sections<'n, 'a> {
    root: Node<'n, 'a>,
    compiler: compiler::Compiler,
    defaults: defaults::Defaults<'n, 'a>,
    assets: Vec<Node<'n, 'a>>,
    worlds: Vec<Node<'n, 'a>>,
    actuators: Vec<Node<'n, 'a>>,
    equalities: Vec<Node<'n, 'a>>,
    options: Vec<Node<'n, 'a>>,
}

impl<'n, 'a> Sections<'n, 'a> {
    fn read(reader: &mut Reader<'a>, document: &'n Document<'a>) -> Result<Self, FileError> {
        let root = document.root_element();
        if root.tag_name().name() != "mujoco" {
            let problem = Problem::WrongRoot {
                format: "MJCF",
                expected: "mujoco",
                found: root.tag_name().name().to_owned(),
            };
            return Err(FileError::new(reader.location(root), problem));
        }
        let (mut compilers, mut defaults) = (Vec::new(), Vec::new());
        let (mut assets, mut worlds, mut actuators) = (Vec::new(), Vec::new(), Vec::new());
        let (mut equalities, mut options) = (Vec::new(), Vec::new());
        for (tag, node) in reader.children(root)? {
            match tag {
                "compiler" => compilers.push(node),
                "default" => defaults.push(node),
                "asset" => assets.push(node),
                "worldbody" => worlds.push(node),
                "actuator" => actuators.push(node),
                "equality" => equalities.push(node),
                "option" => options.push(node),
                "include" => {
                    let problem = Problem::NotExpanded { program: "MuJoCo" };
                    return Err(FileError::new(reader.location(node), problem));
                }
                _ => reader.ignore(node),
            }
        }
        Ok(Self {
            root,
            compiler: compiler::Compiler::read(reader, &compilers)?,
            defaults: defaults::Defaults::read(reader, &defaults)?,
            assets,
            worlds,
            actuators,
            equalities,
            options,
        })
    }
}
