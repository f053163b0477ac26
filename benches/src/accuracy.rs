//! `accuracy`: the forward error of every solver over many seeds, case by case.
//!
//! One problem says little about an algorithm: over the seeds of one case errors differ a
//! hundredfold. So an [`Entry`] holds what the middle and the end of the distribution are, and how
//! often the solver refused. Neither the number of threads nor the machine makes a difference, only which GPU it
//! is, if it is one: entries can be compared with stored ones, which [`crate::suite::seeds`] does.

pub mod case;
pub mod entry;
mod hard;
mod mixed;
mod output;
mod pictures;
mod solvers;

pub use hard::Hard;
pub(crate) use hard::Lost;
pub use mixed::Mixed;
pub use solvers::Solvers;

use crate::cli::{AccuracyArgs, Backend};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::run::Outcome;
use crate::suite;
use anyhow::Context;
use case::Case;
use entry::Entry;
use std::fs;
use std::path::{Path, PathBuf};

/// Runs `accuracy`: measures, prints and writes the entries, beside those of other cases and sizes in the folder.
///
/// # Errors
/// If no case is meant, there is no GPU to measure, a problem has no reference, or the files cannot be written.
pub fn run(arguments: &AccuracyArgs) -> anyhow::Result<Outcome> {
    let cases = chosen(&arguments.cases)?;
    let solvers = match arguments.backend {
        Backend::Cpu => Solvers::on_cpu(),
        Backend::Gpu => Solvers::on_gpu(&suite::gpu::device()?),
    };
    output::check_writable(&arguments.out)?;
    let interrupt = Interrupt::on_ctrl_c()?;
    let sizes = arguments.sizes();
    let mut progress = Progress::new(cases.len() * sizes.len());
    let mut entries = Vec::new();
    'all: for case in &cases {
        for &bodies in &sizes {
            let label = format!("{} of {bodies}", case.name());
            progress.begin(&label);
            match entry::measure(&solvers, case, bodies, arguments.seeds(), &interrupt)? {
                Some(measured) => entries.extend(measured),
                None => break 'all,
            }
            progress.done(&label);
        }
    }
    progress.finish();
    if !entries.is_empty() {
        output::print(&entries);
        let entries = joined(before(&arguments.out)?, entries, &solvers);
        if let Some(note) = output::seeds(&entries) {
            println!("{note}");
        }
        for path in output::write(&arguments.out, &entries)? {
            println!("wrote {}", path.display());
        }
    }
    Ok(if interrupt.requested() {
        Outcome::Interrupted
    } else {
        Outcome::Success
    })
}

/// The cases whose names contain one of these.
fn chosen(parts: &[String]) -> anyhow::Result<Vec<Case>> {
    let mut cases = Case::all();
    let has = |case: &Case, part: &String| case.name().contains(part.as_str());
    if let Some(part) = (parts.iter()).find(|part| !cases.iter().any(|case| has(case, part))) {
        let names: Vec<String> = cases.iter().map(Case::name).collect();
        anyhow::bail!(
            "no case has `{part}` in its name; the cases are: {}",
            names.join("; ")
        );
    }
    if !parts.is_empty() {
        cases.retain(|case| parts.iter().any(|part| has(case, part)));
    }
    Ok(cases)
}

/// The entries that a folder holds; none if it has no file of them.
///
/// # Errors
/// If the file cannot be read, or holds something else.
fn before(folder: &Path) -> anyhow::Result<Vec<Entry>> {
    let path = folder.join(output::JSON);
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    parse(&text).with_context(|| path.display().to_string())
}

/// Earlier entries with new ones in their places and after them. Those of another device, or of cases or solvers that are no
/// more, do not stay.
fn joined(before: Vec<Entry>, mut new: Vec<Entry>, solvers: &Solvers) -> Vec<Entry> {
    let names: Vec<String> = Case::all().iter().map(Case::name).collect();
    let stays = |entry: &Entry| {
        let name = format!("{}, {}", entry.shape, entry.pattern);
        let is_measured = names.contains(&name) && solvers.have(&entry.method, &entry.precision);
        is_measured && new.iter().all(|other| other.device == entry.device)
    };
    let mut all: Vec<Entry> = before.into_iter().filter(stays).collect();
    for entry in &mut all {
        if let Some(at) = new.iter().position(|other| other.key() == entry.key()) {
            *entry = new.remove(at);
        }
    }
    all.extend(new);
    all
}

/// Writes tables and pictures again from the entries in a folder; gives the paths of the files, none if
/// there are no entries there.
///
/// # Errors
/// If the entries cannot be read, or the files not written.
pub fn write_again(folder: &Path, out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = before(folder)?;
    if entries.is_empty() {
        return Ok(Vec::new());
    }
    Ok(output::write(out, &entries)?)
}

/// Reads stored entries.
///
/// # Errors
/// If the text is not what `accuracy` writes.
pub fn parse(text: &str) -> Result<Vec<Entry>, serde_json::Error> {
    serde_json::from_str(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_chosen_by_parts_of_their_names() {
        let chosen = |part: &str| chosen(&[part.to_owned()]).map(|cases| cases.len());
        assert_eq!(chosen("chain, equal").unwrap(), 1);
        assert_eq!(chosen("decades").unwrap(), 5);
        let error = chosen("chian").unwrap_err().to_string();
        assert!(
            error.contains("`chian`") && error.contains("chain, equal"),
            "{error}"
        );
    }

    #[test]
    fn new_entries_take_the_places_of_old_ones() {
        let entries = |names: [&str; 2], seeds| {
            let entry = |name: &str| {
                let cases = chosen(&[name.to_owned()]).unwrap();
                let solvers = Solvers::on_cpu();
                let go_on = Interrupt::default();
                let measured = entry::measure(&solvers, &cases[0], 2, seeds, &go_on).unwrap();
                measured.unwrap().swap_remove(0)
            };
            names.map(entry).to_vec()
        };
        let mut old = entries(["chain, equal", "chain, tiny"], 1);
        old[0].pattern = "no more".to_owned();
        old.push(Entry {
            method: "no more".to_owned(),
            ..old[1].clone()
        });
        let new = entries(["tree, equal", "chain, tiny"], 2);
        let solvers = Solvers::on_cpu();
        let all = joined(old.clone(), new.clone(), &solvers);
        assert_eq!(all, [new[1].clone(), new[0].clone()]);
        let elsewhere = Entry {
            device: "a GPU".to_owned(),
            ..old.swap_remove(1)
        };
        assert_eq!(joined(vec![elsewhere], new.clone(), &solvers), new);
        assert!(output::seeds(&new).is_none());
        let both = [old[1].clone(), new[0].clone()];
        let note = output::seeds(&both).unwrap();
        assert!(note.contains("1 and 2 seeds"), "{note}");
    }
}
