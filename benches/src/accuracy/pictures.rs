//! Pictures of entries: errors over the number of bodies, and over the ratio of masses.

use super::entry::Entry;
use crate::plot::{Curve, Curves, Plot, Unit};

/// Families of patterns, by what comes before the ratio in their names, and the first point.
const RATIOS: [(&str, &str); 3] = [
    ("alternating ", "masses alternate"),
    ("heavy tip ", "the last body is heavier"),
    (" decades", "masses are random over decades"),
];

/// The pictures that these entries call for.
pub(super) fn of(entries: &[Entry]) -> Vec<Plot> {
    let mut plots = Vec::new();
    let patterns = [
        ("chain", "equal"),
        ("tree", "equal"),
        ("chain", "8 decades"),
    ];
    for (shape, pattern) in patterns {
        let of_case = |entry: &&Entry| entry.shape == shape && entry.pattern == pattern;
        let curves = curves(entries, of_case, |entry| {
            #[expect(clippy::cast_precision_loss, reason = "a size")]
            let bodies = entry.bodies as f64;
            Some(bodies)
        });
        plots.extend(Plot::of_curves(
            &format!("error-against-bodies-{shape}-{}", pattern.replace(' ', "-")),
            &Curves {
                title: format!("{shape}, {pattern}: error against the number of bodies"),
                horizontal: ("bodies".to_owned(), Unit::Count),
                ..frame(entries)
            }
            .with(curves),
        ));
    }
    let Some(bodies) = largest_common(entries) else {
        return plots;
    };
    for shape in ["chain", "tree"] {
        for (family, what) in RATIOS {
            let of_family = |entry: &&Entry| {
                entry.shape == shape
                    && entry.bodies == bodies
                    && (entry.pattern == "equal" || entry.pattern.contains(family))
            };
            let curves = curves(entries, of_family, |entry| ratio(&entry.pattern, family));
            let name = what.rsplit(' ').next().unwrap_or(what);
            plots.extend(Plot::of_curves(
                &format!("error-against-masses-{shape}-{name}"),
                &Curves {
                    title: format!("{shape} of {bodies}, {what}: error against the ratio"),
                    horizontal: ("largest mass over smallest".to_owned(), Unit::Number),
                    ..frame(entries)
                }
                .with(curves),
            ));
        }
    }
    plots
}

impl Curves {
    fn with(self, curves: Vec<Curve>) -> Self {
        Self { curves, ..self }
    }
}

fn frame(entries: &[Entry]) -> Curves {
    let seeds = || entries.iter().map(|entry| entry.seeds);
    let [least, most] = [seeds().min(), seeds().max()].map(Option::unwrap_or_default);
    let seeds = if least == most {
        most.to_string()
    } else {
        format!("{least} to {most}")
    };
    Curves {
        title: String::new(),
        subtitle: format!(
            "Medians of {seeds} seeds, and bars to the largest, against the reference precision"
        ),
        vertical: (
            "forward error, relative to the largest reference value".to_owned(),
            Unit::Number,
        ),
        horizontal: (String::new(), Unit::Number),
        remark: "A number after + counts corrections. Where most problems are refused there is no point. Curves lie a \
                 little side by side, so that none hides another."
            .to_owned(),
        curves: Vec::new(),
    }
}

/// A curve a solver, over what `x` says, in order of that.
fn curves(
    entries: &[Entry],
    filter: impl Fn(&&Entry) -> bool,
    x: impl Fn(&Entry) -> Option<f64>,
) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    // Those of all entries: a solver looks the same on each picture.
    for entry in entries {
        let label = label(entry);
        if !curves.iter().any(|curve| curve.label == label) {
            curves.push(Curve {
                label,
                turn: curves.len(),
                points: Vec::new(),
                bars: Vec::new(),
            });
        }
    }
    for entry in entries.iter().filter(filter) {
        let (Some(x), Some(median)) = (x(entry), entry.median) else {
            continue;
        };
        if 2 * entry.refused > entry.seeds {
            continue;
        }
        let is_its = |curve: &&mut Curve| curve.label == label(entry);
        if let Some(curve) = curves.iter_mut().find(is_its) {
            curve.points.push((x, median));
            curve.bars.extend(entry.max.map(|max| (x, max)));
        }
    }
    for curve in &mut curves {
        curve.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    curves.retain(|curve| curve.points.len() > 1);
    curves
}

/// Name of a solver.
fn label(entry: &Entry) -> String {
    format!("{} {}", entry.method, entry.precision)
}

/// The ratio in a pattern's name: 1 of equal masses.
fn ratio(pattern: &str, family: &str) -> Option<f64> {
    if pattern == "equal" {
        return Some(1.0);
    }
    if let Some(decades) = pattern.strip_suffix(" decades") {
        return decades.parse::<f64>().ok().map(libm::exp10);
    }
    pattern.strip_prefix(family)?.parse().ok()
}

/// The largest number of bodies that every chain and tree was measured with.
fn largest_common(entries: &[Entry]) -> Option<usize> {
    let plain = || entries.iter().filter(|entry| entry.shape != "hard");
    let mut sizes: Vec<usize> = plain().map(|entry| entry.bodies).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let has = |pattern: &str, bodies: usize| {
        plain().any(|entry| entry.pattern == pattern && entry.bodies == bodies)
    };
    let all = |bodies: &usize| plain().all(|entry| has(&entry.pattern, *bodies));
    sizes.into_iter().rev().find(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::Solvers;
    use crate::accuracy::case::Case;
    use crate::accuracy::entry::measure;
    use crate::interrupt::Interrupt;

    #[test]
    fn ratios_are_read_from_names() {
        assert_eq!(ratio("equal", "alternating "), Some(1.0));
        assert_eq!(ratio("alternating 1e4", "alternating "), Some(1e4));
        assert_eq!(ratio("8 decades", " decades"), Some(1e8));
        assert_eq!(ratio("heavy base 1e4", "heavy tip "), None);
    }

    #[test]
    fn entries_give_pictures() {
        let named = |name: &str| Case::all().into_iter().find(|case| case.name() == name);
        let mut entries = Vec::new();
        for name in ["chain, equal", "chain, alternating 1e2"] {
            for bodies in [3, 6] {
                let case = named(name).unwrap();
                let measured = measure(&Solvers::on_cpu(), &case, bodies, 3, &Interrupt::default());
                entries.extend(measured.unwrap().unwrap());
            }
        }
        let plots = of(&entries);
        let titles: Vec<&str> = plots.iter().map(Plot::title).collect();
        assert_eq!(
            titles,
            [
                "chain, equal: error against the number of bodies",
                "chain of 6, masses alternate: error against the ratio"
            ]
        );
        assert!(plots[1].svg().unwrap().contains("to 1e-10 any"));
    }
}
