//! A figure as SVG or PNG, drawn by plotters.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::Color as _;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::PlotError;
use super::figure::{Align, Color, Figure, Marker, Point, Shape, Text, load_fonts};

/// Plotters works in whole pixels without smoothing: both formats are drawn this much larger, and
/// then the bitmap is averaged down and the vector drawing scaled down by its view box.
const ZOOM: u32 = 4;
/// Half the width of a marker \[px\].
pub(super) const MARKER: f64 = 5.5;
/// Width of a marker's white rim, which sets it off from lines and other markers \[px\].
const RIM: f64 = 1.5;

/// Height that the bitmap backend takes as the size of a font, in em: ascent and descent of DejaVu
/// Sans, 1901 and 483 of 2048 units.
pub(super) const BITMAP_HEIGHT_PER_EM: f64 = (1901.0 + 483.0) / 2048.0;
/// Half the height of the capitals \[em\].
const HALF_CAPITAL: f64 = 0.5 * 1493.0 / 2048.0;

/// How a backend of plotters sets text that is anchored at the top.
#[derive(Clone, Copy)]
struct Typesetting {
    /// Size to ask for \[em\].
    size: f64,
    /// From the place asked for down to the baseline \[em\].
    baseline: f64,
}

const SVG: Typesetting = Typesetting {
    size: 1.24,
    baseline: 0.76,
};
const BITMAP: Typesetting = Typesetting {
    size: BITMAP_HEIGHT_PER_EM,
    baseline: 0.5 * BITMAP_HEIGHT_PER_EM,
};

/// The figure as an SVG document.
pub(super) fn svg(figure: &Figure) -> Result<String, PlotError> {
    let (width, height) = (ZOOM * figure.width, ZOOM * figure.height);
    let mut document = String::new();
    {
        let area = SVGBackend::with_string(&mut document, (width, height)).into_drawing_area();
        draw(figure, &area, SVG).map_err(|error| failure(figure, &error))?;
    }
    let drawn = format!("width=\"{width}\" height=\"{height}\"");
    let shown = format!("width=\"{}\" height=\"{}\"", figure.width, figure.height);
    Ok(document.replacen(&drawn, &shown, 1))
}

/// The figure as the bytes of a PNG file.
pub(super) fn png(figure: &Figure) -> Result<Vec<u8>, PlotError> {
    let (width, height) = (ZOOM * figure.width, ZOOM * figure.height);
    let mut pixels = vec![255; 3 * width as usize * height as usize];
    {
        let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        draw(figure, &area, BITMAP).map_err(|error| failure(figure, &error))?;
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, figure.width, figure.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    // Flat colours: plain bytes repeat, differences between neighbours do not.
    encoder.set_filter(png::FilterType::NoFilter);
    encoder.set_compression(png::Compression::Best);
    encoder
        .write_header()
        .and_then(|mut writer| {
            writer.write_image_data(&average_down(&pixels, figure.width as usize))
        })
        .map_err(|error| failure(figure, &error))?;
    Ok(file)
}

fn failure(figure: &Figure, error: &dyn std::fmt::Display) -> PlotError {
    PlotError::Draw {
        title: figure.title.clone(),
        message: error.to_string(),
    }
}

/// Each pixel the mean of its `ZOOM` x `ZOOM` block; `pixels` are RGB rows of `ZOOM * width`
/// pixels.
fn average_down(pixels: &[u8], width: usize) -> Vec<u8> {
    let zoom = ZOOM as usize;
    let mut small = Vec::with_capacity(pixels.len() / (zoom * zoom));
    for rows in pixels.chunks_exact(3 * zoom * zoom * width) {
        for x in 0..width {
            for channel in 0..3 {
                let sum: u32 = rows
                    .chunks_exact(3 * zoom * width)
                    .flat_map(|row| {
                        row[3 * zoom * x..3 * zoom * (x + 1)]
                            .iter()
                            .skip(channel)
                            .step_by(3)
                    })
                    .map(|value| u32::from(*value))
                    .sum();
                small.push(u8::try_from(sum / (ZOOM * ZOOM)).unwrap_or(u8::MAX));
            }
        }
    }
    small
}

/// Draws the shapes in their order.
fn draw<DB: DrawingBackend>(
    figure: &Figure,
    area: &DrawingArea<DB, Shift>,
    typesetting: Typesetting,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    load_fonts();
    area.fill(&WHITE)?;
    for shape in &figure.shapes {
        match shape {
            Shape::Line {
                points,
                color,
                width,
            } => {
                let points: Vec<_> = points.iter().copied().map(pixel).collect();
                let width = u32::try_from(whole(width * f64::from(ZOOM)).max(1)).unwrap_or(1);
                area.draw(&PathElement::new(points, rgb(*color).stroke_width(width)))?;
            }
            Shape::Marker {
                at,
                marker,
                color,
                hollow,
            } => {
                mark(area, *at, *marker, MARKER + RIM, super::figure::WHITE)?;
                mark(area, *at, *marker, MARKER, *color)?;
                if *hollow {
                    mark(area, *at, *marker, MARKER - 2.0, super::figure::WHITE)?;
                }
            }
            Shape::Text(text) => draw_text(area, text, typesetting)?,
        }
    }
    area.present()
}

/// Fills a marker of the given half width.
fn mark<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    (x, y): Point,
    marker: Marker,
    half: f64,
    color: Color,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let style = rgb(color).filled();
    // Half widths that give all markers about the same area as the circle.
    let corners: &[Point] = match marker {
        Marker::Circle => {
            let radius = whole(half * f64::from(ZOOM));
            return area.draw(&Circle::new(pixel((x, y)), radius, style));
        }
        Marker::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        Marker::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
        Marker::Up => &[(0.0, -1.3), (1.2, 0.85), (-1.2, 0.85)],
        Marker::Down => &[(0.0, 1.3), (1.2, -0.85), (-1.2, -0.85)],
    };
    let corners: Vec<_> = corners
        .iter()
        .map(|(dx, dy)| pixel((x + half * dx, y + half * dy)))
        .collect();
    area.draw(&Polygon::new(corners, style))
}

fn draw_text<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    text: &Text,
    typesetting: Typesetting,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let style = if text.bold {
        FontStyle::Bold
    } else {
        FontStyle::Normal
    };
    let horizontal = match text.align {
        Align::Left => HPos::Left,
        Align::Center => HPos::Center,
        Align::Right => HPos::Right,
    };
    let font = FontDesc::new(
        FontFamily::SansSerif,
        f64::from(ZOOM) * typesetting.size * text.em,
        style,
    );
    let color = rgb(text.color);
    let style = TextStyle::from(font)
        .color(&color)
        .pos(Pos::new(horizontal, VPos::Top));
    let (x, y) = text.at;
    let top = y + text.em * (HALF_CAPITAL - typesetting.baseline);
    area.draw(&plotters::element::Text::new(
        text.text.as_str(),
        pixel((x, top)),
        style,
    ))
}

fn rgb(Color(red, green, blue): Color) -> RGBColor {
    RGBColor(red, green, blue)
}

/// A place in the enlarged drawing.
fn pixel((x, y): Point) -> (i32, i32) {
    let zoom = f64::from(ZOOM);
    (whole(x * zoom), whole(y * zoom))
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "saturates far outside any picture"
)]
fn whole(value: f64) -> i32 {
    value.round() as i32
}
