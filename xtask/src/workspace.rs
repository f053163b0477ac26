//! What cargo and rustup tell of the workspace and the toolchain.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;
use xshell::{Shell, cmd};

/// For the environment of programs that open a GPU: Mesa's layer that puts devices in order looks for a display and
/// complains where there is none.
pub(crate) const QUIET: (&str, &str) = ("NODEVICE_SELECT", "1");

/// A shell in the root of the workspace.
pub(crate) fn shell() -> Result<Shell> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .context("the xtask folder has no parent")?;
    let sh = Shell::new()?;
    sh.change_dir(root);
    sh.set_var(QUIET.0, QUIET.1);
    Ok(sh)
}

/// The packages of the workspace and their targets.
pub(crate) struct Workspace {
    metadata: Value,
}

impl Workspace {
    /// Asks cargo.
    pub(crate) fn load(sh: &Shell) -> Result<Self> {
        let text = cmd!(sh, "cargo metadata --format-version 1 --no-deps")
            .quiet()
            .read()?;
        Ok(Self {
            metadata: serde_json::from_str(&text).context("cargo metadata is not JSON")?,
        })
    }

    /// Where cargo builds.
    pub(crate) fn target_directory(&self) -> Result<PathBuf> {
        let directory = self.metadata["target_directory"].as_str();
        directory
            .map(PathBuf::from)
            .context("cargo metadata names no target directory")
    }

    /// Names of the packages that are published as libraries.
    pub(crate) fn libraries(&self) -> Vec<&str> {
        // `publish = false` is an empty list of registries.
        let published = |package: &&Value| {
            package["publish"]
                .as_array()
                .is_none_or(|list| !list.is_empty())
        };
        let library = |package: &&Value| targets(package, "lib").next().is_some();
        self.packages()
            .filter(published)
            .filter(library)
            .filter_map(|package| package["name"].as_str())
            .collect()
    }

    /// Names of the examples of a package, and the features each needs.
    pub(crate) fn examples(&self, package: &str) -> Vec<(&str, Vec<&str>)> {
        let packages = self
            .packages()
            .filter(|candidate| candidate["name"] == package);
        let examples = packages.flat_map(|package| targets(package, "example"));
        examples
            .filter_map(|target| {
                let features = target["required-features"].as_array().into_iter().flatten();
                let features = features.filter_map(Value::as_str).collect();
                Some((target["name"].as_str()?, features))
            })
            .collect()
    }

    /// The oldest compiler each package says it needs.
    pub(crate) fn rust_versions(&self) -> impl Iterator<Item = (&str, Option<&str>)> {
        self.packages().filter_map(|package| {
            Some((package["name"].as_str()?, package["rust_version"].as_str()))
        })
    }

    fn packages(&self) -> impl Iterator<Item = &Value> {
        self.metadata["packages"].as_array().into_iter().flatten()
    }
}

/// The targets of a package of one kind.
fn targets<'a>(package: &'a Value, kind: &str) -> impl Iterator<Item = &'a Value> {
    let of_kind = move |target: &&Value| {
        target["kind"]
            .as_array()
            .is_some_and(|kinds| kinds.iter().any(|k| k == kind))
    };
    package["targets"]
        .as_array()
        .into_iter()
        .flatten()
        .filter(of_kind)
}

/// Whether cargo has this subcommand and it starts.
pub(crate) fn has_subcommand(sh: &Shell, subcommand: &str) -> bool {
    cmd!(sh, "cargo {subcommand} --version")
        .quiet()
        .ignore_stdout()
        .ignore_stderr()
        .run()
        .is_ok()
}

/// Makes a component of the toolchain available, or says why it cannot be had.
pub(crate) fn require_component(
    sh: &Shell,
    component: &str,
    subcommand: &str,
) -> Result<(), String> {
    if has_subcommand(sh, subcommand) {
        return Ok(());
    }
    let remedy = format!("rustup component add {component}");
    if cmd!(sh, "rustup component add {component}").run().is_ok() && has_subcommand(sh, subcommand)
    {
        return Ok(());
    }
    Err(format!(
        "{component} is not installed and could not be added; `{remedy}`, or install it with the compiler"
    ))
}

/// Makes the standard library for a target available, or says why it cannot be had.
pub(crate) fn require_target(sh: &Shell, target: &str) -> Result<(), String> {
    let installed = || {
        let libraries = cmd!(sh, "rustc --print target-libdir --target {target}")
            .quiet()
            .ignore_stderr()
            .read();
        libraries.is_ok_and(|directory| Path::new(&directory).is_dir())
    };
    if installed() || (cmd!(sh, "rustup target add {target}").run().is_ok() && installed()) {
        return Ok(());
    }
    Err(format!(
        "not available here: no standard library for {target}, and `rustup target add {target}` failed"
    ))
}
