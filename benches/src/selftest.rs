//! `selftest`: the shared suite where there is no cargo.

use crate::cli::Backend;
use crate::suite::{self, Figure, Outcome};

/// Runs every check of a backend, prints the worst figure of each, or all of them, and says whether
/// all pass.
///
/// # Errors
/// If there is no GPU to test.
pub fn selftest(backend: Backend, all_figures: bool) -> anyhow::Result<bool> {
    let mut counts = [0_usize; 2];
    let mut report = |label: &str, outcome: Outcome| {
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
                    "{verdict}  {label}: {} figures, worst {:.3e} of {:.3e} ({})",
                    figures.len(),
                    worst.value,
                    worst.bound,
                    worst.name
                ),
                None => println!("{verdict}  {label}: measured nothing"),
            },
            Err(error) => println!("{verdict}  {label}: {error:#}"),
        }
    };
    match backend {
        Backend::Cpu => cpu(&mut report),
        Backend::Gpu => gpu(&mut report)?,
    }
    let [passed, failed] = counts;
    println!("{passed} passed, {failed} failed");
    Ok(failed == 0)
}

/// Every check with every solver it applies to.
fn cpu(report: &mut impl FnMut(&str, Outcome)) {
    let solvers = suite::solver::all();
    for check in suite::DYNAMICS {
        for solver in solvers.iter().filter(|s| (check.applies)(s.as_ref())) {
            let label = format!("{} {} {}", check.name, solver.method(), solver.precision());
            report(&label, (check.run)(solver.as_ref()));
        }
    }
    for (name, check) in suite::OTHERS {
        report(name, check());
    }
}

/// Every check of a GPU.
fn gpu(report: &mut impl FnMut(&str, Outcome)) -> anyhow::Result<()> {
    let device = suite::gpu::device()?;
    println!("device: {}", device.description());
    for check in suite::gpu::CHECKS {
        report(check.name, (check.run)(&device));
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
