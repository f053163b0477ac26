//! Default classes: what an element has that does not state it.

use crate::{FileError, Problem};
use glam::DVec3;
use std::collections::HashMap;
use vertebra_assembly::xml::{Node, Reader, XmlError, XmlProblem};

/// For each attribute the `<default>` element that states it.
type Settings<'n, 'a> = HashMap<&'n str, Node<'n, 'a>>;

/// The name of the outermost class where the file gives it none.
const MAIN: &str = "main";

/// Elements that may have defaults which matter here.
const TAGS: [&str; 8] = [
    "joint", "geom", "site", "mesh", "motor", "position", "velocity", "general",
];

/// Actuators, which are spellings of one element: what is common to them is stated by any of them.
const ACTUATORS: [&str; 4] = ["motor", "position", "velocity", "general"];
const COMMON: [&str; 5] = [
    "gear",
    "ctrlrange",
    "ctrllimited",
    "forcerange",
    "forcelimited",
];

/// All classes, each with what it inherits.
pub(super) struct Defaults<'n, 'a> {
    outermost: &'n str,
    classes: HashMap<&'n str, HashMap<&'n str, Settings<'n, 'a>>>,
}

/// An element with the defaults of its class behind it.
#[derive(Clone, Copy)]
pub(super) struct Element<'r, 'n, 'a> {
    pub(super) node: Node<'n, 'a>,
    settings: Option<&'r Settings<'n, 'a>>,
}

impl<'n, 'a> Defaults<'n, 'a> {
    /// Reads all `<default>` sections of the file.
    pub(super) fn read(
        reader: &mut Reader<'a>,
        sections: &[Node<'n, 'a>],
    ) -> Result<Self, FileError> {
        let mut defaults = Self {
            outermost: MAIN,
            classes: HashMap::from([(MAIN, HashMap::new())]),
        };
        for &section in sections {
            if let Some(name) = reader.optional_text(section, "class")?
                && let Some(settings) = defaults.classes.remove(defaults.outermost)
            {
                defaults.outermost = name;
                defaults.classes.insert(name, settings);
            }
            let mut stack = vec![(section, defaults.outermost)];
            while let Some((node, class)) = stack.pop() {
                let mut own = defaults.classes.remove(class).unwrap_or_default();
                let mut nested = Vec::new();
                for (tag, child) in reader.children(node)? {
                    if tag == "default" {
                        nested.push((child, reader.text(child, "class")?));
                    } else if TAGS.contains(&tag) {
                        let stated = child.attributes().map(|a| (a.name(), child));
                        own.entry(tag).or_default().extend(stated.clone());
                        if ACTUATORS.contains(&tag) {
                            let common = stated.filter(|(name, _)| COMMON.contains(name));
                            for other in ACTUATORS {
                                own.entry(other).or_default().extend(common.clone());
                            }
                        }
                    } else {
                        reader.ignore(child);
                    }
                }
                for &(child, name) in &nested {
                    if name == class || defaults.classes.contains_key(name) {
                        return Err(reader.error(child, XmlProblem::Repeated).into());
                    }
                    defaults.classes.insert(name, own.clone());
                }
                stack.extend(nested);
                defaults.classes.insert(class, own);
            }
        }
        Ok(defaults)
    }

    /// An element with the class it states, or else the one in force around it.
    pub(super) fn element<'r>(
        &'r self,
        reader: &Reader<'a>,
        node: Node<'n, 'a>,
        class: Option<&'n str>,
    ) -> Result<Element<'r, 'n, 'a>, FileError> {
        let class = reader.optional_text(node, "class")?.or(class);
        let settings = match class {
            None => self.classes.get(self.outermost),
            Some(name) => Some(self.classes.get(name).ok_or_else(|| {
                let problem = Problem::unknown("class", name, self.classes.keys().copied());
                FileError::new(reader.location(node), problem)
            })?),
        };
        Ok(Element {
            node,
            settings: settings.and_then(|class| class.get(node.tag_name().name())),
        })
    }
}

impl<'n, 'a> Element<'_, 'n, 'a> {
    /// An element that has no defaults.
    pub(super) const fn plain(node: Node<'n, 'a>) -> Self {
        Self {
            node,
            settings: None,
        }
    }

    /// The element that states an attribute: this one, or a default.
    pub(super) fn source(&self, attribute: &str) -> Node<'n, 'a> {
        if self.node.has_attribute(attribute) {
            return self.node;
        }
        let default = self.settings.and_then(|settings| settings.get(attribute));
        default.copied().unwrap_or(self.node)
    }

    pub(super) fn has(&self, attribute: &str) -> bool {
        self.source(attribute).has_attribute(attribute)
    }

    pub(super) fn text(
        &self,
        reader: &Reader<'a>,
        attribute: &'static str,
    ) -> Result<Option<&'n str>, XmlError> {
        reader.optional_text(self.source(attribute), attribute)
    }

    pub(super) fn number(
        &self,
        reader: &Reader<'a>,
        attribute: &'static str,
    ) -> Result<Option<f64>, XmlError> {
        reader.optional_number(self.source(attribute), attribute)
    }

    pub(super) fn numbers<const N: usize>(
        &self,
        reader: &Reader<'a>,
        attribute: &'static str,
    ) -> Result<Option<[f64; N]>, XmlError> {
        reader.optional_numbers(self.source(attribute), attribute)
    }

    pub(super) fn vector(
        &self,
        reader: &Reader<'a>,
        attribute: &'static str,
    ) -> Result<Option<DVec3>, XmlError> {
        reader.optional_vector(self.source(attribute), attribute)
    }

    /// Any number of numbers.
    pub(super) fn list(
        &self,
        reader: &Reader<'a>,
        attribute: &'static str,
    ) -> Result<Option<Vec<f64>>, XmlError> {
        let node = self.source(attribute);
        let text = reader.optional_text(node, attribute)?;
        text.map(|text| reader.number_list(node, attribute, text))
            .transpose()
    }

    /// `true`, `false` or, where neither is stated, what `automatic` says.
    pub(super) fn flag(
        &self,
        reader: &Reader<'a>,
        attribute: &'static str,
        automatic: bool,
    ) -> Result<bool, FileError> {
        let node = self.source(attribute);
        if node.attribute(attribute) == Some("auto") {
            return Ok(automatic);
        }
        let stated = super::compiler::boolean(reader, node, attribute)?;
        Ok(stated.unwrap_or(automatic))
    }
}
