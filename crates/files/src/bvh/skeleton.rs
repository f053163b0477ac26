//! The hierarchy: joints, their offsets and channels.

use super::Options;
use super::words::Words;
use crate::tree::Names;
use crate::{FileError, Part, Problem, Shape};
use core::f64::consts::FRAC_1_SQRT_2;
use glam::{DQuat, DVec3};
use vertebra_assembly::{Ignored, Joint, MassProperties, Model, ModelDescription};
use vertebra_spatial::Pose;

/// What a number of a frame moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Channel {
    /// Along an axis.
    Position(usize),
    /// About an axis.
    Rotation(DVec3),
}

/// A joint of the file.
pub(super) struct Bone {
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    /// From the parent's joint, in the file's unit.
    pub(super) offset: DVec3,
    pub(super) channels: Vec<Channel>,
    /// Ends of bones that carry no joint.
    ends: Vec<DVec3>,
    line: usize,
}

/// The joints in the order of the file, parents first.
pub(super) struct Skeleton {
    pub(super) bones: Vec<Bone>,
    pub(super) ignored: Vec<Ignored>,
}

impl Skeleton {
    /// Reads from `HIERARCHY` to the brace that ends the last root.
    pub(super) fn read(words: &mut Words<'_>) -> Result<Self, FileError> {
        words.expect("the text", "HIERARCHY")?;
        let mut skeleton = Self {
            bones: Vec::new(),
            ignored: Vec::new(),
        };
        let mut names = Names::default();
        // The joints whose braces are open; our own stack, as files may be deep.
        let mut open: Vec<usize> = Vec::new();
        loop {
            let word = words.peek().unwrap_or_default();
            let element = match open.last() {
                Some(&bone) => format!("joint `{}`", skeleton.bones[bone].name),
                None => "the hierarchy".to_owned(),
            };
            if open.is_empty() && !word.eq_ignore_ascii_case("ROOT") {
                if skeleton.bones.is_empty() {
                    return Err(words.error(&element, "ROOT"));
                }
                return Ok(skeleton);
            }
            match word.to_ascii_uppercase().as_str() {
                "ROOT" if open.is_empty() => {
                    words.expect(&element, "ROOT")?;
                    open.push(skeleton.start(words, &mut names, None)?);
                }
                "JOINT" => {
                    words.expect(&element, "JOINT")?;
                    let parent = open.last().copied();
                    open.push(skeleton.start(words, &mut names, parent)?);
                }
                "END" => {
                    words.expect(&element, "End")?;
                    words.take("Site")?;
                    words.expect(&element, "{")?;
                    let end = offset(words, &element)?;
                    words.expect(&element, "}")?;
                    if let Some(&bone) = open.last() {
                        skeleton.bones[bone].ends.push(end);
                    }
                }
                "}" => {
                    words.expect(&element, "}")?;
                    open.pop();
                }
                _ => return Err(words.error(&element, "JOINT, End Site or a closing brace")),
            }
        }
    }

    /// Reads a joint's name, offset and channels.
    fn start(
        &mut self,
        words: &mut Words<'_>,
        names: &mut Names,
        parent: Option<usize>,
    ) -> Result<usize, FileError> {
        const NAME: &str = "the name of a joint";
        let line = words.line();
        if words.peek() == Some("{") {
            return Err(words.error("the hierarchy", NAME));
        }
        // A name may have blanks in it.
        let mut parts = vec![words.take(NAME)?];
        while !matches!(words.peek(), Some("{") | None) {
            parts.push(words.take("{")?);
        }
        let name = parts.join(" ");
        let element = format!("joint `{name}`");
        words.expect(&element, "{")?;
        let offset = offset(words, &element)?;
        let mut channels = Vec::new();
        if words
            .peek()
            .is_some_and(|word| word.eq_ignore_ascii_case("CHANNELS"))
        {
            words.expect(&element, "CHANNELS")?;
            for _ in 0..words.count(&element)? {
                let (line, word) = (words.line(), words.peek().unwrap_or_default());
                let channel = channel(word)
                    .ok_or_else(|| words.error(&element, "a channel such as Xrotation"))?;
                // Euler's angles may turn about the first axis again, but not at once.
                let is_again = match channel {
                    Channel::Position(_) => channels.contains(&channel),
                    Channel::Rotation(_) => channels.last() == Some(&channel),
                };
                if is_again {
                    let expected = "a channel that the joint has not named yet";
                    return Err(words.error(&element, expected));
                }
                if parent.is_some() && matches!(channel, Channel::Position(_)) {
                    self.ignored.push(Ignored {
                        element: word.to_owned(),
                        owner: element.clone(),
                        line: u32::try_from(line).unwrap_or(u32::MAX),
                        is_attribute: true,
                        why: Some("bones keep their lengths".to_owned()),
                    });
                }
                words.take("a channel")?;
                channels.push(channel);
            }
        }
        self.bones.push(Bone {
            name: names.fresh(name),
            parent,
            offset,
            channels,
            ends: Vec::new(),
            line,
        });
        Ok(self.bones.len() - 1)
    }

    /// The model, and the bones as parts of it.
    pub(super) fn build(&self, options: &Options) -> Result<(Model, Vec<Part>), FileError> {
        // The far ends of each joint's bones.
        let mut ends: Vec<Vec<DVec3>> = self.bones.iter().map(|bone| bone.ends.clone()).collect();
        for bone in &self.bones {
            if let Some(parent) = bone.parent {
                ends[parent].push(bone.offset);
            }
        }
        let longest = ends
            .iter()
            .flatten()
            .fold(0.0_f64, |most, end| most.max(end.length()));
        if longest == 0.0 {
            let problem = Problem::Empty("all offsets are zero; give the bones their lengths");
            return Err(FileError::on_line(
                self.bones[0].line,
                "the hierarchy",
                problem,
            ));
        }
        // What no bone starts from is a ball as thick as a bone a fifth as long as the longest.
        let ball = 0.2 * longest * options.unit * options.thickness;
        // y up becomes z up.
        let upright = DQuat::from_xyzw(FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);
        let mut description = ModelDescription::new(self.bones[0].name.clone());
        let mut shapes = Vec::new();
        for (bone, ends) in self.bones.iter().zip(&ends) {
            let mut mass: Option<MassProperties> = None;
            let capsules = ends
                .iter()
                .filter_map(|&end| capsule(end * options.unit, options));
            let mut own: Vec<(Pose, Shape)> = capsules.collect();
            if own.is_empty() {
                own.push((Pose::IDENTITY, Shape::Sphere { radius: ball }));
            }
            for (placement, shape) in own {
                // These shapes are no meshes, whose masses alone can fail.
                let Ok(part) = shape.mass_properties(options.density) else {
                    continue;
                };
                let part = part.placed(&placement);
                mass = Some(mass.map_or(part, |sum| sum.combined(&part)));
                shapes.push((bone.name.clone(), placement, shape));
            }
            let has_channel = |wanted: fn(&Channel) -> bool| bone.channels.iter().any(wanted);
            let at = bone.offset * options.unit;
            let joint = match bone.parent {
                // The root's displacement is counted from the world's origin.
                None if has_channel(|channel| matches!(channel, Channel::Position(_))) => {
                    Joint::free().at(Pose::from_rotation(upright))
                }
                None => Joint::free().at(Pose::new(upright, upright * at)),
                Some(_) => Joint::spherical().at(Pose::from_translation(at)),
            };
            let parent = bone.parent.map(|parent| self.bones[parent].name.as_str());
            let mass = mass.unwrap_or(MassProperties::MASSLESS);
            description = description.body(bone.name.clone(), parent, joint, mass);
        }
        let model = description.build().map_err(|error| {
            let bone = error
                .culprit()
                .and_then(|name| self.bones.iter().find(|b| b.name == name));
            let line = bone.map_or(0, |bone| bone.line);
            FileError::on_line(line, "the hierarchy", Problem::Model(error))
        })?;
        let parts = shapes.into_iter().map(|(name, placement, shape)| Part {
            body: model.find(&name),
            placement,
            shape,
        });
        let parts = parts.collect();
        Ok((model, parts))
    }
}

/// A bone from the origin to its end \[m\]; none where it has no length.
fn capsule(end: DVec3, options: &Options) -> Option<(Pose, Shape)> {
    let length = end.length();
    if length < 1e-100 {
        return None;
    }
    let rotation = DQuat::from_rotation_arc(DVec3::Z, end / length);
    let radius = options.thickness * length;
    let shape = match length - 2.0 * radius {
        barrel if barrel > 0.0 => Shape::Capsule {
            radius,
            length: barrel,
        },
        // Thicker than long.
        _ => Shape::Sphere { radius },
    };
    Some((Pose::new(rotation, end * 0.5), shape))
}

fn offset(words: &mut Words<'_>, element: &str) -> Result<DVec3, FileError> {
    words.expect(element, "OFFSET")?;
    let mut number = || words.number(element);
    Ok(DVec3::new(number()?, number()?, number()?))
}

fn channel(word: &str) -> Option<Channel> {
    Some(match word.to_ascii_lowercase().as_str() {
        "xposition" => Channel::Position(0),
        "yposition" => Channel::Position(1),
        "zposition" => Channel::Position(2),
        "xrotation" => Channel::Rotation(DVec3::X),
        "yrotation" => Channel::Rotation(DVec3::Y),
        "zrotation" => Channel::Rotation(DVec3::Z),
        _ => return None,
    })
}
