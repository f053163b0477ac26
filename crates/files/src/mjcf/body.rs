//! The tree of bodies.

use super::compiler::{FromGeoms, placed};
use super::defaults::Element;
use super::joint;
use super::mesh::{self, Mesh};
use super::{Options, Robot, Sections, actuator, coupling, geom};
use crate::tree::Names;
use crate::{FileError, Part, Problem};
use glam::{DMat3, DVec3};
use std::collections::{BTreeMap, HashMap};
use vertebra_assembly::xml::{Node, Reader, XmlProblem};
use vertebra_assembly::{
    BodyId, Joint, JointKind, Location, MassProperties, Model, ModelDescription, ModelError,
};
use vertebra_spatial::Pose;

/// An element, the `<frame>`s between it and its body, and the class in force around it.
#[derive(Clone, Copy)]
pub(super) struct Placed<'n, 'a> {
    pub(super) node: Node<'n, 'a>,
    pub(super) offset: Pose,
    pub(super) class: Option<&'n str>,
}

/// What stands in a body.
#[derive(Default)]
struct Content<'n, 'a> {
    inertial: Option<Placed<'n, 'a>>,
    joints: Vec<Placed<'n, 'a>>,
    geoms: Vec<Placed<'n, 'a>>,
    sites: Vec<Placed<'n, 'a>>,
    bodies: Vec<Placed<'n, 'a>>,
}

/// A body of the file.
pub(super) struct Entry {
    /// Its name in the model.
    pub(super) name: String,
    /// Its place in the world at q = 0.
    pub(super) place: Pose,
}

/// What is gathered on the way through the tree.
struct Walk<'r, 'n, 'a> {
    sections: &'r Sections<'n, 'a>,
    meshes: HashMap<&'n str, Mesh>,
    description: ModelDescription,
    names: Names,
    /// Bodies of the file, by their name there.
    entries: HashMap<&'n str, Entry>,
    /// The body in the model that each named joint carries.
    joints: Vec<(&'n str, String)>,
    sites: Vec<(String, Option<String>, Pose)>,
    parts: Vec<(Option<String>, Part)>,
    /// Where the bodies of the model stand in the file.
    lines: HashMap<String, Location>,
    count: usize,
}

/// A body still to be read.
struct Task<'n, 'a> {
    body: Placed<'n, 'a>,
    parent: Option<String>,
    parent_place: Pose,
}

/// Reads the bodies and all that refers to them.
pub(super) fn assemble<'n, 'a>(
    mut reader: Reader<'a>,
    sections: &Sections<'n, 'a>,
    options: &Options,
) -> Result<Robot, FileError> {
    let root = sections.root;
    let name = reader
        .optional_text(root, "model")?
        .unwrap_or("MuJoCo model");
    reader.ignore_attributes_but(root, &["model"]);
    let mut description = ModelDescription::new(name);
    let mut time_step = None;
    for &option in &sections.options {
        reader.ignore_attributes_but(option, &["gravity", "timestep"]);
        for (_, child) in reader.children(option)? {
            reader.ignore(child);
        }
        if let Some(gravity) = reader.optional_vector(option, "gravity")? {
            description.gravity = gravity;
        }
        time_step = reader.optional_number(option, "timestep")?.or(time_step);
    }
    let mut walk = Walk {
        sections,
        meshes: mesh::read(&mut reader, sections, options)?,
        description,
        names: Names::default(),
        entries: HashMap::new(),
        joints: Vec::new(),
        sites: Vec::new(),
        parts: Vec::new(),
        lines: HashMap::new(),
        count: 0,
    };
    walk.take_names(&reader)?;
    walk.walk(&mut reader)?;
    walk.finish(reader, time_step)
}

impl<'n, 'a> Walk<'_, 'n, 'a> {
    /// Takes the names that the file gives, so that made-up ones keep clear of them.
    fn take_names(&mut self, reader: &Reader<'a>) -> Result<(), FileError> {
        let mut first_lines: HashMap<&str, u32> = HashMap::new();
        let worlds = self.sections.worlds.iter();
        for body in worlds.flat_map(Node::descendants) {
            if body.tag_name().name() != "body" {
                continue;
            }
            let Some(name) = reader
                .optional_text(body, "name")?
                .filter(|name| !name.is_empty())
            else {
                continue;
            };
            if let Some(first_line) = first_lines.insert(name, reader.line(body)) {
                let problem = Problem::DuplicateName { first_line };
                return Err(FileError::new(reader.location(body), problem));
            }
            self.names.take(name);
        }
        Ok(())
    }

    /// Depth first, in the order of the file; the stack is our own, as files may be deep.
    fn walk(&mut self, reader: &mut Reader<'a>) -> Result<(), FileError> {
        let mut stack = Vec::new();
        for &world in self.sections.worlds.iter().rev() {
            let content = gather(reader, self.sections, world, None)?;
            let misplaced = content.inertial.iter().chain(&content.joints).next();
            if let Some(element) = misplaced {
                let problem = Problem::Misplaced { place: "a <body>" };
                return Err(FileError::new(reader.location(element.node), problem));
            }
            self.shapes(reader, &content, None)?;
            self.sites(reader, &content, None)?;
            stack.extend(content.bodies.iter().rev().map(|&body| Task {
                body,
                parent: None,
                parent_place: Pose::IDENTITY,
            }));
        }
        while let Some(task) = stack.pop() {
            self.body(reader, &task, &mut stack)?;
        }
        Ok(())
    }

    fn body(
        &mut self,
        reader: &mut Reader<'a>,
        task: &Task<'n, 'a>,
        stack: &mut Vec<Task<'n, 'a>>,
    ) -> Result<(), FileError> {
        let node = task.body.node;
        let mut known = placed(["childclass"]);
        known.retain(|&attribute| attribute != "class");
        reader.ignore_attributes_but(node, &known);
        self.count += 1;
        let stated = reader
            .optional_text(node, "name")?
            .filter(|name| !name.is_empty());
        let name = match stated {
            Some(name) => name.to_owned(),
            None => self.names.fresh(format!("body_{}", self.count)),
        };
        let class = reader
            .optional_text(node, "childclass")?
            .or(task.body.class);
        let own = self
            .sections
            .compiler
            .placement(reader, Element::plain(node))?;
        let pose = task.body.offset * own;
        let place = task.parent_place * pose;
        let content = gather(reader, self.sections, node, class)?;
        let weights = self.shapes(reader, &content, Some(&name))?;
        let mass = self.mass(reader, &content, weights)?;
        self.joints(reader, &content, task, (&name, pose), mass)?;
        self.sites(reader, &content, Some(&name))?;
        if let Some(stated) = stated {
            let entry = Entry {
                name: name.clone(),
                place,
            };
            self.entries.insert(stated, entry);
        }
        stack.extend(content.bodies.iter().rev().map(|&body| Task {
            body,
            parent: Some(name.clone()),
            parent_place: place,
        }));
        Ok(())
    }

    /// Adds the body, and a massless one for every joint but the last.
    fn joints(
        &mut self,
        reader: &mut Reader<'a>,
        content: &Content<'n, 'a>,
        task: &Task<'n, 'a>,
        (name, pose): (&str, Pose),
        mass: MassProperties,
    ) -> Result<(), FileError> {
        let node = task.body.node;
        let mut parent = task.parent.clone();
        let mut pose = pose;
        if content.joints.is_empty() {
            self.push(
                reader,
                node,
                (name.to_owned(), parent),
                Joint::fixed().at(pose),
                mass,
            );
            return Ok(());
        }
        let last = content.joints.len() - 1;
        for (index, element) in content.joints.iter().enumerate() {
            let read = joint::read(reader, self.sections, element)?;
            if read.joint.kind == JointKind::Free && (task.parent.is_some() || last > 0) {
                let place = "a body of the world, without other joints";
                let problem = Problem::Misplaced { place };
                return Err(FileError::new(reader.location(element.node), problem));
            }
            let (carried, mass) = match index == last {
                true => (name.to_owned(), mass),
                false => {
                    let between = self.names.fresh(format!("{name}.{}", index + 1));
                    (between, MassProperties::MASSLESS)
                }
            };
            if let Some(joint) = read.name {
                if self.joints.iter().any(|(other, _)| *other == joint) {
                    return Err(reader.error(element.node, XmlProblem::Repeated).into());
                }
                self.joints.push((joint, carried.clone()));
            }
            let joint = joint::placed(&read, pose);
            self.push(reader, element.node, (carried.clone(), parent), joint, mass);
            parent = Some(carried);
            pose = Pose::IDENTITY;
        }
        Ok(())
    }

    fn push(
        &mut self,
        reader: &Reader<'a>,
        node: Node<'n, 'a>,
        (name, parent): (String, Option<String>),
        joint: Joint,
        mass: MassProperties,
    ) {
        self.lines.insert(name.clone(), reader.location(node));
        let description = core::mem::replace(&mut self.description, ModelDescription::new(""));
        self.description = description.body(name, parent.as_deref(), joint, mass);
    }

    /// Keeps the shapes of a body and gives their masses.
    fn shapes(
        &mut self,
        reader: &mut Reader<'a>,
        content: &Content<'n, 'a>,
        body: Option<&str>,
    ) -> Result<Vec<Result<MassProperties, FileError>>, FileError> {
        let mut masses = Vec::with_capacity(content.geoms.len());
        for placed in &content.geoms {
            let geom = geom::read(reader, self.sections, &self.meshes, placed)?;
            let location = reader.location(placed.node);
            masses.push(
                geom.mass
                    .map_err(|problem| FileError::new(location, problem)),
            );
            if let Some(shape) = geom.shape {
                let part = Part {
                    body: None,
                    placement: geom.placement,
                    shape,
                };
                self.parts.push((body.map(str::to_owned), part));
            }
        }
        Ok(masses)
    }

    /// The mass a body states, or that of its geoms.
    fn mass(
        &self,
        reader: &mut Reader<'a>,
        content: &Content<'n, 'a>,
        weights: Vec<Result<MassProperties, FileError>>,
    ) -> Result<MassProperties, FileError> {
        let stated = content
            .inertial
            .as_ref()
            .map(|placed| self.inertial(reader, placed));
        let stated = stated.transpose()?;
        match (self.sections.compiler.from_geoms, stated) {
            (FromGeoms::Never | FromGeoms::WhereNotStated, Some(stated)) => Ok(stated),
            (FromGeoms::Never, None) => Ok(MassProperties::MASSLESS),
            (FromGeoms::Always | FromGeoms::WhereNotStated, _) => {
                weights
                    .into_iter()
                    .try_fold(MassProperties::MASSLESS, |sum, weight| {
                        let weight = weight?;
                        Ok(match sum == MassProperties::MASSLESS {
                            true => weight,
                            false => sum.combined(&weight),
                        })
                    })
            }
        }
    }

    fn inertial(
        &self,
        reader: &mut Reader<'a>,
        element: &Placed<'n, 'a>,
    ) -> Result<MassProperties, FileError> {
        let node = element.node;
        reader.ignore_attributes_but(node, &placed(["mass", "diaginertia", "fullinertia"]));
        let own = self
            .sections
            .compiler
            .placement(reader, Element::plain(node))?;
        let mass = reader.number(node, "mass")?;
        let diagonal = reader.optional_vector(node, "diaginertia")?;
        let full = reader.optional_numbers::<6>(node, "fullinertia")?;
        let inertia = match (diagonal, full) {
            (Some(_), Some(_)) => {
                let problem = Problem::Contradiction {
                    first: "`diaginertia`",
                    second: "`fullinertia`",
                };
                return Err(FileError::new(reader.location(node), problem));
            }
            (Some(moments), None) => DMat3::from_diagonal(moments),
            (None, Some([xx, yy, zz, xy, xz, yz])) => DMat3::from_cols(
                DVec3::new(xx, xy, xz),
                DVec3::new(xy, yy, yz),
                DVec3::new(xz, yz, zz),
            ),
            (None, None) => {
                let attribute = "diaginertia";
                return Err(reader
                    .error(node, XmlProblem::MissingAttribute { attribute })
                    .into());
            }
        };
        let about_center = MassProperties {
            mass,
            center: DVec3::ZERO,
            inertia,
        };
        Ok(about_center.placed(&(element.offset * own)))
    }

    fn sites(
        &mut self,
        reader: &mut Reader<'a>,
        content: &Content<'n, 'a>,
        body: Option<&str>,
    ) -> Result<(), FileError> {
        for site in &content.sites {
            reader.ignore_attributes_but(site.node, &placed([]));
            let Some(name) = reader
                .optional_text(site.node, "name")?
                .filter(|name| !name.is_empty())
            else {
                reader.ignore(site.node);
                continue;
            };
            let element = self
                .sections
                .defaults
                .element(reader, site.node, site.class)?;
            let own = self.sections.compiler.placement(reader, element)?;
            // Sites may be called as bodies are; frames may not.
            let name = self.names.fresh(name.to_owned());
            self.sites
                .push((name, body.map(str::to_owned), site.offset * own));
        }
        Ok(())
    }

    /// Builds the model and resolves what refers to it.
    fn finish(
        mut self,
        mut reader: Reader<'a>,
        time_step: Option<f64>,
    ) -> Result<Robot, FileError> {
        let mut description = self.description;
        let root = self.sections.root;
        let moves = |joint: &Joint| joint.kind.dof_count() > 0;
        if !description.bodies.iter().any(|body| moves(&body.joint)) {
            let problem =
                Problem::Empty("has no joint, so that nothing moves; add a body with one");
            return Err(FileError::new(reader.location(root), problem));
        }
        for (name, body, placement) in self.sites {
            description = description.frame(name, body.as_deref(), placement);
        }
        let equalities = coupling::read(
            &mut reader,
            self.sections,
            &self.entries,
            &self.joints,
            &mut description,
        )?;
        let locate = |error: ModelError| {
            let place = error.culprit().and_then(|name| self.lines.remove(name));
            let place = place.unwrap_or_else(|| reader.location(root));
            FileError::new(place, Problem::Model(error))
        };
        let model = description.build().map_err(locate)?;
        let joints: BTreeMap<String, BodyId> = (self.joints.iter())
            .filter_map(|(joint, body)| Some(((*joint).to_owned(), model.find(body)?)))
            .collect();
        let actuators = actuator::read(&mut reader, self.sections, &joints)?;
        let mut ignored = reader.into_ignored();
        ignored.sort_by_key(|element| element.line);
        Ok(Robot {
            parts: parts(self.parts, &model),
            couplings: coupling::resolve(&equalities, &model),
            joints,
            actuators,
            time_step,
            ignored,
            model,
        })
    }
}

fn parts(parts: Vec<(Option<String>, Part)>, model: &Model) -> Vec<Part> {
    let on_body = |(body, part): (Option<String>, Part)| Part {
        body: body.and_then(|name| model.find(&name)),
        ..part
    };
    parts.into_iter().map(on_body).collect()
}

/// Sorts what stands in a body, `<frame>`s opened, in the order of the file.
fn gather<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    body: Node<'n, 'a>,
    class: Option<&'n str>,
) -> Result<Content<'n, 'a>, FileError> {
    let mut content = Content::default();
    let mut stack = vec![Placed {
        node: body,
        offset: Pose::IDENTITY,
        class,
    }];
    let mut is_body = true;
    while let Some(placed) = stack.pop() {
        let tag = placed.node.tag_name().name();
        match tag {
            _ if core::mem::take(&mut is_body) => open(reader, &placed, &mut stack)?,
            "frame" => {
                let mut known = super::compiler::placed(["childclass"]);
                known.retain(|&attribute| attribute != "class");
                reader.ignore_attributes_but(placed.node, &known);
                let element = Element::plain(placed.node);
                let frame = Placed {
                    offset: placed.offset * sections.compiler.placement(reader, element)?,
                    class: reader
                        .optional_text(placed.node, "childclass")?
                        .or(placed.class),
                    ..placed
                };
                open(reader, &frame, &mut stack)?;
            }
            "inertial" => {
                if content.inertial.replace(placed).is_some() {
                    return Err(reader.error(placed.node, XmlProblem::Repeated).into());
                }
            }
            "joint" | "freejoint" => content.joints.push(placed),
            "geom" => content.geoms.push(placed),
            "site" => content.sites.push(placed),
            "body" => content.bodies.push(placed),
            "include" | "replicate" | "attach" | "composite" | "flexcomp" => {
                let problem = Problem::NotExpanded { program: "MuJoCo" };
                return Err(FileError::new(reader.location(placed.node), problem));
            }
            _ => reader.ignore(placed.node),
        }
    }
    Ok(content)
}

fn open<'n, 'a>(
    reader: &mut Reader<'a>,
    owner: &Placed<'n, 'a>,
    stack: &mut Vec<Placed<'n, 'a>>,
) -> Result<(), FileError> {
    let children = reader.children(owner.node)?;
    stack.extend(
        children
            .into_iter()
            .rev()
            .map(|(_, node)| Placed { node, ..*owner }),
    );
    Ok(())
}
