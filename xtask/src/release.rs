//! Checks before a release that take too long for every run of the tests.

use std::fs;
use std::path::Path;

use crate::drills;
use crate::machine::{self, run, run_with};

/// - `short`: leaves out the long runs.
/// - errors: the first check that failed.
pub(crate) fn check(short: bool) -> Result<(), String> {
    machine::setup()?;
    same_minds()?;
    same_bytes()?;
    if short {
        return Ok(());
    }
    drills::simulate(1_000_000, 1)?;
    drills::crash(1_000, None)?;
    drills::powerloss(500, None)?;
    drills::damage(20_000, None)
}

/// The release build trains the minds that are pinned, on this processor and on emulated ones.
fn same_minds() -> Result<(), String> {
    eprintln!("== the release build trains the same minds");
    let binary = machine::release_binary()?.display().to_string();
    let environment = [("APPRENTICE_OPTIMISED_BINARY", binary.as_str()), ("CI", "true")];
    let test = ["test", "--test", "determinism", "train_the_same_minds"];
    run_with(&environment, "cargo", &test)
}

/// Two release builds of the last commit, in different folders, are the same bytes.
fn same_bytes() -> Result<(), String> {
    eprintln!("== two release builds in different folders are the same bytes");
    let scratch = machine::root().join("target/two-builds");
    // Left by an interrupted run.
    let _ = fs::remove_dir_all(&scratch);
    let built = ["one", "another-folder"].map(|name| build_in(&scratch.join(name)));
    let [one, other] = built;
    let (one, other) = (one?, other?);
    fs::remove_dir_all(&scratch).map_err(|e| format!("{}: {e}", scratch.display()))?;
    match one == other {
        true => Ok(()),
        false => Err(format!(
            "two release builds of the same commit differ ({} and {} bytes): look for a path or a \
             date in the binary",
            one.len(),
            other.len(),
        )),
    }
}

/// Builds the last commit in `folder`, which must not exist yet.
///
/// - returns: the binary's bytes.
fn build_in(folder: &Path) -> Result<Vec<u8>, String> {
    let path = folder.display().to_string();
    let root = machine::root().display().to_string();
    run("git", &["clone", "--quiet", "--local", &root, &path])?;
    let home =
        std::env::var("CARGO_HOME").or_else(|_| std::env::var("HOME").map(|h| h + "/.cargo"));
    let home = home.map_err(|_| "neither CARGO_HOME nor HOME is set".to_owned())?;
    // Also for the C++ of libzmq.
    let flags = format!("--remap-path-prefix={path}=/apprentice --remap-path-prefix={home}=/cargo");
    let prefixes = format!("-ffile-prefix-map={path}=/apprentice -ffile-prefix-map={home}=/cargo");
    let target = folder.join("target").display().to_string();
    let manifest = folder.join("Cargo.toml").display().to_string();
    let environment = [
        ("RUSTFLAGS", flags.as_str()),
        ("CFLAGS", prefixes.as_str()),
        ("CXXFLAGS", prefixes.as_str()),
        ("CARGO_TARGET_DIR", target.as_str()),
    ];
    let build = ["build", "--release", "--quiet", "--bin", "apprentice", "--manifest-path"];
    run_with(&environment, "cargo", &[&build[..], &[&manifest]].concat())?;
    let binary = folder.join("target/release/apprentice");
    fs::read(&binary).map_err(|e| format!("{}: {e}", binary.display()))
}
