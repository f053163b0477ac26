//! Places for the labels of points, so that no label covers another, a point, or a line to a label.

use std::f64::consts::TAU;

use super::figure::{Point, Rect};

/// Steps between trial distances from the point, the first of them \[px\].
const STEP: f64 = 9.0;
/// Trial distances.
const DISTANCES: usize = 24;
/// Trial directions at each distance.
const DIRECTIONS: usize = 16;
/// Labels farther from their point than this get a line to it \[px\].
const NEAR: f64 = 14.0;

/// A label to place: its point and its size \[px\].
pub(super) struct Label {
    pub(super) point: Point,
    pub(super) width: f64,
    pub(super) height: f64,
}

/// A place for each label within `bounds` that avoids `obstacles` and the labels before it, the
/// nearest that there is.
///
/// Lines to labels avoid them too as long as any place allows that. `None` for a label that has no
/// place.
pub(super) fn place(labels: &[Label], obstacles: &[Rect], bounds: &Rect) -> Vec<Option<Rect>> {
    let mut taken = obstacles.to_vec();
    let mut lines: Vec<Rect> = Vec::new();
    let mut places = Vec::new();
    for label in labels {
        let clear = |rect: &Rect, of: &[Rect]| !of.iter().any(|other| rect.overlaps(other));
        let free = |candidate: &Rect| bounds.contains(candidate) && clear(candidate, &taken);
        let tidy = |candidate: &Rect| {
            free(candidate)
                && clear(candidate, &lines)
                && leader(label.point, candidate)
                    .iter()
                    .all(|part| clear(part, &taken) && clear(part, &lines))
        };
        let place = candidates(label)
            .find(tidy)
            .or_else(|| candidates(label).find(free));
        if let Some(place) = place {
            taken.push(place);
            lines.extend(leader(label.point, &place));
        }
        places.push(place);
    }
    places
}

/// Trial places from near to far, and at each distance from the right round upwards.
fn candidates(label: &Label) -> impl Iterator<Item = Rect> {
    let (x, y) = label.point;
    let (width, height) = (label.width, label.height);
    (1..=DISTANCES).flat_map(move |step| {
        (0..DIRECTIONS).map(move |direction| {
            let distance = STEP * step as f64;
            let (sin, cos) = (TAU * direction as f64 / DIRECTIONS as f64).sin_cos();
            let (cx, cy) = (
                x + cos * (distance + 0.5 * width),
                y - sin * (distance + 0.5 * height),
            );
            Rect {
                left: cx - 0.5 * width,
                right: cx + 0.5 * width,
                top: cy - 0.5 * height,
                bottom: cy + 0.5 * height,
            }
        })
    })
}

/// Where the line from a point to its label ends; `None` when the label is near enough to need
/// none.
pub(super) fn leader_end(point: Point, place: &Rect) -> Option<Point> {
    let end = place.nearest(point);
    ((end.0 - point.0).hypot(end.1 - point.1) > NEAR).then_some(end)
}

/// Small squares along the line from a point to its label, without its first part: at its own
/// marker it has to start.
fn leader(point: Point, place: &Rect) -> Vec<Rect> {
    let Some(end) = leader_end(point, place) else {
        return Vec::new();
    };
    let length = (end.0 - point.0).hypot(end.1 - point.1);
    let mut squares = Vec::new();
    let mut along = NEAR;
    while along < length - 2.0 {
        let part = along / length;
        squares.push(Rect::around(
            (
                point.0 + part * (end.0 - point.0),
                point.1 + part * (end.1 - point.1),
            ),
            1.0,
        ));
        along += 4.0;
    }
    squares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crowded_labels_stay_apart() {
        let bounds = Rect {
            left: 0.0,
            top: 0.0,
            right: 800.0,
            bottom: 500.0,
        };
        let points: Vec<Point> = (0..20)
            .map(|i| {
                (
                    300.0 + 7.0 * f64::from(i % 5),
                    200.0 + 6.0 * f64::from(i / 5),
                )
            })
            .collect();
        let labels: Vec<Label> = points
            .iter()
            .map(|point| Label {
                point: *point,
                width: 50.0,
                height: 16.0,
            })
            .collect();
        let obstacles: Vec<Rect> = points
            .iter()
            .map(|point| Rect::around(*point, 6.0))
            .collect();
        let places: Vec<Rect> = place(&labels, &obstacles, &bounds)
            .into_iter()
            .flatten()
            .collect();
        assert_eq!(places.len(), labels.len());
        for (index, place) in places.iter().enumerate() {
            assert!(bounds.contains(place));
            assert!(
                !places[..index]
                    .iter()
                    .chain(&obstacles)
                    .any(|other| place.overlaps(other)),
                "{index}"
            );
        }
    }

    #[test]
    fn a_label_without_room_is_not_placed() {
        let bounds = Rect {
            left: 0.0,
            top: 0.0,
            right: 40.0,
            bottom: 40.0,
        };
        let label = Label {
            point: (20.0, 20.0),
            width: 50.0,
            height: 16.0,
        };
        assert_eq!(place(&[label], &[], &bounds), [None]);
    }
}
