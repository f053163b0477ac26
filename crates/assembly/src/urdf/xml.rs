//! Reading XML elements, with the line of everything that is wrong or has no effect.

use super::{Ignored, Location, Problem, UrdfError};
use glam::DVec3;
use roxmltree::{Document, Node};
use vertebra_spatial::Pose;

/// Reads the elements of one document and keeps a list of those it passes over.
pub(super) struct Reader<'a> {
    text: &'a str,
    /// Byte offsets at which lines start.
    line_starts: Vec<usize>,
    /// The root's namespace: elements of others are not URDF's.
    namespace: Option<&'a str>,
    ignored: Vec<Ignored>,
}

impl<'a> Reader<'a> {
    /// A reader of a document, whose root must be `<robot>`.
    pub(super) fn new(document: &'a Document<'a>) -> Result<Self, UrdfError> {
        let text = document.input_text();
        let root = document.root_element();
        let reader = Self {
            text,
            line_starts: core::iter::once(0)
                .chain(text.match_indices('\n').map(|(at, _)| at + 1))
                .collect(),
            namespace: root.tag_name().namespace(),
            ignored: Vec::new(),
        };
        if root.tag_name().name() == "robot" {
            return Ok(reader);
        }
        let looks_like = match root.tag_name().name() {
            "sdf" | "gazebo" => Some("SDF"),
            "mujoco" | "mujocoinclude" => Some("MuJoCo's MJCF"),
            "COLLADA" => Some("a COLLADA mesh"),
            "launch" => Some("a ROS launch file"),
            "package" => Some("a ROS package manifest"),
            _ => None,
        };
        Err(reader.error(root, Problem::NotRobot { looks_like }))
    }

    /// What was passed over.
    pub(super) fn into_ignored(self) -> Vec<Ignored> {
        self.ignored
    }

    /// Line of an element, from 1.
    pub(super) fn line(&self, node: Node<'_, '_>) -> u32 {
        let start = node.range().start;
        let line = self.line_starts.partition_point(|&at| at <= start);
        u32::try_from(line).unwrap_or(u32::MAX)
    }

    /// An error at an element.
    pub(super) fn error(&self, node: Node<'_, '_>, problem: Problem) -> UrdfError {
        UrdfError {
            location: Location {
                file: None,
                line: Some(self.line(node)),
                element: describe(self.text, node),
            },
            problem,
        }
    }

    /// Notes that an element has no effect.
    pub(super) fn ignore(&mut self, node: Node<'_, '_>) {
        self.ignored.push(Ignored {
            element: qualified_name(self.text, node).to_owned(),
            owner: node
                .parent_element()
                .map_or_else(String::new, |parent| describe(self.text, parent)),
            line: self.line(node),
        });
    }

    /// The child elements and their names. Those of foreign namespaces are passed over, but xacro
    /// is refused: without it the robot is another one.
    pub(super) fn children<'n>(
        &mut self,
        node: Node<'n, 'a>,
    ) -> Result<Vec<(&'n str, Node<'n, 'a>)>, UrdfError> {
        let mut children = Vec::new();
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name();
            if tag.namespace() == self.namespace {
                children.push((tag.name(), child));
            } else if tag.namespace().is_some_and(|name| name.contains("xacro")) {
                let found = format!("<{}>", qualified_name(self.text, child));
                return Err(self.error(child, Problem::Unexpanded { found }));
            } else {
                self.ignore(child);
            }
        }
        Ok(children)
    }

    /// Takes an element that may stand once.
    pub(super) fn once<'n>(
        &self,
        slot: &mut Option<Node<'n, 'a>>,
        node: Node<'n, 'a>,
    ) -> Result<(), UrdfError> {
        match slot.replace(node) {
            None => Ok(()),
            Some(_) => Err(self.error(node, Problem::Repeated)),
        }
    }

    /// The child elements of these names, each once at most; others are passed over.
    pub(super) fn only<'n, const N: usize>(
        &mut self,
        node: Node<'n, 'a>,
        names: [&'static str; N],
    ) -> Result<[Option<Node<'n, 'a>>; N], UrdfError> {
        let mut slots = [None; N];
        for (tag, child) in self.children(node)? {
            match names.iter().position(|&name| name == tag) {
                Some(index) => self.once(&mut slots[index], child)?,
                None => self.ignore(child),
            }
        }
        Ok(slots)
    }

    /// An element that must be there.
    pub(super) fn needed<'n>(
        &self,
        parent: Node<'_, '_>,
        child: &'static str,
        found: Option<Node<'n, 'a>>,
    ) -> Result<Node<'n, 'a>, UrdfError> {
        found.ok_or_else(|| self.error(parent, Problem::MissingElement { child }))
    }

    /// An attribute, if it is there.
    pub(super) fn optional_text<'n>(
        &self,
        node: Node<'n, 'a>,
        attribute: &'static str,
    ) -> Result<Option<&'n str>, UrdfError> {
        let value = node.attribute(attribute);
        match value {
            Some(text) if text.contains("${") || text.contains("$(") => {
                let found = text.to_owned();
                Err(self.error(node, Problem::Unexpanded { found }))
            }
            _ => Ok(value),
        }
    }

    /// An attribute that must be there and not be empty.
    pub(super) fn text<'n>(
        &self,
        node: Node<'n, 'a>,
        attribute: &'static str,
    ) -> Result<&'n str, UrdfError> {
        self.optional_text(node, attribute)?
            .filter(|text| !text.is_empty())
            .ok_or_else(|| self.error(node, Problem::MissingAttribute { attribute }))
    }

    /// A list of numbers, if the attribute is there.
    pub(super) fn optional_numbers<const N: usize>(
        &self,
        node: Node<'_, 'a>,
        attribute: &'static str,
    ) -> Result<Option<[f64; N]>, UrdfError> {
        let Some(text) = self.optional_text(node, attribute)? else {
            return Ok(None);
        };
        let mut numbers = [0.0; N];
        let mut found = 0;
        for word in text.split_whitespace() {
            let number = self.parse(node, attribute, word)?;
            if let Some(slot) = numbers.get_mut(found) {
                *slot = number;
            }
            found += 1;
        }
        if found == N {
            return Ok(Some(numbers));
        }
        let problem = Problem::WrongCount {
            attribute,
            expected: N,
            found,
        };
        Err(self.error(node, problem))
    }

    /// A number, if the attribute is there.
    pub(super) fn optional_number(
        &self,
        node: Node<'_, 'a>,
        attribute: &'static str,
    ) -> Result<Option<f64>, UrdfError> {
        Ok(self
            .optional_numbers(node, attribute)?
            .map(|[number]| number))
    }

    /// A number that must be there.
    pub(super) fn number(
        &self,
        node: Node<'_, 'a>,
        attribute: &'static str,
    ) -> Result<f64, UrdfError> {
        self.optional_number(node, attribute)?
            .ok_or_else(|| self.error(node, Problem::MissingAttribute { attribute }))
    }

    /// Three numbers, if the attribute is there.
    pub(super) fn optional_vector(
        &self,
        node: Node<'_, 'a>,
        attribute: &'static str,
    ) -> Result<Option<DVec3>, UrdfError> {
        Ok(self
            .optional_numbers(node, attribute)?
            .map(DVec3::from_array))
    }

    /// The placement an `<origin>` states; the identity where there is none.
    pub(super) fn placement(&self, origin: Option<Node<'_, 'a>>) -> Result<Pose, UrdfError> {
        let Some(origin) = origin else {
            return Ok(Pose::IDENTITY);
        };
        let translation = self.optional_vector(origin, "xyz")?.unwrap_or_default();
        let turns = self.optional_vector(origin, "rpy")?.unwrap_or_default();
        Ok(Pose::new(from_roll_pitch_yaw(turns), translation))
    }

    fn parse(
        &self,
        node: Node<'_, '_>,
        attribute: &'static str,
        word: &str,
    ) -> Result<f64, UrdfError> {
        let text = || word.to_owned();
        let problem = match word.parse::<f64>() {
            Ok(number) if number.is_finite() => return Ok(number),
            Ok(_) => Problem::NonFinite {
                attribute,
                text: text(),
            },
            Err(_) => Problem::NotANumber {
                attribute,
                text: text(),
            },
        };
        Err(self.error(node, problem))
    }
}

/// Turns about the fixed axes x, y, z in this order: Rz(yaw) Ry(pitch) Rx(roll). `libm` makes the
/// model the same, bit for bit, on every machine.
fn from_roll_pitch_yaw(turns: DVec3) -> glam::DQuat {
    let half = |angle: f64| (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
    let ((sx, cx), (sy, cy), (sz, cz)) = (half(turns.x), half(turns.y), half(turns.z));
    let roll = glam::DQuat::from_xyzw(sx, 0.0, 0.0, cx);
    let pitch = glam::DQuat::from_xyzw(0.0, sy, 0.0, cy);
    let yaw = glam::DQuat::from_xyzw(0.0, 0.0, sz, cz);
    (yaw * pitch * roll).normalize()
}

/// What an element is called in messages: ``joint `elbow` `` or ``<axis> of joint `elbow` ``.
fn describe(text: &str, node: Node<'_, '_>) -> String {
    let own = |node: Node<'_, '_>| {
        let name = node.attribute("name")?;
        match node.tag_name().name() {
            tag @ ("link" | "joint" | "robot") => Some(format!("{tag} `{name}`")),
            _ => None,
        }
    };
    own(node).unwrap_or_else(|| {
        let tag = qualified_name(text, node);
        match node.ancestors().skip(1).find_map(own) {
            Some(owner) => format!("<{tag}> of {owner}"),
            None => format!("<{tag}>"),
        }
    })
}

/// An element's name as written, prefix included.
fn qualified_name<'t>(text: &'t str, node: Node<'_, '_>) -> &'t str {
    let start = node.range().start + 1;
    let rest = text.get(start..).unwrap_or_default();
    let end = rest.find(|c: char| c.is_whitespace() || c == '/' || c == '>');
    &rest[..end.unwrap_or(rest.len())]
}
