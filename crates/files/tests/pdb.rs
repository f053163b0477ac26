//! Proteins: torsion-angle chains that keep bonds and angles, and everything that is refused.

#![cfg(feature = "pdb")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::DVec3;
use std::f64::consts::{PI, TAU};
use vertebra_assembly::{JointKind, Random, State};
use vertebra_dynamics::{Forces, Precision, Workspace, aba, forward_kinematics};
use vertebra_files::pdb::{self, Angle, Atom, Options, Protein, Torsion};

const PEPTIDE: &str = include_str!("data/peptide.pdb");

fn peptide() -> Protein {
    pdb::parse_pdb(PEPTIDE, &Options::default()).unwrap()
}

/// Where the atoms are at positions q \[m\].
fn places(protein: &Protein, state: &State) -> Vec<DVec3> {
    let mut workspace = Workspace::new(&protein.model, Precision::F64);
    forward_kinematics(&protein.model, state, &mut workspace).unwrap();
    let place = |atom: &Atom| {
        workspace
            .pose(atom.body)
            .unwrap()
            .transform_point(atom.position)
    };
    protein.atoms.iter().map(place).collect()
}

fn random_state(protein: &Protein, seed: u64) -> State {
    let mut random = Random::new(seed);
    let mut state = State::neutral(&protein.model);
    for body in protein.model.bodies() {
        if let JointKind::Revolute { .. } = body.joint.kind {
            state.q[body.position_start] = PI * random.symmetric();
        }
    }
    state
}

/// The torsion angle of four points, by the triple product of its definition.
fn dihedral([a, b, c, d]: [DVec3; 4]) -> f64 {
    let (u, v, w) = (b - a, c - b, d - c);
    let sine = v.length() * u.dot(v.cross(w));
    let cosine = u.cross(v).dot(v.cross(w));
    sine.atan2(cosine)
}

#[test]
fn atoms_are_where_the_file_has_them() {
    let protein = peptide();
    let found = places(&protein, &State::neutral(&protein.model));
    let rows = PEPTIDE.lines().filter(|line| line.starts_with("ATOM"));
    let mut count = 0;
    for row in rows {
        let name = row[12..16].trim();
        let residue = format!("A:{}", row[22..26].trim());
        let coordinate = |from: usize| row[from..from + 8].trim().parse::<f64>().unwrap();
        let stated = DVec3::new(coordinate(30), coordinate(38), coordinate(46)) * 1e-10;
        let atom = protein
            .atoms
            .iter()
            .position(|a| a.name == name && a.residue == residue);
        assert!(
            (found[atom.unwrap()] - stated).length() < 1e-23,
            "{residue}:{name}"
        );
        count += 1;
    }
    assert_eq!(protein.atoms.len(), count);
    assert_eq!(protein.left_out, ["A:101 (HOH) is no amino acid"]);
    // Free, phi of 10 residues (neither of the first nor of proline), psi of 12, chi of side chains:
    // SER 1, VAL 1, LYS 4, ILE 2, PHE 2, ASP 2, MET 3, CYS 1.
    assert_eq!(protein.model.dof_count(), 6 + 11 + 12 + 16);
}

#[test]
fn bonds_and_angles_stay_whatever_the_torsions() {
    let protein = peptide();
    let rest = places(&protein, &State::neutral(&protein.model));
    let bonded = |i: usize, j: usize| {
        let hydrogens = [i, j]
            .iter()
            .filter(|&&k| protein.atoms[k].element == 1)
            .count();
        hydrogens < 2
            && rest[i].distance(rest[j]) < if hydrogens == 1 { 1.25e-10 } else { 1.95e-10 }
    };
    let count = rest.len();
    let bonds: Vec<(usize, usize)> = (0..count)
        .flat_map(|i| (i + 1..count).map(move |j| (i, j)))
        .filter(|&(i, j)| bonded(i, j))
        .collect();
    // One bond fewer than atoms, but for the two rings.
    assert_eq!(bonds.len(), count - 1 + 2);
    let mut pairs = bonds.clone();
    for &(i, j) in &bonds {
        for &(k, l) in &bonds {
            let ends = if i == k {
                (j, l)
            } else if i == l {
                (j, k)
            } else if j == k {
                (i, l)
            } else {
                (i, k)
            };
            let shared = [i, j].iter().filter(|&&a| a == k || a == l).count();
            if shared == 1 {
                pairs.push(ends);
            }
        }
    }
    for seed in 0..5 {
        let moved = places(&protein, &random_state(&protein, seed));
        for &(i, j) in &pairs {
            let change = moved[i].distance(moved[j]) - rest[i].distance(rest[j]);
            let (a, b) = (&protein.atoms[i], &protein.atoms[j]);
            assert!(
                change.abs() < 1e-22,
                "{}:{} {}:{}",
                a.residue,
                a.name,
                b.residue,
                b.name
            );
        }
    }
}

#[test]
fn torsions_are_what_q_adds_to_those_of_the_file() {
    let protein = peptide();
    let state = random_state(&protein, 8);
    let moved = places(&protein, &state);
    let find = |residue: &str, name: &str| {
        let atom = |a: &Atom| a.residue == residue && a.name == name;
        protein
            .atoms
            .iter()
            .position(atom)
            .map(|index| moved[index])
    };
    let neighbour = |torsion: &Torsion, step: i32| {
        let number: i32 = torsion.residue[2..].parse().unwrap();
        format!("A:{}", number + step)
    };
    let mut checked = 0;
    for torsion in &protein.torsions {
        let at = |name: &str| find(&torsion.residue, name);
        let points = match torsion.angle {
            Angle::Phi => [
                find(&neighbour(torsion, -1), "C"),
                at("N"),
                at("CA"),
                at("C"),
            ],
            Angle::Psi => [
                at("N"),
                at("CA"),
                at("C"),
                find(&neighbour(torsion, 1), "N"),
            ],
            Angle::Chi(1) => {
                let ends = ["OG", "SG", "CG", "CG1"].into_iter().find_map(at);
                [at("N"), at("CA"), at("CB"), ends]
            }
            Angle::Chi(2) => {
                let ends = ["CD", "CD1", "OD1", "SD"].into_iter().find_map(at);
                [at("CA"), at("CB"), at("CG").or(at("CG1")), ends]
            }
            Angle::Chi(3) => [at("CB"), at("CG"), at("CD").or(at("SD")), at("CE")],
            _ => [at("CG"), at("CD"), at("CE"), at("NZ")],
        };
        let [Some(a), Some(b), Some(c), Some(d)] = points else {
            assert_eq!(torsion.start, None);
            continue;
        };
        let body = protein.model.body(torsion.body).unwrap();
        let expected = torsion.start.unwrap() + state.q[body.position_start];
        let apart = (dihedral([a, b, c, d]) - expected).rem_euclid(TAU);
        assert!(apart.min(TAU - apart) < 1e-11, "{torsion:?}");
        checked += 1;
    }
    assert_eq!(
        checked,
        protein.torsions.len() - 2,
        "all but the first phi and the last psi"
    );
}

#[test]
fn both_formats_give_the_same_model() {
    let text = include_str!("data/peptide.cif");
    let other = pdb::parse_mmcif(text, &Options::default()).unwrap();
    let (other, same) = (other.model.describe(), peptide().model.describe());
    for (a, b) in other.bodies.iter().zip(&same.bodies) {
        assert_eq!(
            (&a.name, &a.parent, a.mass.mass),
            (&b.name, &b.parent, b.mass.mass)
        );
        // The parser rounds the numbers of the two formats in its own ways.
        let apart = a.joint.parent_placement.translation - b.joint.parent_placement.translation;
        assert!(apart.length() < 1e-23 && (a.mass.center - b.mass.center).length() < 1e-23);
    }
    assert_eq!(other.bodies.len(), same.bodies.len());
}

#[test]
fn every_body_resists_every_turn() {
    let protein = peptide();
    let weigh = |element: u8| match element {
        1 => 1.008,
        6 => 12.011,
        7 => 14.007,
        8 => 15.999,
        _ => 32.06,
    };
    let expected: f64 = protein.atoms.iter().map(|atom| weigh(atom.element)).sum();
    let mass: f64 = protein
        .model
        .bodies()
        .iter()
        .map(|body| body.mass.mass)
        .sum();
    assert!((mass / 1.660_539_068_92e-27 - expected).abs() < 1e-9 * expected);
    // The nitrogen at the start stands alone.
    assert_eq!(protein.thickened[0], protein.model.find("A:1:N").unwrap());
    for body in protein.model.bodies() {
        assert!(body.mass.inertia.determinant() > 0.0, "{}", body.name);
    }
    let mut workspace = Workspace::new(&protein.model, Precision::F64);
    for seed in 0..5 {
        let mut forces = Forces::none(&protein.model);
        forces.joint.fill(1e-21); // [N m]
        let state = random_state(&protein, seed);
        let qdd = aba(&protein.model, &state, &forces, &mut workspace).unwrap();
        assert!(qdd.iter().all(|x| x.is_finite()));
    }
}

/// Lines as older programs write them: nothing behind the coordinates, so that names tell the elements, and
/// records that no structure needs, broken.
#[test]
fn short_lines_and_foreign_records_are_read() {
    let coordinates = |line: &str| match line.starts_with("ATOM") || line.starts_with("HETATM") {
        true => line[..54].to_owned(),
        false => line.to_owned(),
    };
    let lines: Vec<String> = PEPTIDE.lines().map(coordinates).collect();
    let text = format!("CRYST1  what\nREMARK\nSEQRES\n{}\n", lines.join("\n"));
    let read = pdb::parse_pdb(&text, &Options::default()).unwrap();
    assert_eq!(read.model.describe(), peptide().model.describe());
    assert_eq!(read.atoms, peptide().atoms);
}

/// Each line of an atom as another writer has it.
fn rewritten(change: impl Fn(usize, &str) -> String) -> String {
    let line = |(number, line): (usize, &str)| match line.starts_with("ATOM") {
        true => change(number, line) + "\n",
        false => line.to_owned() + "\n",
    };
    PEPTIDE.lines().enumerate().map(line).collect()
}

/// Columns 73 to 80 as they were before 1996, names at the left of their columns, and selenium.
#[test]
fn elements_come_from_names_where_none_is_stated() {
    let old = rewritten(|number, line| format!("{:<72}1ABC{number:4}", &line[..66]));
    let left = |line: &str| {
        let (name, rest) = (line[12..16].trim(), &line[16..54]);
        format!("{}{name:<4}{rest}", &line[..12])
    };
    let numbered = |number: usize, line: &str| format!("{:<76}{:2}", left(line), number % 100);
    for text in [
        old,
        rewritten(|_, line| left(line)),
        rewritten(numbered),
        rewritten(|_, line| format!("{:<76} 1", &line[..54])),
    ] {
        let read = pdb::parse_pdb(&text, &Options::default()).unwrap();
        assert_eq!(read.atoms, peptide().atoms);
        assert_eq!(read.left_out, peptide().left_out);
    }
    for selenium in ["SE  ", " SE "] {
        let text = rewritten(|_, line| {
            let sulphur = format!("{selenium} MSE");
            let line = left(line).replace("SD   MET", &sulphur);
            line.replace(" MET ", " MSE ")
        });
        let read = pdb::parse_pdb(&text, &Options::default()).unwrap();
        let mut atoms = peptide().atoms;
        for atom in atoms.iter_mut().filter(|atom| atom.name == "SD") {
            (atom.name, atom.element) = ("SE".to_owned(), 34);
        }
        let elements = |atoms: &[Atom]| {
            let both = atoms.iter().map(|atom| (atom.name.clone(), atom.element));
            both.collect::<Vec<_>>()
        };
        assert_eq!(elements(&read.atoms), elements(&atoms));
    }
}

/// Beyond 99 999 atoms writers go on in base 36 or 16, with stars, or take a column more.
#[test]
fn serial_numbers_may_be_anything() {
    for serial in ["A0000 ", "***** ", "186a0 ", "      ", "100000"] {
        let text = rewritten(|_, line| format!("{}{serial}{}", &line[..6], &line[12..]));
        let read = pdb::parse_pdb(&text, &Options::default()).unwrap();
        assert_eq!(read.atoms, peptide().atoms, "{serial}");
    }
}

#[test]
fn gaps_start_chains_and_bridges_are_found() {
    let without = |number: &str| {
        let of = |line: &&str| line.starts_with("ATOM") && line[22..26].trim() == number;
        PEPTIDE
            .lines()
            .filter(|line| !of(line))
            .collect::<Vec<_>>()
            .join("\n")
    };
    let broken = pdb::parse_pdb(&without("6"), &Options::default()).unwrap();
    let free = broken
        .model
        .bodies()
        .iter()
        .filter(|body| body.joint.kind == JointKind::Free);
    assert_eq!(free.count(), 2);
    assert!(
        broken
            .left_out
            .iter()
            .any(|text| text.contains("from A:5 to A:7 is too long"))
    );
    // Half a residue is left out, and says what it lacks.
    let half: String = PEPTIDE
        .lines()
        .filter(|line| !line.contains(" CA  LYS"))
        .map(|line| format!("{line}\n"))
        .collect();
    let half = pdb::parse_pdb(&half, &Options::default()).unwrap();
    assert!(
        half.left_out
            .contains(&"A:6 (LYS) lacks its atom CA".to_owned()),
        "{:?}",
        half.left_out
    );
    let atom = |serial: u32, name: &str, residue: u32, x: f64, y: f64, element: &str| {
        format!(
            "ATOM  {serial:5}  {name:<3} CYS A{residue:4}    {x:8.3}{y:8.3}{:8.3}  1.00  0.00          {element:>2}\n",
            0.0
        )
    };
    let cysteine = |residue: u32, y: f64, sign: f64| {
        let first = residue * 10;
        [
            ("N", -1.2, 3.5, "N"),
            ("CA", 0.0, 3.0, "C"),
            ("C", 1.2, 3.6, "C"),
            ("CB", 0.1, 1.8, "C"),
            ("SG", 0.0, 1.0, "S"),
        ]
        .into_iter()
        .zip(first..)
        .map(|((name, x, h, element), serial)| {
            atom(serial, name, residue, x, y + sign * h, element)
        })
        .collect::<String>()
    };
    let bridged = cysteine(1, 0.0, 1.0) + &cysteine(5, 0.0, -1.0);
    let bridged = pdb::parse_pdb(&bridged, &Options::default()).unwrap();
    assert_eq!(bridged.disulfides.len(), 1, "{:?}", bridged.left_out);
}

#[test]
fn mistakes_are_named() {
    let refused = |text: &str, words: &str| {
        let error = pdb::parse_pdb(text, &Options::default()).unwrap_err();
        assert!(error.to_string().to_lowercase().contains(words), "{error}");
    };
    refused("", "no atoms");
    refused("HEADER\nEND\n", "no atoms");
    let collapsed = PEPTIDE.replace("   1.000   2.000   3.000", "   2.458   2.000   3.000");
    refused(
        &collapsed,
        "residue `a:1`: has two bonded atoms in one place",
    );
    let error = pdb::parse_pdb(
        &PEPTIDE.replacen("   1.000   2.000", "   1.0x0   2.000", 1),
        &Options::default(),
    );
    let error = error.unwrap_err();
    assert_eq!(error.location.line, Some(2), "{error}");
    let line = PEPTIDE.lines().nth(1).unwrap();
    for (columns, value, words) in [
        (
            12..16,
            "    ",
            "name of an atom, columns 13 to 16: found nothing",
        ),
        (
            17..20,
            "   ",
            "residue of an atom, columns 18 to 20: found nothing",
        ),
        (
            22..26,
            "   z",
            "number of the residue of an atom, columns 23 to 26",
        ),
        (
            30..38,
            "     NaN",
            "x of an atom, columns 31 to 38: found `nan`",
        ),
        (
            38..46,
            "     inf",
            "y of an atom, columns 39 to 46: found `inf`",
        ),
        (
            46..54,
            "        ",
            "z of an atom, columns 47 to 54: found nothing",
        ),
        (
            50..81,
            "",
            "z of an atom, columns 47 to 54: found the end of the line",
        ),
    ] {
        let mut broken = line.to_owned();
        broken.replace_range(columns.start..columns.end.min(line.len()), value);
        let text = PEPTIDE.replacen(line, &broken, 1);
        let error = pdb::parse_pdb(&text, &Options::default()).unwrap_err();
        assert_eq!(error.location.line, Some(2), "{error}");
        assert!(error.to_string().to_lowercase().contains(words), "{error}");
    }
    refused("data_X\nloop_\n", "this is mmcif");
    refused(
        "HETATM  107  O   HOH B 101       9.000   9.000   9.000\n",
        "the structure: has no amino acid with n, ca and c; choose a file with a protein: b:101 (hoh) is no amino acid",
    );
    // No line is made up where none is known.
    for text in [
        "HETATM  107  O   HOH B 101       9.000   9.000   9.000\n",
        &collapsed,
        "END\n",
    ] {
        let error = pdb::parse_pdb(text, &Options::default()).unwrap_err();
        assert_eq!(error.location.line, None, "{error}");
        assert!(!error.to_string().contains("line 0"), "{error}");
    }
    let error = pdb::read("no/such.pdb", &Options::default()).unwrap_err();
    assert!(error.to_string().starts_with("no/such.pdb"), "{error}");
}
