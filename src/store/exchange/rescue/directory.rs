use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::index::{Index, Pages, predecessor};
use crate::events::{Head, Header};
use crate::ids::{Digest, StreamId, StreamKey, TenantId};
use crate::store::directory::error::{Fail, OpenError};
use crate::store::disk::lock::{DirLock, LOCK_FILE};
use crate::store::log::heads::{Heads, HeadsFile};
use crate::store::sealing::entropy::OsEntropy;
use crate::store::sealing::keys::{KeyError, Keys};
use crate::store::sealing::seal::Walk;

/// A data directory, read without its database. Never written to.
pub struct Rescue {
    index: Index,
    heads: Heads,
    /// What is wrong with the heads file, in a sentence. Then it is unknown where streams ended.
    heads_damage: Option<String>,
    keys: Keys,
    /// The keys of streams of which anything was found.
    found: Vec<StreamKey>,
    /// Every stream that heads, key files or trees of the database name.
    named: BTreeSet<StreamId>,
    /// The labs of those.
    tenants: BTreeSet<TenantId>,
    _lock: Option<DirLock>,
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
    #[error("records after {valid} exist but do not continue the chain: {reason}")]
    Beyond { valid: u64, reason: String },
    #[error("the key: its records are kept sealed and cannot be decrypted: {0}")]
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
        // A lost lock file does not prevent a rescue.
        let lock = match File::open(dir.join(LOCK_FILE)) {
            Ok(file) => Some(DirLock::of(file).map_err(|error| Fail(dir).lock(error))?),
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
        let mut named = named_by_key_files(dir);
        for (tenant, streams) in &heads {
            named.extend(streams.keys().map(|key| StreamId { tenant: tenant.clone(), key }));
        }
        let mut found = Vec::new();
        for (key, tenants) in index.found() {
            found.push(key);
            let tenants = tenants.into_iter().flatten().cloned();
            named.extend(tenants.map(|tenant| StreamId { tenant, key }));
        }
        let tenants = named.iter().map(|stream| stream.tenant.clone()).collect();
        Ok(Rescue { index, heads, heads_damage, keys, found, named, tenants, _lock: lock })
    }

    pub fn heads_damage(&self) -> Option<&str> {
        self.heads_damage.as_deref()
    }

    /// Every stream that was acknowledged or of which anything may have been found, and the number
    /// of those whose tenant is unknown.
    pub fn streams(&self) -> (Vec<StreamId>, usize) {
        // A stream beyond heads that are whole was never acknowledged, and neither was a key file
        // without records.
        let there = |stream: &&StreamId| {
            self.recorded(stream).is_some() || self.index.holds_beyond(stream, 0)
        };
        let streams = self.named.iter().filter(there).cloned().collect();
        let unknown = self.found.iter().map(|&key| self.strangers(key)).sum();
        (streams, unknown)
    }

    /// How many streams with this key were found that are of none of the labs we know.
    fn strangers(&self, key: StreamKey) -> usize {
        let claims: Vec<StreamId> = self.claims(key).collect();
        let Some(any) = claims.first() else { return 1 };
        // Heads that are whole name every stream that was acknowledged. And a person's key is hardly
        // ever another's.
        if self.heads_damage.is_none() || (claims.len() == 1 && !any.is_tenants()) {
            return 0;
        }
        let first = self.index.frames(any, 1, (false, Pages::All), |frame| {
            step(&Walk::after(key, Head::EMPTY), frame).map(|next| next.last().digest)
        });
        let mut strangers = BTreeSet::new();
        for (frame, digest) in first.unwrap_or_default() {
            let opens = claims.iter().any(|stream| self.opens(stream, &frame));
            strangers.extend((!opens).then_some(digest));
        }
        for stream in &claims {
            for (_, walk) in self.origin(stream, true).unwrap_or_default() {
                strangers.remove(&walk.last().digest);
            }
        }
        strangers.len()
    }

    /// The streams of all labs that may have this key.
    fn claims(&self, key: StreamKey) -> impl Iterator<Item = StreamId> {
        let streams =
            self.tenants.iter().map(move |tenant| StreamId { tenant: tenant.clone(), key });
        streams.filter(|stream| self.named.contains(stream))
    }

    fn recorded(&self, stream: &StreamId) -> Option<Head> {
        self.heads.get(&stream.tenant).and_then(|heads| heads.get(&stream.key)).copied()
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
        let recorded = self.recorded(stream);
        let mut walk = Walk::after(stream.key, Head::EMPTY);
        let reason = loop {
            let seq = walk.last().next().get();
            let acknowledged =
                self.heads_damage.is_some() || recorded.is_some_and(|head| seq <= head.seq);
            let found = match seq {
                1 => self.origin(stream, acknowledged),
                _ => self.successors(stream, &walk, acknowledged),
            };
            match found {
                Ok(mut found) => {
                    // Two that both continue the chain: the one that was itself continued.
                    let mut which = 0;
                    if found.len() > 1 {
                        let named = self.index.predecessors(stream, seq + 1);
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
        } else if acknowledged.is_none() && self.index.holds_beyond(stream, valid.seq) {
            losses.push(Loss::Beyond { valid: valid.seq, reason });
        }
        match self.keys.user_key(stream) {
            Ok(_) | Err(KeyError::Erased { .. }) => {}
            Err(error) => losses.push(Loss::Key(error)),
        }
        Ok(StreamFound { stream: stream.clone(), acknowledged, valid, losses })
    }

    /// The records that continue `walk`, each with the walk behind it. The chain says whose they are:
    /// a record names the one before it by its digest.
    fn successors(&self, stream: &StreamId, walk: &Walk, acknowledged: bool) -> Found {
        let mut pages =
            Pages::ALL.into_iter().map(|pages| self.follow(stream, walk, acknowledged, pages));
        // What is wrong with a lab's own record says more than that another lab's does not fit.
        let first = pages.next().expect("there are pages to search");
        first.or_else(|reason| pages.find_map(Result::ok).ok_or(reason))
    }

    /// The records in those pages that may stand behind `walk`.
    fn follow(&self, stream: &StreamId, walk: &Walk, acknowledged: bool, pages: Pages) -> Found {
        let recorded = self.recorded(stream);
        let seq = walk.last().next().get();
        self.index.frames(stream, seq, (acknowledged, pages), |frame| {
            let next = step(walk, frame)?;
            match recorded {
                Some(head) if head.seq == seq && head != next.last() => {
                    Err(format!("record {seq} is not the one that was acknowledged"))
                }
                _ => Ok(next),
            }
        })
    }

    /// The first records that may be the stream's. No record says of which lab it is, and the first
    /// one continues none. It is the stream's when its key opens it; else when no other lab has a
    /// stream with this key; else when the acknowledged head leads back to it; else when it stands in
    /// the lab's own pages and no other lab's key opens it. Every lab has a stream of its own, perhaps
    /// also one of which nothing else is left: no lab is alone with that key.
    fn origin(&self, stream: &StreamId, acknowledged: bool) -> Found {
        let start = Walk::after(stream.key, Head::EMPTY);
        let found = Pages::ALL.map(|pages| self.follow(stream, &start, acknowledged, pages));
        for found in found.iter().flatten() {
            let opened = found.iter().filter(|(frame, _)| self.opens(stream, frame)).cloned();
            let opened: Vec<_> = opened.collect();
            if !opened.is_empty() {
                return Ok(opened);
            }
        }
        let others: Vec<_> = self.claims(stream.key).filter(|claim| claim != stream).collect();
        if others.is_empty() && !stream.is_tenants() {
            return self.successors(stream, &start, acknowledged);
        }
        if let Some(digest) = self.recorded(stream).and_then(|head| self.led_to_by(stream, head))
            && let Some(frame) = self.index.named(stream, 1, digest)
            && let Ok(walk) = step(&start, &frame)
        {
            return Ok(vec![(frame, walk)]);
        }
        let [own, ..] = found;
        let mut own = own?;
        own.retain(|(frame, _)| !others.iter().any(|other| self.opens(other, frame)));
        match own.is_empty() {
            false => Ok(own),
            true => Err("record 1 in its pages belongs to another lab".to_owned()),
        }
    }

    /// The digest of the first record of the chain that ends with `head`; none when a link is lost.
    fn led_to_by(&self, stream: &StreamId, head: Head) -> Option<Digest> {
        let (mut seq, mut digest) = (head.seq, head.digest);
        while seq > 1 {
            digest = predecessor(&self.index.named(stream, seq, digest)?)?;
            seq -= 1;
        }
        Some(digest)
    }

    /// Whether the stream's key is at hand and opens the record.
    fn opens(&self, stream: &StreamId, frame: &[u8]) -> bool {
        let Ok(key) = self.keys.user_key(stream) else { return false };
        Header::unframe(frame).is_ok_and(|(header, body, _)| key.reveal(&header, body).is_ok())
    }
}

/// Framed records and the walk behind each, or why there is none.
type Found = Result<Vec<(Vec<u8>, Walk)>, String>;

fn step(walk: &Walk, frame: &[u8]) -> Result<Walk, String> {
    let mut next = walk.clone();
    next.step(frame).map_err(|error| error.to_string())?;
    Ok(next)
}

/// The streams that key files and marks of erasure name.
fn named_by_key_files(dir: &Path) -> BTreeSet<StreamId> {
    let mut named = BTreeSet::new();
    for dir in entries(&dir.join("keys/users")) {
        let name = dir.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let Ok(tenant) = TenantId::new(&name) else { continue };
        for file in entries(&dir) {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            if let Ok(key) = stem.parse() {
                named.insert(StreamId { tenant: tenant.clone(), key });
            }
        }
    }
    named
}

fn entries(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).into_iter().flatten();
    entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect()
}
