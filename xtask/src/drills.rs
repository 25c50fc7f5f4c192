//! The long runs behind `docs/reliability.md`. The test command runs a short one of each.

use crate::machine::{self, run_with};

/// Runs `seeds` seeds of the simulator, beginning with `first`. Prints the first seed that breaks a
/// law.
pub(crate) fn simulate(seeds: u64, first: u64) -> Result<(), String> {
    run_with(
        &[("APPRENTICE_SEEDS", &seeds.to_string()), ("APPRENTICE_SEED", &first.to_string())],
        "cargo",
        &["test", "--release", "--test", "simulation", "--", "--nocapture", "whatever_fails"],
    )
}

/// Kills the service this number of times. Prints the first acknowledgement that is lost.
pub(crate) fn crash(kills: u64, seed: Option<u64>) -> Result<(), String> {
    faults("whenever_it_is_killed", "APPRENTICE_KILLS", kills, seed)
}

/// Copies this number of images of a disk during writes. Prints the first that broke a promise.
///
/// - errors: also if this machine cannot do it.
pub(crate) fn powerloss(images: u64, seed: Option<u64>) -> Result<(), String> {
    machine::disk_tools()?;
    faults("after_a_power_cut", "APPRENTICE_IMAGES", images, seed)
}

/// Gives this number of cases to the decoders. Prints the first that causes a panic or takes too
/// much memory.
pub(crate) fn fuzz(cases: u64, seed: Option<u64>, target: Option<&str>) -> Result<(), String> {
    let (cases, seed) = (cases.to_string(), seed.map(|seed| seed.to_string()));
    let mut environment = vec![("APPRENTICE_CASES", &*cases)];
    environment.extend(seed.as_deref().map(|seed| ("APPRENTICE_SEED", seed)));
    environment.extend(target.map(|target| ("APPRENTICE_TARGET", target)));
    let arguments =
        ["test", "--release", "--test", "hostile", "--", "--nocapture", "no_bytes_make_a_decoder"];
    run_with(&environment, "cargo", &arguments)
}

/// Flips this number of bits of a closed directory, one at a time. Prints the first that was
/// neither harmless nor reported.
pub(crate) fn damage(flips: u64, seed: Option<u64>) -> Result<(), String> {
    let (flips, seed) = (flips.to_string(), seed.map(|seed| seed.to_string()));
    let mut environment = vec![("APPRENTICE_FLIPS", &*flips)];
    environment.extend(seed.as_deref().map(|seed| ("APPRENTICE_SEED", seed)));
    let test = ["test", "--release", "--test", "damage", "--", "--nocapture", "a_flipped_bit"];
    run_with(&environment, "cargo", &test)
}

fn faults(test: &str, variable: &str, count: u64, seed: Option<u64>) -> Result<(), String> {
    let (count, seed) = (count.to_string(), seed.map(|seed| seed.to_string()));
    // A long run that skips its test has failed.
    let mut environment = vec![(variable, &*count), ("CI", "true")];
    environment.extend(seed.as_deref().map(|seed| ("APPRENTICE_SEED", seed)));
    let arguments = ["test", "--release", "--test", "faults", "--", "--nocapture", test];
    run_with(&environment, "cargo", &arguments)
}
