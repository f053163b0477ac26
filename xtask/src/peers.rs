//! `cargo xtask peers`: other programs beside ours on the same inputs.
//!
//! It installs what it can, compiles the small programs of `benches/peers`, and has `vertebra-bench
//! peers` run them. What cannot be had here is named with its remedy, and the comparison goes on
//! without it.

mod install;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use serde::Serialize;
use xshell::{Shell, cmd};

use crate::binary::{self, Build};
use crate::workspace::{self, Workspace};
use install::Workshop;

/// Arguments of the command.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// What to compare: `collision` or `dynamics`
    #[arg(value_parser = ["collision", "dynamics"])]
    what: String,
    /// Only see that everything runs
    #[arg(long)]
    quick: bool,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for peers-WHAT.json, .csv and .md, from the root of the workspace; target/peers by
    /// default
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Install nothing, neither by apt-get nor by pip: leave out the peers that are not here
    #[arg(long)]
    no_install: bool,
}

/// A peer as `vertebra-bench peers` is told of it.
#[derive(Serialize)]
struct Harness {
    name: &'static str,
    command: Vec<String>,
    absent: Option<String>,
}

/// Command line of a peer, without the folder of the input.
type Recipe = fn(&Workshop<'_>) -> Result<Vec<String>>;

const COLLISION: [(&str, Recipe); 5] = [
    ("CGAL", |workshop| {
        workshop.headers("CGAL/version.h", "libcgal-dev")?;
        workshop.compile("cgal", &["-lgmp", "-lmpfr"])
    }),
    ("Embree", |workshop| {
        workshop.headers("CGAL/version.h", "libcgal-dev")?;
        workshop.headers("embree3/rtcore.h", "libembree-dev")?;
        let leaf = workshop.library("exact-leaf", "vertebra_exact_leaf")?;
        workshop.compile("embree", &[&leaf, "-lembree3", "-lgmp", "-lmpfr"])
    }),
    ("parry3d", |workshop| {
        workshop.cargo("parry", "vertebra-peers-parry")
    }),
    ("libigl", |workshop| {
        workshop.wheel("libigl", "2.6.3")?;
        workshop.script("with_libigl.py")
    }),
    ("python-fcl", |workshop| {
        workshop.wheel("python-fcl", "0.7.0.11")?;
        workshop.script("with_fcl.py")
    }),
];

const DYNAMICS: [(&str, Recipe); 2] = [
    ("Pinocchio", |workshop| {
        workshop.headers("eigen3/Eigen/Core", "libeigen3-dev")?;
        workshop.wheel("pin", "4.1.0")?;
        let include = format!("-isystem{}/cmeel.prefix/include", workshop.packages()?);
        workshop.compile(
            "pinocchio",
            &[
                &include,
                "-isystem/usr/include/eigen3",
                // As its own build has them: it has more kinds of joints than Boost expects.
                "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
                "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
                "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
            ],
        )
    }),
    ("MuJoCo", |workshop| {
        workshop.wheel("mujoco", "4.0.0")?;
        let folder = format!("{}/mujoco", workshop.packages()?);
        let include = format!("-isystem{folder}/include");
        let library = format!("{folder}/libmujoco.so.4.0.0");
        let at_run_time = format!("-Wl,-rpath,{folder}");
        workshop.compile("mujoco", &[&include, &library, &at_run_time])
    }),
];

/// Prepares the peers and runs the comparison, with its exit status.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let sh = &workspace::shell()?;
    let target = Workspace::load(sh)?.target_directory()?.join("peers");
    let workshop = Workshop::new(sh, &target, !arguments.no_install)?;
    let peers: &[(&str, Recipe)] = match arguments.what.as_str() {
        "collision" => &COLLISION,
        _ => &DYNAMICS,
    };
    let mut harnesses = Vec::new();
    for &(name, recipe) in peers {
        println!("=== {name} ===");
        let (command, absent) = match recipe(&workshop) {
            Ok(command) => (command, None),
            Err(reason) => {
                println!("not available: {reason:#}");
                (Vec::new(), Some(format!("{reason:#}")))
            }
        };
        harnesses.push(Harness {
            name,
            command,
            absent,
        });
    }
    let list = target.join(format!("{}-harnesses.json", arguments.what));
    fs::write(&list, serde_json::to_string_pretty(&harnesses)?)
        .with_context(|| format!("cannot write {}", list.display()))?;

    println!("=== comparison ===");
    let program = binary::build(sh, Build::Release)?;
    let out = arguments.out.as_ref().unwrap_or(&target);
    let (what, seed) = (&arguments.what, arguments.seed.to_string());
    let quick = arguments.quick.then_some("--quick");
    cmd!(
        sh,
        "{program} peers {what} --harnesses {list} --seed {seed} --out {out} {quick...}"
    )
    .run()?;
    Ok(ExitCode::SUCCESS)
}

/// A path as text, which every file this command makes has.
fn text(path: PathBuf) -> Result<String> {
    path.into_os_string()
        .into_string()
        .map_err(|path| anyhow::anyhow!("{} is not text", path.display()))
}

/// Where the sources of the small programs lie.
fn sources(sh: &Shell) -> PathBuf {
    sh.current_dir().join("benches").join("peers")
}
