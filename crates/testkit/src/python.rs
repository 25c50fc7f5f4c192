//! The Python that runs the examples and the second verifier of proofs.

use std::path::PathBuf;
use std::process::Command;

/// An interpreter with the packages. If there is none, the result is none, with a message; with
/// `CI=true` it panics.
///
/// - `packages`: as Python imports them, `zmq, msgpack`.
pub fn python(packages: &str) -> Option<PathBuf> {
    let root = crate::paths::root();
    let named = std::env::var_os("APPRENTICE_PYTHON").map(PathBuf::from);
    let candidates = match named {
        Some(named) => vec![named],
        None => vec![root.join("target/python/bin/python"), PathBuf::from("python3")],
    };
    let found = candidates.into_iter().find(|python| {
        let imports = Command::new(python).args(["-c", &format!("import {packages}")]).output();
        imports.is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        assert!(std::env::var_os("CI").is_none(), "CI has no Python with {packages}");
        eprintln!("skipped: no Python with {packages} (cargo xtask test makes one)");
    }
    found
}
