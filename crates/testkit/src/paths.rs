//! Where things are.

use std::path::{Path, PathBuf};

/// The folder of the workspace.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("the testkit lies in crates/ of the workspace").to_owned()
}

/// The program `apprentice` of this build. Cargo builds it for the tests of its own package.
///
/// - panics: when it is not there.
pub fn program() -> PathBuf {
    let test = std::env::current_exe().expect("the operating system knows the running test");
    // target/debug/deps/TEST
    let program = test.ancestors().nth(2).expect("a test lies in deps/").join("apprentice");
    assert!(program.is_file(), "{} is missing; run `cargo build` first", program.display());
    program
}
