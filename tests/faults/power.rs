//! The power cut: a data directory on an ext4 file system, whose image is copied while the service
//! writes, without any sync. Data that is only in the kernel's memory is not in the copy, as it
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
/// Space for all images of one file system.
const DISK_BYTES: u64 = 96 * 1024 * 1024;

/// What a run has seen.
#[derive(Debug, Default)]
pub struct Counts {
    pub images: usize,
    /// Taken before the data directory was complete.
    pub early: usize,
    /// Acknowledgements that the images had to contain, and contained.
    pub promised: usize,
    /// Records found, with those beyond the promises.
    pub records: usize,
    pub large_records: usize,
    pub minds: usize,
    pub while_learning: usize,
    pub asked_again: usize,
}

/// True if this machine can run the test.
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

/// An ext4 file system in a file, mounted. It is unmounted when dropped. Its loop device detaches
/// itself with the last mount; no other device is touched.
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
            // Still in use. It is unmounted when its last user ends.
            let _ = Command::new("umount").arg("--lazy").arg(&self.at).status();
        }
        // Usually nothing is left. If something is, it is on our image, so it is ours.
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

/// Takes a number of images. Panics if one of them has broken a promise.
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
/// - returns: the first broken promise, if one of the images showed one.
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

/// True if `fsync` and `fdatasync` of the service work.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Syncs {
    Honest,
    Lie,
}

fn one_disk(images: usize, syncs: Syncs, dice: &mut Dice, counts: &mut Counts) {
    // In memory if possible: only the bytes that reached the image file count, not how long it
    // took.
    let memory = Path::new("/dev/shm");
    let folder = match memory.is_dir() {
        true => tempfile::tempdir_in(memory),
        false => tempfile::tempdir(),
    };
    let folder = folder.unwrap();
    let (image, copy) = (folder.path().join("disk"), folder.path().join("copy"));
    Disk::make(&image);
    // `writeback` lets a file grow before its bytes are on the disk. Other file systems do so too.
    let options = *dice.of(&["data=ordered", "data=ordered", "data=writeback"]);
    let mounted = Disk::mount(&image, &folder.path().join("mounted"), options);
    let socket = folder.path().join("socket");
    let ledgers: Vec<Ledger> =
        (0..PEOPLE).map(|number| Ledger::new(&format!("person {number}"))).collect();
    let seeds: Vec<u64> = ledgers.iter().map(|_| dice.number()).collect();
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

/// Copies the image as it is at one moment. A copy takes time. If the service wrote meanwhile, the
/// copy would mix two moments, and no power cut leaves that. So the service is stopped, and the
/// copy is repeated until two copies in a row are equal. Nothing is synced. The kernel only
/// finishes what it had begun to write.
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

/// Disconnects in every case. Otherwise the people's threads would wait without end.
struct HangUp<'a>(&'a Signals);

impl Drop for HangUp<'_> {
    fn drop(&mut self) {
        self.0.hang_up.store(true, Ordering::SeqCst);
    }
}

/// Compares what is left after the cut with the promises, and lets people continue on it.
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

    // Everybody finds what they were told, and every training ends.
    let socket = cut.image.with_extension("socket");
    let server = Server::start(&cut.data(), &socket);
    let signals = Signals::default();
    thread::scope(|scope| {
        let people = then.iter().map(|ledger| {
            let mut person = Person::new(ledger, &socket, dice.number(), &signals);
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
