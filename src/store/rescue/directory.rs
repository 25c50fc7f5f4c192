use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::index::Index;
use crate::events::Head;
use crate::ids::{StreamId, StreamKey, TenantId};
use crate::store::heads::{Heads, HeadsFile};
use crate::store::{KeyError, Keys, OpenError, OsEntropy, Walk};

/// A data directory, read without its database. Never written to.
pub struct Rescue {
    dir: PathBuf,
    index: Index,
    heads: Heads,
    /// What is wrong with the heads file, in a sentence. Then nobody can say where streams ended.
    heads_damage: Option<String>,
    keys: Keys,
    _lock: Option<File>,
}

/// Why nothing at all can be read.
#[derive(Debug, thiserror::Error)]
pub enum RescueError {
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error("{path} cannot be read: {reason}")]
    Io { path: String, reason: String },
}

/// How far a stream could be read.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamFound {
    pub stream: StreamId,
    /// Records acknowledged; none when the heads file cannot say.
    pub acknowledged: Option<u64>,
    /// The head of the longest valid prefix.
    pub valid: Head,
    /// Empty when nothing is missing.
    pub losses: Vec<Loss>,
}

/// Something that is gone, in a sentence for a person.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Loss {
    #[error("{} of {acknowledged} records, from {} on: {reason}", acknowledged - valid, valid + 1)]
    Tail { acknowledged: u64, valid: u64, reason: String },
    #[error("records after {valid} are there and do not continue it: {reason}")]
    Beyond { valid: u64, reason: String },
    #[error("the key: its records are kept sealed and cannot be read: {0}")]
    Key(KeyError),
}

impl Rescue {
    /// Reads the whole database file of `dir` once.
    ///
    /// - errors: the directory is in use, or its database file cannot be read at all.
    pub fn open(dir: &Path) -> Result<Rescue, RescueError> {
        let failed = |path: &Path, error: &io::Error| RescueError::Io {
            path: path.display().to_string(),
            reason: error.to_string(),
        };
        // A lost lock file keeps nobody from rescuing the rest.
        let lock = match File::open(dir.join("LOCK")) {
            Ok(file) => Some(crate::store::open::lock(dir, file)?),
            Err(_) => None,
        };
        let database = dir.join("log/db");
        let index = Index::of(&database).map_err(|error| failed(&database, &error))?;
        let (heads, heads_damage) = match HeadsFile::read(&dir.join("HEADS")) {
            Ok(Some(read)) => (read.heads, read.damage),
            Ok(None) => (Heads::new(), Some("it is missing".to_owned())),
            Err(error) => (Heads::new(), Some(error.to_string())),
        };
        let keys = Keys::open_read_only(&dir.join("keys"), Arc::new(OsEntropy));
        Ok(Rescue { dir: dir.to_owned(), index, heads, heads_damage, keys, _lock: lock })
    }

    pub fn heads_damage(&self) -> Option<&str> {
        self.heads_damage.as_deref()
    }

    /// Every stream that was acknowledged or of which anything was found, and the number of those
    /// whose tenant nobody knows any more.
    pub fn streams(&self) -> (Vec<StreamId>, usize) {
        let mut tenants: BTreeMap<StreamKey, TenantId> = self.tenants_of_key_files();
        for (tenant, streams) in &self.heads {
            tenants.extend(streams.keys().map(|&key| (key, tenant.clone())));
        }
        let acknowledged = self.heads.values().flat_map(|streams| streams.keys().copied());
        let mut all = self.index.streams();
        // A stream beyond heads that are whole was never acknowledged, and neither was a key file
        // without records.
        all.extend(acknowledged);
        let (mut streams, mut unknown) = (Vec::new(), 0);
        for key in all {
            match tenants.get(&key) {
                Some(tenant) => streams.push(StreamId { tenant: tenant.clone(), key }),
                None => unknown += 1,
            }
        }
        streams.sort();
        (streams, unknown)
    }

    /// The tenants of streams by the names of key files.
    fn tenants_of_key_files(&self) -> BTreeMap<StreamKey, TenantId> {
        let mut found = BTreeMap::new();
        let users = self.dir.join("keys/users");
        for dir in entries(&users) {
            let name = dir.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let Ok(tenant) = TenantId::new(&name) else { continue };
            for file in entries(&dir) {
                let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                if let Ok(key) = stem.parse() {
                    found.insert(key, tenant.clone());
                }
            }
        }
        found
    }

    /// Walks a stream's longest valid prefix and hands each record on.
    ///
    /// - `each`: gets the head that the stream has with the record, and its framed bytes; its first
    ///   error ends the walk and is returned.
    pub fn walk<E>(
        &self,
        stream: &StreamId,
        mut each: impl FnMut(Head, &[u8]) -> Result<(), E>,
    ) -> Result<StreamFound, E> {
        let recorded = self.heads.get(&stream.tenant).and_then(|heads| heads.get(&stream.key));
        let mut walk = Walk::after(stream.key, Head::EMPTY);
        let reason = loop {
            let seq = walk.last().next().get();
            let acknowledged =
                self.heads_damage.is_some() || recorded.is_some_and(|head| seq <= head.seq);
            let found = self.index.frames(stream.key, seq, acknowledged, |frame| {
                let mut next = walk.clone();
                next.step(frame).map_err(|error| error.to_string())?;
                match recorded {
                    Some(head) if head.seq == seq && *head != next.last() => {
                        Err(format!("record {seq} is not the one that was acknowledged"))
                    }
                    _ => Ok(next),
                }
            });
            match found {
                Ok(mut found) => {
                    // Two that both continue the chain: the one that was itself continued.
                    let mut which = 0;
                    if found.len() > 1 {
                        let named = self.index.predecessors(stream.key, seq + 1);
                        let continued = |(_, next): &(_, Walk)| named.contains(&next.last().digest);
                        which = found.iter().position(continued).unwrap_or(0);
                    }
                    let (frame, next) = found.swap_remove(which);
                    walk = next;
                    each(walk.last(), &frame)?;
                }
                Err(reason) => break reason,
            }
        };
        let valid = walk.last();
        let acknowledged = match (recorded, &self.heads_damage) {
            (Some(head), None) => Some(head.seq.max(valid.seq)),
            (Some(head), Some(_)) if head.seq > valid.seq => Some(head.seq),
            (None, None) => Some(valid.seq),
            _ => None,
        };
        let mut losses = Vec::new();
        if let Some(acknowledged) = acknowledged.filter(|&all| all > valid.seq) {
            losses.push(Loss::Tail { acknowledged, valid: valid.seq, reason });
        } else if self.index.holds_beyond(stream.key, valid.seq) && acknowledged.is_none() {
            losses.push(Loss::Beyond { valid: valid.seq, reason });
        }
        match self.keys.user_key(stream) {
            Ok(_) | Err(KeyError::Erased { .. }) => {}
            Err(error) => losses.push(Loss::Key(error)),
        }
        Ok(StreamFound { stream: stream.clone(), acknowledged, valid, losses })
    }
}

fn entries(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).into_iter().flatten();
    entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect()
}
