//! Strands: hair, ropes, roots, tentacles, given as polylines.
//!
//! The text format has one statement a line; blank lines and what follows a `#` do not count.
//!
//! ```text
//! strands 1          # the format and its version
//! unit 0.01          # metres a unit of all lengths that follow; 1 without it
//! radius 0.004       # of the strands that follow, in units; 1 mm without it
//! density 1300       # of the strands that follow [kg/m^3]; 1000 without it
//! strand fringe      # a new strand; without a name it is called strand_N
//! 0 0 150            # its points from the root on, two at least
//! 0 1 149
//! 0 2 147
//! ```
//!
//! [`parse`] and [`read`] give polylines, [`Strands::build`] makes chains of them: a link from each
//! point to the next, carried at its first point by a joint of the kind asked for, the first link by
//! the world. At q = 0 the strands are as the text has them.
//!
//! ```
//! use vertebra_assembly::Joint;
//! use vertebra_files::strands;
//!
//! let strands = strands::parse("strands 1\nradius 0.01\nstrand rope\n0 0 0\n0 0 -1\n0 0 -2")?;
//! let model = strands.build(&Joint::spherical(), None)?;
//! assert_eq!(model.bodies()[1].name, "rope.2");
//! # Ok::<(), vertebra_files::FileError>(())
//! ```

use crate::tree::Names;
use crate::{FileError, Part, Problem, Shape, read_text};
use core::fmt::Write as _;
use glam::{DQuat, DVec3};
use std::path::Path;
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription};
use vertebra_spatial::Pose;

/// Version of the format written, and the only one read.
const VERSION: &str = "1";

/// A polyline with a thickness.
#[derive(Clone, Debug, PartialEq)]
pub struct Strand {
    /// Name, unique among the strands.
    pub name: String,
    /// Points from the root on \[m\].
    pub points: Vec<DVec3>,
    /// Radius \[m\].
    pub radius: f64,
    /// Density [kg/m^3].
    pub density: f64,
    /// Line of the text on which it starts, from 1; 0 where it came from elsewhere.
    pub line: u32,
}

/// Several strands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strands {
    /// The strands.
    pub strands: Vec<Strand>,
}

/// Reads a file of strands.
///
/// # Errors
/// [`FileError`], naming the file, line and element that is wrong and what to do.
pub fn read(path: impl AsRef<Path>) -> Result<Strands, FileError> {
    let path = path.as_ref();
    parse(&read_text(path)?).map_err(|error| error.in_file(path))
}

/// Reads text of strands.
///
/// # Errors
/// [`FileError`], naming the line and element that is wrong and what to do.
pub fn parse(text: &str) -> Result<Strands, FileError> {
    let mut statements = (1..).zip(text.lines()).filter_map(|(line, text)| {
        let text = text.split('#').next().unwrap_or_default();
        let words: Vec<&str> = text.split_whitespace().collect();
        (!words.is_empty()).then_some((line, words))
    });
    let syntax = |line: usize, expected: &'static str, found: &[&str]| {
        let found: String = found.join(" ").chars().take(40).collect();
        let found = match found.as_str() {
            "" => "the end of the text".to_owned(),
            found => format!("`{found}`"),
        };
        FileError::on_line(line, "the strands", Problem::Syntax { expected, found })
    };
    match statements.next() {
        Some((_, words)) if words == ["strands", VERSION] => {}
        Some((line, words)) => return Err(syntax(line, "`strands 1`", &words)),
        None => return Err(syntax(1, "`strands 1`", &[])),
    }
    let (mut unit, mut radius, mut density) = (1.0, 1e-3, 1000.0);
    let mut strands: Vec<Strand> = Vec::new();
    let mut names = Names::default();
    for (line, words) in statements {
        let positive = |word: &str| {
            let number = word.parse::<f64>().ok();
            number
                .filter(|number| (1e-100..=1e100).contains(number))
                .ok_or_else(|| syntax(line, "a number above zero", &words))
        };
        match words[..] {
            ["unit", word] => unit = positive(word)?,
            ["radius", word] => radius = positive(word)? * unit,
            ["density", word] => density = positive(word)?,
            ["strand", ref name @ ..] => {
                let name = match name {
                    [] => names.fresh(format!("strand_{}", strands.len() + 1)),
                    words => {
                        let name = words.join(" ");
                        if !names.take(&name) {
                            let first = strands.iter().find(|strand| strand.name == name);
                            let first_line = first.map_or(0, |strand| strand.line);
                            let problem = Problem::DuplicateName { first_line };
                            return Err(FileError::on_line(
                                line,
                                format!("strand `{name}`"),
                                problem,
                            ));
                        }
                        name
                    }
                };
                strands.push(Strand {
                    name,
                    points: Vec::new(),
                    radius,
                    density,
                    line: u32::try_from(line).unwrap_or(u32::MAX),
                });
            }
            [x, y, z] => {
                let coordinate = |word: &str| {
                    let number = word.parse::<f64>().ok().map(|number| number * unit);
                    number
                        .filter(|number| number.abs() <= 1e100)
                        .ok_or_else(|| syntax(line, "a statement or three coordinates", &words))
                };
                let point = DVec3::new(coordinate(x)?, coordinate(y)?, coordinate(z)?);
                let Some(strand) = strands.last_mut() else {
                    return Err(syntax(line, "`strand` before its points", &words));
                };
                strand.points.push(point);
            }
            _ => return Err(syntax(line, "a statement or three coordinates", &words)),
        }
    }
    let strands = Strands { strands };
    strands.check()?;
    Ok(strands)
}

impl Strands {
    /// The strands as text that [`parse`] reads back to the last bit, in the order they have here.
    #[must_use]
    pub fn write(&self) -> String {
        let mut text = format!("strands {VERSION}\n");
        for strand in &self.strands {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "radius {:?}\ndensity {:?}\nstrand {}",
                strand.radius, strand.density, strand.name
            );
            for point in &strand.points {
                let _ = writeln!(text, "{:?} {:?} {:?}", point.x, point.y, point.z);
            }
        }
        text
    }

    /// Chains along the strands, one model: the links of strand `s` are called `s.1`, `s.2`, ... With a
    /// number of links every strand is cut anew into that many of equal length.
    ///
    /// # Errors
    /// [`FileError`], naming the strand that has too few points or two in the same place, or the
    /// joint that is impossible.
    pub fn build(&self, joint: &Joint, links: Option<usize>) -> Result<Model, FileError> {
        self.check()?;
        if self.strands.is_empty() || links == Some(0) {
            let problem = Problem::Empty("has no links; state a strand and at least one link");
            return Err(FileError::on_line(0, "the strands", problem));
        }
        let mut description = ModelDescription::new("strands");
        for strand in &self.strands {
            let mut parent: Option<String> = None;
            let mut before = Pose::IDENTITY;
            for (index, (from, to)) in strand.links(links).into_iter().enumerate() {
                let place = Pose::new(direction(to - from), from);
                let name = format!("{}.{}", strand.name, index + 1);
                let volume = core::f64::consts::PI * strand.radius.powi(2) * (to - from).length();
                let mass = MassProperties::rod(
                    volume * strand.density,
                    (to - from).length(),
                    strand.radius,
                );
                let joint = joint.clone().at(before.inverse() * place);
                description = description.body(name.clone(), parent.as_deref(), joint, mass);
                parent = Some(name);
                before = place;
            }
        }
        description.build().map_err(|error| {
            let of_strand = |strand: &&Strand| {
                error.culprit().is_some_and(|name| {
                    name.rsplit_once('.')
                        .is_some_and(|(name, _)| name == strand.name)
                })
            };
            let line = self
                .strands
                .iter()
                .find(of_strand)
                .map_or(0, |strand| strand.line);
            FileError::on_line(line as usize, "the strands", Problem::Model(error))
        })
    }

    /// The shapes of the links of a model made by [`build`](Self::build).
    #[must_use]
    pub fn parts(&self, model: &Model, links: Option<usize>) -> Vec<Part> {
        let of_strand = |strand: &Strand| {
            let (name, radius) = (strand.name.clone(), strand.radius);
            let numbered = strand.links(links).into_iter().zip(1..);
            numbered
                .map(move |((from, to), number): ((DVec3, DVec3), usize)| {
                    let length = (to - from).length();
                    Part {
                        body: model.find(&format!("{name}.{number}")),
                        placement: Pose::from_translation(DVec3::new(0.0, 0.0, 0.5 * length)),
                        shape: Shape::Capsule { radius, length },
                    }
                })
                .collect::<Vec<_>>()
        };
        self.strands.iter().flat_map(of_strand).collect()
    }

    fn check(&self) -> Result<(), FileError> {
        for strand in &self.strands {
            let short = strand.points.len() < 2;
            let meet = strand
                .points
                .windows(2)
                .any(|pair| (pair[1] - pair[0]).length() < 1e-100);
            let (reason, remedy) = match (short, meet) {
                (true, _) => ("has fewer than two points", "add points"),
                (false, true) => (
                    "has two neighbouring points in one place",
                    "remove one of them",
                ),
                (false, false) => continue,
            };
            let problem = Problem::Degenerate { reason, remedy };
            let element = format!("strand `{}`", strand.name);
            return Err(FileError::on_line(strand.line as usize, element, problem));
        }
        Ok(())
    }
}

impl Strand {
    /// A strand along points \[m\], with a radius \[m\] and a density [kg/m^3].
    #[must_use]
    pub fn new(name: impl Into<String>, points: Vec<DVec3>, radius: f64, density: f64) -> Self {
        Self {
            name: name.into(),
            points,
            radius,
            density,
            line: 0,
        }
    }

    /// Ends of the links: as the points have them, or that many of equal length along the polyline.
    fn links(&self, count: Option<usize>) -> Vec<(DVec3, DVec3)> {
        let segments = self.points.windows(2).map(|pair| (pair[0], pair[1]));
        let Some(count) = count else {
            return segments.collect();
        };
        let length: f64 = segments
            .clone()
            .map(|(from, to)| (to - from).length())
            .sum();
        #[expect(clippy::cast_precision_loss, reason = "links are far fewer than 2^53")]
        let step = length / count as f64;
        let mut cuts = vec![self.points[0]];
        let mut walked = 0.0;
        for (from, to) in segments {
            let own = (to - from).length();
            while cuts.len() < count {
                #[expect(clippy::cast_precision_loss, reason = "links are far fewer than 2^53")]
                let next = step * cuts.len() as f64;
                if next > walked + own {
                    break;
                }
                cuts.push(from + (to - from) * ((next - walked) / own));
            }
            walked += own;
        }
        cuts.extend(self.points.last());
        cuts.windows(2).map(|pair| (pair[0], pair[1])).collect()
    }
}

/// A rotation that takes z to the direction of a vector.
fn direction(v: DVec3) -> DQuat {
    DQuat::from_rotation_arc(DVec3::Z, v.normalize())
}
