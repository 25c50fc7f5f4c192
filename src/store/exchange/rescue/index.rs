use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use super::pages::{Item, SEGMENT_BYTES, Value, number, walk};
use super::trees::{Trees, Ways};
use crate::events::Header;
use crate::ids::{Digest, StreamId, StreamKey, TenantId};
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
    /// The number of their page, [`NO_PAGE`] when that is lost.
    page: u64,
}

/// Page 0 holds the names of the trees, and no value.
const NO_PAGE: u64 = 0;

/// Whose pages are searched for a lab's records. Keys name no lab, and two labs may use one key
/// (every lab's own stream has the same), so a lab's own pages come first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pages {
    /// Those that stand in the lab's tree.
    Own,
    /// Those, and the ones of which nothing says where they stand.
    OwnAndLost,
    All,
}

/// Where the values of a database's file stand, by stream, record and chunk. Holds places only.
pub(super) struct Index {
    file: File,
    trees: Trees,
    /// By whole key, which is one for several labs. More than one place for most: old pages stay until their segment is reused.
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
    ways: Ways,
}

impl Pages {
    /// In the order in which they are to be searched.
    pub(super) const ALL: [Pages; 3] = [Pages::Own, Pages::OwnAndLost, Pages::All];
}

impl Index {
    /// Reads the whole file once.
    pub(super) fn of(path: &Path) -> io::Result<Index> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        let mut index = Index {
            file,
            trees: Trees::default(),
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
                Item::Page { page, leads_to } => gathered.ways.page(lsn, page, leads_to),
                Item::Roots(roots) => gathered.ways.roots(lsn, &roots),
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
        self.trees = gathered.ways.walk();
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
                places.push(Place { at: offset + next as u64, bytes: bytes as u32, page: NO_PAGE });
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

    /// The stream keys of which anything was found, each with the labs in whose pages; none for a
    /// page of which nothing says where it stands.
    pub(super) fn found(&self) -> Vec<(StreamKey, BTreeSet<Option<&TenantId>>)> {
        let mut found: BTreeMap<[u8; 16], BTreeSet<_>> = BTreeMap::new();
        let mut add = |key: &[u8; KEY_BYTES], tenant| {
            let stream = key.first_chunk().expect("a key begins with its stream's");
            found.entry(*stream).or_default().insert(tenant);
        };
        for (key, places) in &self.known {
            places.iter().for_each(|place| add(key, self.trees.tenant_of(place.page)));
        }
        self.loose.keys().for_each(|key| add(key, None));
        found.into_iter().map(|(key, tenants)| (StreamKey(key), tenants)).collect()
    }

    /// Whether anything was found of a record of the stream after `seq`.
    pub(super) fn holds_beyond(&self, stream: &StreamId, seq: u64) -> bool {
        let Some(next) = seq.checked_add(1) else { return false };
        let from = chunk_key(stream.key, next, 0);
        let to = chunk_key(stream.key, u64::MAX, u16::MAX);
        let own = |place: &Place| self.is_in(place, &stream.tenant, Pages::OwnAndLost);
        self.known.range(from..=to).any(|(_, places)| places.iter().any(own))
            || self.loose.range(from..=to).next().is_some()
    }

    fn is_in(&self, place: &Place, tenant: &TenantId, pages: Pages) -> bool {
        match (pages, self.trees.tenant_of(place.page)) {
            (Pages::All, _) | (Pages::OwnAndLost, None) => true,
            (Pages::Own, None) => false,
            (Pages::Own | Pages::OwnAndLost, Some(found)) => found == tenant,
        }
    }

    /// The framed records found in those pages for that stream and number that `accept` takes, and
    /// why it refused the others. Usually one; after a crash another may be left that was never
    /// acknowledged.
    ///
    /// - `acknowledged`: whether the record may have been; then those in doubt count too.
    pub(super) fn frames<T>(
        &self,
        stream: &StreamId,
        seq: u64,
        (acknowledged, pages): (bool, Pages),
        mut accept: impl FnMut(&[u8]) -> Result<T, String>,
    ) -> Result<Vec<(Vec<u8>, T)>, String> {
        let mut reason = format!("no complete copy of record {seq} was found");
        let mut accepted = Vec::new();
        for frame in self.candidates(stream, seq, acknowledged, pages) {
            match accept(&frame) {
                Ok(judged) => accepted.push((frame, judged)),
                Err(refused) => reason = refused,
            }
        }
        if accepted.is_empty() { Err(reason) } else { Ok(accepted) }
    }

    /// The record of that number and digest, wherever it is.
    pub(super) fn named(&self, stream: &StreamId, seq: u64, digest: Digest) -> Option<Vec<u8>> {
        let fits = |frame: &Vec<u8>| Digest::of(frame) == digest;
        let mut pages = Pages::ALL.into_iter();
        pages.find_map(|pages| self.candidates(stream, seq, true, pages).into_iter().find(fits))
    }

    /// The digests that records found for that number name as their predecessor's.
    pub(super) fn predecessors(&self, stream: &StreamId, seq: u64) -> BTreeSet<Digest> {
        let named = self.candidates(stream, seq, true, Pages::All).into_iter();
        named.filter_map(|frame| predecessor(&frame)).collect()
    }

    fn candidates(
        &self,
        stream: &StreamId,
        seq: u64,
        doubtful: bool,
        pages: Pages,
    ) -> BTreeSet<Vec<u8>> {
        let places = |key| self.places(key, doubtful, &stream.tenant, pages);
        let mut found = BTreeSet::new();
        // As many as labs use the key: no bound here, each is one whole beginning of a record.
        for first in self.values(places(chunk_key(stream.key, seq, 0))) {
            let Some((_, _, whole)) = promise(&first) else { continue };
            let mut candidates = vec![first];
            for chunk in 1..whole.div_ceil(STORE_VALUE_BYTES_MAX) {
                let key = chunk_key(stream.key, seq, u16::try_from(chunk).unwrap_or(u16::MAX));
                let wanted = (whole - chunk * STORE_VALUE_BYTES_MAX).min(STORE_VALUE_BYTES_MAX);
                let mut values = self.values(places(key).take(TRIES_MAX));
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
        if pages != Pages::Own {
            for places in self.loose.get(&chunk_key(stream.key, seq, 0)).into_iter().flatten() {
                let parts: Option<Vec<_>> = places.iter().map(|&place| self.read(place)).collect();
                found.extend(parts.map(|parts| parts.concat()));
            }
        }
        found
    }

    /// Where values for a key stand in those pages.
    fn places(
        &self,
        key: [u8; KEY_BYTES],
        doubtful: bool,
        tenant: &TenantId,
        pages: Pages,
    ) -> impl Iterator<Item = Place> {
        let homeless = (1..KEY_BYTES).filter_map(move |from| self.ends.get(&key[from..])).flatten();
        let places = self.known.get(&key).into_iter().flatten().chain(homeless).copied();
        places.filter(move |place| {
            (doubtful || !self.doubtful.contains(place)) && self.is_in(place, tenant, pages)
        })
    }

    /// The different values that stand there.
    fn values(&self, places: impl Iterator<Item = Place>) -> BTreeSet<Vec<u8>> {
        places.filter_map(|place| self.read(place)).collect()
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
    let (at, page) = (offset + value.start as u64, value.page);
    (value.bytes <= STORE_VALUE_BYTES_MAX).then_some(Place { at, bytes, page })
}

/// The digest that a framed record names as its predecessor's, unproved.
pub(super) fn predecessor(frame: &[u8]) -> Option<Digest> {
    Some(Digest(*frame.get(52..)?.first_chunk()?))
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
