//! The real program killed: SIGKILL at random moments, while it starts, under load, and while minds
//! are trained.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use apprentice::store::{self, Store};

use crate::ledger::{Found, Ledger};
use crate::people::{Insisted, Person, Signals};
use crate::served::{PATIENCE, Server, copy_tree};
use apprentice_testkit::dice::Dice;

const PEOPLE: usize = 4;
/// Kills of one data directory; then a new one begins.
const KILLS_OF_ONE: usize = 25;

/// A data directory, its people, and their ledgers.
struct Place {
    folder: tempfile::TempDir,
    people: Vec<Ledger>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Moment {
    /// While it opens its directory.
    Starting,
    UnderLoad,
    /// Right after a training was scheduled.
    Learning,
}

/// What a run has seen.
#[derive(Debug, Default)]
pub struct Counts {
    pub kills: usize,
    pub while_starting: usize,
    pub while_learning: usize,
    pub acknowledged: usize,
    pub asked_again: usize,
    pub answered_late: usize,
    pub records: usize,
    pub large_records: usize,
    pub trainings: usize,
}

impl Place {
    fn new() -> Place {
        let people = (0..PEOPLE).map(|number| Ledger::new(&format!("person {number}"))).collect();
        Place { folder: tempfile::tempdir().unwrap(), people }
    }

    fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("socket")
    }

    /// Compares a copy of the directory, as the kill left it, with the ledgers. It is a copy,
    /// because reading must not repair the directory before the next start.
    fn check(&self) -> Vec<Found> {
        if !self.data().exists() {
            return vec![Found::default(); self.people.len()];
        }
        let copy = self.folder.path().join("copy");
        copy_tree(&self.data(), &copy);
        let opened = store::open(&copy).unwrap_or_else(|error| {
            let kept = std::env::temp_dir().join(format!("apprentice-kept-{}", std::process::id()));
            copy_tree(&self.data(), &kept);
            panic!("{error}; the directory as the kill left it is kept in {}", kept.display())
        });
        let found = self.people.iter().map(|ledger| check(&opened, ledger)).collect();
        drop(opened);
        std::fs::remove_dir_all(&copy).unwrap();
        found
    }
}

fn check(store: &Store, ledger: &Ledger) -> Found {
    ledger.check(store, &ledger.acknowledged()).unwrap_or_else(|sentence| panic!("{sentence}"))
}

/// Kills a service a number of times. Panics if it has broken a promise.
pub fn run(kills: usize, seed: u64) -> Counts {
    let (mut dice, mut counts) = (Dice::new(seed), Counts::default());
    let mut place = Place::new();
    for kill in 1..=kills {
        let moment =
            dice.weighted(&[(2, Moment::Starting), (5, Moment::UnderLoad), (3, Moment::Learning)]);
        let insisted = kill_once(&place, moment, &mut dice);
        counts.kills += 1;
        counts.while_starting += usize::from(moment == Moment::Starting);
        insisted.iter().for_each(|insisted| {
            counts.asked_again += insisted.again;
            counts.answered_late += insisted.late;
        });
        let found = place.check();
        counts.while_learning += found.iter().filter(|found| found.learning).count();
        if kill % KILLS_OF_ONE == 0 || kill == kills {
            settle(&place, &mut dice);
            for found in place.check() {
                assert!(!found.learning, "a training was forgotten");
                counts.acknowledged += found.acknowledged;
                counts.records += found.records;
                counts.large_records += found.large;
                counts.trainings += found.minds;
            }
            shown_by_the_log_command(&place);
            place = Place::new();
        }
        if kill % 100 == 0 {
            eprintln!("{kill} kills: {counts:?}");
        }
    }
    counts
}

/// Starts the service, lets people repeat their requests and continue, and kills it.
fn kill_once(place: &Place, moment: Moment, dice: &mut Dice) -> Vec<Insisted> {
    let mut server = Server::spawn(&place.data(), &place.socket(), &[]);
    if moment == Moment::Starting {
        thread::sleep(Duration::from_micros(dice.below(80_000) as u64));
        server.kill();
        return Vec::new();
    }
    if let Err(ended) = server.ready() {
        panic!("it does not start: {ended:?}");
    }
    let signals = Signals::default();
    let pause = Duration::from_micros(match moment {
        Moment::Learning => dice.below(4_000),
        _ => dice.below(150_000),
    } as u64);
    let seeds: Vec<u64> = place.people.iter().map(|_| dice.number()).collect();
    thread::scope(|scope| {
        let people: Vec<_> = place
            .people
            .iter()
            .zip(&seeds)
            .map(|(ledger, seed)| {
                let mut person = Person::new(ledger, &place.socket(), *seed, &signals);
                scope.spawn(move || {
                    let insisted = person.insist();
                    person.live();
                    insisted.expect("nobody kills it before everybody is satisfied")
                })
            })
            .collect();
        let everybody = || {
            let waiting = signals.satisfied.load(Ordering::SeqCst) < place.people.len();
            waiting && !people.iter().any(|person| person.is_finished())
        };
        wait_while(everybody, PATIENCE);
        if moment == Moment::Learning {
            wait_while(|| signals.learning.load(Ordering::SeqCst) == 0, Duration::from_secs(5));
        }
        thread::sleep(pause);
        server.kill();
        signals.hang_up.store(true, Ordering::SeqCst);
        assert_eq!(signals.defects.load(Ordering::SeqCst), 0, "a defect was answered");
        people.into_iter().map(|person| person.join().unwrap()).collect()
    })
}

pub fn wait_while(condition: impl Fn() -> bool, limit: Duration) {
    let until = Instant::now() + limit;
    while condition() && Instant::now() < until {
        thread::sleep(Duration::from_micros(200));
    }
}

/// Starts it once more. Everybody finds everything again, and no work is left.
fn settle(place: &Place, dice: &mut Dice) {
    let server = Server::start(&place.data(), &place.socket());
    let signals = Signals::default();
    for ledger in &place.people {
        let insisted = Person::new(ledger, &place.socket(), dice.number(), &signals).insist();
        insisted.expect("nobody hangs up");
    }
    server.kill();
}

/// `apprentice log show` prints what the store contains: every record, in order.
fn shown_by_the_log_command(place: &Place) {
    let store = store::copy_private(&place.data()).unwrap();
    let store = store.open().unwrap();
    for ledger in &place.people {
        let records = ledger.records(&store).unwrap();
        let shown = shown(&place.data(), ledger);
        assert_eq!(shown.lines().count(), records.len());
        for (line, record) in shown.lines().zip(&records) {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            let kind = format!("{:?}", record.event.kind());
            assert_eq!(line["seq"].as_u64(), Some(record.seq.get()));
            assert_eq!(line["kind"].as_str(), Some(&*kind));
        }
    }
}

fn shown(data: &Path, ledger: &Ledger) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(["log", "show", "--json", "--user", ledger.user.as_str(), "--data"]).arg(data);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}
