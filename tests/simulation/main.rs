//! The simulator: one seed decides what people of two labs say, which appends fail or hang, who
//! crashes, wakes, sleeps and is erased when, what operators order, which caches are lost and how
//! requests are repeated and reordered. The seats, the directory and the tenants' writer are the
//! shipped ones. No socket, no thread, no sleep. The fold of the log is the oracle (`docs/reliability.md`).
//!
//! `cargo xtask simulate --seeds N [--seed S]` runs any number of seeds.

mod counts;
mod defects;
mod disturbed;
mod drive;
mod oracle;
mod orders;
mod people;
mod process;
mod registrar;
mod system;

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use apprentice::actors::{Input, Seat};
use apprentice::client::{PersonAsk, Query};
use apprentice::ids::{RequestId, StreamId, TenantId, Timestamp, UserId};
use apprentice_testkit::chance::number;
use apprentice_testkit::toy::Bells;
use counts::Counts;
use defects::{DEFECTS, Defect};
use oracle::Broken;
use system::{System, beginning};

/// Moves of one seed. Every tenth seed has a long run.
fn moves(seed: u64) -> usize {
    if seed.is_multiple_of(10) { 2_700 } else { 540 }
}

/// Number of seeds in the test command; `APPRENTICE_SEEDS` and `APPRENTICE_SEED` choose others.
const SEEDS: u64 = 10_000;

fn run(seed: u64, defect: Defect) -> Result<Counts, Broken> {
    System::new(seed, defect, false).run(moves(seed)).0
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
        let (_, trace) = System::new(seed, Defect::None, true).run(moves(seed));
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
        assert_eq!(counts.missing(), Vec::<&str>::new(), "otherwise the run has shown nothing");
    }
}

#[test]
fn a_seed_repeats_itself_move_by_move() {
    let lived = |seed| System::new(seed, Defect::None, true).run(moves(seed));
    assert_eq!(lived(10), lived(10));
    assert_ne!(lived(10).1, lived(20).1);
}

#[test]
fn a_service_that_breaks_a_law_is_caught_within_five_hundred_seeds() {
    for (defect, laws) in DEFECTS {
        let caught = (1..=500).find_map(|seed| Some((seed, run(seed, defect).err()?)));
        let (seed, caught) = caught.unwrap_or_else(|| panic!("{defect:?} was not seen"));
        assert!(laws.contains(&caught.law), "{defect:?} was taken for {caught:?}");
        println!("{defect:?}: seed {seed}, {}: {}", caught.law, caught.how);
    }
}

#[test]
#[should_panic(expected = "SingleWriter")]
fn a_seat_takes_no_request_before_its_session_was_read() {
    let (_, new) = beginning();
    let stream = StreamId::of_tenant(&TenantId::local());
    let mut seat: Seat<Bells, ()> = Seat::new(stream, UserId::new("ada").unwrap(), new.clone());
    let [request, fresh] = [1, 2].map(|byte| RequestId([byte; 16]));
    let ask = PersonAsk::Query(Query::Status);
    seat.step(Input::Asked { ask, request, caller: (), at: Timestamp(1), fresh });
}
