//! From residues to bodies.

use super::residue::{Residue, Rider, Site};
use super::{Angle, Atom, Options, Protein, Torsion, torsion};
use crate::{FileError, Problem};
use glam::{DMat3, DVec3};
use vertebra_assembly::{Joint, MassProperties, ModelDescription};
use vertebra_spatial::{Pose, SmallCholesky};

/// Atoms that move together, and the bond they turn about.
struct Group<'r> {
    name: String,
    parent: Option<usize>,
    /// Where the joint is \[m\].
    origin: DVec3,
    /// The bond; none for a free body.
    axis: Option<DVec3>,
    angle: Option<(Angle, Option<f64>)>,
    residue: &'r str,
    atoms: Vec<(&'r str, &'r Site)>,
}

/// All chains as one model.
pub(super) fn build(
    chains: &[Vec<Residue>],
    mut left_out: Vec<String>,
    options: &Options,
) -> Result<Protein, FileError> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for residues in chains {
        let mut before: Option<(&Residue, usize)> = None;
        for residue in residues {
            let nitrogen = residue.place("N");
            let bound = before
                .filter(|(last, _)| last.place("C").distance(nitrogen) <= options.longest_bond);
            if let (Some((last, _)), None) = (before, bound) {
                left_out.push(format!(
                    "the bond from {} to {} is too long",
                    last.id, residue.id
                ));
            }
            before = Some((residue, add(&mut groups, residue, bound)?));
        }
    }
    if groups.is_empty() {
        let why = left_out.into_iter().next();
        let problem = Problem::Refused {
            reason: "has no amino acid with N, CA and C; choose a file with a protein".to_owned(),
            detail: why.unwrap_or_else(|| "there is no residue at all".to_owned()),
        };
        return Err(FileError::on_line(0, "the structure", problem));
    }
    assemble(&groups, left_out, options)
}

/// Adds the bodies of a residue, bound to the plane of the one before if there is one, and gives the
/// index of its own plane.
fn add<'r>(
    groups: &mut Vec<Group<'r>>,
    residue: &'r Residue,
    before: Option<(&'r Residue, usize)>,
) -> Result<usize, FileError> {
    let [n, ca, c] = ["N", "CA", "C"].map(|name| residue.place(name));
    let riders = residue.riders();
    let of = |rider: Rider| {
        let atoms = residue
            .sites
            .iter()
            .zip(&riders)
            .filter(move |(_, other)| **other == rider);
        atoms.map(|(site, _)| (residue.id.as_str(), site))
    };
    let group = |name: &str, parent: Option<usize>, origin: DVec3| Group {
        name: format!("{}:{name}", residue.id),
        parent,
        origin,
        axis: None,
        angle: None,
        residue: residue.id.as_str(),
        atoms: Vec::new(),
    };
    let bond = |from: DVec3, to: DVec3| {
        let length = to.distance(from);
        if (1e-12..1e-8).contains(&length) {
            return Ok((to - from) / length);
        }
        let problem = Problem::Degenerate {
            reason: "has two bonded atoms in one place, or far apart",
            remedy: "correct the coordinates, or remove the residue",
        };
        Err(FileError::on_line(
            0,
            format!("residue `{}`", residue.id),
            problem,
        ))
    };
    let start = match before {
        Some((_, plane)) => plane,
        None => {
            groups.push(group("N", None, n));
            groups.len() - 1
        }
    };
    groups[start].atoms.extend(of(Rider::Nitrogen));
    // Proline's ring holds CA where it is.
    let alpha = if residue.is_proline {
        start
    } else {
        let measured = before.map(|(last, _)| torsion([last.place("C"), n, ca, c]));
        groups.push(Group {
            axis: Some(bond(n, ca)?),
            angle: Some((Angle::Phi, measured)),
            ..group("CA", Some(start), n)
        });
        groups.len() - 1
    };
    groups[alpha].atoms.extend(of(Rider::SideChain(0)));
    // The side chain.
    let mut inner = alpha;
    for chi in 1..=residue.chi_count() {
        let names = [chi - 1, chi].map(|index| residue.chis[index]);
        let [from, to] = names.map(|name| residue.place(name));
        let name = names[1];
        let first = match chi {
            1 => Some(n),
            _ => Some(residue.place(residue.chis[chi - 2])),
        };
        let last = next_beyond(residue, chi);
        let measured = first
            .zip(last)
            .map(|(first, last)| torsion([first, from, to, last]));
        let number = u8::try_from(chi).unwrap_or(u8::MAX);
        groups.push(Group {
            axis: Some(bond(from, to)?),
            angle: Some((Angle::Chi(number), measured)),
            atoms: of(Rider::SideChain(chi)).collect(),
            ..group(name, Some(inner), from)
        });
        inner = groups.len() - 1;
    }
    // The plane to the next residue, whose N joins it later; psi is measured from there.
    groups.push(Group {
        axis: Some(bond(ca, c)?),
        angle: Some((Angle::Psi, None)),
        atoms: of(Rider::Carbonyl).collect(),
        ..group("C", Some(alpha), ca)
    });
    if let Some((last, plane)) = before {
        let points = [last.place("N"), last.place("CA"), last.place("C"), n];
        groups[plane].angle = Some((Angle::Psi, Some(torsion(points))));
    }
    Ok(groups.len() - 1)
}

/// The atom that a chi is measured to: the next on the side chain's way, or the first beyond its end
/// in the order of their names, as is the rule.
fn next_beyond(residue: &Residue, chi: usize) -> Option<DVec3> {
    if let Some(name) = residue.chis.get(chi + 1) {
        return residue
            .find(name)
            .map(|index| residue.sites[index].position);
    }
    let letter = "ABGDEZH".chars().nth(chi + 1)?;
    let beyond = residue
        .sites
        .iter()
        .filter(|site| site.element != 1 && site.name.chars().nth(1) == Some(letter));
    let first = beyond.min_by(|a, b| a.name.chars().skip(2).cmp(b.name.chars().skip(2)));
    first.map(|site| site.position)
}

fn assemble(
    groups: &[Group<'_>],
    left_out: Vec<String>,
    options: &Options,
) -> Result<Protein, FileError> {
    let mut description = ModelDescription::new("protein").gravity(DVec3::ZERO);
    let mut thickened = Vec::new();
    for group in groups {
        let (mass, is_thickened) = mass_of(group, options);
        if is_thickened {
            thickened.push(group.name.as_str());
        }
        let parent = group.parent.map(|parent| &groups[parent]);
        let from = parent.map_or(DVec3::ZERO, |parent| parent.origin);
        let joint = match group.axis {
            Some(axis) => Joint::revolute(axis),
            None => Joint::free(),
        };
        description = description.body(
            group.name.clone(),
            parent.map(|parent| parent.name.as_str()),
            joint.at(Pose::from_translation(group.origin - from)),
            mass,
        );
    }
    let model = description.build().map_err(|error| {
        let element = match error.culprit() {
            Some(name) => format!("body `{name}`"),
            None => "the structure".to_owned(),
        };
        FileError::on_line(0, element, Problem::Model(error))
    })?;
    let (mut torsions, mut atoms, mut sulphurs) = (Vec::new(), Vec::new(), Vec::new());
    for (id, group) in groups
        .iter()
        .filter_map(|group| Some((model.find(&group.name)?, group)))
    {
        if let Some((angle, start)) = group.angle {
            torsions.push(Torsion {
                body: id,
                angle,
                residue: group.residue.to_owned(),
                start,
            });
        }
        for &(residue, site) in &group.atoms {
            atoms.push(Atom {
                name: site.name.clone(),
                residue: residue.to_owned(),
                element: site.element,
                body: id,
                position: site.position - group.origin,
            });
            if site.name == "SG" {
                sulphurs.push((id, site.position));
            }
        }
    }
    // Two sulphurs are bonded at 2.05 Angstrom.
    let mut disulfides = Vec::new();
    for (index, &(a, at)) in sulphurs.iter().enumerate() {
        let near = sulphurs[index + 1..]
            .iter()
            .filter(|(_, other)| at.distance(*other) < 2.5e-10);
        disulfides.extend(near.map(|&(b, _)| [a, b]));
    }
    Ok(Protein {
        thickened: thickened
            .into_iter()
            .filter_map(|name| model.find(name))
            .collect(),
        torsions,
        atoms,
        disulfides,
        left_out,
        model,
    })
}

/// The atoms as points; as balls where points leave a turn without resistance.
fn mass_of(group: &Group<'_>, options: &Options) -> (MassProperties, bool) {
    let sum = |radius: f64| {
        group
            .atoms
            .iter()
            .fold(MassProperties::MASSLESS, |sum, (_, site)| {
                let ball = MassProperties {
                    center: site.position - group.origin,
                    ..MassProperties::sphere(site.mass, radius)
                };
                sum.combined(&ball)
            })
    };
    let points = sum(0.0);
    let enough = 1e-3 * points.mass * options.atom_radius * options.atom_radius;
    match moments_exceed(&points.inertia, enough) {
        true => (points, false),
        false => (sum(options.atom_radius), true),
    }
}

/// Whether every moment of an inertia exceeds a floor: I - floor is positive definite.
fn moments_exceed(inertia: &DMat3, floor: f64) -> bool {
    let scale = inertia
        .to_cols_array()
        .iter()
        .fold(floor, |most, x| most.max(x.abs()));
    if scale == 0.0 {
        return false;
    }
    let reduced = (*inertia - DMat3::from_diagonal(DVec3::splat(floor))) * scale.recip();
    let mut entries = [[0.0; 6]; 6];
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        entries[row][column] = reduced.col(column)[row];
    }
    SmallCholesky::factor(3, &entries, &[0.0; 6]).is_ok()
}
