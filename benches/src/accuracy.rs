//! `accuracy`: the forward error of every solver over many seeds, case by case.
//!
//! One problem says little about an algorithm: over the seeds of one case errors differ a
//! hundredfold. So an [`Entry`] holds what the middle and the end of the distribution are, and how
//! often the solver refused. Neither the number of threads nor the machine makes a difference, only which GPU it
//! is, if it is one: entries can be compared with stored ones, which [`crate::suite::seeds`] does.

pub mod case;
pub mod entry;
mod hard;
mod output;
mod pictures;
mod solvers;

pub use hard::Hard;
pub(crate) use hard::Lost;
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

/// Runs `accuracy`: measures, prints and writes the entries.
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
            if interrupt.requested() {
                break 'all;
            }
            let label = format!("{} of {bodies}", case.name());
            progress.begin(&label);
            entries.extend(entry::measure(&solvers, case, bodies, arguments.seeds())?);
            progress.done(&label);
        }
    }
    progress.finish();
    if !entries.is_empty() {
        output::print(&entries);
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
    if !parts.is_empty() {
        cases.retain(|case| parts.iter().any(|part| case.name().contains(part.as_str())));
    }
    if cases.is_empty() {
        let names: Vec<String> = Case::all().iter().map(Case::name).collect();
        anyhow::bail!("no case is named so; there are {}", names.join("; "));
    }
    Ok(cases)
}

/// Writes tables and pictures again from the entries in a folder; gives the paths of the files, none if
/// there are no entries there.
///
/// # Errors
/// If the entries cannot be read, or the files not written.
pub fn write_again(folder: &Path, out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let path = folder.join(output::JSON);
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let entries = parse(&text).with_context(|| path.display().to_string())?;
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
        assert_eq!(chosen("decades").unwrap(), 4);
        assert!(chosen("a name that no case has").is_err());
    }
}
