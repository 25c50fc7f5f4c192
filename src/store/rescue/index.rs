use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use super::pages::{Item, SEGMENT_BYTES, Value, number, walk};
use crate::events::Header;
use crate::ids::{Digest, StreamKey};
use crate::limits::{RECORD_BYTES_MAX, STORE_VALUE_BYTES_MAX};
use crate::store::sled::{KEY_BYTES, chunk_key};

const MAGIC: &[u8; 4] = b"APR1";
/// Ways to put the chunks of one record together that are tried before it counts as lost.
const TRIES_MAX: usize = 256;
/// A sealed body is its text and what sealing adds, which is far below this.
const FRAME_BYTES_MAX: usize = RECORD_BYTES_MAX + 4096;

/// Where bytes stand in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    at: u64,
    bytes: u32,
}

/// Where the values of a database's file stand, by stream, record and chunk. Holds places only.
pub(super) struct Index {
    file: File,
    /// By whole key. More than one place for most: old pages stay until their segment is reused.
    known: BTreeMap<[u8; KEY_BYTES], BTreeSet<Place>>,
    /// Values whose page's base was not found, by the end of their key.
    ends: BTreeMap<Vec<u8>, BTreeSet<Place>>,
    /// Values of a batch whose end is not there: after a crash they were never acknowledged, after
    /// damage they may have been.
    doubtful: BTreeSet<Place>,
    /// Whole records found in bytes that are no message any more, by their first chunk's key.
    loose: BTreeMap<[u8; KEY_BYTES], Vec<Vec<Place>>>,
}

/// What a scan gathers before it knows all.
#[derive(Default)]
struct Gathered {
    prefixes: BTreeMap<u64, BTreeSet<Vec<u8>>>,
    updates: Vec<(u64, Vec<u8>, Option<u64>, Place)>,
    bases: Vec<([u8; KEY_BYTES], Option<u64>, Place)>,
    batches: Vec<(u64, u64)>,
}

impl Index {
    /// Reads the whole file once.
    pub(super) fn of(path: &Path) -> io::Result<Index> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        let mut index = Index {
            file,
            known: BTreeMap::new(),
            ends: BTreeMap::new(),
            doubtful: BTreeSet::new(),
            loose: BTreeMap::new(),
        };
        let mut gathered = Gathered::default();
        let mut buffer = vec![0; SEGMENT_BYTES];
        let (mut at, mut tip) = (0, 0);
        while at < length {
            let bytes = usize::try_from(length - at).unwrap_or(usize::MAX).min(SEGMENT_BYTES);
            let segment = &mut buffer[..bytes];
            index.file.read_exact_at(segment, at)?;
            let segment = &*segment;
            let last = walk(segment, |lsn, item| match item {
                Item::Base(value) => gathered.base(lsn, at, &value),
                Item::Update(value) => gathered.update(lsn, at, &value, segment),
                Item::Batch { until } => gathered.batches.extend(lsn.map(|lsn| (lsn, until))),
                Item::Unreadable { start, end } => index.search(segment, start, end, at),
            });
            tip = tip.max(last);
            at += bytes as u64;
        }
        index.settle(gathered, tip);
        Ok(index)
    }

    /// Gives each update its key, and doubts what belongs to a batch that was cut short.
    fn settle(&mut self, gathered: Gathered, tip: u64) {
        let torn: Vec<(u64, u64)> =
            gathered.batches.into_iter().filter(|&(_, until)| until > tip).collect();
        let doubt = |lsn: Option<u64>| {
            torn.iter().any(|&(from, until)| lsn.is_some_and(|lsn| lsn > from && lsn <= until))
        };
        for (key, lsn, place) in gathered.bases {
            self.doubtful.extend(doubt(lsn).then_some(place));
            self.known.entry(key).or_default().insert(place);
        }
        for (page, suffix, lsn, place) in gathered.updates {
            self.doubtful.extend(doubt(lsn).then_some(place));
            let mut homeless = true;
            for prefix in gathered.prefixes.get(&page).into_iter().flatten() {
                let whole: Vec<u8> = [&prefix[..], &suffix].concat();
                if let Ok(key) = whole.try_into() {
                    self.known.entry(key).or_default().insert(place);
                    homeless = false;
                }
            }
            match <[u8; KEY_BYTES]>::try_from(&suffix[..]) {
                Ok(key) => drop(self.known.entry(key).or_default().insert(place)),
                Err(_) if homeless => drop(self.ends.entry(suffix).or_default().insert(place)),
                Err(_) => {}
            }
        }
    }

    /// Looks for records whose chunks stand one after the other in a page's base, as they do when
    /// the base was damaged elsewhere.
    fn search(&mut self, segment: &[u8], start: usize, end: usize, offset: u64) {
        let end = end.min(segment.len());
        let mut from = start;
        while let Some(found) = segment[from..end].windows(4).position(|four| four == MAGIC) {
            let at = from + found;
            from = at + 1;
            let Some((stream, seq, mut left)) = promise(&segment[at..]) else { continue };
            let (mut places, mut next) = (Vec::new(), at);
            while left > 0 {
                let bytes = left.min(STORE_VALUE_BYTES_MAX);
                places.push(Place { at: offset + next as u64, bytes: bytes as u32 });
                left -= bytes;
                next += bytes;
                let Some(mut rest) = segment.get(next..) else { break };
                if left > 0 {
                    let before = rest.len();
                    if number(&mut rest) != Some(left.min(STORE_VALUE_BYTES_MAX) as u64) {
                        break;
                    }
                    next += before - rest.len();
                }
            }
            if left == 0 && next <= segment.len() {
                self.loose.entry(chunk_key(stream, seq, 0)).or_default().push(places);
            }
        }
    }

    /// The streams of which anything was found.
    pub(super) fn streams(&self) -> BTreeSet<StreamKey> {
        let keys = self.known.keys().chain(self.loose.keys());
        keys.filter_map(|key| key.first_chunk().copied().map(StreamKey)).collect()
    }

    /// Whether anything was found of a record of the stream after `seq`.
    pub(super) fn holds_beyond(&self, stream: StreamKey, seq: u64) -> bool {
        let from = chunk_key(stream, seq + 1, 0);
        let to = chunk_key(stream, u64::MAX, u16::MAX);
        self.known.range(from..=to).next().is_some() || self.loose.range(from..=to).next().is_some()
    }

    /// The framed records found for that stream and number that `accept` takes, and why it refused
    /// the others. Usually one; after a crash another may be left that was never acknowledged.
    ///
    /// - `acknowledged`: whether the record may have been; then those in doubt count too.
    pub(super) fn frames<T>(
        &self,
        stream: StreamKey,
        seq: u64,
        acknowledged: bool,
        mut accept: impl FnMut(&[u8]) -> Result<T, String>,
    ) -> Result<Vec<(Vec<u8>, T)>, String> {
        let mut reason = format!("no whole copy of record {seq} is there");
        let mut accepted = Vec::new();
        for frame in self.candidates(stream, seq, acknowledged) {
            match accept(&frame) {
                Ok(judged) => accepted.push((frame, judged)),
                Err(refused) => reason = refused,
            }
        }
        if accepted.is_empty() { Err(reason) } else { Ok(accepted) }
    }

    /// The digests that records found for that number name as their predecessor's.
    pub(super) fn predecessors(&self, stream: StreamKey, seq: u64) -> BTreeSet<Digest> {
        let named = self.candidates(stream, seq, true).into_iter();
        named.filter_map(|frame| Some(Digest(*frame.get(52..)?.first_chunk()?))).collect()
    }

    fn candidates(&self, stream: StreamKey, seq: u64, doubtful: bool) -> BTreeSet<Vec<u8>> {
        let mut found = BTreeSet::new();
        for first in self.values(chunk_key(stream, seq, 0), doubtful) {
            let Some((_, _, whole)) = promise(&first) else { continue };
            let mut candidates = vec![first];
            for chunk in 1..whole.div_ceil(STORE_VALUE_BYTES_MAX) {
                let key = chunk_key(stream, seq, u16::try_from(chunk).unwrap_or(u16::MAX));
                let wanted = (whole - chunk * STORE_VALUE_BYTES_MAX).min(STORE_VALUE_BYTES_MAX);
                let mut values = self.values(key, doubtful);
                values.retain(|value| value.len() == wanted);
                if let (1, Some(value)) = (values.len(), values.first()) {
                    candidates.iter_mut().for_each(|so_far| so_far.extend_from_slice(value));
                    continue;
                }
                candidates = candidates
                    .iter()
                    .flat_map(|so_far| values.iter().map(|value| [&so_far[..], value].concat()))
                    .take(TRIES_MAX)
                    .collect();
            }
            found.extend(candidates);
        }
        for places in self.loose.get(&chunk_key(stream, seq, 0)).into_iter().flatten() {
            let parts: Option<Vec<_>> = places.iter().map(|&place| self.read(place)).collect();
            found.extend(parts.map(|parts| parts.concat()));
        }
        found
    }

    /// The different values found for a key.
    fn values(&self, key: [u8; KEY_BYTES], doubtful: bool) -> BTreeSet<Vec<u8>> {
        let homeless = (1..KEY_BYTES).filter_map(|from| self.ends.get(&key[from..])).flatten();
        let places = self.known.get(&key).into_iter().flatten().chain(homeless);
        places
            .filter(|place| doubtful || !self.doubtful.contains(place))
            .filter_map(|&place| self.read(place))
            .take(TRIES_MAX)
            .collect()
    }

    fn read(&self, place: Place) -> Option<Vec<u8>> {
        let mut bytes = vec![0; usize::try_from(place.bytes).ok()?];
        self.file.read_exact_at(&mut bytes, place.at).ok().map(|()| bytes)
    }
}

impl Gathered {
    fn base(&mut self, lsn: Option<u64>, offset: u64, value: &Value<'_>) {
        let prefixes = self.prefixes.entry(value.page).or_default();
        if !prefixes.contains(value.prefix) {
            prefixes.insert(value.prefix.to_vec());
        }
        if let (Ok(key), Some(place)) =
            ([value.prefix, value.suffix].concat().try_into(), place(offset, value))
        {
            self.bases.push((key, lsn, place));
        }
    }

    fn update(&mut self, lsn: Option<u64>, offset: u64, value: &Value<'_>, segment: &[u8]) {
        let Some(place) = place(offset, value) else { return };
        // A record's first chunk says itself where it belongs.
        match promise(&segment[value.start..value.start + value.bytes]) {
            Some((stream, seq, _)) => self.bases.push((chunk_key(stream, seq, 0), lsn, place)),
            None => self.updates.push((value.page, value.suffix.to_vec(), lsn, place)),
        }
    }
}

fn place(offset: u64, value: &Value<'_>) -> Option<Place> {
    let bytes = u32::try_from(value.bytes).ok()?;
    (value.bytes <= STORE_VALUE_BYTES_MAX)
        .then_some(Place { at: offset + value.start as u64, bytes })
}

/// What the header at the start of `bytes` says, unproved: stream, number, length of the frame.
fn promise(bytes: &[u8]) -> Option<(StreamKey, u64, usize)> {
    let head = bytes.strip_prefix(MAGIC).and_then(|_| bytes.get(..Header::BYTES))?;
    let stream = StreamKey(*head[4..].first_chunk()?);
    let seq = u64::from_be_bytes(*head[20..].first_chunk()?);
    let sealed = usize::try_from(u32::from_be_bytes(*head[120..].first_chunk()?)).ok()?;
    let whole = Header::BYTES + sealed;
    (whole <= FRAME_BYTES_MAX).then_some((stream, seq, whole))
}
