//! From links and joints to bodies: fixed joints are folded away or kept.

use super::joint::{Joint, Kind};
use super::link::Link;
use super::tree::{self, Tree};
use super::{Ignored, Location, Options, Problem, UrdfError};
use crate::{self as assembly, MassProperties, ModelDescription, ModelError};
use std::collections::HashMap;
use vertebra_spatial::Pose;

/// Where a link went.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// The link whose body it belongs to; none for the world.
    pub(super) body: Option<usize>,
    /// Where its frame is in that body's frame, or in the world.
    pub(super) placement: Pose,
}

/// The parts of a file, and the tree they make.
pub(super) struct File<'n> {
    pub(super) robot: Location,
    pub(super) name: &'n str,
    pub(super) links: Vec<Link<'n>>,
    pub(super) joints: Vec<Joint<'n>>,
    pub(super) tree: Tree,
}

impl File<'_> {
    /// The place of every link.
    pub(super) fn places(&self, options: &Options) -> Vec<Place> {
        let mut places = vec![
            Place {
                body: None,
                placement: Pose::IDENTITY,
            };
            self.links.len()
        ];
        for &link in &self.tree.order {
            places[link] = match self.tree.carriers[link] {
                Some(carrier) if self.is_folded(carrier.joint, options) => Place {
                    placement: beyond(
                        &places[carrier.parent].placement,
                        &self.joints[carrier.joint].origin,
                    ),
                    ..places[carrier.parent]
                },
                None if !options.floating_base && !options.keep_fixed => places[link],
                _ => Place {
                    body: Some(link),
                    ..places[link]
                },
            };
        }
        places
    }

    /// The bodies and frames.
    pub(super) fn describe(
        &self,
        places: &[Place],
        options: &Options,
        ignored: &mut Vec<Ignored>,
    ) -> Result<ModelDescription, UrdfError> {
        self.check_base(options)?;
        let masses = self.merged_masses(places);
        let joints: HashMap<&str, usize> = (self.joints.iter().enumerate())
            .map(|(index, joint)| (joint.name, index))
            .collect();
        let name_of = |body: Option<usize>| body.map(|body| self.links[body].name);
        let mut description = ModelDescription::new(self.name).gravity(options.gravity);
        for &link in &self.tree.order {
            let place = places[link];
            let name = self.links[link].name;
            if place.body != Some(link) {
                description = description.frame(name, name_of(place.body), place.placement);
                continue;
            }
            let Some(carrier) = self.tree.carriers[link] else {
                let joint = match options.floating_base {
                    true => assembly::Joint::free(),
                    false => assembly::Joint::fixed(),
                };
                description = description.body(name, None, joint, masses[link]);
                continue;
            };
            let read = &self.joints[carrier.joint];
            let parent = places[carrier.parent];
            let mimic = self.mimic(read, &joints, options, ignored);
            let joint = read.kind.compound().map(|joint| assembly::Joint {
                limits: read.limits,
                damping: read.damping,
                friction: read.friction,
                mimic: mimic.clone(),
                ..joint
            });
            let joint = joint.at(beyond(&parent.placement, &read.origin));
            description = description.body(name, name_of(parent.body), joint, masses[link]);
        }
        if description.bodies.is_empty() {
            return Err(self.error(Problem::NothingMoves));
        }
        Ok(description)
    }

    /// The error of a refused model, at the link or joint it speaks of.
    pub(super) fn locate(&self, error: ModelError) -> UrdfError {
        let (name, of_joint) = (error.culprit(), error.is_of_joint());
        let find = |name: &str| self.links.iter().position(|link| link.name == name);
        // Of a planar joint, the bodies between bear the name of the link and a number.
        let carried = |name: &str| find(name.rsplit_once('.')?.0);
        let Some(link) = name.and_then(|name| find(name).or_else(|| carried(name))) else {
            return self.error(Problem::Model(error));
        };
        match self.tree.carriers[link] {
            Some(carrier) if of_joint => {
                let joint = &self.joints[carrier.joint];
                tree::error("joint", joint.name, joint.line, Problem::Model(error))
            }
            _ => {
                let link = &self.links[link];
                tree::error("link", link.name, link.line, Problem::Model(error))
            }
        }
    }

    fn is_folded(&self, joint: usize, options: &Options) -> bool {
        !options.keep_fixed && self.joints[joint].kind == Kind::Fixed
    }

    /// A base that is to float must have mass, or its first step divides by zero.
    fn check_base(&self, options: &Options) -> Result<(), UrdfError> {
        if !options.floating_base {
            return Ok(());
        }
        let mut of_base = vec![false; self.links.len()];
        for &link in &self.tree.order {
            of_base[link] = self.tree.carriers[link].is_none_or(|carrier| {
                of_base[carrier.parent] && self.joints[carrier.joint].kind == Kind::Fixed
            });
            if of_base[link] && self.links[link].mass.mass > 0.0 {
                return Ok(());
            }
        }
        let root = &self.links[self.tree.order[0]];
        Err(tree::error(
            "link",
            root.name,
            root.line,
            Problem::MasslessBase,
        ))
    }

    /// Every body's mass with that of the links folded into it.
    fn merged_masses(&self, places: &[Place]) -> Vec<MassProperties> {
        let mut masses: Vec<_> = self.links.iter().map(|link| link.mass).collect();
        for &link in &self.tree.order {
            let place = places[link];
            let mass = self.links[link].mass;
            if let Some(body) = place.body
                && body != link
                && mass != MassProperties::MASSLESS
            {
                masses[body] = masses[body].combined(&mass.placed(&place.placement));
            }
        }
        masses
    }

    /// The coupling to the body that the other joint carries. One that was folded away, or is missing
    /// as in files cut out of larger ones, leaves nothing to follow.
    fn mimic(
        &self,
        joint: &Joint<'_>,
        joints: &HashMap<&str, usize>,
        options: &Options,
        ignored: &mut Vec<Ignored>,
    ) -> Option<assembly::Mimic> {
        let mimic = joint.mimic.as_ref()?;
        let other = joints.get(mimic.joint).copied();
        let is_planar = |other: usize| matches!(self.joints[other].kind, Kind::Planar(_));
        let moving = other.filter(|&other| !self.is_folded(other, options) && !is_planar(other));
        let Some(moving) = moving else {
            let why = match other {
                Some(other) if is_planar(other) => "has several freedoms",
                Some(_) => "does not move",
                None => "is not in the file",
            };
            ignored.push(Ignored {
                element: "mimic".to_owned(),
                owner: format!("joint `{}`", joint.name),
                line: mimic.line,
                is_attribute: false,
                why: Some(format!("the joint `{}` {why}", mimic.joint)),
            });
            return None;
        };
        Some(assembly::Mimic {
            body: self.links[self.tree.children[moving]].name.to_owned(),
            multiplier: mimic.multiplier,
            offset: mimic.offset,
        })
    }

    fn error(&self, problem: Problem) -> UrdfError {
        UrdfError {
            location: self.robot.clone(),
            problem,
        }
    }
}

/// A placement seen from beyond another. The product rounds, and what stands at the origin is to keep
/// its bits.
fn beyond(outer: &Pose, inner: &Pose) -> Pose {
    match *outer == Pose::IDENTITY {
        true => *inner,
        false => *outer * *inner,
    }
}
