//! SDFormat: the models of Gazebo and its kin.
//!
//! [`read`] and [`parse`] give an [`Import`]: every model of the file, or of its world, in one
//! [`Model`], with its links' shapes and a list of everything that has no effect. The first joint that carries
//! a link is one of the tree; further ones close loops of the model, and what `<mimic>`s state is coupled. A body bears the name of its link; with several models in the file, `model::link`. A link
//! that no joint carries moves freely; a `static` model becomes [`Frame`](vertebra_assembly::Frame)s
//! of the world.
//! Versions from 1.2 on are read; before 1.5 axes are in the model's frame. Poses are resolved as SDFormat 1.7 and later have it: `relative_to`, `<frame>`s with `attached_to`,
//! joints at the child link where they state nothing, axes `expressed_in` any frame (in the
//! model's by `use_parent_model_frame` of 1.5 and 1.6), models placed by their
//! `placement_frame`. A link without `<inertial>` weighs 1 kg, and in a world that states no gravity it is 9.8 m/s^2, as
//! SDFormat says.
//!
//! ```
//! use vertebra_files::sdf;
//!
//! let import = sdf::parse(
//!     r#"<sdf version="1.9">
//!          <model name="door">
//!            <link name="leaf"><pose>0.5 0 1 0 0 0</pose></link>
//!            <joint name="hinge" type="revolute">
//!              <parent>world</parent><child>leaf</child>
//!              <pose>-0.5 0 0 0 0 0</pose>
//!              <axis><xyz>0 0 1</xyz></axis>
//!            </joint>
//!          </model>
//!        </sdf>"#,
//! )?;
//! assert_eq!(import.model.dof_count(), 1);
//! # Ok::<(), vertebra_files::FileError>(())
//! ```

mod build;
mod frames;
mod joint;
mod link;
mod model;
mod values;

use crate::{FileError, Part, Problem, read_text};
use std::collections::BTreeMap;
use std::path::Path;
use vertebra_assembly::xml::{self, Node, Reader};
use vertebra_assembly::{BodyId, Ignored, Model};

/// What an SDF file says.
#[derive(Clone, Debug)]
pub struct Import {
    /// Bodies, joints and frames.
    pub model: Model,
    /// Shapes of the links: those that collide, or those that are seen where none collides. Planes
    /// and meshes in files of their own are not among them.
    pub parts: Vec<Part>,
    /// The body that each joint carries, by the joint's name.
    pub joints: BTreeMap<String, BodyId>,
    /// Elements that have no effect, in the order of their lines.
    pub ignored: Vec<Ignored>,
}

/// That of a world which states none [m/s^2].
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.8];

/// The earliest version that is read.
const EARLIEST: [u32; 2] = [1, 2];

/// The latest that is known.
const LATEST: [u32; 2] = [1, 12];

/// Reads an SDF file.
///
/// # Errors
/// [`FileError`], naming the file, line and element that is wrong and what to do.
pub fn read(path: impl AsRef<Path>) -> Result<Import, FileError> {
    let path = path.as_ref();
    parse(&read_text(path)?).map_err(|error| error.in_file(path))
}

/// Reads SDF text.
///
/// # Errors
/// [`FileError`], naming the line and element that is wrong and what to do.
pub fn parse(text: &str) -> Result<Import, FileError> {
    let document = xml::document(text)?;
    let owners = &["sdf", "world", "model", "link", "joint", "frame"];
    let mut reader = Reader::new(&document, owners);
    let root = document.root_element();
    if root.tag_name().name() != "sdf" {
        let problem = Problem::WrongRoot {
            format: "SDF",
            expected: "sdf",
            found: root.tag_name().name().to_owned(),
        };
        return Err(FileError::new(reader.location(root), problem));
    }
    let import = read_root(&mut reader, root);
    let mut import = import.map_err(|error| error.after_slip(&reader, root))?;
    import.ignored = reader.into_ignored();
    import.ignored.sort_by_key(|element| element.line);
    Ok(import)
}

/// Reads the models of the root element; what is ignored stays with the reader.
fn read_root<'n, 'a>(reader: &mut Reader<'a>, root: Node<'n, 'a>) -> Result<Import, FileError> {
    check_version(reader, root)?;
    let mut models = Vec::new();
    let mut gravity = None;
    let mut open = vec![root];
    while let Some(node) = open.pop() {
        for (tag, child) in reader.children(node)? {
            match tag {
                "world" if node == root => {
                    gravity = gravity.or(Some(GRAVITY));
                    open.push(child);
                }
                "model" => models.push(child),
                "gravity" if node != root => {
                    gravity = Some(values::numbers::<3>(reader, child, "gravity")?);
                }
                "include" => {
                    let problem = Problem::NotExpanded {
                        program: "gz sdf -p",
                    };
                    return Err(FileError::new(reader.location(child), problem));
                }
                _ => reader.ignore(child),
            }
        }
    }
    build::build(reader, root, &models, gravity.map(Into::into))
}

/// Refuses what is older than what is read, and lists what is newer than what is known.
fn check_version<'a>(reader: &mut Reader<'a>, root: Node<'_, 'a>) -> Result<(), FileError> {
    reader.ignore_attributes_but(root, &["version"]);
    let stated = reader.text(root, "version")?;
    let refused = |supported| {
        let problem = Problem::UnknownValue {
            attribute: "version",
            found: stated.to_owned(),
            supported,
        };
        FileError::new(reader.location(root), problem)
    };
    match version(stated) {
        None => Err(refused("a version such as 1.9")),
        Some(version) if version < EARLIEST => {
            Err(refused("1.2 or later; `gz sdf -p` converts older files"))
        }
        Some(version) => {
            if version > LATEST {
                let why = "it is later than 1.12, and what came after that is not known";
                reader.ignore_attribute_because(root, "version", why);
            }
            Ok(())
        }
    }
}

/// The numbers of a version.
fn version(stated: &str) -> Option<[u32; 2]> {
    let number = |text: &str| {
        let is_number = text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<u32>().ok().filter(|_| is_number)
    };
    let (major, minor) = stated.split_once('.')?;
    Some([number(major)?, number(minor)?])
}

/// Whether the axes of an element's document are in their model's frame, as before version 1.5.
fn has_axes_of_models(axis: Node<'_, '_>) -> bool {
    stated_version(axis).is_some_and(|version| version < [1, 5])
}

/// Whether axes say by `use_parent_model_frame` if they are in their model's frame, as in versions 1.5 and 1.6.
fn has_flags_of_axes(axis: Node<'_, '_>) -> bool {
    stated_version(axis).is_some_and(|version| ([1, 5]..[1, 7]).contains(&version))
}

fn stated_version(node: Node<'_, '_>) -> Option<[u32; 2]> {
    version(node.document().root_element().attribute("version")?)
}
