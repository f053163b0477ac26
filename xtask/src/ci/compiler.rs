//! The compiler in use is no older than the packages say they need. Whether they build with the
//! oldest they name is found out by running all stages with that one.

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::stages::Outcome;
use crate::workspace::Workspace;

/// Compares the versions and says which compiler it is.
pub(super) fn check(sh: &Shell, workspace: &Workspace) -> Result<Outcome> {
    let compiler = cmd!(sh, "rustc --version").quiet().read()?;
    println!("compiler: {compiler}");
    let in_use = version(compiler.split(' ').nth(1).unwrap_or_default())
        .with_context(|| format!("`{compiler}` names no version"))?;
    for (package, needed) in workspace.rust_versions() {
        let needed =
            needed.with_context(|| format!("{package}: no rust-version in its Cargo.toml"))?;
        let oldest = version(needed)
            .with_context(|| format!("{package}: rust-version `{needed}` is no version"))?;
        ensure!(
            oldest <= in_use,
            "{package} needs Rust {needed}, but this is {compiler}; run `rustup update`"
        );
    }
    Ok(Outcome::Passed)
}

/// The numbers of `1.95`, `1.95.0` or `1.97.0-nightly`.
fn version(text: &str) -> Option<(u32, u32, u32)> {
    let release = text.split('-').next()?;
    let mut numbers = release.split('.').map(|number| number.parse().ok());
    let version = (
        numbers.next()??,
        numbers.next()??,
        numbers.next().unwrap_or(Some(0))?,
    );
    numbers.next().is_none().then_some(version)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_compare_by_number() {
        assert_eq!(version("1.95"), Some((1, 95, 0)));
        assert_eq!(version("1.97.1-nightly"), Some((1, 97, 1)));
        assert!(version("1.100.0") > version("1.95"));
        for text in ["", "1", "1.x", "1.2.3.4", "1.2.x"] {
            assert_eq!(version(text), None, "{text}");
        }
    }
}
