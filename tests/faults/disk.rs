//! The disk full, and the disk failing. One short history is played once for each write and each
//! sync, and that call fails. A child process plays it, and `shim.c` fails the calls of its C
//! library.

use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use apprentice::limits::COMMIT_S_MAX;
use apprentice::store;

use crate::ledger::Ledger;
use crate::people::{Person, Signals};
use crate::served::{Ended, Server};

/// What fails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// The disk is full: this write and all that follow find no space.
    Full,
    /// One write is an I/O error.
    Write,
    /// One sync is an I/O error.
    Sync,
}

/// What a run has seen.
#[derive(Debug, Default)]
pub struct Counts {
    pub failed: usize,
    pub at_start: usize,
    pub under_way: usize,
    /// Of these, the cases in which the log hung and the watch ended it.
    pub hung: usize,
    /// One person got an error, and everybody else could have continued.
    pub refused: usize,
    /// The call belonged to a cache, or was repeated with success: no client noticed.
    pub harmless: usize,
    /// The history was over before that call: background work differs from run to run.
    pub not_reached: usize,
    pub acknowledged: usize,
}

/// Commands of the short history. It begins with a new person and has a training.
const STEPS: usize = 12;
/// How long a service that cannot continue may take to end.
const GONE: Duration = Duration::from_secs(4);
/// No test waits longer than this for an answer.
const HANGS: Duration = Duration::from_secs(2 * COMMIT_S_MAX);
/// The same as [`GONE`], after a history in which no client was told of any trouble.
const SOON: Duration = Duration::from_millis(50);

/// The shim, compiled once.
fn shim() -> &'static Path {
    static SHIM: OnceLock<PathBuf> = OnceLock::new();
    SHIM.get_or_init(|| {
        let source = apprentice_testkit::paths::root().join("tests/faults/shim.c");
        let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join("faults-shim.so");
        let compile = |compiler: &str| {
            let mut command = Command::new(compiler);
            command.args(["-shared", "-fPIC", "-O1", "-x", "c", "-o"]).arg(&library).arg(&source);
            command.args(["-ldl"]).output()
        };
        let output = compile("cc").or_else(|_| compile("gcc")).expect("a C compiler is installed");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        library
    })
}

pub fn environment(folder: &Path, kind: &str, at: usize) -> Vec<(&'static str, String)> {
    vec![
        ("LD_PRELOAD", shim().display().to_string()),
        ("FAULT_DIR", folder.join("data").display().to_string()),
        ("FAULT_KIND", kind.to_owned()),
        ("FAULT_AT", at.to_string()),
        ("FAULT_MARK", folder.join("mark").display().to_string()),
        ("APPRENTICE_LOG", "off".to_owned()),
    ]
}

/// How many writes and syncs the short history has when nothing fails.
pub fn calls() -> (usize, usize) {
    let folder = tempfile::tempdir().unwrap();
    let ledger = Ledger::new("ada");
    let ending = live(folder.path(), &ledger, "count", 0);
    assert!(matches!(ending, Ending::Whole), "nothing fails and yet: {ending:?}");
    let counts = std::fs::read_to_string(folder.path().join("mark")).unwrap();
    let (writes, syncs) = counts.split_once(' ').unwrap();
    (writes.parse().unwrap(), syncs.parse().unwrap())
}

/// Fails the call of each index, one history each. Panics at the end if one broke a promise.
pub fn fail_each(kind: Kind, calls: usize) -> Counts {
    let (next, counts) = (AtomicUsize::new(1), Mutex::new(Counts::default()));
    let broken = AtomicUsize::new(0);
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::SeqCst);
                    if at > calls {
                        break;
                    }
                    // All are checked before the test fails, because calls at similar places show
                    // similar faults.
                    if catch_unwind(|| fail(kind, at, &counts)).is_err() {
                        broken.fetch_add(1, Ordering::SeqCst);
                    }
                }
            });
        }
    });
    let broken = broken.into_inner();
    assert_eq!(broken, 0, "{kind:?}: of {calls} calls {broken} broke a promise; see above");
    counts.into_inner().unwrap()
}

fn fail(kind: Kind, at: usize, counts: &Mutex<Counts>) {
    let folder = tempfile::tempdir().unwrap();
    let ledger = Ledger::new("ada");
    let word = match kind {
        Kind::Full => "full",
        Kind::Write => "write",
        Kind::Sync => "sync",
    };
    let ending = live(folder.path(), &ledger, word, at);
    let what = std::fs::read_to_string(folder.path().join("mark")).ok();
    let case = format!("{word} {at} on {what:?}");
    match (what.as_deref(), &ending) {
        (Some(path), Ending::Gone(ended)) => {
            // A full disk soon hits the log as well.
            assert!(!path.contains("/cache/") || kind == Kind::Full, "{case}: {ended:?}");
            one_sentence(&case, ended);
        }
        // Without a key nothing was written for this person. The log is unchanged.
        (Some(path), Ending::Refused(errors)) => {
            assert!(path.contains("/keys/"), "{case}: it answers {errors:?} and does not end");
            assert!(errors.iter().all(|error| error.contains("key")), "{case}: {errors:?}");
        }
        (Some(path), Ending::Whole) => {
            assert!(may_pass(path), "{case}: it went on as if nothing had happened");
        }
        (None, ending) => assert!(matches!(ending, Ending::Whole), "{case}: {ending:?}"),
    }

    // There is space again: everything acknowledged is there, and the service works.
    let promised = ledger.acknowledged();
    let (data, socket) = (folder.path().join("data"), folder.path().join("socket"));
    let opened = store::open(&data).unwrap_or_else(|error| panic!("{case}: {error}"));
    ledger.check(&opened, &promised).unwrap_or_else(|sentence| panic!("{case}: {sentence}"));
    drop(opened);
    let signals = Signals::default();
    let server = Server::start(&data, &socket);
    let mut person = Person::new(&ledger, &socket, at as u64, &signals);
    person.insist().expect("nobody hangs up");
    person.step().expect("it records again");
    server.kill();

    let mut counts = counts.lock().unwrap();
    counts.failed += usize::from(what.is_some());
    counts.not_reached += usize::from(what.is_none());
    let hung = |ended: &Ended| ended.errors.contains("did not store a record within");
    counts.hung += usize::from(matches!(&ending, Ending::Gone(ended) if hung(ended)));
    match ending {
        Ending::Gone(_) if promised.is_empty() => counts.at_start += 1,
        Ending::Gone(_) => counts.under_way += 1,
        Ending::Refused(_) => counts.refused += 1,
        Ending::Whole => counts.harmless += usize::from(what.is_some()),
    }
    counts.acknowledged += promised.len();
}

/// True if a failure at this call may go unnoticed: making a key is tried again before anything else,
/// and the tree is signed again when it has grown.
fn may_pass(path: &str) -> bool {
    ["/cache/", "/keys/users", "/checkpoints"].iter().any(|part| path.contains(part))
}

/// The process gives a code other than 0 and one clear sentence, and does not panic.
fn one_sentence(case: &str, ended: &Ended) {
    let code = ended.status.code();
    assert!(matches!(code, Some(1 | 2)), "{case}: {ended:?}");
    let said: Vec<&str> =
        ended.errors.lines().filter(|line| !line.contains("everything is kept in")).collect();
    assert_eq!(said.len(), 1, "{case}: {ended:?}");
    assert!(said[0].starts_with("apprentice: "), "{case}: {ended:?}");
    assert!(!said[0].contains("panicked"), "{case}: {ended:?}");
}

/// How a short history ended.
#[derive(Debug)]
enum Ending {
    /// All steps were answered.
    Whole,
    /// The service continued, and said why it could not carry something out.
    Refused(Vec<String>),
    /// The service ended by itself.
    Gone(Ended),
}

/// The short history, always the same, on a directory that does not exist yet.
fn live(folder: &Path, ledger: &Ledger, kind: &str, at: usize) -> Ending {
    let (data, socket) = (folder.join("data"), folder.join("socket"));
    let mut server = Server::spawn(&data, &socket, &environment(folder, kind, at));
    if let Err(ended) = server.ready() {
        return Ending::Gone(ended);
    }
    let signals = Signals::default();
    let whole = thread::scope(|scope| {
        let mut person = Person::new(ledger, &socket, 7, &signals);
        let living = scope.spawn(move || (0..STEPS).all(|_| person.step().is_some()));
        let until = Instant::now() + HANGS;
        while !living.is_finished() && !server.has_ended() {
            if Instant::now() >= until {
                signals.hang_up.store(true, Ordering::SeqCst);
                panic!("{kind} {at}: it neither answers nor ends");
            }
            thread::sleep(Duration::from_millis(2));
        }
        signals.hang_up.store(true, Ordering::SeqCst);
        living.join().unwrap()
    });
    // A service that cannot continue has said so, or is about to end. The fault may also have come
    // after the last answer.
    let limit = if whole { SOON } else { GONE };
    let errors = signals.errors.into_inner().unwrap();
    // A fault after the last answer is reported only now. A busy machine takes longer for it.
    let ended = server.end(limit).or_else(|| {
        let hit = std::fs::read_to_string(folder.join("mark")).ok();
        let told = whole && kind != "count" && hit.is_some_and(|path| !may_pass(&path));
        told.then(|| server.end(GONE)).flatten()
    });
    match ended {
        Some(ended) => Ending::Gone(ended),
        None if whole => Ending::Whole,
        None => Ending::Refused(errors),
    }
}
