//! The long runs behind `docs/reliability.md`. The test command makes short ones of each.

use crate::machine::run_with;

/// Runs `seeds` seeds of the simulator from `first` on; the first that breaks a law is printed.
pub fn simulate(seeds: u64, first: u64) -> Result<(), String> {
    run_with(
        &[("APPRENTICE_SEEDS", &seeds.to_string()), ("APPRENTICE_SEED", &first.to_string())],
        "cargo",
        &["test", "--release", "--test", "simulation", "--", "--nocapture", "whatever_fails"],
    )
}
