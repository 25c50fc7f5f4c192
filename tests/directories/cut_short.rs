//! Long work of the real program, killed at any moment: an upgrade and a salvage. The next run
//! completes it.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use apprentice::events::{Head, Record};
use apprentice::ids::{Seq, StreamId};
use apprentice::store::conformance::{batch, stream};
use apprentice::store::{self, Entropy, OpenError, SeededEntropy, Store};
use apprentice_testkit::chance::seed;
use apprentice_testkit::released::released;

const BINARY: &str = env!("CARGO_BIN_EXE_apprentice");
const KILLS: u32 = 25;
const PATIENCE: Duration = Duration::from_secs(60);

fn dice() -> SeededEntropy {
    SeededEntropy::new(seed())
}

/// A random part of `whole`.
fn part_of(whole: Duration, dice: &SeededEntropy) -> Duration {
    let mut bytes = [0; 4];
    dice.fill(&mut bytes);
    whole.mul_f64(f64::from(u32::from_be_bytes(bytes)) / f64::from(u32::MAX))
}

fn spawn(arguments: &[&str], dir: &Path, more: &[&Path]) -> Child {
    let mut command = Command::new(BINARY);
    command.args(arguments).arg("--data").arg(dir).args(more);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// SIGKILL, unless it ended before.
fn kill(child: &mut Child) {
    let _ = child.kill();
    child.wait().unwrap();
}

fn layout(dir: &Path) -> String {
    fs::read_to_string(dir.join("LAYOUT")).unwrap()
}

fn all_records(store: &Store) -> Vec<Vec<Record>> {
    let tenants = store.log.tenants().unwrap();
    let streams = tenants.iter().flat_map(|tenant| store.log.streams(tenant).unwrap());
    let read = |stream: StreamId| {
        store.log.read(&stream, Seq::FIRST).unwrap().collect::<Result<_, _>>().unwrap()
    };
    // Records that the service itself added since do not count.
    streams.filter(|stream| !stream.is_tenants()).map(read).collect()
}

fn serve(dir: &Path) -> Child {
    // Without a port: what matters happens before a client could connect.
    spawn(&["serve", "--zmq", "tcp://127.0.0.1:0"], dir, &[])
}

/// Serves until the layout is the present one. Returns the time that it took.
fn bring_up(dir: &Path) -> Duration {
    let began = Instant::now();
    let mut child = serve(dir);
    while layout(dir).contains("layout 1") {
        assert!(began.elapsed() < PATIENCE && child.try_wait().unwrap().is_none());
        thread::sleep(Duration::from_micros(200));
    }
    let took = began.elapsed();
    kill(&mut child);
    took
}

/// Opens what a kill left, as a second start of the service does. A child that the dead process had
/// just forked holds its lock until it runs its own program.
fn open_again(dir: &Path) -> Store {
    let began = Instant::now();
    loop {
        match store::open(dir) {
            Err(OpenError::InUse { .. }) if began.elapsed() < PATIENCE => thread::yield_now(),
            opened => return opened.unwrap_or_else(|error| panic!("{error}")),
        }
    }
}

#[test]
fn bringing_up_a_former_layout_survives_a_kill_at_any_moment() {
    let dice = dice();
    let first = released("released-0.1", "data");
    let took = bring_up(first.path()).mul_f64(1.2);
    let expected = all_records(&store::open(first.path()).unwrap());
    assert!(expected.iter().map(Vec::len).sum::<usize>() > 20);
    let (mut before, mut after) = (0, 0);
    for _ in 0..KILLS {
        let room = released("released-0.1", "data");
        let dir = room.path();
        let mut child = serve(dir);
        thread::sleep(part_of(took, &dice));
        kill(&mut child);
        match layout(dir).contains("layout 1") {
            true => before += 1,
            false => after += 1,
        }
        let store = open_again(dir);
        assert_eq!(all_records(&store), expected);
        assert!(!layout(dir).contains("layout 1"));
    }
    println!(
        "{KILLS} kills: {before} before the layout was flipped, {after} after; 0 records lost"
    );
    assert!(before > 0, "every kill came too late to show anything");
}

/// A closed directory that is large enough for copying it to take a while.
fn large(dir: &Path) -> Vec<Vec<Record>> {
    let store = store::open(dir).unwrap();
    let long = "words ".repeat(600);
    for person in 0..12 {
        let who = stream(&store.keys, "local", &format!("person {person}"));
        let mut head = Head::EMPTY;
        for _ in 0..25 {
            head = store.log.append(&who, head, batch([&*long; 4])).wait().unwrap().head();
        }
    }
    all_records(&store)
}

#[test]
fn salvaging_survives_a_kill_at_any_moment_and_leaves_nothing_that_looks_whole_and_is_not() {
    let dice = dice();
    let room = tempfile::tempdir().unwrap();
    let (dir, out) = (room.path().join("data"), room.path().join("out"));
    let expected = large(&dir);
    let salvage = || spawn(&["salvage"], &dir, &[Path::new("--out"), &out]);
    let began = Instant::now();
    assert!(salvage().wait().unwrap().success());
    let took = began.elapsed();
    fs::remove_dir_all(&out).unwrap();
    let (mut unfinished, mut whole) = (0, 0);
    for _ in 0..KILLS {
        let mut child = salvage();
        thread::sleep(part_of(took, &dice));
        kill(&mut child);
        match out.exists() {
            true => {
                whole += 1;
                assert_eq!(all_records(&store::open(&out).unwrap()), expected);
                fs::remove_dir_all(&out).unwrap();
            }
            false => unfinished += 1,
        }
    }
    assert!(salvage().wait().unwrap().success(), "what a kill left behind is in nobody's way");
    assert_eq!(all_records(&store::open(&out).unwrap()), expected);
    println!("{KILLS} kills: {unfinished} left nothing that counts, {whole} came too late");
    assert!(unfinished > 0, "every kill came too late to show anything");
}
