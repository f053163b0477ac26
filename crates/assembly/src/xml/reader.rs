//! Reading XML elements, with the line of everything that is wrong or has no effect.

use super::{XmlError, XmlProblem};
use crate::{Ignored, Location, spelling};
use glam::{DQuat, DVec3};
use roxmltree::{Document, Node};
use vertebra_spatial::Pose;

/// Namespace of the attributes that this library adds to files of others.
pub(crate) const EXTENSION: &str = "vertebra";

/// Reads the elements of one document and keeps a list of those it passes over.
pub struct Reader<'a> {
    text: &'a str,
    /// Byte offsets at which lines start.
    line_starts: Vec<usize>,
    /// The root's namespace: elements of others are not the format's.
    namespace: Option<&'a str>,
    owners: &'static [&'static str],
    ignored: Vec<Ignored>,
    /// Those among the ignored, by index, that are nearly spelt like something that is read.
    slips: Vec<usize>,
}

impl<'a> Reader<'a> {
    /// A reader of a document. Messages call an element by the nearest named element it stands in
    /// whose tag is among `owners`.
    #[must_use]
    pub fn new(document: &'a Document<'a>, owners: &'static [&'static str]) -> Self {
        let text = document.input_text();
        Self {
            text,
            line_starts: core::iter::once(0)
                .chain(text.match_indices('\n').map(|(at, _)| at + 1))
                .collect(),
            namespace: document.root_element().tag_name().namespace(),
            owners,
            ignored: Vec::new(),
            slips: Vec::new(),
        }
    }

    /// What was passed over.
    #[must_use]
    pub fn into_ignored(self) -> Vec<Ignored> {
        self.ignored
    }

    /// What was passed over though it is nearly spelt like something that is read.
    pub fn slips(&self) -> impl Iterator<Item = &Ignored> {
        self.slips.iter().filter_map(|&slip| self.ignored.get(slip))
    }

    /// Line of an element, from 1.
    #[must_use]
    pub fn line(&self, node: Node<'_, '_>) -> u32 {
        let start = node.range().start;
        let line = self.line_starts.partition_point(|&at| at <= start);
        u32::try_from(line).unwrap_or(u32::MAX)
    }

    /// Where an element stands.
    #[must_use]
    pub fn location(&self, node: Node<'_, '_>) -> Location {
        Location {
            file: None,
            line: Some(self.line(node)),
            element: self.describe(node),
        }
    }

    /// An error at an element.
    #[must_use]
    pub fn error(&self, node: Node<'_, '_>, problem: XmlProblem) -> XmlError {
        XmlError {
            location: self.location(node),
            problem,
        }
    }

    /// Notes that an element has no effect.
    pub fn ignore(&mut self, node: Node<'_, '_>) {
        self.note(node, None);
    }

    /// Notes that an element has no effect, and why.
    pub fn ignore_because(&mut self, node: Node<'_, '_>, why: impl Into<String>) {
        self.note(node, Some(why.into()));
    }

    /// Notes that an element has no effect which is none of those that may stand there. One that is
    /// nearly spelt like one of them is taken for a slip.
    pub fn ignore_unknown(&mut self, node: Node<'_, '_>, known: &[&str]) {
        let meant = spelling::nearest(node.tag_name().name(), known.iter().copied());
        self.note(node, meant.map(|name| format!("is <{name}> meant?")));
        self.slips.extend(meant.map(|_| self.ignored.len() - 1));
    }

    /// Notes that an attribute has no effect, if the element has it.
    pub fn ignore_attribute(&mut self, node: Node<'_, '_>, attribute: &str) {
        self.note_attribute(node, attribute, None);
    }

    /// Notes that an attribute has no effect, if the element has it, and why.
    pub fn ignore_attribute_because(&mut self, node: Node<'_, '_>, attribute: &str, why: &str) {
        self.note_attribute(node, attribute, Some(why.to_owned()));
    }

    /// Notes that every attribute but these has no effect. One that is nearly spelt like one of them is
    /// taken for a slip.
    pub fn ignore_attributes_but(&mut self, node: Node<'_, '_>, known: &[&str]) {
        for attribute in node.attributes() {
            let name = attribute.name();
            if !known.contains(&name) {
                let meant = spelling::nearest(name, known.iter().copied());
                self.note_attribute(node, name, meant.map(|name| format!("is `{name}` meant?")));
                self.slips.extend(meant.map(|_| self.ignored.len() - 1));
            }
        }
    }

    /// Notes that an element lacks one that the format asks for, and what is made of that.
    pub fn note_missing(&mut self, node: Node<'_, '_>, child: &str, why: &str) {
        self.ignored.push(Ignored {
            element: child.to_owned(),
            owner: self.describe(node),
            line: self.line(node),
            is_attribute: false,
            why: Some(why.to_owned()),
        });
    }

    fn note(&mut self, node: Node<'_, '_>, why: Option<String>) {
        self.ignored.push(Ignored {
            element: qualified_name(self.text, node).to_owned(),
            owner: node
                .parent_element()
                .map_or_else(String::new, |parent| self.describe(parent)),
            line: self.line(node),
            is_attribute: false,
            why,
        });
    }

    fn note_attribute(&mut self, node: Node<'_, '_>, attribute: &str, why: Option<String>) {
        if node.has_attribute(attribute) {
            self.ignored.push(Ignored {
                element: attribute.to_owned(),
                owner: self.describe(node),
                line: self.line(node),
                is_attribute: true,
                why,
            });
        }
    }

    /// The child elements and their names. Those of foreign namespaces are passed over, but xacro
    /// is refused: without it the robot is another one.
    ///
    /// # Errors
    /// [`XmlProblem::Unexpanded`] for an element of xacro.
    pub fn children<'n>(
        &mut self,
        node: Node<'n, 'a>,
    ) -> Result<Vec<(&'n str, Node<'n, 'a>)>, XmlError> {
        let mut children = Vec::new();
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name();
            if tag.namespace() == self.namespace {
                children.push((tag.name(), child));
            } else if tag.namespace().is_some_and(|name| name.contains("xacro")) {
                let found = format!("<{}>", qualified_name(self.text, child));
                return Err(self.error(child, XmlProblem::Unexpanded { found }));
            } else {
                self.ignore(child);
            }
        }
        Ok(children)
    }

    /// Takes an element that may stand once.
    ///
    /// # Errors
    /// [`XmlProblem::Repeated`].
    pub fn once<'n>(
        &self,
        slot: &mut Option<Node<'n, 'a>>,
        node: Node<'n, 'a>,
    ) -> Result<(), XmlError> {
        match slot.replace(node) {
            None => Ok(()),
            Some(_) => Err(self.error(node, XmlProblem::Repeated)),
        }
    }

    /// The child elements of these names, each once at most; others are passed over.
    ///
    /// # Errors
    /// [`XmlProblem::Repeated`], or [`XmlProblem::Unexpanded`] for an element of xacro.
    pub fn only<'n, const N: usize>(
        &mut self,
        node: Node<'n, 'a>,
        names: [&'static str; N],
    ) -> Result<[Option<Node<'n, 'a>>; N], XmlError> {
        let mut slots = [None; N];
        for (tag, child) in self.children(node)? {
            match names.iter().position(|&name| name == tag) {
                Some(index) => self.once(&mut slots[index], child)?,
                None => self.ignore_unknown(child, &names),
            }
        }
        Ok(slots)
    }

    /// An element that must be there.
    ///
    /// # Errors
    /// [`XmlProblem::MissingElement`].
    pub fn needed<'n>(
        &self,
        parent: Node<'_, '_>,
        child: &'static str,
        found: Option<Node<'n, 'a>>,
    ) -> Result<Node<'n, 'a>, XmlError> {
        found.ok_or_else(|| self.error(parent, XmlProblem::MissingElement { child }))
    }

    /// An attribute, if it is there.
    ///
    /// # Errors
    /// [`XmlProblem::Unexpanded`] for an expression of xacro.
    pub fn optional_text<'n>(
        &self,
        node: Node<'n, 'a>,
        attribute: &'static str,
    ) -> Result<Option<&'n str>, XmlError> {
        let value = node.attribute(attribute);
        match value {
            Some(text) if text.contains("${") || text.contains("$(") => {
                let found = text.to_owned();
                Err(self.error(node, XmlProblem::Unexpanded { found }))
            }
            _ => Ok(value),
        }
    }

    /// An attribute that must be there and not be empty.
    ///
    /// # Errors
    /// [`XmlProblem::MissingAttribute`], or [`XmlProblem::Unexpanded`] for an expression of xacro.
    pub fn text<'n>(
        &self,
        node: Node<'n, 'a>,
        attribute: &'static str,
    ) -> Result<&'n str, XmlError> {
        self.optional_text(node, attribute)?
            .filter(|text| !text.is_empty())
            .ok_or_else(|| self.error(node, XmlProblem::MissingAttribute { attribute }))
    }

    /// A list of numbers, if the attribute is there.
    ///
    /// # Errors
    /// [`XmlProblem::NotANumber`], [`XmlProblem::NonFinite`], [`XmlProblem::WrongCount`] or
    /// [`XmlProblem::Unexpanded`].
    pub fn optional_numbers<const N: usize>(
        &self,
        node: Node<'_, 'a>,
        attribute: &'static str,
    ) -> Result<Option<[f64; N]>, XmlError> {
        let text = self.optional_text(node, attribute)?;
        text.map(|text| self.numbers(node, attribute, text))
            .transpose()
    }

    /// A list of numbers in the text of an attribute or element.
    ///
    /// # Errors
    /// [`XmlProblem::NotANumber`], [`XmlProblem::NonFinite`] or [`XmlProblem::WrongCount`].
    pub fn numbers<const N: usize>(
        &self,
        node: Node<'_, '_>,
        attribute: &'static str,
        text: &str,
    ) -> Result<[f64; N], XmlError> {
        let numbers = self.number_list(node, attribute, text)?;
        let found = numbers.len();
        numbers.try_into().map_err(|_| {
            let problem = XmlProblem::WrongCount {
                attribute,
                expected: N,
                found,
            };
            self.error(node, problem)
        })
    }

    /// Any number of numbers in the text of an attribute or element.
    ///
    /// # Errors
    /// [`XmlProblem::NotANumber`] or [`XmlProblem::NonFinite`].
    pub fn number_list(
        &self,
        node: Node<'_, '_>,
        attribute: &'static str,
        text: &str,
    ) -> Result<Vec<f64>, XmlError> {
        text.split_whitespace()
            .map(|word| self.parse(node, attribute, word))
            .collect()
    }

    /// A number, if the attribute is there.
    ///
    /// # Errors
    /// As [`optional_numbers`](Self::optional_numbers).
    pub fn optional_number(
        &self,
        node: Node<'_, 'a>,
        attribute: &'static str,
    ) -> Result<Option<f64>, XmlError> {
        Ok(self
            .optional_numbers(node, attribute)?
            .map(|[number]| number))
    }

    /// A number that must be there.
    ///
    /// # Errors
    /// As [`optional_numbers`](Self::optional_numbers), and [`XmlProblem::MissingAttribute`].
    pub fn number(&self, node: Node<'_, 'a>, attribute: &'static str) -> Result<f64, XmlError> {
        self.optional_number(node, attribute)?
            .ok_or_else(|| self.error(node, XmlProblem::MissingAttribute { attribute }))
    }

    /// Three numbers, if the attribute is there.
    ///
    /// # Errors
    /// As [`optional_numbers`](Self::optional_numbers).
    pub fn optional_vector(
        &self,
        node: Node<'_, 'a>,
        attribute: &'static str,
    ) -> Result<Option<DVec3>, XmlError> {
        Ok(self
            .optional_numbers(node, attribute)?
            .map(DVec3::from_array))
    }

    /// The placement an `<origin>` states; the identity where there is none. Its rotation is given by
    /// `rpy` or, as in newer files, by `quat_xyzw`. This library's own writer adds a quaternion to
    /// `rpy` where angles do not give its last bit; it counts as long as it states the same rotation.
    ///
    /// # Errors
    /// As [`optional_numbers`](Self::optional_numbers), and [`XmlProblem::NoRotation`].
    pub fn placement(&self, origin: Option<Node<'_, 'a>>) -> Result<Pose, XmlError> {
        let Some(origin) = origin else {
            return Ok(Pose::IDENTITY);
        };
        let translation = self.optional_vector(origin, "xyz")?.unwrap_or_default();
        if let Some(stated) = self.optional_numbers(origin, "quat_xyzw")? {
            let rotation = self.unit_quaternion(origin, "quat_xyzw", DQuat::from_array(stated))?;
            return Ok(Pose::new(rotation, translation));
        }
        let turns = self.optional_vector(origin, "rpy")?.unwrap_or_default();
        let rotation = from_roll_pitch_yaw(turns);
        let exact = match origin.attribute((EXTENSION, "quaternion")) {
            Some(text) => self.numbers(origin, "quaternion", text)?,
            None => return Ok(Pose::new(rotation, translation)),
        };
        let exact = DQuat::from_array(exact);
        // A quaternion and its negative are one rotation.
        let apart = (exact - rotation).length().min((exact + rotation).length());
        let is_same = apart <= 1e-12;
        Ok(Pose::new(
            if is_same { exact } else { rotation },
            translation,
        ))
    }

    /// A quaternion of any length but zero, made a unit one.
    ///
    /// # Errors
    /// [`XmlProblem::NoRotation`].
    pub fn unit_quaternion(
        &self,
        node: Node<'_, '_>,
        attribute: &'static str,
        quaternion: DQuat,
    ) -> Result<DQuat, XmlError> {
        let length = quaternion.length();
        if !(1e-100..=1e100).contains(&length) {
            return Err(self.error(node, XmlProblem::NoRotation { attribute }));
        }
        // One that is of unit length to rounding stays as it is written.
        if (length - 1.0).abs() <= 2.0 * f64::EPSILON {
            return Ok(quaternion);
        }
        Ok(quaternion / length)
    }

    /// What an element is called in messages: ``joint `elbow` `` or ``<axis> of joint `elbow` ``.
    fn describe(&self, node: Node<'_, '_>) -> String {
        let own = |node: Node<'_, '_>| {
            let name = node.attribute("name")?;
            let tag = node.tag_name().name();
            self.owners
                .contains(&tag)
                .then(|| format!("{tag} `{name}`"))
        };
        own(node).unwrap_or_else(|| {
            let tag = qualified_name(self.text, node);
            match node.ancestors().skip(1).find_map(own) {
                Some(owner) => format!("<{tag}> of {owner}"),
                None => format!("<{tag}>"),
            }
        })
    }

    fn parse(
        &self,
        node: Node<'_, '_>,
        attribute: &'static str,
        word: &str,
    ) -> Result<f64, XmlError> {
        let text = || word.to_owned();
        let problem = match word.parse::<f64>() {
            Ok(number) if number.is_finite() => return Ok(number),
            Ok(_) => XmlProblem::NonFinite {
                attribute,
                text: text(),
            },
            Err(_) => XmlProblem::NotANumber {
                attribute,
                text: text(),
            },
        };
        Err(self.error(node, problem))
    }
}

/// Turns about the fixed axes x, y, z in this order: Rz(yaw) Ry(pitch) Rx(roll). `libm` makes the
/// model the same, bit for bit, on every machine.
#[must_use]
pub fn from_roll_pitch_yaw(turns: DVec3) -> DQuat {
    let half = |angle: f64| (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
    let ((sx, cx), (sy, cy), (sz, cz)) = (half(turns.x), half(turns.y), half(turns.z));
    let roll = DQuat::from_xyzw(sx, 0.0, 0.0, cx);
    let pitch = DQuat::from_xyzw(0.0, sy, 0.0, cy);
    let yaw = DQuat::from_xyzw(0.0, 0.0, sz, cz);
    (yaw * pitch * roll).normalize()
}

/// An element's name as written, prefix included.
fn qualified_name<'t>(text: &'t str, node: Node<'_, '_>) -> &'t str {
    let start = node.range().start + 1;
    let rest = text.get(start..).unwrap_or_default();
    let end = rest.find(|c: char| c.is_whitespace() || c == '/' || c == '>');
    &rest[..end.unwrap_or(rest.len())]
}
