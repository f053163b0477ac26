//! The words that options of `bench` take, and which scenarios take which option.

/// Scenarios, and the options besides `--method` and `--seed` by which their rows are chosen.
pub(super) const SCENARIOS: [(&str, &[&str]); 11] = [
    ("dynamics", &["--precision", "--sizes", "--threads"]),
    ("needs", &["--precision"]),
    ("chunks", &["--precision"]),
    ("joints", &[]),
    ("batch", &["--precision", "--sizes", "--threads"]),
    ("loops", &["--precision"]),
    ("collision", &["--precision", "--threads"]),
    ("collision-queries", &["--threads"]),
    ("collision-error", &["--precision"]),
    ("collision-scaling", &["--threads"]),
    ("gpu", &["--precision", "--sizes"]),
];

/// Names of methods, and families of them.
pub(super) const METHODS: &[&str] = &[
    "aba",
    "aba-batch",
    "aba-batch-1",
    "aba-batch-2",
    "aba-batch-4",
    "aba-batch-8",
    "aba-derivatives",
    "aba-refined",
    "aba-refined-2",
    "add",
    "add-chain",
    "add-tree",
    "build",
    "crba",
    "cut",
    "cut-chain",
    "cut-tree",
    "dca",
    "dca-batch",
    "dca-refined",
    "dca-refined-2",
    "reattach",
    "reattach-chain",
    "reattach-tree",
    "remove",
    "remove-chain",
    "remove-tree",
    "resume",
    "resume-chain",
    "resume-tree",
    "rnea",
    "step",
    "step-16",
    "step-all-poses",
    "step-bare",
    "step-batch",
    "step-batch-rk4",
    "step-elements",
    "step-no-pose",
    "step-rough",
    "tolerance",
    "tolerance-1e-10",
    "weld",
    "weld-chain",
    "weld-tree",
    "exact",
    "exact-any",
    "exact-any-resident",
    "exact-classified",
    "exact-classified-resident",
    "exact-count",
    "exact-count-resident",
    "exact-curves",
    "exact-curves-resident",
    "exact-mask",
    "exact-mask-resident",
    "exact-pairs",
    "exact-pairs-all",
    "exact-pairs-resident",
    "exact-within",
    "exact-within-resident",
    "inside",
    "inside-resident",
    "links",
    "poses",
    "rebuild",
    "refit",
    "self",
    "self-pairs",
    "self-pairs-resident",
    "seeds",
    "moller",
    "moller-pairs",
    "moller0",
    "moller0-pairs",
    "separating-axes",
    "dispatch",
    "copy",
    "reduce",
    "scan",
    "compact",
    "histogram",
    "sort",
    "shapes",
    "collision",
    "collision-any",
    "collision-build",
    "collision-contacts",
    "collision-contacts-posed",
    "collision-count",
    "collision-device",
    "collision-device-all",
    "collision-device-tree",
    "collision-error-exact",
    "collision-error-moller",
    "collision-following",
    "collision-links",
    "collision-mask",
    "collision-moller",
    "collision-pairs",
    "collision-pairs-all",
    "collision-pairs-chosen",
    "collision-pairs-moving",
    "collision-pairs-tree",
    "collision-pairs-upload",
    "collision-poses",
    "collision-refit-pairs",
    "collision-self",
    "collision-spheres",
    "collision-spheres-all",
    "collision-spheres-tree",
];

/// Says which of the options given a scenario would pass over in silence.
///
/// # Errors
/// If there is one.
pub(super) fn check(scenarios: &[String], given: &[&str]) -> anyhow::Result<()> {
    let takes = |scenario: &str, option: &str| {
        let found = SCENARIOS.iter().find(|(name, _)| *name == scenario);
        found.is_none_or(|(_, options)| options.contains(&option))
    };
    for option in given {
        if let Some(scenario) = scenarios.iter().find(|scenario| !takes(scenario, option)) {
            let takers = SCENARIOS
                .iter()
                .filter(|(_, options)| options.contains(option));
            let takers: Vec<&str> = takers.map(|(name, _)| *name).collect();
            anyhow::bail!(
                "`{scenario}` has no choice of rows by {option}: leave it out; {} take it",
                takers.join(", ")
            );
        }
    }
    Ok(())
}
