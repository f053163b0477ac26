//! The import itself: text to [`Robot`].

use super::fold::File;
use super::joint::Joint;
use super::link::Link;
use super::mesh_path::MeshFinder;
use super::tree::Tree;
use super::{Geometry, Mesh, Options, Problem, UrdfError};
use crate::xml::{self, Reader};
use crate::{BodyId, Ignored, InertiaViolation, Location, Model};
use core::fmt;
use roxmltree::{Document, Node};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a URDF file says.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Bodies, joints and frames. Every link is a body or a frame of its name.
    pub model: Model,
    /// Shapes of the links, link by link in the order of the file.
    pub geometry: Vec<Geometry>,
    /// The body that each joint carries, by the joint's name; joints folded away are not in it.
    pub joints: BTreeMap<String, BodyId>,
    /// Elements of the file that have no effect, in the order of their lines.
    pub ignored: Vec<Ignored>,
    /// Links that no distribution of mass can be, accepted as parts of bodies that are possible
    /// (or of the world).
    pub doubtful: Vec<DoubtfulInertia>,
    meshes: MeshFinder,
    file: Option<PathBuf>,
}

/// A link whose own inertia is impossible.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DoubtfulInertia {
    /// Name of the link.
    pub link: String,
    /// What it violates.
    pub violation: InertiaViolation,
    /// Line of the link, from 1.
    pub line: u32,
}

impl fmt::Display for DoubtfulInertia {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            link,
            violation,
            line,
        } = self;
        write!(
            f,
            "line {line}: the inertia of link `{link}` is impossible: {violation}"
        )
    }
}

impl Robot {
    /// The path of a mesh file, which exists.
    ///
    /// `package://name/rest` is looked for as `name/rest` in every search path, then in the URDF
    /// file's folder and those above it; where such a folder is itself called `name`, as `rest` in
    /// it. A plain path starts from the URDF file's folder or a search path.
    ///
    /// # Errors
    /// [`Problem::MeshNotFound`] with every path tried, or [`Problem::MeshAddress`].
    pub fn mesh_path(&self, mesh: &Mesh) -> Result<PathBuf, UrdfError> {
        self.meshes.find(&mesh.file).map_err(|problem| UrdfError {
            location: Location {
                file: self.file.clone(),
                line: Some(mesh.line),
                element: format!("<mesh> of link `{}`", mesh.link),
            },
            problem,
        })
    }
}

/// Reads a URDF file.
///
/// # Errors
/// [`UrdfError`], naming the file, line and element that is wrong and what to do.
pub fn read(path: impl AsRef<Path>, options: &Options) -> Result<Robot, UrdfError> {
    let path = path.as_ref();
    let text = std::fs::read_to_string(path).map_err(|error| UrdfError {
        location: Location {
            file: Some(path.to_owned()),
            line: None,
            element: "the file".to_owned(),
        },
        problem: Problem::Unreadable(error),
    })?;
    let mut robot = parse(&text, options).map_err(|error| error.in_file(path))?;
    // A file just read has an absolute path; if not, its relative one serves all the same.
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    robot.meshes.folder = absolute.parent().map(Path::to_owned);
    robot.file = Some(path.to_owned());
    Ok(robot)
}

/// Reads URDF text. Meshes are looked for in the search paths only.
///
/// # Errors
/// [`UrdfError`], naming the line and element that is wrong and what to do.
pub fn parse(text: &str, options: &Options) -> Result<Robot, UrdfError> {
    let document = xml::document(text)?;
    let mut reader = Reader::new(&document, &["link", "joint", "robot"]);
    let file = read_elements(&mut reader, &document)?;

    let mut ignored = reader.into_ignored();
    let places = file.places(options);
    let description = file.describe(&places, options, &mut ignored)?;
    let model = description.build().map_err(|error| file.locate(error))?;
    ignored.sort_by_key(|element| element.line);

    let body_of = |link: usize| model.find(file.links[link].name);
    let mut geometry = Vec::new();
    for (link, place) in file.links.iter().zip(&places) {
        geometry.extend(link.parts.iter().map(|part| Geometry {
            link: link.name.to_owned(),
            body: place.body.and_then(body_of),
            placement: place.placement * part.placement,
            role: part.role,
            shape: part.shape.clone(),
        }));
    }
    let joints = (file.joints.iter().zip(&file.tree.children))
        .filter_map(|(joint, &child)| Some((joint.name.to_owned(), body_of(child)?)))
        .collect();
    Ok(Robot {
        geometry,
        joints,
        ignored,
        doubtful: doubtful(&file.links),
        meshes: MeshFinder {
            folder: None,
            search_paths: options.search_paths.clone(),
        },
        file: None,
        model,
    })
}

fn doubtful(links: &[Link<'_>]) -> Vec<DoubtfulInertia> {
    let doubt = |link: &Link<'_>| {
        link.violation.map(|violation| DoubtfulInertia {
            link: link.name.to_owned(),
            violation,
            line: link.line,
        })
    };
    links.iter().filter_map(doubt).collect()
}

fn read_elements<'n>(
    reader: &mut Reader<'n>,
    document: &'n Document<'n>,
) -> Result<File<'n>, UrdfError> {
    let root = document.root_element();
    check_root(reader, root)?;
    let name = reader.text(root, "name")?;
    let mut links = Vec::new();
    let mut joints = Vec::new();
    for (tag, node) in reader.children(root)? {
        match tag {
            "link" => links.push(Link::read(reader, node)?),
            "joint" => joints.push(Joint::read(reader, node)?),
            _ => reader.ignore_unknown(node, &["link", "joint"]),
        }
    }
    if links.is_empty() {
        return Err(UrdfError::at(reader.location(root), Problem::NoLinks));
    }
    let robot = Location {
        file: None,
        line: Some(reader.line(root)),
        element: format!("robot `{name}`"),
    };
    let tree = Tree::new(&robot, &links, &joints)?;
    Ok(File {
        robot,
        name,
        links,
        joints,
        tree,
    })
}

fn check_root(reader: &Reader<'_>, root: Node<'_, '_>) -> Result<(), UrdfError> {
    let looks_like = match root.tag_name().name() {
        "robot" => return Ok(()),
        "sdf" | "gazebo" => Some("SDF"),
        "mujoco" | "mujocoinclude" => Some("MuJoCo's MJCF"),
        "COLLADA" => Some("a COLLADA mesh"),
        "launch" => Some("a ROS launch file"),
        "package" => Some("a ROS package manifest"),
        _ => None,
    };
    let problem = Problem::NotRobot { looks_like };
    Err(UrdfError::at(reader.location(root), problem))
}
