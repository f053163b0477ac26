//! The command line of `vertebra-bench`.

mod choices;

use crate::scenario::Selection;
use clap::{Args, Parser, Subcommand};
use std::path::{Path, PathBuf};
use vertebra::Pose;
use vertebra::Precision;
use vertebra::glam::{DQuat, DVec3};

/// Benchmarks of vertebra: speed, always beside error.
#[derive(Debug, Parser)]
#[command(name = "vertebra-bench", version, propagate_version = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Measure scenarios, or your own files, and write tables and plots.
    #[command(after_help = BENCH_EXAMPLES)]
    Bench(Box<BenchArgs>),
    /// Measure the error of forward dynamics over many seeds, on masses that tell algorithms apart.
    Accuracy(AccuracyArgs),
    /// Measure energy, momentum and the error of motions over long runs, by integrator and step.
    Motion(MotionArgs),
    /// Ask everything of models as unreasonable as can be built, and look for answers that are no
    /// numbers.
    Fuzz(FuzzArgs),
    /// Judge one run against another, row by row.
    Compare(CompareArgs),
    /// Write tables and plots again from stored results: of `bench`, `accuracy` and `motion`.
    Report(ReportArgs),
    /// Run the test suite that every solver passes.
    Selftest {
        /// Print every figure, not only the one nearest to its bound.
        #[arg(long)]
        figures: bool,
        /// Run the checks of the processor that take minutes, too.
        #[arg(long)]
        full: bool,
        /// What to test. A GPU is the one that the environment variable VERTEBRA_ADAPTER names, or
        /// the best there is.
        #[arg(long, value_enum, default_value = "cpu")]
        backend: Backend,
        /// Run only the checks whose names contain one of these.
        #[arg(long, value_name = "NAME", value_delimiter = ',')]
        only: Vec<String>,
    },
    /// Compute the inputs of a file on the CPU and on the GPU and compare, element by element.
    Replay {
        /// The file: a failing check of a GPU writes one.
        file: PathBuf,
        /// Print the elements of this stage.
        #[arg(long, value_name = "STAGE")]
        dump: Option<String>,
        /// Elements to print, from the first that differs.
        #[arg(long, default_value_t = 100)]
        rows: usize,
    },
    /// Write a scenario's inputs for other tools.
    Export(ExportArgs),
    /// Measure other programs beside ours on the same inputs; `cargo xtask peers` installs them.
    Peers(PeersArgs),
}

const BENCH_EXAMPLES: &str = "\
Examples:
  vertebra-bench bench --quick
      everything, within a minute
  vertebra-bench bench dynamics --method aba,step --precision f64 --sizes 64,1000
      two methods on chains of two lengths
  vertebra-bench bench --model robot.urdf --floating-base --frames motion.json
      your robot, and how it moves
  vertebra-bench bench --mesh-a cup.obj --mesh-b spoon.stl --pose-b 0,0,0.1,0,0,0,1 --hits hits.ply
      your meshes, and which of their triangles collide
  vertebra-bench bench --compare old/results.json --fail-on-regression
      against an earlier run

The exit status is 1 when something could not be measured or written, or got worse with
--fail-on-regression; 130 after Ctrl-C, when what was measured until then is written.";

/// Options of `bench`.
#[derive(Args, Debug)]
pub struct BenchArgs {
    /// Scenarios to measure: `dynamics`, `needs`, `chunks`, `joints`, `batch`, `loops`, `collision`,
    /// `collision-queries`, `collision-error`, `collision-scaling`, `gpu`. All by default, `gpu` where there is a real one;
    /// none of them when you name files of your own.
    #[arg(value_parser = choices::SCENARIOS.map(|(name, _)| name))]
    pub scenarios: Vec<String>,
    /// Take fewer samples and leave out what is slow: done within a minute.
    #[arg(long)]
    pub quick: bool,
    /// Methods: aba, crba, dca, rnea, tolerance, step, step-bare, step-elements, cut; exact, moller, moller0, separating-axes, build, self, inside,
    /// poses, links, refit, rebuild, or one question such as exact-any; copy, reduce, scan, compact, histogram, sort, dispatch on a GPU,
    /// shapes of the sort, and collision or one of its rows.
    #[arg(long, value_delimiter = ',', value_parser = clap::builder::PossibleValuesParser::new(choices::METHODS))]
    pub method: Vec<String>,
    /// Precisions; that of divide and conquer is its joins'.
    #[arg(long, value_delimiter = ',', value_enum)]
    pub precision: Vec<PrecisionArg>,
    /// Backends; a GPU only where there is a real one, unless it is named.
    #[arg(long, value_delimiter = ',', value_parser = ["cpu", "gpu"])]
    pub backend: Vec<String>,
    /// Numbers of bodies of the chains.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=4_000_000))]
    pub sizes: Vec<u32>,
    /// Numbers of threads; one and all by default, and never more than there are.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Vec<u32>,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for results.json, results.csv, report.md and plots.
    #[arg(long, default_value = "target/bench", value_name = "DIR")]
    pub out: PathBuf,
    /// Write into docs/results, where the report of the repository is.
    #[arg(long, conflicts_with = "out")]
    pub report: bool,
    /// Measure this robot.
    #[arg(long, value_name = "FILE.urdf")]
    pub model: Option<PathBuf>,
    /// Let the robot's root float freely.
    #[arg(long, requires = "model")]
    pub floating_base: bool,
    /// Measure this mesh (OBJ, STL, PLY or OFF) against --mesh-b.
    #[arg(long, value_name = "FILE", requires = "mesh_b")]
    pub mesh_a: Option<PathBuf>,
    /// The other mesh.
    #[arg(long, value_name = "FILE", requires = "mesh_a")]
    pub mesh_b: Option<PathBuf>,
    /// Where the other mesh stands: position, then quaternion.
    #[arg(
        long,
        value_name = "x,y,z,qx,qy,qz,qw",
        requires = "mesh_b",
        allow_hyphen_values = true,
        value_parser = parse_pose
    )]
    pub pose_b: Option<Pose>,
    /// Write the (last) two meshes with colliding triangles coloured.
    #[arg(long, value_name = "FILE.ply")]
    pub hits: Option<PathBuf>,
    /// Write the poses of a moving chain, or of --model, over two seconds.
    #[arg(long, value_name = "FILE.json")]
    pub frames: Option<PathBuf>,
    /// Judge the result against an older results.json.
    #[arg(long, value_name = "OLD.json")]
    pub compare: Option<PathBuf>,
    /// With --compare: fail when a row got slower or less accurate.
    #[arg(long, requires = "compare")]
    pub fail_on_regression: bool,
}

/// Options of `accuracy`.
#[derive(Args, Debug)]
pub struct AccuracyArgs {
    /// Cases to measure, by a part of their names, such as `chain` or `decades`; all by default.
    pub cases: Vec<String>,
    /// What is measured. A GPU is the one that the environment variable VERTEBRA_ADAPTER names, or the best
    /// there is.
    #[arg(long, value_enum, default_value = "cpu")]
    pub backend: Backend,
    /// Leave out the sizes that take long, and most seeds.
    #[arg(long)]
    pub quick: bool,
    /// Numbers of bodies; 32, 128, 512, 2048 and 4096 by default, on a GPU the first three.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=4_000_000))]
    pub sizes: Vec<u32>,
    /// Seeds of each case and size; 200 by default, on a GPU 64, 16 with --quick.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub seeds: Option<u32>,
    /// Folder for accuracy.json, accuracy.csv and accuracy.md; what it holds of other cases and sizes stays.
    #[arg(long, default_value = "target/accuracy", value_name = "DIR")]
    pub out: PathBuf,
}

/// Options of `motion`.
#[derive(Args, Debug)]
pub struct MotionArgs {
    /// Only see that everything runs.
    #[arg(long)]
    pub quick: bool,
    /// Simulated seconds of a run.
    #[arg(long, default_value_t = 30.0, value_parser = positive_seconds, allow_negative_numbers = true)]
    pub seconds: f64,
    /// Run only the scenes whose names contain one of these; runs of the others in the folder stay.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Folder for motion.json, motion.md and plots.
    #[arg(long, default_value = "target/motion", value_name = "DIR")]
    pub out: PathBuf,
}

/// Options of `fuzz`.
#[derive(Args, Debug)]
pub struct FuzzArgs {
    /// Who is asked. A GPU is the one that the environment variable VERTEBRA_ADAPTER names, or the best there
    /// is.
    #[arg(long, value_enum, default_value = "cpu")]
    pub backend: Backend,
    /// Models to try, 100000 by default, on a GPU 256; some of them are too unreasonable to be built.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    pub models: Option<u64>,
    /// The number of the first: with `--models 1` and the same `--seed`, the model that a failure names.
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    pub first: u64,
    /// Stop after so many seconds, at the end of a block of 512 models, of 8 on a GPU.
    #[arg(long, value_parser = positive_seconds, allow_negative_numbers = true)]
    pub seconds: Option<f64>,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Options of `compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// The older results.json, or its folder.
    pub old: PathBuf,
    /// The newer one.
    pub new: PathBuf,
    /// Fail when a row got slower or less accurate.
    #[arg(long)]
    pub fail_on_regression: bool,
}

/// Options of `report`.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// A results.json, or a folder with results.json, accuracy.json or motion.json. Of several, each a results.json or a folder
    /// with one, what they have in common: the scenarios measured on more than one device, CPUs and GPUs on one picture.
    #[arg(required = true)]
    pub results: Vec<PathBuf>,
    /// Folder to write to; beside the data by default, if that is one folder.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Options of `export`.
#[derive(Args, Debug)]
pub struct ExportArgs {
    /// The scenario: `dynamics`, `collision`.
    #[arg(value_parser = ["dynamics", "collision"])]
    pub scenario: String,
    /// Folder to write to.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Numbers of bodies of the chains.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=4_000_000))]
    pub sizes: Vec<u32>,
    /// Seed of everything random, as for `bench`.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Options of `peers`.
#[derive(Args, Debug)]
pub struct PeersArgs {
    /// What to compare.
    #[arg(value_parser = ["collision", "dynamics"])]
    pub what: String,
    /// The other programs, as an array of {"name", "command"} or {"name", "absent"}; none by default.
    #[arg(long, value_name = "FILE.json")]
    pub harnesses: Option<PathBuf>,
    /// Only see that everything runs.
    #[arg(long)]
    pub quick: bool,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for peers-WHAT.json, .csv and .md.
    #[arg(long, default_value = "target/peers", value_name = "DIR")]
    pub out: PathBuf,
}

/// What computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Backend {
    /// The processor.
    Cpu,
    /// A GPU, or a software driver that plays one.
    Gpu,
}

/// A precision on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum PrecisionArg {
    /// Single.
    F32,
    /// Double.
    F64,
    /// Double-double, which the errors of the others are measured against.
    Reference,
}

impl From<PrecisionArg> for Precision {
    fn from(argument: PrecisionArg) -> Self {
        match argument {
            PrecisionArg::F32 => Self::F32,
            PrecisionArg::F64 => Self::F64,
            PrecisionArg::Reference => Self::Reference,
        }
    }
}

impl BenchArgs {
    /// What is to be measured.
    #[must_use]
    pub fn selection(&self) -> Selection {
        Selection {
            methods: self.method.clone(),
            precisions: self.precision.iter().map(|&p| p.into()).collect(),
            sizes: to_sizes(&self.sizes),
            threads: to_sizes(&self.threads),
            seed: self.seed,
            quick: self.quick,
        }
    }

    /// Refuses options that a scenario named would pass over in silence.
    ///
    /// # Errors
    /// If there is one.
    pub fn check(&self) -> anyhow::Result<()> {
        let given = [
            ("--precision", !self.precision.is_empty()),
            ("--sizes", !self.sizes.is_empty()),
            ("--threads", !self.threads.is_empty()),
        ];
        let given = given.into_iter().filter(|(_, is_given)| *is_given);
        let given: Vec<&str> = given.map(|(option, _)| option).collect();
        choices::check(&self.scenarios, &given)
    }

    /// The folder to write to.
    #[must_use]
    pub fn folder(&self) -> &Path {
        if self.report {
            Path::new("docs/results")
        } else {
            &self.out
        }
    }

    /// Whether a built-in scenario is asked for.
    #[must_use]
    pub fn wants(&self, scenario: &str) -> bool {
        if self.scenarios.is_empty() {
            return self.model.is_none() && self.mesh_a.is_none();
        }
        self.scenarios.iter().any(|s| s == scenario)
    }

    /// Whether a backend is asked for.
    #[must_use]
    pub fn wants_backend(&self, backend: &str) -> bool {
        self.backend.is_empty() || self.backend.iter().any(|b| b == backend)
    }
}

impl AccuracyArgs {
    /// The sizes asked for.
    #[must_use]
    pub fn sizes(&self) -> Vec<usize> {
        match (self.sizes.is_empty(), self.quick, self.backend) {
            (false, ..) => to_sizes(&self.sizes),
            (true, false, Backend::Cpu) => vec![32, 128, 512, 2048, 4096],
            (true, true, Backend::Gpu) => vec![32, 128],
            _ => vec![32, 128, 512],
        }
    }

    /// The number of seeds asked for.
    #[must_use]
    pub fn seeds(&self) -> u32 {
        self.seeds.unwrap_or(match (self.quick, self.backend) {
            (true, _) => 16,
            (false, Backend::Cpu) => 200,
            (false, Backend::Gpu) => 64,
        })
    }
}

impl ExportArgs {
    /// The inputs that `bench` would measure.
    #[must_use]
    pub fn selection(&self) -> Selection {
        Selection {
            methods: Vec::new(),
            precisions: Vec::new(),
            sizes: to_sizes(&self.sizes),
            threads: Vec::new(),
            seed: self.seed,
            // The largest chains make files of gigabytes.
            quick: true,
        }
    }
}

fn to_sizes(numbers: &[u32]) -> Vec<usize> {
    numbers.iter().map(|&n| n as usize).collect()
}

fn parse_pose(text: &str) -> Result<Pose, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| {
            part.trim()
                .parse()
                .map_err(|_| format!("`{part}` is not a number"))
        })
        .collect::<Result<_, _>>()?;
    let [x, y, z, qx, qy, qz, qw] = numbers[..] else {
        return Err(format!("expected seven numbers, found {}", numbers.len()));
    };
    let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
    let length = rotation.length();
    if !(length.is_finite() && length > 0.0) {
        return Err("the quaternion must be finite and not zero".to_owned());
    }
    Ok(Pose::new(rotation.normalize(), DVec3::new(x, y, z)))
}

/// A time \[s\] that is finite and above zero.
fn positive_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        _ => Err("give a number of seconds above zero".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn poses_are_read_and_refused() {
        let pose = parse_pose("1,2,-3,0,0,0,2").expect("a pose");
        assert_eq!(pose, Pose::from_translation(DVec3::new(1.0, 2.0, -3.0)));
        for bad in [
            "",
            "1,2,3",
            "a,0,0,0,0,0,1",
            "0,0,0,0,0,0,0",
            "0,0,0,nan,0,0,1",
        ] {
            assert!(parse_pose(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn times_below_zero_are_refused_as_such() {
        for command in ["fuzz", "motion"] {
            let words = ["vertebra-bench", command, "--seconds", "-1"];
            let refused = Cli::try_parse_from(words).expect_err("no time at all");
            assert!(refused.to_string().contains("above zero"), "{refused}");
        }
    }

    #[test]
    fn own_files_replace_the_scenarios_unless_named() {
        let parse = |words: &[&str]| {
            let cli = Cli::parse_from([&["vertebra-bench", "bench"], words].concat());
            match cli.command {
                Command::Bench(arguments) => arguments,
                other => panic!("{other:?}"),
            }
        };
        assert!(parse(&[]).wants("dynamics"));
        assert!(!parse(&["--model", "a.urdf"]).wants("dynamics"));
        assert!(
            parse(&["loops", "chunks", "--precision", "f32"])
                .check()
                .is_ok()
        );
        for idle in [["joints", "--precision", "f32"], ["loops", "--sizes", "8"]] {
            let error = parse(&idle)
                .check()
                .expect_err("an option without effect")
                .to_string();
            assert!(
                error.contains(idle[0]) && error.contains(idle[1]),
                "{error}"
            );
        }
        assert!(
            parse(&["joints", "--method", "cut-tree,weld,step-rough,step-16"])
                .check()
                .is_ok()
        );
        let both = parse(&["dynamics", "--model", "a.urdf"]);
        assert!(both.wants("dynamics") && !both.wants("collision"));
    }
}
