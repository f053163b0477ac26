//! `export`: the inputs of a scenario, for other tools.

use crate::cli::ExportArgs;
use crate::results::write_atomically;
use crate::scenario::{chain, meshes};
use serde::Serialize;
use std::collections::BTreeMap;
use vertebra::collision::RelativePose;
use vertebra::{Forces, Model, Pose, State, TriangleMesh};

/// One articulated problem; everything in SI, vectors in world axes.
#[derive(Serialize)]
struct Problem<'a> {
    model: &'a Model,
    cases: Vec<Case<'a>>,
}

#[derive(Serialize)]
struct Case<'a> {
    state: &'a State,
    joint_forces: &'a [f64],
    /// Forces at centres of mass.
    external: Vec<External>,
}

#[derive(Serialize)]
struct External {
    body: u32,
    force_at_center: [f64; 3],
}

/// Writes the scenario's inputs.
///
/// # Errors
/// If a file cannot be written.
pub fn export(arguments: &ExportArgs) -> anyhow::Result<()> {
    let write = |name: String, contents: &[u8]| -> anyhow::Result<()> {
        let path = arguments.out.join(name);
        write_atomically(&path, contents)?;
        println!("wrote {}", path.display());
        Ok(())
    };
    if arguments.scenario == chain::NAME {
        for subject in chain::subjects(&arguments.selection())? {
            let problem = Problem {
                model: &subject.model,
                cases: subject.inputs.iter().map(|(s, f)| case(s, f)).collect(),
            };
            let name = format!("chain-{}.json", subject.model.bodies().len());
            write(name, &serde_json::to_vec(&problem)?)?;
        }
        return Ok(());
    }
    let mut files = BTreeMap::new();
    for subject in meshes::subjects()? {
        // The cup takes part twice, in the same place.
        let (first, second) = subject.scenario.split_once(" x ").unwrap_or(("a", "b"));
        files.insert(
            format!("{first}.obj"),
            posed_obj(&subject.a, &Pose::IDENTITY)?,
        );
        files.insert(
            format!("{second}.obj"),
            posed_obj(&subject.b, &subject.pose_b)?,
        );
    }
    files
        .into_iter()
        .try_for_each(|(name, text)| write(name, text.as_bytes()))
}

fn case<'a>(state: &'a State, forces: &'a Forces) -> Case<'a> {
    let external = forces.external().iter();
    Case {
        state,
        joint_forces: &forces.joint,
        external: external
            .map(|(body, wrench)| External {
                body: body.0,
                force_at_center: wrench.force.to_array(),
            })
            .collect(),
    }
}

/// The mesh as the exact test sees it: posed vertices in f64, written so that they read back exactly.
pub(crate) fn posed_obj(mesh: &TriangleMesh, pose: &Pose) -> anyhow::Result<String> {
    use std::fmt::Write;
    let relative = RelativePose::between(&Pose::IDENTITY, pose)?;
    let mut text = String::new();
    for &vertex in mesh.vertices() {
        let p = relative.apply(vertex);
        writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in mesh.triangles() {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    Ok(text)
}
