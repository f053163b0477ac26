//! How links hang from each other.

use super::joint::Joint;
use super::link::Link;
use super::{Location, Problem, UrdfError};
use std::collections::HashMap;

/// The tree that joints make of links: all by index into the file's lists.
pub(super) struct Tree {
    /// The links depth first, siblings in the order of their joints, the root first.
    pub(super) order: Vec<usize>,
    /// For each link the joint that carries it and the parent link; none for the root.
    pub(super) carriers: Vec<Option<Carrier>>,
    /// For each joint the link it carries.
    pub(super) children: Vec<usize>,
}

/// What carries a link.
#[derive(Clone, Copy)]
pub(super) struct Carrier {
    pub(super) joint: usize,
    pub(super) parent: usize,
}

impl Tree {
    /// Resolves names and refuses everything that is not one tree; `robot` is where the root
    /// element stands.
    pub(super) fn new(
        robot: &Location,
        links: &[Link<'_>],
        joints: &[Joint<'_>],
    ) -> Result<Self, UrdfError> {
        let by_name = unique(links.iter().map(|link| (link.name, link.line)), "link")?;
        unique(joints.iter().map(|joint| (joint.name, joint.line)), "joint")?;

        let mut carriers: Vec<Option<Carrier>> = vec![None; links.len()];
        let mut hanging: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
        let mut children = Vec::with_capacity(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            let find = |name: &str| {
                by_name.get(name).copied().ok_or_else(|| {
                    let link = name.to_owned();
                    error(
                        "joint",
                        joint.name,
                        joint.line,
                        Problem::UnknownLink { link },
                    )
                })
            };
            let (parent, child) = (find(joint.parent)?, find(joint.child)?);
            let carrier = Carrier {
                joint: index,
                parent,
            };
            if let Some(first) = carriers[child].replace(carrier) {
                let problem = Problem::TwoParents {
                    link: links[child].name.to_owned(),
                    other: joints[first.joint].name.to_owned(),
                    other_line: joints[first.joint].line,
                };
                return Err(error("joint", joint.name, joint.line, problem));
            }
            hanging[parent].push(child);
            children.push(child);
        }

        let name_of = |&index: &usize| links[index].name.to_owned();
        let roots: Vec<usize> = (0..links.len())
            .filter(|&link| carriers[link].is_none())
            .collect();
        if roots.len() > 1 {
            return Err(UrdfError {
                location: robot.clone(),
                problem: Problem::SeveralRoots {
                    links: roots.iter().map(name_of).collect(),
                },
            });
        }

        let mut order = Vec::with_capacity(links.len());
        let mut reached = vec![false; links.len()];
        let mut stack = roots;
        while let Some(link) = stack.pop() {
            order.push(link);
            reached[link] = true;
            stack.extend(hanging[link].iter().rev());
        }
        if let Some(lost) = reached.iter().position(|&reached| !reached) {
            let cycle = cycle_above(lost, &carriers);
            let first = &links[cycle[0]];
            let problem = Problem::Cycle {
                links: cycle.iter().map(name_of).collect(),
            };
            return Err(error("link", first.name, first.line, problem));
        }
        Ok(Self {
            order,
            carriers,
            children,
        })
    }
}

/// An error at a link or joint.
pub(super) fn error(tag: &str, name: &str, line: u32, problem: Problem) -> UrdfError {
    UrdfError {
        location: Location {
            file: None,
            line: Some(line),
            element: format!("{tag} `{name}`"),
        },
        problem,
    }
}

/// Indices by name.
fn unique<'n>(
    elements: impl Iterator<Item = (&'n str, u32)>,
    tag: &str,
) -> Result<HashMap<&'n str, usize>, UrdfError> {
    let mut lines: Vec<u32> = Vec::new();
    let mut by_name = HashMap::new();
    for (name, line) in elements {
        if let Some(first) = by_name.insert(name, lines.len()) {
            let first_line = lines[first];
            return Err(error(
                tag,
                name,
                line,
                Problem::DuplicateName { first_line },
            ));
        }
        lines.push(line);
    }
    Ok(by_name)
}

/// The cycle that carries an unreachable link, each link carried by the one before.
///
/// Every link above it has a carrier, as the root is not among them: the way up meets itself.
fn cycle_above(lost: usize, carriers: &[Option<Carrier>]) -> Vec<usize> {
    let up = |link: usize| carriers[link].map_or(link, |carrier| carrier.parent);
    let on_cycle = (0..carriers.len()).fold(lost, |link, _| up(link));
    let mut cycle = vec![on_cycle];
    let mut link = up(on_cycle);
    while link != on_cycle {
        cycle.push(link);
        link = up(link);
    }
    cycle.reverse();
    cycle
}
