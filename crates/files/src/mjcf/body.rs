//! The tree of bodies.

use super::compiler::{FromGeoms, placed};
use super::content::{Content, Placed, gather};
use super::coupling::{self, Known, Site};
use super::defaults::Element;
use super::joint;
use super::mesh::{self, Mesh};
use super::{Options, Robot, Sections, actuator, geom, name_taken};
use crate::tree::Names;
use crate::{FileError, Part, Problem};
use glam::{DMat3, DVec3};
use std::collections::{BTreeMap, HashMap};
use vertebra_assembly::xml::{Node, Reader, XmlProblem};
use vertebra_assembly::{
    BodyId, Joint, JointKind, Location, MassProperties, Model, ModelDescription, ModelError,
};
use vertebra_spatial::Pose;

/// A body of the file.
pub(super) struct Entry {
    /// Its name in the model.
    pub(super) name: String,
    /// Its place in the world at q = 0.
    pub(super) place: Pose,
}

/// A named joint.
pub(super) struct Carrier {
    /// Name of the body in the model that it carries.
    pub(super) body: String,
    /// What the file calls its position at q = 0 [rad or m].
    pub(super) reference: f64,
}

/// What is gathered on the way through the tree.
struct Walk<'r, 'n, 'a> {
    sections: &'r Sections<'n, 'a>,
    meshes: HashMap<&'n str, Mesh>,
    description: ModelDescription,
    names: Names,
    /// Bodies of the file, by their name there.
    entries: HashMap<&'n str, Entry>,
    joints: HashMap<&'n str, Carrier>,
    /// Named places, in the order of the file, and what they are called in the model.
    sites: Vec<(&'n str, String, Site)>,
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

/// Reads the bodies and all that refers to them; what is ignored stays with the reader.
pub(super) fn assemble<'n, 'a>(
    reader: &mut Reader<'a>,
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
        meshes: mesh::read(reader, sections, options)?,
        description,
        names: Names::default(),
        entries: HashMap::new(),
        joints: HashMap::new(),
        sites: Vec::new(),
        parts: Vec::new(),
        lines: HashMap::new(),
        count: 0,
    };
    walk.take_names(reader)?;
    walk.walk(reader)?;
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
                let carrier = Carrier {
                    body: carried.clone(),
                    reference: read.reference,
                };
                if self.joints.insert(joint, carrier).is_some() {
                    return Err(name_taken(reader, element.node, &["joint", "freejoint"]));
                }
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
            let place = Site {
                body: body.map(str::to_owned),
                placement: site.offset * own,
            };
            // Sites may be called as bodies are; frames may not.
            let frame = self.names.fresh(name.to_owned());
            self.sites.push((name, frame, place));
        }
        Ok(())
    }

    /// Builds the model and resolves what refers to it.
    fn finish(
        mut self,
        reader: &mut Reader<'a>,
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
        for (_, frame, site) in &self.sites {
            description = description.frame(frame, site.body.as_deref(), site.placement);
        }
        let known = Known {
            bodies: &self.entries,
            joints: &self.joints,
            sites: (self.sites.iter())
                .map(|(name, _, site)| (*name, site))
                .collect(),
        };
        let (description, mut loops) = coupling::read(reader, self.sections, &known, description)?;
        let model = match description.build() {
            Ok(model) => model,
            Err(error) => {
                let of_loop = matches!(
                    error,
                    ModelError::SelfLoop { .. } | ModelError::CoupledFreedoms { .. }
                );
                let lines = if of_loop { &mut loops } else { &mut self.lines };
                let place = error.culprit().and_then(|name| lines.remove(name));
                let place = place.unwrap_or_else(|| reader.location(root));
                return Err(FileError::new(place, Problem::Model(error)));
            }
        };
        let joints: BTreeMap<String, BodyId> = (self.joints.iter())
            .filter_map(|(joint, carrier)| Some(((*joint).to_owned(), model.find(&carrier.body)?)))
            .collect();
        let actuators = actuator::read(reader, self.sections, &self.joints, &model)?;
        Ok(Robot {
            parts: parts(self.parts, &model),
            joints,
            actuators,
            time_step,
            ignored: Vec::new(),
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
