use super::quiet::guarded;
use super::sentence;
use crate::events::{Head, Record};
use crate::ids::{Digest, Seq, StreamKey};
use crate::limits::STORE_VALUE_BYTES_MAX;
use crate::store::log::{ReadError, SealedRecord};
use crate::store::sealing::seal::{DataKey, Walk};

/// stream key (16) ‖ sequence number (8) ‖ chunk (2), big-endian.
pub(in crate::store) const KEY_BYTES: usize = 16 + 8 + 2;

pub(in crate::store) fn chunk_key(stream: StreamKey, seq: u64, chunk: u16) -> [u8; KEY_BYTES] {
    let mut key = [0; KEY_BYTES];
    key[..16].copy_from_slice(&stream.0);
    key[16..24].copy_from_slice(&seq.to_be_bytes());
    key[24..].copy_from_slice(&chunk.to_be_bytes());
    key
}

pub(super) fn parse_key(bytes: &[u8]) -> Option<(StreamKey, u64, u16)> {
    let bytes: &[u8; KEY_BYTES] = bytes.try_into().ok()?;
    let (stream, rest) = bytes.split_first_chunk()?;
    let (seq, chunk) = rest.split_first_chunk()?;
    let chunk = chunk.try_into().ok()?;
    Some((StreamKey(*stream), u64::from_be_bytes(*seq), u16::from_be_bytes(chunk)))
}

/// The values a framed record is stored as.
pub(super) fn chunks(frame: &[u8]) -> impl Iterator<Item = (u16, &[u8])> {
    let numbered = (0..=u16::MAX).zip(frame.chunks(STORE_VALUE_BYTES_MAX));
    debug_assert!(frame.len() <= STORE_VALUE_BYTES_MAX * usize::from(u16::MAX));
    numbered
}

/// Joins chunks again, insisting on each.
#[derive(Default)]
struct Joiner {
    frame: Vec<u8>,
    next: u16,
}

impl Joiner {
    fn push(&mut self, seq: u64, chunk: u16, value: &[u8]) -> Result<(), ReadError> {
        if chunk != self.next {
            let reason = format!("expected chunk {}, found {chunk}", self.next);
            return Err(ReadError::Chunks { seq, reason });
        }
        self.frame.extend_from_slice(value);
        self.next = self.next.saturating_add(1);
        Ok(())
    }
}

/// The framed bytes of one record.
pub(super) fn frame_at(
    tree: &::sled::Tree,
    stream: StreamKey,
    seq: Seq,
) -> Result<Vec<u8>, ReadError> {
    let seq = seq.get();
    let mut joiner = Joiner::default();
    let mut values = tree.range(chunk_key(stream, seq, 0)..=chunk_key(stream, seq, u16::MAX));
    while let Some((key, value)) = next(&mut values)? {
        let (_, _, chunk) = parse_key(&key).ok_or_else(|| foreign_key(&key))?;
        joiner.push(seq, chunk, &value)?;
    }
    match joiner.next {
        0 => Err(ReadError::Store { reason: format!("record {seq} is missing") }),
        _ => Ok(joiner.frame),
    }
}

/// The number of the last record of each stream in a tree, two look-ups a stream.
pub(super) fn last_seqs(tree: &::sled::Tree) -> Result<Vec<(StreamKey, u64)>, String> {
    let mut found = Vec::new();
    let mut from = vec![0; KEY_BYTES];
    while let Some(entry) = tree.range(from.clone()..).next() {
        let (key, _) = entry.map_err(|error| sentence(&error))?;
        let (stream, _, _) = parse_key(&key).ok_or_else(|| foreign_key(&key).to_string())?;
        let end = chunk_key(stream, u64::MAX, u16::MAX);
        let last = tree.get_lt(end).map_err(|error| error.to_string())?;
        let (key, _) = last.ok_or("a stream vanished while it was looked at")?;
        match parse_key(&key) {
            Some((last_stream, seq, _)) if last_stream == stream => found.push((stream, seq)),
            _ => return Err(foreign_key(&key).to_string()),
        }
        from = end.to_vec();
        from.push(0);
    }
    Ok(found)
}

/// Checks all that needs no key, up to the record `end`.
pub(super) fn walk(tree: &::sled::Tree, stream: StreamKey, end: Head) -> Result<Head, ReadError> {
    let frames = Frames::new(tree, Walk::after(stream, Head::EMPTY), end);
    for record in frames {
        record?;
    }
    Ok(end)
}

/// The framed records of one stream, one in memory at a time; all that needs no key is checked. No
/// lock is held between two of them, and records appended meanwhile are not shown.
pub(super) struct Frames {
    values: ::sled::Iter,
    /// A value that was read and belongs to the next record.
    pending: Option<(::sled::IVec, ::sled::IVec)>,
    walk: Walk,
    end: Head,
    ended: bool,
}

impl Frames {
    /// From the record after `walk`'s last one to `end`.
    pub(super) fn new(tree: &::sled::Tree, walk: Walk, end: Head) -> Frames {
        let stream = walk.stream();
        let first = chunk_key(stream, walk.last().next().get(), 0);
        let values = tree.range(first..=chunk_key(stream, end.seq, u16::MAX));
        Frames { values, pending: None, walk, end, ended: false }
    }

    /// The next record's frame, unless the last one was given, checked by `check`.
    fn checked<T>(
        &mut self,
        check: impl FnOnce(&mut Walk, Vec<u8>) -> Result<T, ReadError>,
    ) -> Option<Result<T, ReadError>> {
        if self.ended || self.walk.last().seq >= self.end.seq {
            return None;
        }
        let read = self.joined().and_then(|frame| {
            let checked = check(&mut self.walk, frame)?;
            let last = self.walk.last();
            match last.seq == self.end.seq && last.digest != self.end.digest {
                true => Err(other_end(self.end, last.digest)),
                false => Ok(checked),
            }
        });
        self.ended = read.is_err();
        Some(read)
    }

    fn joined(&mut self) -> Result<Vec<u8>, ReadError> {
        let seq = self.walk.last().next().get();
        let mut joiner = Joiner::default();
        loop {
            let entry = match self.pending.take() {
                Some(entry) => Some(entry),
                None => next(&mut self.values)?,
            };
            let Some((key, value)) = entry else { break };
            let (_, found, chunk) = parse_key(&key).ok_or_else(|| foreign_key(&key))?;
            if found != seq {
                if joiner.next == 0 {
                    return Err(ReadError::Gap { expected: seq, found });
                }
                self.pending = Some((key, value));
                break;
            }
            joiner.push(seq, chunk, &value)?;
        }
        if joiner.next == 0 {
            let reason = format!("record {seq} of {} is missing", self.end.seq);
            return Err(ReadError::Store { reason });
        }
        Ok(joiner.frame)
    }
}

impl Iterator for Frames {
    type Item = Result<SealedRecord, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.checked(Walk::sealed)
    }
}

fn other_end(end: Head, found: Digest) -> ReadError {
    let (expected, found) = (end.digest.to_hex(), found.to_hex());
    let reason =
        format!("the head of the stream has digest {expected}, but this record has {found}");
    ReadError::Seal { seq: end.seq, reason }
}

/// The same, opened.
pub(super) struct Records {
    frames: Frames,
    key: DataKey,
}

impl Records {
    /// From the record after `walk`'s last one to `end`.
    pub(super) fn new(tree: &::sled::Tree, key: DataKey, walk: Walk, end: Head) -> Records {
        Records { frames: Frames::new(tree, walk, end), key }
    }
}

impl Iterator for Records {
    type Item = Result<Record, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        let Records { frames, key } = self;
        frames.checked(|walk, frame| walk.open(key, &frame))
    }
}

type Entry = (::sled::IVec, ::sled::IVec);

/// The next value; a panic of sled over a damaged page is an error like any other.
fn next(values: &mut ::sled::Iter) -> Result<Option<Entry>, ReadError> {
    let entry = guarded(|| values.next().transpose());
    match entry {
        Ok(Ok(entry)) => Ok(entry),
        Ok(Err(error)) => Err(ReadError::Store { reason: sentence(&error) }),
        Err(reason) => Err(ReadError::Store { reason }),
    }
}

fn foreign_key(key: &[u8]) -> ReadError {
    ReadError::Store { reason: format!("{} bytes of a key that does not name a record", key.len()) }
}
