//! Small files that survive a crash: written whole, synced with their directory.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// A new name is durable only when the directory that holds it is.
pub(in crate::store) fn sync_dir(dir: &Path) -> io::Result<()> {
    File::open(dir)?.sync_all()
}

/// Makes `dir` and what is missing above it, readable by its owner only.
pub(in crate::store) fn make_dir(dir: &Path) -> io::Result<()> {
    if dir.is_dir() {
        return Ok(());
    }
    let parent = match dir.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    // One after the other: each new name is durable only with the directory above it.
    make_dir(parent)?;
    fs::DirBuilder::new().recursive(true).mode(0o700).create(dir)?;
    // Without the sync it may be gone after a power cut, so it must not be found next time.
    sync_dir(parent).inspect_err(|_| drop(fs::remove_dir(dir)))
}

/// Puts `bytes` under `path`, all or nothing, readable by its owner only. Durable once the
/// directory is synced, which is left to the caller: many files share one sync.
pub(in crate::store) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let fresh = beside(path);
    let mut file = create(&fresh)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    fs::rename(&fresh, path)
}

/// An empty file for [`write_whole`]'s first half.
pub(in crate::store) fn create(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(true).mode(0o600).open(path)
}

/// The name under which a new version of `path` is written before it takes its place.
pub(in crate::store) fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    PathBuf::from(name)
}

/// Overwrites a file with zeros, syncs it and takes its name away. The directory is left to the
/// caller. A file system that copies on write, or a flash disk, may keep the old block: full-disk
/// encryption is the answer to that.
pub(in crate::store) fn overwrite_and_remove(path: &Path) -> io::Result<()> {
    let mut file = match OpenOptions::new().write(true).open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        opened => opened?,
    };
    let length = usize::try_from(file.metadata()?.len()).unwrap_or(0);
    file.write_all(&vec![0; length])?;
    file.sync_all()?;
    fs::remove_file(path)
}

/// Copies a directory with all that is in it.
///
/// - returns: the bytes copied.
pub(in crate::store) fn copy_tree(from: &Path, to: &Path) -> io::Result<u64> {
    let mut bytes = 0;
    make_dir(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        bytes += match entry.file_type()?.is_dir() {
            true => copy_tree(&source, &target)?,
            false => fs::copy(&source, &target)?,
        };
    }
    Ok(bytes)
}
