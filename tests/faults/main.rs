//! Faults of the real thing: the process killed, the power cut, the disk full or failing, a panic
//! inside. Promises and figures stand in `docs/reliability.md`; `cargo xtask crash` and
//! `cargo xtask powerloss` run as many rounds as wanted.

#[path = "../simulation/dice.rs"]
mod dice;
#[path = "../support/mod.rs"]
mod support;

mod bounds;
mod crash;
mod disk;
mod ledger;
mod line;
#[cfg(debug_assertions)]
mod panics;
mod people;
mod power;
mod served;

use apprentice::store::{Entropy, OsEntropy};

/// A number that the environment chooses, or what stands for it.
fn number(variable: &str, otherwise: u64) -> u64 {
    let text = std::env::var(variable).ok();
    text.map_or(otherwise, |text| {
        text.parse().unwrap_or_else(|_| panic!("{variable} is {text:?}, which is no number"))
    })
}

/// A seed that is printed, so that a failure can be tried again; threads and the disk have their
/// own say in what happens under it.
fn seed() -> u64 {
    let mut bytes = [0; 8];
    OsEntropy.fill(&mut bytes);
    let seed = number("APPRENTICE_SEED", u64::from_be_bytes(bytes));
    println!("seed: APPRENTICE_SEED={seed}");
    seed
}

#[test]
fn whenever_it_is_killed_every_acknowledgement_is_found_again() {
    let kills = number("APPRENTICE_KILLS", 50) as usize;
    let counts = crash::run(kills, seed());
    println!("{kills} kills: {counts:?}; acknowledgements lost: 0");
    if kills >= 50 {
        // Each kind of trouble was there; otherwise the run has shown nothing.
        for (kind, count) in [
            ("kill while starting", counts.while_starting),
            ("kill while learning", counts.while_learning),
            ("acknowledgement", counts.acknowledged),
            ("repeated reply", counts.asked_again),
            ("late reply", counts.answered_late),
            ("large record", counts.large_records),
            ("training", counts.trainings),
        ] {
            assert!(count > 0, "there was no {kind}");
        }
    }
}

#[test]
fn after_a_power_cut_every_acknowledgement_is_found_again() {
    if let Err(reason) = power::able() {
        let ci = std::env::var("CI").is_ok_and(|value| value == "true");
        assert!(!ci, "CI=true and no power cut can be tried: {reason}");
        println!("skipped, no power cut can be tried here: {reason}");
        return;
    }
    // In a mount namespace of its own: whatever ends the process, the kernel unmounts what it
    // mounted, and with the mounts go the loop devices.
    let output = std::process::Command::new("unshare")
        .args(["--mount", "--propagation", "private", "--"])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "power_cuts_in_a_namespace", "--ignored", "--nocapture"])
        .stderr(std::process::Stdio::inherit())
        .output()
        .unwrap();
    print!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "a promise was broken; see above");
}

#[test]
#[ignore = "run by after_a_power_cut_every_acknowledgement_is_found_again"]
fn power_cuts_in_a_namespace() {
    let images = number("APPRENTICE_IMAGES", 20) as usize;
    let counts = power::cut(images, seed());
    println!("{images} images: {counts:?}; acknowledgements lost: 0");
    if images >= 20 {
        for (kind, count) in [
            ("acknowledgement", counts.promised),
            ("repeated reply", counts.asked_again),
            ("large record", counts.large_records),
            ("mind", counts.minds),
        ] {
            assert!(count > 0, "no image had a {kind}");
        }
    }
}

#[test]
fn a_full_or_failing_disk_is_said_and_costs_no_acknowledgement() {
    let (writes, syncs) = disk::calls();
    println!("one small life has {writes} writes and {syncs} syncs");
    for (kind, calls) in
        [(disk::Kind::Full, writes), (disk::Kind::Write, writes), (disk::Kind::Sync, syncs)]
    {
        let counts = disk::fail_each(kind, calls);
        println!("{kind:?}: {counts:?}; acknowledgements lost: 0");
        assert!(counts.at_start > 0 && counts.under_way > 0, "{kind:?}: {counts:?}");
    }
}
