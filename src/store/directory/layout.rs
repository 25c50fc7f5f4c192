//! Which layout a data directory has, as its file `LAYOUT` says.

use std::fs;
use std::io;
use std::path::Path;

use super::error::{Fail, OpenError};
use crate::store::disk::files::{sync_dir, write_whole};
use crate::store::disk::lock::LOCK_FILE;

/// The layout of data directories that this binary makes. Former ones are brought up.
pub const LAYOUT: u32 = 2;

pub(super) const LAYOUT_FILE: &str = "LAYOUT";
/// Exists while a directory is being made; nothing was acknowledged yet.
const CREATING_FILE: &str = "CREATING";
const LAYOUT_TEXT: &str = "apprentice data directory, layout ";

/// What a directory is before it is opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    /// Still to be made.
    Fresh,
    /// A data directory of this layout, [`LAYOUT`] or a former one.
    At(u32),
}

/// - errors: it belongs to somebody else, or to a newer version.
pub(super) fn standing(dir: &Path) -> Result<Standing, OpenError> {
    if dir.join(CREATING_FILE).exists() {
        return Ok(Standing::Fresh);
    }
    let path = dir.join(LAYOUT_FILE);
    let fail = Fail(dir);
    match fs::read(&path) {
        Ok(bytes) => match number(&bytes) {
            Some(known @ 1..=LAYOUT) => Ok(Standing::At(known)),
            Some(found) if found > LAYOUT => {
                let dir = fail.dir();
                Err(OpenError::Newer { dir, found, known: LAYOUT })
            }
            _ => Err(OpenError::Layout { dir: fail.dir() }),
        },
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let entries = fs::read_dir(dir).map_err(|error| fail.io(dir, error))?;
            for entry in entries {
                let name = entry.map_err(|error| fail.io(dir, error))?.file_name();
                // A crash right at the start leaves these two.
                if name != LOCK_FILE && name != "CREATING.new" {
                    let found = format!("{:?}", name.to_string_lossy());
                    return Err(OpenError::NotOurs { dir: fail.dir(), found });
                }
            }
            Ok(Standing::Fresh)
        }
        Err(error) => Err(fail.io(&path, error)),
    }
}

/// The number that the file's one line names.
pub(in crate::store) fn number(bytes: &[u8]) -> Option<u32> {
    let text = std::str::from_utf8(bytes).ok()?.strip_suffix('\n')?;
    text.strip_prefix(LAYOUT_TEXT)?.parse().ok()
}

/// Names the layout of `dir`, durably and in one step.
pub(super) fn write_layout(dir: &Path, number: u32) -> Result<(), OpenError> {
    let path = dir.join(LAYOUT_FILE);
    write_whole(&path, format!("{LAYOUT_TEXT}{number}\n").as_bytes())
        .and_then(|()| sync_dir(dir))
        .map_err(|error| Fail(dir).io(&path, error))
}

/// Marks `dir` as being made, durably.
pub(super) fn begin(dir: &Path) -> Result<(), OpenError> {
    let path = dir.join(CREATING_FILE);
    write_whole(&path, b"").and_then(|()| sync_dir(dir)).map_err(|error| Fail(dir).io(dir, error))
}

/// Ends the making of `dir`: it has the newest layout.
pub(super) fn complete(dir: &Path) -> Result<(), OpenError> {
    write_layout(dir, LAYOUT)?;
    let creating = dir.join(CREATING_FILE);
    fs::remove_file(&creating)
        .and_then(|()| sync_dir(dir))
        .map_err(|error| Fail(dir).io(&creating, error))
}
