//! The power cut: a data directory on an ext4 file system whose image is copied in the middle of
//! writing, without any sync. What only stands in the kernel's memory is not in the copy, as it
//! would not be on the disk.

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use apprentice::ids::RequestId;
use apprentice::store::{self, OpenError};

use crate::crash::wait_while;
use crate::disk;
use crate::ledger::Ledger;
use crate::people::{Person, Signals};
use crate::served::{PATIENCE, Server};
use apprentice_testkit::dice::Dice;

const PEOPLE: usize = 4;
/// Images of one file system; then a new one begins.
const IMAGES_OF_ONE: usize = 5;
/// Room enough for the life of one file system.
const DISK_BYTES: u64 = 96 * 1024 * 1024;

/// What a run has seen.
#[derive(Debug, Default)]
pub struct Counts {
    pub images: usize,
    /// Taken before the data directory was complete.
    pub early: usize,
    /// Acknowledgements that the images had to hold, and held.
    pub promised: usize,
    /// Records found, those beyond the promises included.
    pub records: usize,
    pub large_records: usize,
    pub minds: usize,
    pub while_learning: usize,
    pub asked_again: usize,
}

/// Whether this machine can do it.
///
/// - errors: what is missing.
pub fn able() -> Result<(), String> {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let uid = status.lines().find_map(|line| line.strip_prefix("Uid:"));
    if uid.and_then(|ids| ids.split_whitespace().nth(1)) != Some("0") {
        return Err("only root may mount an image".to_owned());
    }
    for (program, arguments) in
        [("mkfs.ext4", &["-V"][..]), ("losetup", &["--find"]), ("unshare", &["--mount", "true"])]
    {
        let answer = Command::new(program).args(arguments).output();
        let answer = answer.map_err(|error| format!("{program} does not run: {error}"))?;
        if !answer.status.success() {
            let said = String::from_utf8_lossy(&answer.stderr);
            return Err(format!("{program} {}: {}", arguments.join(" "), said.trim()));
        }
    }
    Ok(())
}

/// An ext4 file system in a file, mounted. Unmounted when dropped; its loop device detaches itself
/// with the last mount, and no other is touched.
struct Disk {
    image: PathBuf,
    at: PathBuf,
}

impl Disk {
    fn make(image: &Path) {
        let file = std::fs::File::create(image).unwrap();
        file.set_len(DISK_BYTES).unwrap();
        run("mkfs.ext4", &["-q".as_ref(), "-F".as_ref(), image]);
    }

    fn mount(image: &Path, at: &Path, options: &str) -> Disk {
        std::fs::create_dir_all(at).unwrap();
        let options = format!("loop,{options}");
        run("mount", &["-t".as_ref(), "ext4".as_ref(), "-o".as_ref(), options.as_ref(), image, at]);
        Disk { image: image.to_owned(), at: at.to_owned() }
    }

    fn data(&self) -> PathBuf {
        self.at.join("data")
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let unmounted = Command::new("umount").arg(&self.at).status();
        if !unmounted.is_ok_and(|status| status.success()) {
            // Still in use: it goes when its last user does.
            let _ = Command::new("umount").arg("--lazy").arg(&self.at).status();
        }
        // Nothing is left in all usual cases; if so, it is ours, for it stands on our image.
        let left = Command::new("losetup")
            .args(["--noheadings", "--output", "NAME", "--associated"])
            .arg(&self.image)
            .output();
        let left = left.map(|output| output.stdout).unwrap_or_default();
        for device in String::from_utf8_lossy(&left).split_whitespace() {
            let _ = Command::new("losetup").args(["--detach", device]).status();
        }
    }
}

#[track_caller]
fn run(program: &str, arguments: &[&Path]) {
    let output = Command::new(program).args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {}", said.trim());
}

/// Takes so many images and panics when one of them has broken a promise.
pub fn cut(images: usize, seed: u64) -> Counts {
    let (mut dice, mut counts) = (Dice::new(seed), Counts::default());
    while counts.images < images {
        let wanted = IMAGES_OF_ONE.min(images - counts.images);
        one_disk(wanted, Syncs::Honest, &mut dice, &mut counts);
        if counts.images % 50 == 0 {
            eprintln!("{} images: {counts:?}", counts.images);
        }
    }
    counts
}

/// Cuts the power of a service whose syncs do nothing.
///
/// - returns: the first broken promise that was seen, if one was among so many images.
pub fn cut_without_syncs(images: usize, seed: u64) -> Option<String> {
    let (mut dice, mut counts) = (Dice::new(seed), Counts::default());
    while counts.images < images {
        let one = || one_disk(IMAGES_OF_ONE, Syncs::Lie, &mut dice, &mut counts);
        if let Err(panic) = catch_unwind(AssertUnwindSafe(one)) {
            let text = panic.downcast_ref::<String>().cloned();
            return Some(text.unwrap_or_else(|| "a panic without words".to_owned()));
        }
    }
    None
}

/// Whether `fsync` and `fdatasync` of the service do what they say.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Syncs {
    Honest,
    Lie,
}

fn one_disk(images: usize, syncs: Syncs, dice: &mut Dice, counts: &mut Counts) {
    // In memory where there is such a place: what counts is what reached the image file, and not
    // what that costs.
    let memory = Path::new("/dev/shm");
    let folder = match memory.is_dir() {
        true => tempfile::tempdir_in(memory),
        false => tempfile::tempdir(),
    };
    let folder = folder.unwrap();
    let (image, copy) = (folder.path().join("disk"), folder.path().join("copy"));
    Disk::make(&image);
    // `writeback` lets a file grow before its bytes are there, which other file systems do too.
    let options = *dice.of(&["data=ordered", "data=ordered", "data=writeback"]);
    let mounted = Disk::mount(&image, &folder.path().join("mounted"), options);
    let socket = folder.path().join("socket");
    let ledgers: Vec<Ledger> =
        (0..PEOPLE).map(|number| Ledger::new(&format!("person {number}"))).collect();
    let seeds: Vec<u64> = ledgers.iter().map(|_| dice.next()).collect();
    let signals = Signals::default();
    let environment = match syncs {
        Syncs::Honest => Vec::new(),
        Syncs::Lie => disk::environment(&mounted.at, "lie", 0),
    };
    let mut server = Server::spawn(&mounted.data(), &socket, &environment);
    thread::scope(|scope| {
        let _hang_up = HangUp(&signals);
        for (ledger, seed) in ledgers.iter().zip(&seeds) {
            let mut person = Person::new(ledger, &socket, *seed, &signals);
            scope.spawn(move || person.live());
        }
        for number in 0..images {
            if number > 0 {
                server.ready_once();
            }
            thread::sleep(Duration::from_micros(dice.below(300_000) as u64));
            // What is acknowledged now must be in the copy that begins now.
            let promised: Vec<_> = ledgers.iter().map(Ledger::acknowledged).collect();
            server.signal("STOP");
            copy_at_one_moment(&image, &copy);
            server.signal("CONT");
            counts.images += 1;
            let cut = Disk::mount(&copy, &folder.path().join("after"), "rw");
            look(&cut, &ledgers, &promised, dice, counts);
        }
        server.kill();
    });
}

/// Copies the image as it stands at one moment. A copy takes time, and what is written meanwhile
/// would give a file system that no power cut leaves: half of one moment and half of a later one. So
/// it is taken until two in a row are the same, while the service is stopped between any two of
/// its instructions. Nothing is synced; the kernel only ends what it had begun to write.
fn copy_at_one_moment(image: &Path, copy: &Path) {
    let again = copy.with_extension("again");
    for _ in 0..100 {
        run("cp", &["--reflink=never".as_ref(), image, copy]);
        run("cp", &["--reflink=never".as_ref(), image, &again]);
        let same = Command::new("cmp").arg("--silent").args([copy, &again]).status().unwrap();
        if same.success() {
            return;
        }
    }
    panic!("{} changes all the time although its writer is stopped", image.display());
}

/// Hangs up whatever happens, or the people's threads would wait for ever.
struct HangUp<'a>(&'a Signals);

impl Drop for HangUp<'_> {
    fn drop(&mut self) {
        self.0.hang_up.store(true, Ordering::SeqCst);
    }
}

/// Holds what is left after the cut against the promises, and lets people go on with it.
fn look(
    cut: &Disk,
    ledgers: &[Ledger],
    promised: &[BTreeSet<RequestId>],
    dice: &mut Dice,
    counts: &mut Counts,
) {
    let wanted: usize = promised.iter().map(BTreeSet::len).sum();
    if wanted == 0 && !cut.data().exists() {
        counts.early += 1;
        return;
    }
    let store = store::open(&cut.data())
        .unwrap_or_else(|error: OpenError| panic!("{wanted} acknowledgements and then: {error}"));
    let mut then = Vec::new();
    for (ledger, promised) in ledgers.iter().zip(promised) {
        let found = ledger.check(&store, promised).unwrap_or_else(|sentence| panic!("{sentence}"));
        counts.records += found.records;
        counts.large_records += found.large;
        counts.minds += found.minds;
        counts.while_learning += usize::from(found.learning);
        then.push(ledger.as_of(&ledger.records(&store).unwrap()));
    }
    counts.promised += wanted;
    drop(store);

    // Everybody finds again what they were told, and every training comes to its end.
    let socket = cut.image.with_extension("socket");
    let server = Server::start(&cut.data(), &socket);
    let signals = Signals::default();
    thread::scope(|scope| {
        let people = then.iter().map(|ledger| {
            let mut person = Person::new(ledger, &socket, dice.next(), &signals);
            scope.spawn(move || {
                let insisted = person.insist().expect("nobody hangs up");
                person.step().expect("life goes on");
                insisted
            })
        });
        let people: Vec<_> = people.collect();
        wait_while(|| people.iter().any(|person| !person.is_finished()), PATIENCE);
        signals.hang_up.store(true, Ordering::SeqCst);
        for person in people {
            counts.asked_again += person.join().unwrap().again;
        }
    });
    server.kill();
}
