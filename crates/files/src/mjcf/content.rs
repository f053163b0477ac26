//! What stands in a body.

use super::Sections;
use super::compiler;
use super::defaults::Element;
use crate::{FileError, Problem};
use vertebra_assembly::xml::{Node, Reader, XmlProblem};
use vertebra_spatial::Pose;

/// Elements that may stand in a body.
const KNOWN: [&str; 7] = [
    "inertial",
    "joint",
    "freejoint",
    "geom",
    "site",
    "body",
    "frame",
];

/// An element, the `<frame>`s between it and its body, and the class in force around it.
#[derive(Clone, Copy)]
pub(super) struct Placed<'n, 'a> {
    pub(super) node: Node<'n, 'a>,
    pub(super) offset: Pose,
    pub(super) class: Option<&'n str>,
}

/// What stands in a body.
#[derive(Default)]
pub(super) struct Content<'n, 'a> {
    pub(super) inertial: Option<Placed<'n, 'a>>,
    pub(super) joints: Vec<Placed<'n, 'a>>,
    pub(super) geoms: Vec<Placed<'n, 'a>>,
    pub(super) sites: Vec<Placed<'n, 'a>>,
    pub(super) bodies: Vec<Placed<'n, 'a>>,
}

/// Sorts what stands in a body, `<frame>`s opened, in the order of the file.
pub(super) fn gather<'n, 'a>(
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
                let mut known = compiler::placed(["childclass"]);
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
            _ => reader.ignore_unknown(placed.node, &KNOWN),
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
