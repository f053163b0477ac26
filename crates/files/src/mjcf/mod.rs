//! MJCF: MuJoCo's robots and scenes.
//!
//! [`read`] and [`parse`] give a [`Robot`]: the [`Model`] with its loops closed, shapes, actuators, and a list of
//! everything in the file that has no effect. A body keeps its name; one without is called `body_N` by
//! its place in the file. Of several joints in one body all but the last carry massless bodies, called
//! as the body with `.1`, `.2` behind, and a body without a joint is fixed. Sites become
//! [`Frame`](vertebra_assembly::Frame)s. Default classes, the `compiler` element, every way to state an
//! orientation, and inertia from geoms are understood as MuJoCo's documentation of MJCF states them.
//!
//! What `<equality>` connects, welds and couples are loops and couplings of the model, which simulations keep
//! exactly; MuJoCo keeps them softly, by `solref` and `solimp`, which are listed.
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
//! assert_eq!(robot.actuators[0].motor(3.0).force, 6.0);
//! assert!(robot.ignored.is_empty());
//! # Ok::<(), vertebra_files::FileError>(())
//! ```

mod actuator;
mod body;
mod compiler;
mod content;
mod coupling;
mod defaults;
mod geom;
mod joint;
mod mesh;

pub use actuator::Actuator;

use crate::{FileError, Part, Problem, TriangleSoup, read_text};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;
use vertebra_assembly::xml::{self, Document, Node, Reader};
use vertebra_assembly::{BodyId, Ignored, Model, ModelError};
use vertebra_dynamics::Motor;

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
    /// Motors and servos, in the order of the file.
    pub actuators: Vec<Actuator>,
    /// The step the file asks for \[s\].
    pub time_step: Option<f64>,
    /// Elements and attributes that have no effect, in the order of their lines.
    pub ignored: Vec<Ignored>,
}

impl Robot {
    /// The motors that the actuators are under these controls, one for each joint that is driven.
    ///
    /// ```
    /// use vertebra_dynamics::Simulation;
    /// use vertebra_files::mjcf::{self, Options};
    ///
    /// let robot = mjcf::parse(
    ///     r#"<mujoco><worldbody>
    ///          <body name="arm"><joint name="hinge" axis="0 1 0" armature="0.1"/><geom size="0.1"/></body>
    ///        </worldbody>
    ///        <actuator><position joint="hinge" kp="20" kv="2"/></actuator></mujoco>"#,
    ///     &Options::default(),
    /// )?;
    /// let mut simulation = Simulation::new(robot.model.clone())?;
    /// for (body, motor) in robot.motors(&[0.5])? {
    ///     simulation.set_motor(body, motor)?;
    /// }
    /// for _ in 0..5000 {
    ///     simulation.step(1e-3)?;
    /// }
    /// assert!((simulation.state()?.q[0] - 0.5).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ModelError::WrongLength`] unless there is one control for each actuator.
    pub fn motors(&self, controls: &[f64]) -> Result<Vec<(BodyId, Motor)>, ModelError> {
        if controls.len() != self.actuators.len() {
            return Err(ModelError::WrongLength {
                quantity: "the list of controls",
                expected: self.actuators.len(),
                found: controls.len(),
            });
        }
        let mut motors: Vec<(BodyId, Motor)> = Vec::with_capacity(controls.len());
        for (actuator, &control) in self.actuators.iter().zip(controls) {
            let own = actuator.motor(control);
            match motors.iter_mut().find(|(body, _)| *body == actuator.body) {
                // Those that share a joint have no bounds, and aim at position and rate zero.
                Some((_, motor)) => {
                    motor.force += own.force;
                    motor.stiffness += own.stiffness;
                    motor.damping += own.damping;
                }
                None => motors.push((actuator.body, own)),
            }
        }
        Ok(motors)
    }
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
    let sections = Sections::read(&mut reader, &document);
    let robot = sections.and_then(|sections| body::assemble(&mut reader, &sections, options));
    let mut robot = robot.map_err(|error| error.after_slip(&reader, document.root_element()))?;
    robot.ignored = reader.into_ignored();
    robot.ignored.sort_by_key(|element| element.line);
    Ok(robot)
}

/// Sections that are read.
const SECTIONS: [&str; 7] = [
    "compiler",
    "default",
    "asset",
    "worldbody",
    "actuator",
    "equality",
    "option",
];

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
                "contact" | "sensor" | "keyframe" | "visual" | "statistic" | "tendon" | "size"
                | "custom" | "extension" | "deformable" => reader.ignore(node),
                _ => reader.ignore_unknown(node, &SECTIONS),
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

/// That an element before this one, of these tags and in such a section too, has its name.
fn name_taken(reader: &Reader<'_>, node: Node<'_, '_>, tags: &[&str]) -> FileError {
    let root = node.document().root_element();
    let section = |node: Node<'_, '_>| {
        let sections = node.ancestors();
        sections
            .take_while(|&ancestor| ancestor != root)
            .last()
            .map(|section| section.tag_name().name().to_owned())
    };
    let is_first = |other: &Node<'_, '_>| {
        tags.contains(&other.tag_name().name())
            && other.attribute("name") == node.attribute("name")
            && section(*other) == section(node)
    };
    // What is named by its file has no name to compare.
    let first = root.descendants().find(is_first).unwrap_or(node);
    let problem = Problem::DuplicateName {
        first_line: reader.line(first),
    };
    FileError::new(reader.location(node), problem)
}
