//! The stages of `cargo xtask test`, in order, each timed against its budget.

use std::time::Instant;

use crate::budget::Budget;
use crate::machine::{self, run, run_with};

struct Stage {
    name: &'static str,
    act: fn() -> Result<(), String>,
}

/// What `cargo xtask test` runs.
const STAGES: &[Stage] = &[
    Stage { name: "setup", act: setup },
    Stage { name: "format", act: || run("cargo", &["fmt", "--all", "--check"]) },
    Stage { name: "lint", act: lint },
    Stage { name: "build", act: build },
    Stage { name: "test", act: test },
    Stage { name: "docs", act: docs },
    Stage { name: "licences", act: licences },
];

/// What `cargo xtask check` runs: the checks before every commit.
const CHECKS: &[Stage] = &[
    Stage { name: "format", act: || run("cargo", &["fmt", "--all", "--check"]) },
    Stage { name: "lint", act: lint },
    Stage { name: "unit", act: unit },
];

/// Runs the checks of `cargo xtask check`.
///
/// - errors: the first that failed.
pub(crate) fn check() -> Result<(), String> {
    for stage in CHECKS {
        eprintln!("== {}", stage.name);
        (stage.act)()?;
    }
    Ok(())
}

/// Runs all stages, or the named ones, and prints how long each took.
///
/// - `enforce_budget`: a stage that exceeds its budget fails. Otherwise the run warns and
///   continues, because the budgets are those of one machine, and a slower machine is no fault of
///   the code.
/// - errors: the first stage that failed or, if enforced, exceeded its budget; a stage without a
///   budget.
pub(crate) fn run_all(only: &[String], enforce_budget: bool) -> Result<(), String> {
    let known: Vec<&str> = STAGES.iter().map(|stage| stage.name).collect();
    if let Some(unknown) = only.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(format!("there is no stage {unknown}; known are {}", known.join(", ")));
    }
    let budget = Budget::load()?;
    let (mut took, mut over) = (Vec::new(), Vec::new());
    for stage in STAGES.iter().filter(|s| only.is_empty() || only.iter().any(|n| n == s.name)) {
        eprintln!("== {}", stage.name);
        let start = Instant::now();
        (stage.act)()?;
        let seconds = start.elapsed().as_secs();
        took.push(format!("{:<10} {seconds:>5} s", stage.name));
        if let Some(sentence) = budget.exceeded(stage.name, seconds)? {
            if enforce_budget {
                return Err(sentence);
            }
            eprintln!("xtask: warning: {sentence}");
            over.push(sentence);
        }
    }
    println!("{}", took.join("\n"));
    // Printed again at the end, where it is easy to see.
    over.iter().for_each(|sentence| println!("warning: {sentence}"));
    Ok(())
}

fn lint() -> Result<(), String> {
    run("cargo", &["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])
}

/// Prints what could not be installed. The tests that need it then say so, or fail with CI=true.
fn setup() -> Result<(), String> {
    machine::setup()?.iter().for_each(|missing| eprintln!("xtask: {missing}"));
    Ok(())
}

/// The unit tests of the libraries, and the checks of `ARCHITECTURE.md`.
fn unit() -> Result<(), String> {
    run("cargo", &["test", "--quiet", "--workspace", "--lib", "--test", "tidy"])
}

fn build() -> Result<(), String> {
    machine::optimised_binary()?;
    machine::unoptimised_binary()?;
    run("cargo", &["test", "--workspace", "--no-run", "--quiet"])
}

/// Gives the tests the binaries for comparing bits between builds and processors.
fn test() -> Result<(), String> {
    let binaries = [
        ("APPRENTICE_OPTIMISED_BINARY", machine::optimised_binary()?),
        ("APPRENTICE_UNOPTIMISED_BINARY", machine::unoptimised_binary()?),
    ];
    let shown = binaries.map(|(name, path)| (name, path.display().to_string()));
    let environment = shown.each_ref().map(|(name, path)| (*name, path.as_str()));
    // One run reports all errors, not only the first.
    run_with(&environment, "cargo", &["test", "--workspace", "--no-fail-fast"])
}

fn docs() -> Result<(), String> {
    // A broken link is an error.
    run_with(
        &[("RUSTDOCFLAGS", "-D warnings")],
        "cargo",
        &["doc", "--workspace", "--no-deps", "--quiet"],
    )
}

/// Advisories need a database that not every machine can reach. Check them by hand, see
/// `deny.toml`.
fn licences() -> Result<(), String> {
    run("cargo", &["deny", "check", "licenses", "bans", "sources"])
}

/// Runs the benchmarks.
pub(crate) fn bench(filter: Option<&str>) -> Result<(), String> {
    let mut arguments = vec!["bench"];
    arguments.extend(["--"].iter().filter(|_| filter.is_some()));
    arguments.extend(filter);
    run("cargo", &arguments)
}
