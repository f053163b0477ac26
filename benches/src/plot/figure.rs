//! A picture as a list of shapes in the order they are drawn; lengths in pixels, y downwards.

use std::sync::Once;

use plotters::style::{FontDesc, FontFamily, FontStyle, register_font};

use super::paint::{BITMAP_HEIGHT_PER_EM, MARKER};

/// A place in the picture \[px\].
pub(super) type Point = (f64, f64);

/// Radius of the ring about a point of a front \[px\].
pub(super) const RING: f64 = MARKER + 3.5;

/// An opaque colour, red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Color(pub(super) u8, pub(super) u8, pub(super) u8);

pub(super) const WHITE: Color = Color(255, 255, 255);
/// Titles and labels.
pub(super) const INK: Color = Color(34, 34, 34);
/// Secondary text, and the axes.
pub(super) const MUTED: Color = Color(96, 96, 96);
/// Published figures.
pub(super) const PUBLISHED: Color = Color(128, 128, 128);
/// Grid lines.
pub(super) const GRID: Color = Color(226, 226, 226);

impl Color {
    /// The colour darkened, for text, which needs more contrast than a filled shape.
    pub(super) fn for_text(self) -> Self {
        let darker = |channel: u8| channel / 4 * 3;
        Self(darker(self.0), darker(self.1), darker(self.2))
    }

    /// The colour mixed with white, for what stands behind the data.
    pub(super) fn pale(self) -> Self {
        let paler = |channel: u8| u8::MAX - (u8::MAX - channel) / 5 * 2;
        Self(paler(self.0), paler(self.1), paler(self.2))
    }
}

/// The form of a data point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Marker {
    Circle,
    Square,
    Diamond,
    Up,
    Down,
}

/// Where a text lies against its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Center,
    Right,
}

/// A line of text.
#[derive(Debug, Clone)]
pub(super) struct Text {
    /// Its left end, centre or right end by `align`, at half the height of the capitals.
    pub(super) at: Point,
    pub(super) text: String,
    /// Font size, the em \[px\].
    pub(super) em: f64,
    pub(super) bold: bool,
    pub(super) color: Color,
    pub(super) align: Align,
}

/// One shape.
#[derive(Debug, Clone)]
pub(super) enum Shape {
    /// A line through points, solid.
    Line {
        points: Vec<Point>,
        color: Color,
        width: f64,
    },
    /// A data point; a hollow one has a white inside.
    Marker {
        at: Point,
        marker: Marker,
        color: Color,
        hollow: bool,
    },
    /// A text.
    Text(Text),
}

/// An upright rectangle \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rect {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Rect {
    /// The square of the given half width about a point.
    pub(super) fn around((x, y): Point, half: f64) -> Self {
        Self {
            left: x - half,
            top: y - half,
            right: x + half,
            bottom: y + half,
        }
    }

    /// The rectangle about a level or upright line, of the given half width.
    pub(super) fn along([from, to]: [Point; 2], half: f64) -> Self {
        Self {
            left: from.0.min(to.0) - half,
            top: from.1.min(to.1) - half,
            right: from.0.max(to.0) + half,
            bottom: from.1.max(to.1) + half,
        }
    }

    /// Whether the two share more than an edge.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    /// Whether `other` lies within.
    pub(super) fn contains(&self, other: &Self) -> bool {
        self.left <= other.left
            && other.right <= self.right
            && self.top <= other.top
            && other.bottom <= self.bottom
    }

    /// The point of the rectangle nearest to another.
    pub(super) fn nearest(&self, (x, y): Point) -> Point {
        (
            x.clamp(self.left, self.right),
            y.clamp(self.top, self.bottom),
        )
    }
}

/// A picture.
#[derive(Debug)]
pub(super) struct Figure {
    pub(super) title: String,
    /// Width \[px\].
    pub(super) width: u32,
    /// Height \[px\].
    pub(super) height: u32,
    pub(super) shapes: Vec<Shape>,
}

impl Figure {
    /// Adds a solid line.
    pub(super) fn line(&mut self, points: &[Point], color: Color, width: f64) {
        self.shapes.push(Shape::Line {
            points: points.to_vec(),
            color,
            width,
        });
    }

    /// Adds a dashed line with dashes and gaps of the given lengths.
    pub(super) fn dashed(
        &mut self,
        points: &[Point],
        color: Color,
        width: f64,
        (dash, gap): (f64, f64),
    ) {
        // How far into the current dash and gap the line is, carried over the corners.
        let mut phase = 0.0;
        for pair in points.windows(2) {
            let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
            let length = (x1 - x0).hypot(y1 - y0);
            let at = |s: f64| (x0 + (x1 - x0) * s / length, y0 + (y1 - y0) * s / length);
            let mut start = -phase;
            while start < length {
                let (from, to) = (start.max(0.0), (start + dash).min(length));
                if from < to {
                    self.line(&[at(from), at(to)], color, width);
                }
                start += dash + gap;
            }
            phase = (phase + length) % (dash + gap);
        }
    }

    /// Adds a data point.
    pub(super) fn marker(&mut self, at: Point, marker: Marker, color: Color, hollow: bool) {
        self.shapes.push(Shape::Marker {
            at,
            marker,
            color,
            hollow,
        });
    }

    /// Adds a ring, which marks a data point as one of a front.
    pub(super) fn ring(&mut self, (x, y): Point) {
        const CORNERS: u32 = 32;
        let corner = |index: u32| {
            let angle = core::f64::consts::TAU * f64::from(index) / f64::from(CORNERS);
            (x + RING * angle.cos(), y + RING * angle.sin())
        };
        let circle: Vec<Point> = (0..=CORNERS).map(corner).collect();
        self.line(&circle, INK, 1.5);
    }

    /// Adds a plain text.
    pub(super) fn text(&mut self, at: Point, text: &str, em: f64, color: Color, align: Align) {
        self.shapes.push(Shape::Text(Text {
            at,
            text: text.to_owned(),
            em,
            bold: false,
            color,
            align,
        }));
    }

    /// Adds a bold text.
    pub(super) fn heading(&mut self, at: Point, text: &str, em: f64, align: Align) {
        let text = text.to_owned();
        self.shapes.push(Shape::Text(Text {
            at,
            text,
            em,
            bold: true,
            color: INK,
            align,
        }));
    }
}

/// Makes the built-in font known to plotters, once. SVG viewers set the same texts in their own
/// sans serif.
pub(super) fn load_fonts() {
    static LOADED: Once = Once::new();
    LOADED.call_once(|| {
        // The two fonts are compiled in and well formed; were they not, drawing text would report
        // it.
        drop(register_font(
            "sans-serif",
            FontStyle::Normal,
            dejavu::sans::regular(),
        ));
        drop(register_font(
            "sans-serif",
            FontStyle::Bold,
            dejavu::sans::bold(),
        ));
    });
}

/// Width of a text of the given font size \[px\].
pub(super) fn text_width(text: &str, em: f64, bold: bool) -> f64 {
    load_fonts();
    // Measured large, as plotters rounds down to whole pixels.
    let zoom = 16.0;
    let style = if bold {
        FontStyle::Bold
    } else {
        FontStyle::Normal
    };
    let font = FontDesc::new(
        FontFamily::SansSerif,
        zoom * em * BITMAP_HEIGHT_PER_EM,
        style,
    );
    font.box_size(text)
        .map_or(0.0, |(width, _)| f64::from(width) / zoom)
}

/// The text in as few lines as fit in `width` \[px\], broken between words.
pub(super) fn wrap(text: &str, em: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), em, false) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The text, or as much of its beginning as fits in `width` \[px\] with an ellipsis.
pub(super) fn fit(text: &str, em: f64, bold: bool, width: f64) -> String {
    if text_width(text, em, bold) <= width {
        return text.to_owned();
    }
    let mut kept: Vec<char> = text.chars().collect();
    while kept.pop().is_some() {
        let shortened = format!("{}…", kept.iter().collect::<String>().trim_end());
        if text_width(&shortened, em, bold) <= width {
            return shortened;
        }
    }
    String::new()
}
