//! Looking at a suspicious directory before it is opened: on a copy, so that nothing is lost by the
//! looking, and in a child process with limits, because the database answers damage with a panic, an
//! endless loop or by using all memory. Whatever happens there becomes one sentence here.

use std::fs;
use std::io::{self, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use super::error::{Fail, OpenError};
use crate::store::disk::closed::Part;
use crate::store::disk::files::{copy_tree, make_dir};
use crate::store::sled::{Damage, LogError, check_cache, check_log};

/// The hidden command of the binary that looks at a copy.
pub const CHECK_COMMAND: &str = "check-copy";
/// Where copies are made: in the directory itself, which has room and is on the same disk.
const COPY: &str = "checking";
/// Allowed for any directory; more for larger ones.
const SECONDS: u64 = 60;
const BYTES_PER_SECOND: u64 = 1024 * 1024;
/// Address space for any directory, plus twice its size. The database's cache takes up to 200 MB.
const MEMORY_BYTES: u64 = 1024 * 1024 * 1024;
/// A line for each damaged stream, of which the first few are shown.
const ANSWER_BYTES_MAX: u64 = 16 * 1024 * 1024;
/// The last line of a child that lived to say everything.
const END: &str = "end";

static CHECKER: OnceLock<PathBuf> = OnceLock::new();

/// From now on suspicious directories are looked at by `program` with [`CHECK_COMMAND`], in a
/// process of its own. A program that never says so has them looked at in its own process, where
/// panics are caught but neither time nor memory is limited.
pub fn check_with(program: PathBuf) {
    // The first one counts: it is the program that runs.
    let _ = CHECKER.set(program);
}

/// Looks at the log of `dir` unless it was closed in order and is untouched since.
pub(super) fn log_before_opening(dir: &Path) -> Result<(), OpenError> {
    remove_copy(dir);
    if Part::Log.is_as_closed(dir) {
        return Ok(());
    }
    tracing::info!(dir = %dir.display(), "the log was not closed properly; a copy is checked first");
    let copy = Copy::make(dir, &["log", "HEADS"]).map_err(|error| {
        Fail(dir).io(&dir.join(COPY), format!("it cannot be copied to be checked: {error}"))
    })?;
    copy.check(Part::Log).map_err(|finding| finding.into_error(dir))
}

/// Throws a cache away that was not closed in order and does not survive a look at a copy.
pub(super) fn cache_before_opening(dir: &Path) {
    let cache = dir.join("cache");
    if !cache.exists() || Part::Cache.is_as_closed(dir) {
        return;
    }
    let sound = match Copy::make(dir, &["cache"]) {
        Ok(copy) => copy.check(Part::Cache).map_err(|finding| finding.to_string()),
        Err(error) => Err(error.to_string()),
    };
    if let Err(reason) = sound {
        tracing::warn!(%reason, "the cache of minds and snapshots is damaged and is emptied");
        if let Err(error) = fs::remove_dir_all(&cache) {
            tracing::warn!(%error, "the damaged cache cannot be removed");
        }
    }
}

/// What was found wrong.
#[derive(Debug, PartialEq, thiserror::Error)]
enum Finding {
    #[error("{0}")]
    Database(String),
    #[error("{0:?}")]
    Damaged(Vec<Damage>),
}

impl Finding {
    fn into_error(self, dir: &Path) -> OpenError {
        match self {
            Finding::Database(reason) => Fail(dir).database(reason),
            Finding::Damaged(damage) => Fail(dir).log(LogError::Damaged(damage)),
        }
    }
}

/// A copy that is removed when dropped.
struct Copy {
    dir: PathBuf,
    bytes: u64,
}

fn remove_copy(dir: &Path) {
    let copy = dir.join(COPY);
    if copy.exists()
        && let Err(error) = fs::remove_dir_all(&copy)
    {
        tracing::warn!(copy = %copy.display(), %error, "the checked copy could not be removed");
    }
}

impl Drop for Copy {
    fn drop(&mut self) {
        if let Some(dir) = self.dir.parent() {
            remove_copy(dir);
        }
    }
}

impl Copy {
    fn make(dir: &Path, names: &[&str]) -> io::Result<Copy> {
        remove_copy(dir);
        let mut copy = Copy { dir: dir.join(COPY), bytes: 0 };
        make_dir(&copy.dir)?;
        for name in names {
            let (from, to) = (dir.join(name), copy.dir.join(name));
            copy.bytes += match fs::metadata(&from) {
                Ok(found) if found.is_dir() => copy_tree(&from, &to)?,
                Ok(_) => fs::copy(&from, &to)?,
                // That is for the check to report.
                Err(error) if error.kind() == io::ErrorKind::NotFound => 0,
                Err(error) => return Err(error),
            };
        }
        Ok(copy)
    }

    fn check(&self, part: Part) -> Result<(), Finding> {
        match CHECKER.get() {
            None => look(&self.dir, part),
            Some(program) => self.ask(program, part, self.limit()),
        }
    }

    fn limit(&self) -> Duration {
        Duration::from_secs(SECONDS + self.bytes / BYTES_PER_SECOND)
    }

    /// Has a child look. Its end, whatever it is, ends this.
    fn ask(&self, program: &Path, part: Part, limit: Duration) -> Result<(), Finding> {
        let unable = |error: io::Error| {
            Finding::Database(format!("the process that checks it cannot be run: {error}"))
        };
        let memory = MEMORY_BYTES + 2 * self.bytes;
        let mut child = Command::new(program)
            .arg(CHECK_COMMAND)
            .args(["--part", part.name(), "--memory", &memory.to_string()])
            .args(["--parent", &std::process::id().to_string()])
            .arg(&self.dir)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            // What a dying process says to programmers is nothing for an operator.
            .stderr(Stdio::null())
            .spawn()
            .map_err(unable)?;
        let stdout = child.stdout.take().expect("it was piped");
        let (sender, receiver) = channel();
        let reader = std::thread::spawn(move || {
            let mut text = String::new();
            // A child that goes on talking is cut off by its closed pipe.
            let _ = stdout.take(ANSWER_BYTES_MAX).read_to_string(&mut text);
            let _ = sender.send(text);
        });
        let said = receiver.recv_timeout(limit);
        if said == Err(RecvTimeoutError::Timeout) {
            child.kill().map_err(unable)?;
        }
        let status = child.wait().map_err(unable)?;
        let _ = reader.join();
        match said {
            Ok(text) => verdict(&text, status),
            Err(_) => Err(Finding::Database(format!(
                "a check of a copy did not end within {} s",
                limit.as_secs_f32()
            ))),
        }
    }
}

impl Part {
    fn name(self) -> &'static str {
        match self {
            Part::Log => "log",
            Part::Cache => "cache",
        }
    }
}

/// What the child's answer says, or its death.
fn verdict(text: &str, status: ExitStatus) -> Result<(), Finding> {
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.pop() != Some(END) {
        let death = match (status.signal(), status.code()) {
            (Some(signal), _) => format!("a check of a copy was ended by signal {signal}"),
            (None, code) => format!("a check of a copy ended with code {}", code.unwrap_or(-1)),
        };
        return Err(Finding::Database(death));
    }
    let mut damage = Vec::new();
    for line in lines {
        match line.split_once(' ') {
            Some(("database", reason)) => return Err(Finding::Database(reason.to_owned())),
            Some(("damage", sentence)) => damage.push(Damage::Seen(sentence.to_owned())),
            _ => return Err(Finding::Database(format!("a check of a copy said {line:?}"))),
        }
    }
    match damage.is_empty() {
        true => Ok(()),
        false => Err(Finding::Damaged(damage)),
    }
}

/// The child's work: looks at a copy and says on `out` what it found.
///
/// - `part`: `log` or `cache`.
pub fn check_copy(copy: &Path, part: &str, out: &mut dyn Write) -> io::Result<()> {
    let part = if part == "cache" { Part::Cache } else { Part::Log };
    match look(copy, part) {
        Ok(()) => {}
        Err(Finding::Database(reason)) => writeln!(out, "database {}", one_line(&reason))?,
        Err(Finding::Damaged(damage)) => {
            for each in damage {
                writeln!(out, "damage {}", one_line(&each.to_string()))?;
            }
        }
    }
    writeln!(out, "{END}")?;
    out.flush()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn look(copy: &Path, part: Part) -> Result<(), Finding> {
    match part {
        Part::Cache => check_cache(&copy.join("cache")).map_err(Finding::Database),
        Part::Log => check_log(copy).map_err(|error| match error {
            LogError::Io(error) => Finding::Database(error.to_string()),
            LogError::Database(reason) => Finding::Database(reason),
            LogError::Damaged(damage) => Finding::Damaged(damage),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_that_never_ends_or_never_stops_talking_is_ended_and_becomes_a_sentence() {
        let dir = tempfile::tempdir().unwrap();
        let ask = |text: &str, limit| {
            let program = dir.path().join("program");
            write_program(&program, text);
            let copy = Copy { dir: dir.path().join(COPY), bytes: 0 };
            copy.ask(&program, Part::Log, limit).unwrap_err().to_string()
        };
        let sentence = ask("exec sleep 1000", Duration::from_millis(100));
        assert_eq!(sentence, "a check of a copy did not end within 0.1 s");
        let sentence = ask("exec yes damage", Duration::from_secs(60));
        assert!(sentence.starts_with("a check of a copy was ended by signal"), "{sentence}");
        let nobody = Copy { dir: dir.path().join(COPY), bytes: 0 };
        let missing = nobody.ask(&dir.path().join("nobody"), Part::Log, Duration::from_secs(1));
        assert!(missing.unwrap_err().to_string().contains("cannot be run"));
    }

    /// A shell script. Another thread's child may still hold it open for writing for a moment when
    /// it is started, so it is written by a child of its own.
    fn write_program(path: &Path, text: &str) {
        let script = format!("printf '#!/bin/sh\\n{text}\\n' > \"$1\" && chmod 700 \"$1\"");
        let status =
            Command::new("/bin/sh").args(["-c", &script, "sh"]).arg(path).status().unwrap();
        assert!(status.success());
    }

    #[test]
    fn the_death_of_a_check_is_one_sentence() {
        let killed = ExitStatus::from_raw(9);
        let sentence = verdict("damage half a li", killed).unwrap_err().to_string();
        assert_eq!(sentence, "a check of a copy was ended by signal 9");
        let gave_up = ExitStatus::from_raw(101 << 8);
        assert!(verdict("", gave_up).unwrap_err().to_string().ends_with("code 101"));
        let well = ExitStatus::from_raw(0);
        assert_eq!(verdict("end\n", well), Ok(()));
        let found = verdict("damage a\ndamage b\nend\n", well);
        let seen = ["a", "b"].map(|text| Damage::Seen(text.to_owned()));
        assert_eq!(found, Err(Finding::Damaged(seen.to_vec())));
        assert_eq!(verdict("database x\nend\n", well), Err(Finding::Database("x".to_owned())));
    }
}
