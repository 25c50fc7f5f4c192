//! Faults of the real program: the process killed, the power cut, the disk full or failing, a panic
//! inside. `docs/reliability.md` has the promises and figures. `cargo xtask crash` and `cargo xtask
//! powerloss` run any number of rounds.

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

use apprentice_testkit::chance::{number, seed};

#[test]
fn whenever_it_is_killed_every_acknowledgement_is_found_again() {
    let kills = number("APPRENTICE_KILLS", 50) as usize;
    let counts = crash::run(kills, seed());
    println!("{kills} kills: {counts:?}; acknowledgements lost: 0");
    if kills >= 50 {
        // Each kind of trouble must have come; otherwise the run shows nothing.
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

/// Runs one of the ignored tests in its own mount namespace. However the process ends, the kernel
/// unmounts what it mounted, and this detaches the loop devices.
fn in_a_namespace(test: &str) {
    if let Err(reason) = power::able() {
        let ci = std::env::var("CI").is_ok_and(|value| value == "true");
        assert!(!ci, "CI=true and no power cut can be tried: {reason}");
        println!("skipped, no power cut can be tried here: {reason}");
        return;
    }
    let output = std::process::Command::new("unshare")
        .args(["--mount", "--propagation", "private", "--"])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", test, "--ignored", "--nocapture"])
        .stderr(std::process::Stdio::inherit())
        .output()
        .unwrap();
    print!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{test} failed; see above");
}

#[test]
fn after_a_power_cut_every_acknowledgement_is_found_again() {
    in_a_namespace("power_cuts_in_a_namespace");
}

#[test]
fn a_service_that_does_not_sync_is_caught_by_the_power_cut() {
    in_a_namespace("a_lie_in_a_namespace");
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
#[ignore = "run by a_service_that_does_not_sync_is_caught_by_the_power_cut"]
fn a_lie_in_a_namespace() {
    std::panic::set_hook(Box::new(|_| {}));
    let caught = power::cut_without_syncs(20, seed());
    drop(std::panic::take_hook());
    let caught = caught.expect("20 images, and nothing was lost without a sync");
    println!("without syncs: {caught}");
    assert!(caught.contains("acknowledge"), "{caught}");
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
