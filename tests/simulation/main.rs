//! The simulator: one seed decides what people say, which appends fail or hang, who crashes when,
//! which caches are lost and how requests are repeated and reordered. No socket, no actor, no
//! sleep. The fold of the log is the oracle (`docs/reliability.md`).
//!
//! `cargo xtask simulate --seeds N [--seed S]` runs as many seeds as wanted.

#[path = "../support/chance.rs"]
mod chance;
#[path = "../support"]
mod support {
    pub mod toy;
}

mod dice;
mod disturbed;
mod house;
mod oracle;
mod people;

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use chance::number;
use house::{Counts, Defect, House};
use oracle::Broken;

/// Moves of one seed: many short lives, and a long one in ten.
fn moves(seed: u64) -> usize {
    if seed.is_multiple_of(10) { 600 } else { 120 }
}

/// Seeds of the test command; `APPRENTICE_SEEDS` and `APPRENTICE_SEED` choose others.
const SEEDS: u64 = 10_000;

fn run(seed: u64, defect: Defect) -> Result<Counts, Broken> {
    House::new(seed, defect, false).run(moves(seed)).0
}

#[test]
fn whatever_fails_nothing_acknowledged_is_lost_and_every_law_holds() {
    let (first, seeds) = (number("APPRENTICE_SEED", 1), number("APPRENTICE_SEEDS", SEEDS));
    let (next, counts) = (AtomicU64::new(first), Mutex::new(Counts::default()));
    let failed: Mutex<Option<(u64, Broken)>> = Mutex::new(None);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= first + seeds || failed.lock().unwrap().is_some() {
                        break;
                    }
                    match run(seed, Defect::None) {
                        Ok(counted) => counts.lock().unwrap().add(&counted),
                        Err(broken) => *failed.lock().unwrap() = Some((seed, broken)),
                    }
                    if seed % 100_000 == 0 {
                        eprintln!("seed {seed}");
                    }
                }
            });
        }
    });
    if let Some((seed, broken)) = failed.into_inner().unwrap() {
        let (_, trace) = House::new(seed, Defect::None, true).run(moves(seed));
        panic!(
            "seed {seed}: {}: {}\nlast moves:\n  {}\nrepeat: cargo xtask simulate --seed {seed}",
            broken.law,
            broken.how,
            trace[trace.len().saturating_sub(40)..].join("\n  "),
        );
    }
    let counts = counts.into_inner().unwrap();
    println!("{seeds} seeds from {first}: {counts:?}");
    if seeds >= 100 {
        // Each kind of trouble was there; otherwise the run has shown nothing.
        for (kind, count) in [
            ("acknowledged", counts.acknowledged),
            ("repeated", counts.repeated),
            ("rejected", counts.rejected),
            ("failed appends", counts.failed_appends),
            ("conflicts", counts.conflicts),
            ("crashes", counts.crashes),
            ("interrupted wakings", counts.interrupted_wakings),
            ("trainings", counts.trainings),
            ("lost caches", counts.lost_caches),
        ] {
            assert!(count > 0, "no seed had {kind}");
        }
    }
}

#[test]
fn a_seed_repeats_itself_move_by_move() {
    let lived = |seed| House::new(seed, Defect::None, true).run(moves(seed));
    assert_eq!(lived(10), lived(10));
    assert_ne!(lived(10).1, lived(20).1);
}

#[test]
fn a_service_that_breaks_a_law_is_caught_within_two_hundred_seeds() {
    for (defect, law) in [
        (Defect::AnswersEarly, "DurableBeforeReply ExactlyOnce"),
        (Defect::ForgetsRequests, "ExactlyOnce"),
        (Defect::ForgetsTrainings, "NoLostWork"),
        (Defect::SnapshotsAhead, "FoldAgrees"),
    ] {
        let caught = (1..=200).find_map(|seed| run(seed, defect).err());
        let caught = caught.unwrap_or_else(|| panic!("{defect:?} was not seen"));
        assert!(law.contains(&caught.law.to_string()), "{defect:?} was taken for {caught:?}");
    }
}
