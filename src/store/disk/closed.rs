//! Marks of an orderly end: what the files of a database were when it was closed.
//!
//! `CLOSED-log` stands beside the log, `CLOSED-cache` beside the cache, from the closing to the next
//! opening. One that fits says that the files hold exactly what our own process wrote, so that they
//! may be opened at once; without one, or with one that does not fit, a copy is looked at first
//! (`check`). The text is a line for each file, and at the end a digest of the text itself:
//!
//! ```text
//! apprentice closed 1
//! 524288 <BLAKE3> log/db
//! end <BLAKE3>
//! ```

use std::fmt::Write;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::files::{sync_dir, write_whole};
use crate::ids::Digest;

const TITLE: &str = "apprentice closed 1\n";

/// What a mark speaks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::store) enum Part {
    /// The log's database and the heads file.
    Log,
    Cache,
}

/// Leaves a mark when it is dropped, which must come after the database itself was.
pub(in crate::store) struct ClosedMark {
    dir: PathBuf,
    part: Part,
    wanted: bool,
}

impl Part {
    fn mark(self, dir: &Path) -> PathBuf {
        dir.join(match self {
            Part::Log => "CLOSED-log",
            Part::Cache => "CLOSED-cache",
        })
    }

    /// The files below `dir` that belong to it, in the order of their names.
    fn files(self, dir: &Path) -> io::Result<Vec<PathBuf>> {
        let mut waiting = match self {
            Part::Log => vec![dir.join("log"), dir.join("HEADS")],
            Part::Cache => vec![dir.join("cache")],
        };
        let mut files = Vec::new();
        while let Some(path) = waiting.pop() {
            match path.is_dir() {
                true => {
                    for entry in fs::read_dir(&path)? {
                        waiting.push(entry?.path());
                    }
                }
                false => files.push(path),
            }
        }
        files.sort();
        Ok(files)
    }

    fn text(self, dir: &Path) -> io::Result<String> {
        let mut text = TITLE.to_owned();
        for path in self.files(dir)? {
            let mut hasher = blake3::Hasher::new();
            let bytes = io::copy(&mut File::open(&path)?, &mut hasher)?;
            let name = path.strip_prefix(dir).unwrap_or(&path).display();
            let _ = writeln!(text, "{bytes} {} {name}", hasher.finalize().to_hex());
        }
        let end = Digest::of(text.as_bytes());
        let _ = writeln!(text, "end {}", end.to_hex());
        Ok(text)
    }

    /// Whether the part was closed in order and nobody has touched its files since. Reads them
    /// once, from the start to the end.
    pub(in crate::store) fn is_as_closed(self, dir: &Path) -> bool {
        let Ok(said) = fs::read_to_string(self.mark(dir)) else { return false };
        self.text(dir).is_ok_and(|found| found == said)
    }

    /// Takes the mark away: from now on the files change.
    pub(in crate::store) fn lift_mark(self, dir: &Path) -> io::Result<()> {
        match fs::remove_file(self.mark(dir)) {
            Ok(()) => sync_dir(dir),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(error) => Err(error),
        }
    }
}

impl ClosedMark {
    pub(in crate::store) fn new(dir: &Path, part: Part) -> ClosedMark {
        ClosedMark { dir: dir.to_owned(), part, wanted: true }
    }

    /// Leaves no mark: the end was not in order.
    pub(in crate::store) fn forget(mut self) {
        self.wanted = false;
    }
}

impl Drop for ClosedMark {
    fn drop(&mut self) {
        if !self.wanted {
            return;
        }
        let (dir, part) = (&self.dir, self.part);
        let marked = part
            .text(dir)
            .and_then(|text| write_whole(&part.mark(dir), text.as_bytes()))
            .and_then(|()| sync_dir(dir));
        if let Err(error) = marked {
            // Costs the next start a check and nothing else.
            tracing::debug!(dir = %dir.display(), %error, "the mark of a proper end was not written");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_fits_until_one_bit_one_length_or_one_name_changes() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("log")).unwrap();
        let good = [("log/db", "database"), ("log/conf", "parameters"), ("HEADS", "heads")];
        let write_good = || good.iter().for_each(|(name, text)| fs::write(at(name), text).unwrap());
        write_good();
        assert!(!Part::Log.is_as_closed(dir.path()), "there is no mark yet");
        drop(ClosedMark::new(dir.path(), Part::Log));
        assert!(Part::Log.is_as_closed(dir.path()));
        assert!(!Part::Cache.is_as_closed(dir.path()), "that is another part's mark");
        for (name, text) in good {
            for damaged in [text.replace('a', "q"), text[1..].to_owned(), format!("{text}\0")] {
                fs::write(at(name), damaged).unwrap();
                assert!(!Part::Log.is_as_closed(dir.path()), "{name}");
                write_good();
            }
        }
        fs::write(at("log/snap.1"), "").unwrap();
        assert!(!Part::Log.is_as_closed(dir.path()));
        fs::remove_file(at("log/snap.1")).unwrap();
        assert!(Part::Log.is_as_closed(dir.path()));
        let mark = fs::read(at("CLOSED-log")).unwrap();
        for bit in 0..mark.len() * 8 {
            let mut damaged = mark.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            fs::write(at("CLOSED-log"), damaged).unwrap();
            assert!(!Part::Log.is_as_closed(dir.path()), "bit {bit}");
        }
        Part::Log.lift_mark(dir.path()).unwrap();
        Part::Log.lift_mark(dir.path()).unwrap();
        assert!(!Part::Log.is_as_closed(dir.path()));
    }
}
