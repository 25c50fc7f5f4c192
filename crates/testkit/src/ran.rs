//! The program as a user starts it.

use std::io::Write;
use std::process::{Command, Stdio};

/// How a run of the program ended, and what it printed.
pub struct Ran {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

/// Runs the program to its end.
///
/// - `input`: the typed text.
#[track_caller]
pub fn run(arguments: &[&str], input: &str) -> Ran {
    let mut command = Command::new(crate::paths::program());
    command.args(arguments).env_remove("APPRENTICE_LOG");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Ran { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}
