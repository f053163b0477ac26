//! A peptide relaxes under a simple energy of its torsion angles and of atoms that touch.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::files::pdb::{Angle, Options, Protein, parse_pdb};
use vertebra::files::{Part, Shape};
use vertebra::glam::DVec3;
use vertebra::{BodyId, Pose, Simulation, Wrench};

/// Height of the barriers of torsion angles, and of two atoms in one place \[J\]: some kT.
const BARRIER: f64 = 1e-20;
const TOUCH: f64 = 2e-19;
/// Atoms of different bodies touch when nearer than this \[m\].
const NEAR: f64 = 2.8e-10;

/// Energy of the torsion angles, and the force of each.
fn torsions(protein: &Protein, q: &[f64], forces: &mut [f64]) -> f64 {
    let mut energy = 0.0;
    for torsion in &protein.torsions {
        let Some(body) = protein.model.body(torsion.body) else {
            continue;
        };
        let angle = torsion.start.unwrap_or(0.0) + q[body.position_start];
        // Side chains are staggered in threes; the backbone has the one valley of an extended strand.
        let (valleys, at) = match torsion.angle {
            Angle::Chi(_) => (3.0, 60_f64.to_radians()),
            Angle::Phi => (1.0, -120_f64.to_radians()),
            Angle::Psi => (1.0, 130_f64.to_radians()),
        };
        energy += BARRIER * (1.0 - (valleys * (angle - at)).cos());
        forces[body.dof_start] = -BARRIER * valleys * (valleys * (angle - at)).sin();
    }
    energy
}

/// Energy of atoms that touch, E (1 - d/near)^2, and the forces between them.
fn touches(protein: &Protein, poses: &[Pose], mut push: impl FnMut(BodyId, DVec3, DVec3)) -> f64 {
    let place =
        |atom: &vertebra::files::pdb::Atom| poses[atom.body.index()].transform_point(atom.position);
    let mut energy = 0.0;
    for (index, a) in protein.atoms.iter().enumerate() {
        for b in protein.atoms[index + 1..]
            .iter()
            .filter(|b| far_apart(protein, a.body, b.body))
        {
            let between = place(b) - place(a);
            let distance = between.length();
            if distance < NEAR {
                let part = 1.0 - distance / NEAR;
                energy += TOUCH * part * part;
                let force = between / distance * (2.0 * TOUCH * part / NEAR);
                push(a.body, -force, a.position);
                push(b.body, force, b.position);
            }
        }
    }
    energy
}

/// Atoms of bodies next to each other are bonded over one bond or two, and do not count.
fn far_apart(protein: &Protein, a: BodyId, b: BodyId) -> bool {
    let parent = |id: BodyId| protein.model.body(id).and_then(|body| body.parent);
    a != b && parent(a) != Some(b) && parent(b) != Some(a) && parent(a) != parent(b)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // From a file: `pdb::read(path, &options)`.
    let text = include_str!("../../files/tests/data/peptide.pdb");
    let mut protein = parse_pdb(text, &Options::default())?;
    // Water takes the energy out [N m s/rad].
    let mut description = protein.model.describe();
    for body in &mut description.bodies {
        body.joint.damping = 2e-33;
    }
    protein.model = description.build()?;
    let model = &protein.model;
    println!(
        "{} atoms on {} bodies, {} torsion angles",
        protein.atoms.len(),
        model.bodies().len(),
        protein.torsions.len()
    );
    let balls = protein.atoms.iter().map(|atom| Part {
        body: Some(atom.body),
        placement: Pose::from_translation(atom.position),
        shape: Shape::Sphere { radius: 0.7e-10 },
    });

    let scene = Scene::new(model, balls.collect(), [1e-15, 2e-14], 200)?;
    let mut simulation = Simulation::new(model.clone())?;
    let (mut first, mut last) = (None, 0.0);
    scene.run(&mut simulation, |simulation| {
        let poses = simulation.poses()?.to_vec();
        let q = simulation.state()?.q.clone();
        let forces = simulation.forces_mut();
        forces.clear_external();
        last = torsions(&protein, &q, &mut forces.joint);
        last += touches(&protein, &poses, |body, force, point| {
            forces.push(body, Wrench::at_point(force, point));
        });
        first.get_or_insert(last);
        Ok(())
    })?;
    println!(
        "in {:.1} fs its energy fell from {:.3e} J to {last:.3e} J",
        simulation.time() * 1e15,
        first.unwrap_or(last)
    );
    Ok(())
}
