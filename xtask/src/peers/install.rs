//! How the programs that are compared with get onto this machine.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use super::{sources, text};

/// Where peers are prepared: everything but system packages goes into one folder.
pub(super) struct Workshop<'a> {
    sh: &'a Shell,
    /// Folder of all that is made.
    target: &'a Path,
    may_install: bool,
}

impl<'a> Workshop<'a> {
    pub(super) fn new(sh: &'a Shell, target: &'a Path, may_install: bool) -> Result<Self> {
        sh.create_dir(target.join("bin"))?;
        Ok(Self {
            sh,
            target,
            may_install,
        })
    }

    /// Makes a header of a Debian package available, or says how it can be had.
    pub(super) fn headers(&self, header: &str, package: &str) -> Result<()> {
        let has = || {
            cmd!(self.sh, "c++ -E -x c++ -")
                .stdin(format!("#include <{header}>\n"))
                .quiet()
                .ignore_stdout()
                .ignore_stderr()
                .run()
                .is_ok()
        };
        if has() {
            return Ok(());
        }
        ensure!(
            self.may_install && self.apt_get(package).is_ok() && has(),
            "its headers are missing: apt-get install g++ {package}"
        );
        Ok(())
    }

    /// Installs a Debian package: as root, or where sudo asks nothing.
    fn apt_get(&self, package: &str) -> Result<()> {
        let root = cmd!(self.sh, "id -u").quiet().read()? == "0";
        let sudo: &[&str] = if root { &[] } else { &["sudo", "-n"] };
        let apt: Vec<&str> = sudo.iter().copied().chain(["apt-get"]).collect();
        let (program, first) = apt.split_first().context("there is a program")?;
        cmd!(self.sh, "{program} {first...} update --quiet").run()?;
        cmd!(
            self.sh,
            "{program} {first...} install --yes --no-install-recommends {package}"
        )
        .run()?;
        Ok(())
    }

    /// Compiles a program of `benches/peers` where it is older than its sources, or than what it is linked with by its
    /// path; its command line.
    pub(super) fn compile(&self, name: &str, flags: &[&str]) -> Result<Vec<String>> {
        let source = sources(self.sh).join(name).with_extension("cpp");
        let program = self.target.join("bin").join(name);
        let newer_than = |path: &Path| {
            let made = |path: &Path| path.metadata()?.modified();
            Ok::<bool, std::io::Error>(made(&program)? > made(path)?)
        };
        let header = sources(self.sh).join("harness.hpp");
        let linked = flags.iter().map(Path::new).filter(|path| path.is_file());
        let fresh = [&*source, &*header]
            .into_iter()
            .chain(linked)
            .all(|path| newer_than(path).unwrap_or(false));
        if !fresh {
            cmd!(
                self.sh,
                "c++ -std=c++17 -O3 -DNDEBUG {source} -o {program} {flags...}"
            )
            .run()
            .context("it does not compile")?;
        }
        Ok(vec![text(program)?])
    }

    /// Builds a program of `benches/peers` that is a workspace of its own; its command line.
    pub(super) fn cargo(&self, folder: &str, name: &str) -> Result<Vec<String>> {
        Ok(vec![text(self.release(folder)?.join(name))?])
    }

    /// Builds a library of `benches/peers` that is a workspace of its own; its path.
    pub(super) fn library(&self, folder: &str, name: &str) -> Result<String> {
        text(self.release(folder)?.join(format!("lib{name}.a")))
    }

    /// Builds a workspace of `benches/peers`; the folder of what came of it.
    fn release(&self, folder: &str) -> Result<PathBuf> {
        let manifest = sources(self.sh).join(folder).join("Cargo.toml");
        let target = self.target.join(folder);
        cmd!(
            self.sh,
            "cargo build --release --locked --manifest-path {manifest} --target-dir {target}"
        )
        .run()
        .context("it does not build")?;
        Ok(target.join("release"))
    }

    /// Makes a Python package available in an environment of our own.
    pub(super) fn wheel(&self, package: &str, version: &str) -> Result<()> {
        let python = self.python();
        let asked =
            format!("import importlib.metadata as m; assert m.version('{package}') == '{version}'");
        let has = || {
            let check = cmd!(self.sh, "{python} -c {asked}");
            check.quiet().ignore_stderr().run().is_ok()
        };
        if has() {
            return Ok(());
        }
        ensure!(
            self.may_install,
            "{package} {version} is missing; run this without --no-install"
        );
        let environment = self.target.join("venv");
        if !python.is_file() {
            cmd!(self.sh, "python3 -m venv {environment}")
                .run()
                .context("it takes Python: apt-get install python3-venv")?;
        }
        let wanted = format!("{package}=={version}");
        cmd!(
            self.sh,
            "{python} -m pip install --quiet --disable-pip-version-check {wanted}"
        )
        .run()
        .with_context(|| format!("{wanted} cannot be installed for this Python"))?;
        Ok(())
    }

    /// Command line of a script of `benches/peers`.
    pub(super) fn script(&self, name: &str) -> Result<Vec<String>> {
        let script = sources(self.sh).join(name);
        // Without -B it leaves compiled files beside the sources.
        Ok(vec![text(self.python())?, "-B".to_owned(), text(script)?])
    }

    /// Where the environment keeps its packages.
    pub(super) fn packages(&self) -> Result<String> {
        let python = self.python();
        let asked = "import sysconfig; print(sysconfig.get_path('purelib'))";
        Ok(cmd!(self.sh, "{python} -c {asked}").quiet().read()?)
    }

    fn python(&self) -> PathBuf {
        self.target.join("venv").join("bin").join("python")
    }
}
