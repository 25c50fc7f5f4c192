//! Every decoder in this process, on as many threads as there are cores.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use apprentice::limits::SCENE_FILE_BYTES_MAX;
use data_encoding::HEXLOWER;

use crate::memory::peak_of;
use crate::mutate::{deepest, mutate};
use crate::targets::{self, Target};
use apprentice_testkit::dice::Dice;

/// Stack of the threads that run people's actors.
const STACK: usize = 2 * 1024 * 1024;
/// Memory that each case may take, and how much more for each of its bytes. A list of large items
/// may reserve a megabyte at once at each level of nesting.
const BYTES_MAX: usize = 8 * 1024 * 1024;
const TIMES_MAX: usize = 128;
/// Bytes of the deepest nesting: as much as the largest file that a client sends.
const DEEPEST: usize = SCENE_FILE_BYTES_MAX;

#[derive(Default)]
struct Counts {
    cases: AtomicU64,
    read: AtomicU64,
    peak: AtomicU64,
    micros: AtomicU64,
}

pub fn run(cases: u64, seed: u64, only: Option<&str>) {
    let mut targets = targets::all();
    if let Some(only) = only {
        targets.retain(|target| target.name.contains(only));
        assert!(!targets.is_empty(), "no target's name has {only:?} in it");
    }
    let weights: u64 = targets.iter().map(|target| target.weight).sum();
    let counts: Vec<Counts> = targets.iter().map(|_| Counts::default()).collect();
    let threads = std::thread::available_parallelism().map_or(1, |cores| cores.get()) as u64;
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let failures: Vec<String> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|thread| {
                let (targets, counts) = (&targets, &counts);
                let work = move || {
                    targets.iter().zip(counts).enumerate().find_map(|(place, (target, counts))| {
                        let share = cases * target.weight / weights / threads;
                        let dice = Dice::new(seed ^ ((place as u64) << 32) ^ (thread << 56));
                        try_out(target, counts, share.max(1), dice).err()
                    })
                };
                std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work).unwrap()
            })
            .collect();
        workers.into_iter().filter_map(|worker| worker.join().unwrap()).collect()
    });
    std::panic::set_hook(hook);
    println!("{:<34} {:>8} {:>8} {:>12} {:>8}", "decoder", "cases", "read", "most memory", "time");
    let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    for (target, counts) in targets.iter().zip(&counts) {
        println!(
            "{:<34} {:>8} {:>8} {:>9} kB {:>6.1} s",
            target.name,
            read(&counts.cases),
            read(&counts.read),
            read(&counts.peak) / 1024,
            read(&counts.micros) as f64 / 1e6
        );
    }
    let total: u64 = counts.iter().map(|counts| read(&counts.cases)).sum();
    println!("{total} cases of {} decoders: 0 panics", targets.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn try_out(target: &Target, counts: &Counts, cases: u64, mut dice: Dice) -> Result<(), String> {
    let start = Instant::now();
    let (mut read, mut most) = (0, 0);
    let mut deepest = deepest(&target.corpus, DEEPEST).into_iter();
    let cases = cases.max(deepest.len() as u64);
    for case in 0..cases {
        let bytes = deepest.next().unwrap_or_else(|| mutate(&mut dice, &target.corpus));
        let (done, peak) = peak_of(|| catch_unwind(AssertUnwindSafe(|| (target.read)(&bytes))));
        let what = match done {
            Err(panic) => {
                let words = panic.downcast_ref::<String>().cloned();
                let words = words.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
                Some(format!("panicked: {}", words.unwrap_or_default()))
            }
            Ok(_) if peak > BYTES_MAX + TIMES_MAX * bytes.len() => {
                Some(format!("took {peak} bytes of memory"))
            }
            Ok(was_read) => {
                read += u64::from(was_read);
                most = most.max(peak);
                None
            }
        };
        if let Some(what) = what {
            let hex = HEXLOWER.encode(&bytes[..bytes.len().min(2_000)]);
            return Err(format!(
                "{}: case {case} of {} bytes {what}\n{hex}",
                target.name,
                bytes.len()
            ));
        }
    }
    counts.cases.fetch_add(cases, Ordering::Relaxed);
    counts.read.fetch_add(read, Ordering::Relaxed);
    counts.peak.fetch_max(most as u64, Ordering::Relaxed);
    counts.micros.fetch_add(start.elapsed().as_micros() as u64, Ordering::Relaxed);
    Ok(())
}

#[test]
fn a_decoder_that_panics_or_believes_a_length_is_caught() {
    let caught = |read: fn(&[u8]) -> bool| {
        let corpus = vec![vec![0, 0, 0, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9]];
        let target = Target { name: "bad", weight: 1, corpus, read: Box::new(read) };
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let done = try_out(&target, &Counts::default(), 10_000, Dice::new(1));
        std::panic::set_hook(hook);
        done.unwrap_err()
    };
    let panics = caught(|bytes| bytes[3] == 9);
    assert!(panics.contains("panicked: index out of bounds"), "{panics}");
    let believes = caught(|bytes| {
        let Some((length, rest)) = bytes.split_first_chunk() else { return false };
        let mut body = Vec::<u8>::with_capacity(u32::from_be_bytes(*length) as usize);
        body.extend_from_slice(rest);
        std::hint::black_box(body).len() == rest.len()
    });
    assert!(believes.contains("bytes of memory"), "{believes}");
}
