//! Fifty thousand records of one person: waking the user, replay and audit hold only a few of them
//! in memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use apprentice::client::Command;
use apprentice::ids::Seq;
use apprentice::learning::Recipe;
use apprentice::parallel::Progress;
use apprentice::replay::{Minds, Scrutiny, audit, keep_snapshot, rebuild, rebuild_at, streams_of};
use apprentice::store::open_memory;
use apprentice_testkit::diary::Diary;
use apprentice_testkit::toy::Bells;

const RECORDS: u64 = 50_000;
/// Utterances of one episode.
const UTTERANCES: usize = 100;
/// The memory that reading a history may take, whatever its length. It is far less than this
/// history. The log in memory returns a list of its frames, 16 bytes each.
const BYTES_MAX: usize = 4 * 1024 * 1024;

/// Counts the bytes that are in use, and the most that were.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
#[allow(unsafe_code, reason = "an allocator is an unsafe trait")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(now, Ordering::Relaxed);
        // SAFETY: the caller keeps the rules of the system's allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the rules of the system's allocator.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The result of `work`, and the most bytes it held beyond those held before.
fn peak_of<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = NOW.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let given = work();
    (given, PEAK.load(Ordering::Relaxed) - before)
}

#[derive(Default)]
struct Watched {
    expected: AtomicU64,
    advanced: AtomicU64,
    calls: AtomicU64,
}

impl Progress for Watched {
    fn expect(&self, records: u64) {
        self.expected.fetch_add(records, Ordering::Relaxed);
    }

    fn advance(&self, records: u64) {
        self.advanced.fetch_add(records, Ordering::Relaxed);
        self.calls.fetch_add(1, Ordering::Relaxed);
    }
}

#[test]
fn fifty_thousand_records_wake_replay_and_are_audited_in_little_memory() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let mut diary = Diary::new(&domain, &store, "ada", Recipe::builtin("tiny").unwrap());
    let before = NOW.load(Ordering::Relaxed);
    let mut digests = Vec::new();
    let mut episodes = 0_u64;
    let mut lesson = None;
    while diary.session.head().seq < RECORDS {
        // A person who continues to learn, and sometimes changes a lesson.
        let teaches = episodes.is_multiple_of(100);
        if let (true, Some(lesson)) = (teaches, lesson) {
            diary.accept(&Command::Forget { lesson });
            diary.learn();
        }
        diary.start("Brass Silver Glass");
        if teaches {
            diary.say("polish the silver bell");
        }
        for number in 0..UTTERANCES {
            diary.say(if number % 2 == 0 { "ring the brass bell" } else { "mute the brass bell" });
        }
        diary.done();
        if teaches {
            lesson = Some(diary.teach(&[1]));
            diary.learn();
        }
        if episodes.is_multiple_of(100) {
            let head = diary.session.head();
            let mind = diary.session.state().mind;
            digests.push((head.seq, diary.session.state_digest(), mind));
        }
        episodes += 1;
    }
    let (head, whole) = (diary.session.head(), NOW.load(Ordering::Relaxed) - before);
    println!("{} records, {} episodes, {whole} bytes", head.seq, episodes);
    assert!(whole > 4 * BYTES_MAX, "the history itself is large: {whole} bytes");

    let (woken, bytes) =
        peak_of(|| rebuild(&domain, &store, &diary.stream, &Minds::default()).unwrap());
    println!("waking from the first record: {bytes} bytes");
    assert!(bytes < BYTES_MAX, "{bytes} bytes");
    assert_eq!(woken.state_digest(), diary.session.state_digest());
    assert_eq!(woken.mind().unwrap().digest(), diary.session.mind().unwrap().digest());

    assert!(digests.len() >= 4);
    for (seq, state, mind) in digests {
        let at = Seq::new(seq).unwrap();
        let (past, bytes) =
            peak_of(|| rebuild_at(&domain, &store, &diary.stream, &Minds::default(), at).unwrap());
        assert!(bytes < BYTES_MAX, "{bytes} bytes");
        assert_eq!((past.state_digest(), past.state().mind), (state, mind), "at record {seq}");
    }

    let (streams, watched) = (streams_of(&store, None).unwrap(), Watched::default());
    let all = Scrutiny { repropose: true, retrain: true };
    let (report, bytes) = peak_of(|| audit(&domain, &store, &streams, all, 2, &watched));
    println!("audit with everything: {bytes} bytes, {:?}", report.counts);
    assert!(bytes < BYTES_MAX, "{bytes} bytes");
    assert_eq!(report.streams[0].difference, None);
    assert_eq!((report.counts.records, report.counts.episodes), (head.seq, episodes));
    assert_eq!(watched.expected.into_inner(), head.seq);
    assert_eq!(watched.advanced.into_inner(), head.seq);
    assert!(watched.calls.into_inner() > 100, "whoever watches sees it move");

    // With a snapshot, waking the user folds nothing.
    keep_snapshot(&store, &diary.stream, &diary.session).unwrap();
    let again = rebuild(&domain, &store, &diary.stream, &Minds::default()).unwrap();
    assert_eq!(again.state_digest(), diary.session.state_digest());
}
