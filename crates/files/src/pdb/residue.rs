//! Residues: which atoms they have, and which of them turn about which bonds.

use core::fmt::Write as _;
use glam::DVec3;
use pdbtbx::PDB;

/// Metres an Angstrom, and kilograms an atomic mass unit (CODATA 2022).
const ANGSTROM: f64 = 1e-10;
const DALTON: f64 = 1.660_539_068_92e-27;

/// An atom of the file, in SI units.
pub(super) struct Site {
    pub(super) name: String,
    pub(super) element: u8,
    pub(super) position: DVec3,
    pub(super) mass: f64,
}

/// An amino acid with its backbone complete.
pub(super) struct Residue {
    /// Chain and number, such as `A:7`.
    pub(super) id: String,
    pub(super) is_proline: bool,
    /// The bonds that chi1, chi2, ... turn about, as names of atoms: from CA on.
    pub(super) chis: &'static [&'static str],
    pub(super) sites: Vec<Site>,
}

/// Amino acids, and the atoms from CA on along which their side chains turn. Rings and planes beyond
/// the last are rigid.
const AMINO_ACIDS: [(&str, &[&str]); 24] = [
    ("ALA", &["CA"]),
    ("ARG", &["CA", "CB", "CG", "CD", "NE"]),
    ("ASN", &["CA", "CB", "CG"]),
    ("ASP", &["CA", "CB", "CG"]),
    ("CYS", &["CA", "CB"]),
    ("CYX", &["CA", "CB"]),
    ("GLN", &["CA", "CB", "CG", "CD"]),
    ("GLU", &["CA", "CB", "CG", "CD"]),
    ("GLY", &["CA"]),
    ("HID", &["CA", "CB", "CG"]),
    ("HIE", &["CA", "CB", "CG"]),
    ("HIS", &["CA", "CB", "CG"]),
    ("ILE", &["CA", "CB", "CG1"]),
    ("LEU", &["CA", "CB", "CG"]),
    ("LYS", &["CA", "CB", "CG", "CD", "CE"]),
    ("MET", &["CA", "CB", "CG", "SD"]),
    ("MSE", &["CA", "CB", "CG", "SE"]),
    ("PHE", &["CA", "CB", "CG"]),
    ("PRO", &["CA"]),
    ("SER", &["CA", "CB"]),
    ("THR", &["CA", "CB"]),
    ("TRP", &["CA", "CB", "CG"]),
    ("TYR", &["CA", "CB", "CG"]),
    ("VAL", &["CA", "CB"]),
];

/// Where the side chain of an amino acid turns; none for other residues.
fn chis_of(residue: &str) -> Option<&'static [&'static str]> {
    let is_meant = |(name, _): &&(&str, _)| name.eq_ignore_ascii_case(residue);
    AMINO_ACIDS.iter().find(is_meant).map(|&(_, chis)| chis)
}

pub(super) fn is_amino_acid(residue: &str) -> bool {
    chis_of(residue).is_some()
}

/// The chains of residues, and what is left out of them.
pub(super) fn sort(structure: &PDB) -> (Vec<Vec<Residue>>, Vec<String>) {
    let mut chains = Vec::new();
    let mut left_out = Vec::new();
    for chain in structure.chains() {
        let mut residues = Vec::new();
        for residue in chain.residues() {
            let mut id = format!("{}:{}", chain.id(), residue.serial_number());
            // Writing to a string cannot fail.
            let _ = write!(id, "{}", residue.insertion_code().unwrap_or_default());
            let name = residue.name().unwrap_or_default();
            let Some(chis) = chis_of(name) else {
                left_out.push(format!("{id} ({name}) is no amino acid"));
                continue;
            };
            let mut sites: Vec<Site> = Vec::new();
            for atom in residue.atoms() {
                let (x, y, z) = atom.pos();
                let number = atom.element().map(pdbtbx::Element::atomic_number);
                let number = number.and_then(|number| u8::try_from(number).ok());
                let Some((element, mass)) = number.and_then(|n| Some((n, mass(n)?))) else {
                    left_out.push(format!(
                        "{id}:{} has no element with a known mass",
                        atom.name()
                    ));
                    continue;
                };
                // The first of alternative locations counts.
                if sites.iter().all(|site| site.name != atom.name()) {
                    sites.push(Site {
                        name: atom.name().to_owned(),
                        element,
                        position: DVec3::new(x, y, z) * ANGSTROM,
                        mass: mass * DALTON,
                    });
                }
            }
            let residue = Residue {
                id,
                is_proline: name == "PRO",
                chis,
                sites,
            };
            match ["N", "CA", "C"]
                .iter()
                .find(|&&name| residue.find(name).is_none())
            {
                None => residues.push(residue),
                Some(missing) => {
                    left_out.push(format!("{} ({name}) lacks its atom {missing}", residue.id));
                }
            }
        }
        if !residues.is_empty() {
            chains.push(residues);
        }
    }
    (chains, left_out)
}

impl Residue {
    /// Index of the atom of that name.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.sites.iter().position(|site| site.name == name)
    }

    /// The place of an atom of the backbone, which is there.
    pub(super) fn place(&self, name: &str) -> DVec3 {
        self.find(name)
            .map_or(DVec3::ZERO, |index| self.sites[index].position)
    }

    /// How many of its side chain's torsions have both of their atoms.
    pub(super) fn chi_count(&self) -> usize {
        let there = self
            .chis
            .iter()
            .take_while(|name| self.find(name).is_some());
        there.count().saturating_sub(1)
    }

    /// For each atom what it rides with: 0 with CA, k beyond chi k; none for those of the backbone
    /// that ride with N or C.
    pub(super) fn riders(&self) -> Vec<Rider> {
        let chis = self.chi_count();
        let heavy = |site: &Site| match site.name.as_str() {
            "N" => Rider::Nitrogen,
            "C" | "O" | "OXT" => Rider::Carbonyl,
            name => {
                // The letter behind the element says how many bonds an atom is from CA.
                let far = name
                    .chars()
                    .nth(1)
                    .and_then(|letter| "ABGDEZH".find(letter));
                let far = far.unwrap_or(0);
                let on_axis = self.chis.get(far).is_none_or(|&atom| atom == name);
                // A branch at the end of an axis rides with what the axis starts from.
                let far = if far > 0 && far <= chis && !on_axis {
                    far - 1
                } else {
                    far
                };
                Rider::SideChain(far.min(chis))
            }
        };
        let riders = self.sites.iter().map(|site| {
            if site.element != 1 {
                return heavy(site);
            }
            let heavy_ones = self.sites.iter().filter(|other| other.element != 1);
            let nearest = heavy_ones.min_by(|a, b| {
                let distance = |other: &Site| other.position.distance_squared(site.position);
                distance(a).total_cmp(&distance(b))
            });
            nearest.map_or(Rider::SideChain(0), heavy)
        });
        riders.collect()
    }
}

/// What an atom rides with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rider {
    Nitrogen,
    Carbonyl,
    /// CA's body for 0, else the body beyond that chi.
    SideChain(usize),
}

/// Standard atomic weight [u], abridged, of the elements that amino acids are made of (IUPAC 2021).
const fn mass(atomic_number: u8) -> Option<f64> {
    Some(match atomic_number {
        1 => 1.008,
        6 => 12.011,
        7 => 14.007,
        8 => 15.999,
        15 => 30.974,
        16 => 32.06,
        34 => 78.971,
        _ => return None,
    })
}
