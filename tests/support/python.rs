//! The Python that the second reader of proofs runs in.

use std::path::{Path, PathBuf};
use std::process::Command;

/// An interpreter that has the package for Ed25519; none, with a message, where there is no such one
/// and no CI asks for it.
pub fn python() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let named = std::env::var_os("APPRENTICE_PYTHON").map(PathBuf::from);
    let candidates = match named {
        Some(named) => vec![named],
        None => vec![root.join("target/python/bin/python"), PathBuf::from("python3")],
    };
    let found = candidates.into_iter().find(|python| {
        let imports = Command::new(python).args(["-c", "import cryptography"]).output();
        imports.is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        assert!(std::env::var_os("CI").is_none(), "CI has no Python with cryptography");
        eprintln!("skipped: no Python with cryptography (cargo xtask test makes one)");
    }
    found
}
