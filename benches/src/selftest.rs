//! `selftest`: the shared suite where there is no cargo.

use crate::cli::Backend;
use crate::suite::{self, Figure, Outcome};
use std::time::Instant;

/// Runs the checks of a backend whose names have one of the parts `only`, or all if there are none, those that take
/// minutes if `full`; prints the worst figure of each, or all of them, and says whether all pass.
///
/// # Errors
/// If there is no GPU to test, or no check of such a name.
pub fn selftest(
    backend: Backend,
    all_figures: bool,
    full: bool,
    only: &[String],
) -> anyhow::Result<bool> {
    let mut counts = [0_usize; 2];
    let mut run = |label: &str, check: &mut dyn FnMut() -> Outcome| {
        if !only.is_empty() && !only.iter().any(|part| label.contains(part.as_str())) {
            return;
        }
        eprintln!("      {label} ...");
        let start = Instant::now();
        let outcome = check();
        let time = start.elapsed().as_secs_f64();
        let passes = matches!(&outcome, Ok(figures) if !figures.is_empty() && figures.iter().all(Figure::passes));
        counts[usize::from(!passes)] += 1;
        let verdict = if passes { "pass" } else { "FAIL" };
        if let (true, Ok(figures)) = (all_figures, &outcome) {
            for Figure { name, value, bound } in figures {
                println!("      {label}: {value:.3e} of {bound:.3e} ({name})");
            }
        }
        match outcome {
            Ok(figures) => match worst(&figures) {
                Some(worst) => println!(
                    "{verdict}  {label} ({time:.2} s): {} figures, worst {:.3e} of {:.3e} ({})",
                    figures.len(),
                    worst.value,
                    worst.bound,
                    worst.name
                ),
                None => println!("{verdict}  {label}: measured nothing"),
            },
            Err(error) => println!("{verdict}  {label} ({time:.2} s): {error:#}"),
        }
    };
    let start = Instant::now();
    match backend {
        Backend::Cpu => cpu(&mut run, full),
        Backend::Gpu => gpu(&mut run)?,
    }
    let [passed, failed] = counts;
    anyhow::ensure!(
        passed + failed > 0,
        "no check has a name with `{}`; without --only all are run",
        only.join("` or `")
    );
    println!("{:.1} s in all", start.elapsed().as_secs_f64());
    println!("{passed} passed, {failed} failed");
    Ok(failed == 0)
}

/// Runs a check and reports it, unless its name is left out.
type Run<'a> = dyn FnMut(&str, &mut dyn FnMut() -> Outcome) + 'a;

/// Every check with every solver it applies to.
fn cpu(run: &mut Run<'_>, full: bool) {
    let solvers = suite::solver::all();
    for check in suite::DYNAMICS {
        for solver in solvers.iter().filter(|s| (check.applies)(s.as_ref())) {
            let label = format!("{} {} {}", check.name, solver.method(), solver.precision());
            run(&label, &mut || (check.run)(solver.as_ref()));
        }
    }
    let long = if full { suite::LONG } else { &[] };
    for (name, check) in suite::OTHERS.iter().chain(long) {
        run(name, &mut || check());
    }
}

/// Every check of a GPU.
fn gpu(run: &mut Run<'_>) -> anyhow::Result<()> {
    let device = suite::gpu::device()?;
    println!("device: {}", device.description());
    for check in suite::gpu::CHECKS {
        run(check.name, &mut || (check.run)(&device));
    }
    Ok(())
}

/// The figure nearest to its bound, or furthest beyond it.
fn worst(figures: &[Figure]) -> Option<&Figure> {
    figures
        .iter()
        .max_by(|a, b| closeness(a).total_cmp(&closeness(b)))
}

fn closeness(figure: &Figure) -> f64 {
    if figure.bound == 0.0 {
        return figure.value;
    }
    figure.value / figure.bound
}
