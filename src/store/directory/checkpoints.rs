//! The checkpoints that were given out, outside the database: one file for each tenant, appended to
//! and synced. A copy kept elsewhere shows later whether the log was rolled back or
//! rewritten; the service itself compares with the newest here.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::ids::TenantId;
use crate::store::disk::files::{make_dir, sync_dir, write_whole};

/// The folder of checkpoints in a data directory.
pub(in crate::store) const CHECKPOINTS: &str = "checkpoints";
/// A capital letter is in no tenant's name.
const ORIGIN_FILE: &str = "ORIGIN";
/// How a line with a signature begins.
const MARK: &[u8] = "\u{2014} ".as_bytes();

/// Why checkpoints cannot be read or kept.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FeedError {
    #[error("the checkpoints in {path} cannot be used: {reason}")]
    Io { path: String, reason: String },
    #[error(
        "the checkpoints in {path} are damaged; restore the file from a backup, or move it away \
         and tell everyone who keeps checkpoints of this log"
    )]
    Damaged { path: String },
    #[error(
        "this service is already called {found} in its checkpoints; it cannot be renamed to {wanted}"
    )]
    Origin { found: String, wanted: String },
    #[error("the checkpoints are open for reading only")]
    ReadOnly,
}

/// Checkpoints by tenant, oldest first.
///
/// A file `checkpoints/<tenant>` holds the signed notes as they were given out, each with an empty
/// line behind it. A last one that a crash cut short was never given out, and is overwritten.
pub struct CheckpointFeed(Home);

enum Home {
    Memory(Mutex<BTreeMap<TenantId, Vec<String>>>),
    Directory { dir: PathBuf, writable: bool },
}

impl Default for CheckpointFeed {
    fn default() -> CheckpointFeed {
        CheckpointFeed(Home::Memory(Mutex::default()))
    }
}

impl CheckpointFeed {
    /// The feed of a data directory that is open for writing, and the folder that it stands in.
    pub(in crate::store) fn make(data: &Path) -> io::Result<CheckpointFeed> {
        let feed = CheckpointFeed::of(data, true);
        make_dir(&data.join(CHECKPOINTS)).map(|()| feed)
    }

    /// The feed of a data directory.
    pub(in crate::store) fn of(data: &Path, writable: bool) -> CheckpointFeed {
        CheckpointFeed(Home::Directory { dir: data.join(CHECKPOINTS), writable })
    }

    /// The name of the service, when it was given one.
    pub fn origin(&self) -> Result<Option<String>, FeedError> {
        let Home::Directory { dir, .. } = &self.0 else { return Ok(None) };
        let path = dir.join(ORIGIN_FILE);
        match fs::read(&path) {
            Ok(bytes) => match String::from_utf8(bytes) {
                Ok(text) => Ok(Some(text.trim_end().to_owned())),
                Err(_) => Err(FeedError::Damaged { path: path.display().to_string() }),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(cannot(&path, &error)),
        }
    }

    /// Gives the service its name, once and for all: checkpoints under two names cannot be held
    /// against each other.
    ///
    /// - `signed`: the name that checkpoints were given out under, if there are some.
    pub fn name(&self, origin: &str, signed: Option<&str>) -> Result<(), FeedError> {
        let found = self.origin()?;
        if let Some(found) = found.as_deref().or(signed)
            && found != origin
        {
            let (found, wanted) = (found.to_owned(), origin.to_owned());
            return Err(FeedError::Origin { found, wanted });
        }
        let Home::Directory { dir, writable } = &self.0 else { return Ok(()) };
        if found.is_some() {
            return Ok(());
        }
        if !writable {
            return Err(FeedError::ReadOnly);
        }
        let path = dir.join(ORIGIN_FILE);
        make_dir(dir)
            .and_then(|()| write_whole(&path, format!("{origin}\n").as_bytes()))
            .and_then(|()| sync_dir(dir))
            .map_err(|error| cannot(&path, &error))
    }

    /// Every checkpoint of a tenant, oldest first.
    pub fn all(&self, tenant: &TenantId) -> Result<Vec<String>, FeedError> {
        let dir = match &self.0 {
            Home::Memory(notes) => {
                let notes = notes.lock().unwrap_or_else(PoisonError::into_inner);
                return Ok(notes.get(tenant).cloned().unwrap_or_default());
            }
            Home::Directory { dir, .. } => dir,
        };
        let path = dir.join(tenant.as_str());
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(cannot(&path, &error)),
        };
        let damaged = || FeedError::Damaged { path: path.display().to_string() };
        let (notes, _) = split(&bytes);
        notes.into_iter().map(|note| String::from_utf8(note).map_err(|_| damaged())).collect()
    }

    /// The newest checkpoint of a tenant. Reads the end of the file only: a service that signs every
    /// minute writes a hundred megabytes a year.
    pub fn newest(&self, tenant: &TenantId) -> Result<Option<String>, FeedError> {
        let Home::Directory { dir, .. } = &self.0 else { return Ok(self.all(tenant)?.pop()) };
        let path = dir.join(tenant.as_str());
        let end = match File::open(&path).and_then(|mut file| end_of(&mut file)) {
            Ok(end) => end,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(cannot(&path, &error)),
        };
        let note = end.newest.map(String::from_utf8).transpose();
        note.map_err(|_| FeedError::Damaged { path: path.display().to_string() })
    }

    /// Keeps a checkpoint; durable on return, and only then to be given out.
    pub fn append(&self, tenant: &TenantId, note: &str) -> Result<(), FeedError> {
        let dir = match &self.0 {
            Home::Memory(notes) => {
                let mut notes = notes.lock().unwrap_or_else(PoisonError::into_inner);
                notes.entry(tenant.clone()).or_default().push(note.to_owned());
                return Ok(());
            }
            Home::Directory { writable: false, .. } => return Err(FeedError::ReadOnly),
            Home::Directory { dir, .. } => dir,
        };
        let path = dir.join(tenant.as_str());
        let appended = (|| {
            make_dir(dir)?;
            let fresh = !path.exists();
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false).mode(0o600);
            let mut file = options.open(&path)?;
            let whole = end_of(&mut file)?.whole;
            file.set_len(whole)?;
            file.seek(SeekFrom::Start(whole))?;
            file.write_all(format!("{note}\n").as_bytes())?;
            file.sync_all()?;
            if fresh { sync_dir(dir) } else { Ok(()) }
        })();
        appended.map_err(|error| cannot(&path, &error))
    }
}

/// Bytes that are read of the end of a file; a note has some hundreds.
const END_BYTES: u64 = 64 * 1024;

/// The end of a file of checkpoints.
struct End {
    /// The last whole note.
    newest: Option<Vec<u8>>,
    /// Bytes of the file up to its end.
    whole: u64,
}

fn end_of(file: &mut File) -> io::Result<End> {
    let length = file.metadata()?.len();
    let from = length.saturating_sub(END_BYTES);
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(from))?;
    file.read_to_end(&mut bytes)?;
    let (mut notes, mut whole) = split(&bytes);
    let mut start = from;
    // The first of them may have begun before; one alone is no good then.
    if from > 0 && notes.len() < 2 {
        bytes.clear();
        file.seek(SeekFrom::Start(0))?;
        file.read_to_end(&mut bytes)?;
        (notes, whole) = split(&bytes);
        start = 0;
    }
    Ok(End { newest: notes.pop(), whole: start + whole })
}

/// The whole notes of a file, and how many of its bytes they take.
fn split(bytes: &[u8]) -> (Vec<Vec<u8>>, u64) {
    let (mut notes, mut start, mut at, mut signed) = (Vec::new(), 0, 0, false);
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        at += line.len();
        if line == b"\n" && signed {
            notes.push(bytes[start..at - 1].to_vec());
            (start, signed) = (at, false);
        } else if line.starts_with(MARK) && line.ends_with(b"\n") {
            signed = true;
        }
    }
    (notes, start as u64)
}

fn cannot(path: &Path, error: &io::Error) -> FeedError {
    FeedError::Io { path: path.display().to_string(), reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(size: u32) -> String {
        format!("lab/local\n{size}\nAAAA\n\n\u{2014} lab/local BBBB\n\u{2014} witness CCCC\n")
    }

    #[test]
    fn checkpoints_are_found_again_and_a_torn_one_is_overwritten() {
        let data = tempfile::tempdir().unwrap();
        let feed = || CheckpointFeed::of(data.path(), true);
        let local = TenantId::local();
        assert_eq!(feed().newest(&local), Ok(None));
        feed().append(&local, &note(1)).unwrap();
        feed().append(&local, &note(2)).unwrap();
        assert_eq!(feed().all(&local), Ok(vec![note(1), note(2)]));
        let path = data.path().join("checkpoints/local");
        let whole = fs::read(&path).unwrap();
        feed().append(&local, &note(3)).unwrap();
        let longer = fs::read(&path).unwrap();
        for length in whole.len()..longer.len() {
            fs::write(&path, &longer[..length]).unwrap();
            assert_eq!(feed().newest(&local), Ok(Some(note(2))), "{length} bytes");
            feed().append(&local, &note(4)).unwrap();
            assert_eq!(feed().all(&local), Ok(vec![note(1), note(2), note(4)]), "{length} bytes");
        }
        assert_eq!(feed().newest(&TenantId::new("other").unwrap()), Ok(None));
    }

    #[test]
    fn the_newest_of_a_long_file_is_found_at_its_end() {
        let data = tempfile::tempdir().unwrap();
        let feed = CheckpointFeed::of(data.path(), true);
        let local = TenantId::local();
        feed.append(&local, &note(0)).unwrap();
        let path = data.path().join("checkpoints/local");
        let many: String = (1..3_000).map(|size| note(size) + "\n").collect();
        assert!(many.len() as u64 > 2 * END_BYTES);
        // Wherever the part that is read begins, inside of a note or between two.
        for cut in (0..200).step_by(7) {
            let last = &many.as_bytes()[..many.len() - cut];
            fs::write(&path, last).unwrap();
            let newest = feed.newest(&local).unwrap();
            assert_eq!(newest.as_ref(), feed.all(&local).unwrap().last(), "{cut} bytes cut");
            feed.append(&local, &note(9_999)).unwrap();
            let all = feed.all(&local).unwrap();
            assert_eq!(all.last(), Some(&note(9_999)));
            assert_eq!(all.get(all.len() - 2), newest.as_ref(), "{cut} bytes cut");
        }
    }

    #[test]
    fn a_service_has_one_name_and_a_reader_writes_nothing() {
        let data = tempfile::tempdir().unwrap();
        let feed = CheckpointFeed::of(data.path(), true);
        assert_eq!(feed.origin(), Ok(None));
        feed.name("lab.example.org", None).unwrap();
        feed.name("lab.example.org", None).unwrap();
        assert_eq!(feed.origin(), Ok(Some("lab.example.org".to_owned())));
        assert!(matches!(feed.name("other", None), Err(FeedError::Origin { .. })));
        let fresh = tempfile::tempdir().unwrap();
        let other = CheckpointFeed::of(fresh.path(), true);
        let error = other.name("lab", Some("apprentice")).unwrap_err().to_string();
        assert!(error.contains("already called apprentice"), "{error}");
        let reader = CheckpointFeed::of(data.path(), false);
        assert_eq!(reader.append(&TenantId::local(), &note(1)), Err(FeedError::ReadOnly));
    }
}
