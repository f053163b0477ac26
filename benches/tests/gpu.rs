//! The checks of a GPU, each a test of its own. Without an adapter they are ignored, and say why;
//! where `CI` is set they fail.
#![expect(clippy::print_stdout, reason = "says why nothing is tested")]

use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};
use vertebra_bench::suite::{Figure, gpu};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let device = gpu::device();
    let ignored = vertebra_gpu::tests_are_left_out();
    if let (Err(error), false) = (&device, arguments.list) {
        println!("no check of a GPU is run: {error}");
    }
    let trials = gpu::CHECKS.iter().map(|check| {
        let device = device.clone();
        let run = move || {
            let figures = (check.run)(&device?).map_err(|error| format!("{error:#}"))?;
            if figures.is_empty() {
                return Err("nothing was measured".into());
            }
            match figures.iter().find(|figure| !figure.passes()) {
                None => Ok(()),
                Some(Figure { name, value, bound }) => Err(Failed::from(format!(
                    "{name} is {value:e}, bound {bound:e}"
                ))),
            }
        };
        Trial::test(check.name, run).with_ignored_flag(ignored)
    });
    libtest_mimic::run(&arguments, trials.collect()).exit_code()
}
