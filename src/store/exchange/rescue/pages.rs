//! The messages of sled 0.34's file, as far as they hold records. The file is a row of segments of
//! [`SEGMENT_BYTES`]; a segment is a header and then messages:
//!
//! | bytes | field |
//! |---|---|
//! | 4 | CRC-32 (little-endian, inverted) over the body and the rest of the header |
//! | 1 | kind |
//! | 1–9 each | length of the body, number of the segment, number of the page |
//!
//! The body of a page's base holds a leaf (keys without their common prefix, then values) or an index
//! (keys, then the numbers of the pages below); the body of a later update holds one key and one value.
//! Page 0 holds the names of the trees, each with the number of its topmost page. No key and no leaf
//! says of which tree it is: only the way down from the name does.

/// The size that `open_database` leaves at its default.
pub(super) const SEGMENT_BYTES: usize = 512 * 1024;
const SEGMENT_HEAD_BYTES: usize = 20;

const BATCH: u8 = 3;
const FREE: u8 = 4;
const ROOTS: u8 = 6;
const BASE: u8 = 8;
const UPDATE: u8 = 10;
const KIND_MAX: u8 = 11;

/// A value with what is known of its key; the value is given by its place in the segment.
pub(super) struct Value<'s> {
    pub page: u64,
    pub prefix: &'s [u8],
    /// What follows the page's common prefix.
    pub suffix: &'s [u8],
    pub start: usize,
    pub bytes: usize,
}

/// What a segment holds.
pub(super) enum Item<'s> {
    /// A value of a page's base: the prefix is known.
    Base(Value<'s>),
    /// A value that was set later: the prefix is that of the page's base.
    Update(Value<'s>),
    /// From here on these pages stand beside and below `page`; none when it was given up.
    Page { page: u64, leads_to: Vec<u64> },
    /// From here on these are all trees: name and topmost page.
    Roots(Vec<(&'s [u8], u64)>),
    /// The messages from here to the position `until` count together or not at all.
    Batch { until: u64 },
    /// Bytes that belong to no whole message.
    Unreadable { start: usize, end: usize },
}

/// Calls `found` for each item, with the position in the database's history where it stands
/// (`lsn`; none in a segment whose header is damaged).
///
/// - returns: the position where the segment's last whole message ends.
pub(super) fn walk<'s>(segment: &'s [u8], mut found: impl FnMut(Option<u64>, Item<'s>)) -> u64 {
    let base = base_of(segment);
    let number = base.map(|lsn| lsn / SEGMENT_BYTES as u64);
    let (mut at, mut lost_from, mut last) = (SEGMENT_HEAD_BYTES, None, 0);
    while at < segment.len() {
        let Some(message) = message(&segment[at..], number) else {
            // Space that was never written is no loss.
            if segment[at] != 0 && lost_from.is_none() {
                lost_from = Some(at);
            }
            at += 1;
            continue;
        };
        if let Some(start) = lost_from.take() {
            found(None, Item::Unreadable { start, end: at });
        }
        let lsn = base.map(|lsn| lsn + at as u64);
        let body = at + message.head_bytes;
        let end = body + message.body_bytes;
        last = last.max(base.map_or(0, |lsn| lsn + end as u64));
        let bytes = &segment[body..end];
        let read = match message.kind {
            BASE => node(bytes, body, message.page, &mut |item| found(lsn, item)),
            FREE => {
                found(lsn, Item::Page { page: message.page, leads_to: Vec::new() });
                Some(())
            }
            ROOTS => roots(bytes).map(|roots| found(lsn, Item::Roots(roots))),
            UPDATE => set(bytes, body, message.page, &mut |value| found(lsn, Item::Update(value))),
            BATCH => {
                if let Some(bytes) = bytes.first_chunk() {
                    found(lsn, Item::Batch { until: u64::from_le_bytes(*bytes) });
                }
                Some(())
            }
            _ => Some(()),
        };
        // A body that is whole by its checksum and still says nonsense: records may be in it.
        if read.is_none() {
            found(None, Item::Unreadable { start: body, end });
        }
        at = end;
    }
    if let Some(start) = lost_from {
        found(None, Item::Unreadable { start, end: segment.len() });
    }
    last
}

/// Where the segment stands in the database's history, if its header is whole.
fn base_of(segment: &[u8]) -> Option<u64> {
    let head = segment.get(..SEGMENT_HEAD_BYTES)?;
    let (said, rest) = head.split_first_chunk()?;
    if crc32fast::hash(rest) != !u32::from_le_bytes(*said) {
        return None;
    }
    let lsn = i64::from_le_bytes(*rest.first_chunk()?) ^ i64::MAX;
    u64::try_from(lsn).ok()
}

struct Message {
    kind: u8,
    page: u64,
    head_bytes: usize,
    body_bytes: usize,
}

/// The whole message at the start of `bytes`, if there is one.
fn message(bytes: &[u8], segment: Option<u64>) -> Option<Message> {
    let (said, rest) = bytes.split_first_chunk()?;
    let (&kind, mut rest) = rest.split_first()?;
    if !(1..=KIND_MAX).contains(&kind) {
        return None;
    }
    let body_bytes = usize::try_from(number(&mut rest)?).ok()?;
    let in_segment = number(&mut rest)?;
    if segment.is_some_and(|segment| segment != in_segment) {
        return None;
    }
    let page = number(&mut rest)?;
    let head_bytes = bytes.len() - rest.len();
    let body = rest.get(..body_bytes)?;
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(body);
    hasher.update(&bytes[4..head_bytes]);
    (hasher.finalize() == !u32::from_le_bytes(*said)).then_some(Message {
        kind,
        page,
        head_bytes,
        body_bytes,
    })
}

/// One number of one to nine bytes, the smaller the shorter.
pub(super) fn number(bytes: &mut &[u8]) -> Option<u64> {
    let (&first, rest) = bytes.split_first()?;
    let (value, used) = match first {
        0..=240 => (u64::from(first), 0),
        241..=248 => (240 + 256 * (u64::from(first) - 241) + u64::from(*rest.first()?), 1),
        249 => (2288 + 256 * u64::from(*rest.first()?) + u64::from(*rest.get(1)?), 2),
        _ => {
            let used = usize::from(first) - 247;
            let mut wide = [0; 8];
            wide[..used].copy_from_slice(rest.get(..used)?);
            (u64::from_le_bytes(wide), used)
        }
    };
    *bytes = &rest[used..];
    Some(value)
}

fn take<'b>(bytes: &mut &'b [u8]) -> Option<&'b [u8]> {
    let length = usize::try_from(number(bytes)?).ok()?;
    let (taken, rest) = bytes.split_at_checked(length)?;
    *bytes = rest;
    Some(taken)
}

/// Reads a page's base; `body` is where `bytes` stand in the segment.
fn node<'s>(
    bytes: &'s [u8],
    body: usize,
    page: u64,
    found: &mut dyn FnMut(Item<'s>),
) -> Option<()> {
    let whole = bytes.len();
    let mut rest = bytes;
    // The next page of the same level, and one that is being merged into this; 0 for none.
    let mut leads_to = vec![number(&mut rest)?, number(&mut rest)?];
    let (_merging, after) = rest.split_first()?;
    let (&prefix, after) = after.split_first()?;
    rest = after;
    let low = take(&mut rest)?;
    take(&mut rest)?;
    let prefix = low.get(..usize::from(prefix))?;
    let (&kind, after) = rest.split_first()?;
    rest = after;
    let count = usize::try_from(number(&mut rest)?).ok()?;
    let mut suffixes = Vec::new();
    for _ in 0..count {
        suffixes.push(take(&mut rest)?);
    }
    for suffix in suffixes {
        if kind != 0 {
            leads_to.push(number(&mut rest)?);
            continue;
        }
        let value = take(&mut rest)?;
        let start = body + whole - rest.len() - value.len();
        found(Item::Base(Value { page, prefix, suffix, start, bytes: value.len() }));
    }
    leads_to.retain(|&page| page != 0);
    found(Item::Page { page, leads_to });
    Some(())
}

fn roots(mut bytes: &[u8]) -> Option<Vec<(&[u8], u64)>> {
    let mut roots = Vec::new();
    while !bytes.is_empty() {
        roots.push((take(&mut bytes)?, number(&mut bytes)?));
    }
    Some(roots)
}

fn set<'s>(
    bytes: &'s [u8],
    body: usize,
    page: u64,
    found: &mut dyn FnMut(Value<'s>),
) -> Option<()> {
    let whole = bytes.len();
    let (&kind, mut rest) = bytes.split_first()?;
    if kind != 0 {
        return Some(());
    }
    let suffix = take(&mut rest)?;
    let value = take(&mut rest)?;
    let start = body + whole - rest.len() - value.len();
    found(Value { page, prefix: &[], suffix, start, bytes: value.len() });
    Some(())
}
