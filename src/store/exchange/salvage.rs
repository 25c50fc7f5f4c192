use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::rescue::{Rescue, RescueError, StreamFound};
use crate::events::Head;
use crate::ids::TenantId;
use crate::store::directory::checkpoints::CHECKPOINTS;
use crate::store::directory::error::OpenError;
use crate::store::directory::open::open;
use crate::store::disk::files::{make_dir, sync_dir};
use crate::store::sled::Adopter;

/// What a salvage copied and what it could not.
#[derive(Debug)]
pub struct Salvaged {
    pub streams: Vec<StreamFound>,
    /// Streams of which records were found and nothing says whose they were; not copied.
    pub unclaimed: usize,
    /// Set when the heads file cannot be trusted: then streams may have been longer.
    pub heads_damage: Option<String>,
    /// Key files that could not be copied, each in a sentence.
    pub lost_keys: Vec<String>,
}

/// What a salvage copied of one lab, and what of it it could not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Share {
    /// People of whom a record was kept.
    pub people: u64,
    /// Their records.
    pub records: u64,
    /// Records kept of the lab's own stream: its keys, quotas, retirements, erasures.
    pub own: u64,
    /// Records that were acknowledged and are not kept, as far as the heads file tells.
    pub lost: u64,
    /// Streams of which something is lost, a key or records of unknown number among it.
    pub hurt: u64,
}

/// Why nothing was salvaged.
#[derive(Debug, thiserror::Error)]
pub enum SalvageError {
    #[error(transparent)]
    Source(#[from] RescueError),
    #[error("{out} already exists and is not empty; name a directory that does not exist")]
    Occupied { out: String },
    #[error("{out} cannot be made: {reason}")]
    Out { out: String, reason: String },
    #[error("{0}")]
    Open(#[from] OpenError),
}

impl Salvaged {
    pub fn is_complete(&self) -> bool {
        self.streams.iter().all(|stream| stream.losses.is_empty())
            && self.unclaimed == 0
            && self.heads_damage.is_none()
            && self.lost_keys.is_empty()
    }

    /// What was kept and lost of each lab of which anything was found.
    pub fn by_tenant(&self) -> BTreeMap<&TenantId, Share> {
        let mut shares: BTreeMap<_, Share> = BTreeMap::new();
        for found in &self.streams {
            let share = shares.entry(&found.stream.tenant).or_default();
            let kept = found.valid.seq;
            match found.stream.is_tenants() {
                true => share.own += kept,
                false => {
                    share.people += u64::from(kept > 0);
                    share.records += kept;
                }
            }
            share.lost += found.acknowledged.map_or(0, |all| all.saturating_sub(kept));
            share.hurt += u64::from(!found.losses.is_empty());
        }
        shares
    }
}

/// Copies each stream's longest valid prefix, and the keys, from `dir` to a new data directory `out`.
/// Never writes to `dir`, and does not need its database to open.
///
/// `out` is made under the name `<out>.unfinished` and gets its own name last: whatever ends this
/// before leaves no directory that could be taken for a whole one, and a later run starts afresh.
pub fn salvage(dir: &Path, out: &Path) -> Result<Salvaged, SalvageError> {
    let failed = |error: &dyn std::fmt::Display| SalvageError::Out {
        out: out.display().to_string(),
        reason: error.to_string(),
    };
    if fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) || out.is_file() {
        return Err(SalvageError::Occupied { out: out.display().to_string() });
    }
    let rescue = Rescue::open(dir)?;
    let unfinished = unfinished(out);
    if unfinished.exists() {
        fs::remove_dir_all(&unfinished).map_err(|error| failed(&error))?;
    }
    // An empty directory with all that belongs into one. Its own tenant key is replaced below.
    drop(open(&unfinished)?);
    let mut salvaged = Salvaged {
        streams: Vec::new(),
        unclaimed: 0,
        heads_damage: rescue.heads_damage().map(str::to_owned),
        lost_keys: Vec::new(),
    };
    copy_keys(&dir.join("keys"), &unfinished.join("keys"), &mut salvaged.lost_keys)
        .map_err(|error| failed(&error))?;
    let mut adopter = Adopter::open(&unfinished).map_err(|error| failed(&error))?;
    let (streams, unclaimed) = rescue.streams();
    salvaged.unclaimed = unclaimed;
    for stream in streams {
        let found = rescue.walk(&stream, |head, frame| adopter.put(&stream, head, frame));
        let found = found.map_err(|error| failed(&error))?;
        // A key may have been made and nothing said.
        let is_there = found.valid != Head::EMPTY || !found.losses.is_empty();
        salvaged.streams.extend(is_there.then_some(found));
    }
    adopter.finish().map_err(|error| failed(&error))?;
    if salvaged.is_complete() {
        copy_checkpoints(&dir.join(CHECKPOINTS), &unfinished.join(CHECKPOINTS))
            .map_err(|error| failed(&error))?;
    }
    let named = || {
        if out.exists() {
            fs::remove_dir(out)?;
        }
        fs::rename(&unfinished, out)?;
        sync_dir(out.parent().filter(|up| !up.as_os_str().is_empty()).unwrap_or(Path::new(".")))
    };
    named().map_err(|error: io::Error| failed(&error))?;
    Ok(salvaged)
}

fn unfinished(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".unfinished");
    PathBuf::from(name)
}

/// The checkpoints that were given out, of a log that lost nothing: it still continues all of them.
/// One that lost something can be held to none.
fn copy_checkpoints(from: &Path, to: &Path) -> io::Result<()> {
    if !from.is_dir() {
        return Ok(());
    }
    make_dir(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        fs::copy(entry.path(), &target)?;
        fs::File::open(&target)?.sync_all()?;
    }
    sync_dir(to)
}

/// The endings of tenants' secrets and people's keys, of marks of erasure, and of the service's own
/// key: with another one every client would have to be told whom to trust now.
const KEY_FILES: [&str; 3] = ["key", "erased", "curve"];

/// Copies key files as they are, marks of erasure included.
fn copy_keys(from: &Path, to: &Path, lost: &mut Vec<String>) -> io::Result<()> {
    let local = to.join(format!("{}.key", TenantId::local()));
    if local.exists() {
        fs::remove_file(local)?;
    }
    let mut waiting = vec![(from.to_owned(), to.to_owned())];
    while let Some((source, target)) = waiting.pop() {
        if source.is_dir() {
            make_dir(&target)?;
            let entries = match fs::read_dir(&source) {
                Ok(entries) => entries,
                Err(error) => {
                    lost.push(format!("{}: {error}", source.display()));
                    continue;
                }
            };
            for entry in entries {
                let entry = entry?;
                waiting.push((entry.path(), target.join(entry.file_name())));
            }
        } else if source.extension().is_some_and(|kind| KEY_FILES.iter().any(|own| kind == *own)) {
            // Modes go along.
            let copied = fs::copy(&source, &target)
                .and_then(|_| fs::File::open(&target)?.sync_all())
                .and_then(|()| sync_dir(target.parent().unwrap_or(to)));
            if let Err(error) = copied {
                lost.push(format!("{}: {error}", source.display()));
            }
        }
    }
    Ok(())
}
