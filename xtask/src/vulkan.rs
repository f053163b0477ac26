//! A Vulkan driver, so that the tests of a GPU run on every machine: where there is none, a
//! software one is installed.

use std::path::Path;

use anyhow::Result;
use xshell::{Cmd, Shell, cmd};

use crate::stages::Outcome;

/// Packages of Debian and Ubuntu with a software driver and the loader.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// Makes a driver available, or says what to install.
pub(crate) fn provide(sh: &Shell) -> Result<Outcome> {
    if !cfg!(target_os = "linux") {
        println!("the system brings its own driver");
        return Ok(Outcome::Passed);
    }
    if is_there(sh) {
        println!("there is a Vulkan driver");
        return Ok(Outcome::Passed);
    }
    if !has_command(sh, "apt-get") {
        return Ok(Outcome::Skipped(
            "no Vulkan driver, and no apt-get to install one with: install your GPU's, or Mesa's \
             software driver (lavapipe) and the Vulkan loader; the checks of a GPU are ignored"
                .to_owned(),
        ));
    }
    match install(sh) {
        Ok(()) if is_there(sh) => Ok(Outcome::Passed),
        _ => Ok(Outcome::Skipped(format!(
            "no Vulkan driver, and it could not be installed: as root, `apt-get install {}`; the \
             checks of a GPU are ignored",
            PACKAGES.join(" ")
        ))),
    }
}

/// Whether a GPU, or a software one, must be found: where there is a driver, and where everything must
/// run because `CI` is set. What is then missing is a failure.
pub(crate) fn is_expected(sh: &Shell) -> bool {
    let everything = std::env::var_os("CI").is_some_and(|value| !value.is_empty());
    everything || !cfg!(target_os = "linux") || is_there(sh)
}

/// The command, for which no adapter is a failure where one is expected.
pub(crate) fn expecting<'a>(sh: &Shell, command: Cmd<'a>) -> Cmd<'a> {
    if is_expected(sh) {
        command.env("CI", "1")
    } else {
        command
    }
}

/// Installs the packages, as root or through sudo where it asks for no password.
fn install(sh: &Shell) -> Result<()> {
    let root = cmd!(sh, "id -u").quiet().read()? == "0";
    let prefix: &[&str] = if root {
        &[]
    } else {
        &["sudo", "--non-interactive"]
    };
    let update: Vec<&str> = [prefix, &["apt-get", "update"]].concat();
    let options = ["apt-get", "install", "--yes", "--no-install-recommends"];
    let install: Vec<&str> = [prefix, &options, &PACKAGES].concat();
    for command in [update, install] {
        let (program, arguments) = (command[0], &command[1..]);
        cmd!(sh, "{program} {arguments...}")
            .env("DEBIAN_FRONTEND", "noninteractive")
            .run()?;
    }
    Ok(())
}

/// Whether the loader and the description of a driver are there.
fn is_there(sh: &Shell) -> bool {
    let named = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
    let named = named.iter().any(|name| std::env::var_os(name).is_some());
    let folders = [
        "/usr/share/vulkan/icd.d",
        "/usr/local/share/vulkan/icd.d",
        "/etc/vulkan/icd.d",
    ];
    let described = folders.iter().any(|folder| !is_empty(Path::new(folder)));
    (named || described) && has_loader(sh)
}

fn is_empty(folder: &Path) -> bool {
    folder
        .read_dir()
        .map_or(true, |mut files| files.next().is_none())
}

fn has_loader(sh: &Shell) -> bool {
    let ldconfig = ["ldconfig", "/sbin/ldconfig"];
    let lists = |program: &&str| {
        cmd!(sh, "{program} -p")
            .quiet()
            .ignore_stderr()
            .read()
            .is_ok_and(|libraries| libraries.contains("libvulkan.so.1"))
    };
    ldconfig.iter().any(lists)
}

fn has_command(sh: &Shell, command: &str) -> bool {
    cmd!(sh, "{command} --version")
        .quiet()
        .ignore_stdout()
        .ignore_stderr()
        .run()
        .is_ok()
}
