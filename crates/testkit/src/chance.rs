//! Random draws of a test run, and how to repeat the run.

use apprentice::store::{Entropy, OsEntropy, SeededEntropy};

/// A number from the environment, or the default.
pub fn number(variable: &str, otherwise: u64) -> u64 {
    let text = std::env::var(variable).ok();
    text.map_or(otherwise, |text| {
        text.parse().unwrap_or_else(|_| panic!("{variable} is {text:?}, which is no number"))
    })
}

/// A seed that is printed, so that a failure can be repeated. Threads and the disk may still behave
/// differently.
pub fn seed() -> u64 {
    let mut bytes = [0; 8];
    OsEntropy.fill(&mut bytes);
    let seed = number("APPRENTICE_SEED", u64::from_be_bytes(bytes));
    println!("seed: APPRENTICE_SEED={seed}");
    seed
}

/// A number below `bound`, which is at least 1.
pub fn below(dice: &SeededEntropy, bound: usize) -> usize {
    let mut bytes = [0; 8];
    dice.fill(&mut bytes);
    usize::try_from(u64::from_be_bytes(bytes) % bound.max(1) as u64).unwrap()
}
