//! The heads file: where each stream ends, kept outside the database.
//!
//! A hash chain cannot see that its tail is gone. After each group of appends the new heads are
//! written here and synced before anything is acknowledged; at the next start the database must
//! reach at least as far.
//!
//! A file is one base frame, then a frame per group, then zeros (space made in advance, so that a
//! sync need not wait for a new file length). A frame, big-endian:
//!
//! | bytes | field |
//! |---|---|
//! | 4 | magic `APH1` |
//! | 1 | 0 for the base, 1 for a group |
//! | 4 | length of the payload |
//! | 4 | CRC-32 (IEEE) over kind, length and payload |
//!
//! The payload is a list of: length of the tenant's name (1 byte), the name, stream key (16),
//! sequence number (8), digest (32). The base is written beside the file and renamed over it, so
//! it is never torn; the last group may be, after a crash, and was then never acknowledged.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use crate::events::Head;
use crate::ids::{Digest, StreamId, StreamKey, TenantId, WithinTenant};
use crate::store::disk::files::{beside, create, sync_dir};

/// Where each stream ends.
pub(in crate::store) type Heads = BTreeMap<TenantId, WithinTenant<Head>>;

const MAGIC: &[u8; 4] = b"APH1";
const FRAME_HEAD_BYTES: usize = 4 + 1 + 4 + 4;
const BASE: u8 = 0;
const GROUP: u8 = 1;
/// Space made in advance.
const RESERVE_BYTES: u64 = 256 * 1024;
/// Below this length a file is not worth rewriting.
const COMPACT_BYTES_MIN: u64 = 4 * 1024 * 1024;

/// The heads file of an open log, appended to by the committer only.
pub(in crate::store) struct HeadsFile {
    path: PathBuf,
    file: File,
    /// Where the next frame goes.
    end: u64,
    reserved: u64,
    base_bytes: u64,
}

/// What a heads file says.
pub(in crate::store) struct HeadsRead {
    pub heads: Heads,
    /// A sentence when a part of the file cannot be trusted.
    pub damage: Option<String>,
}

impl HeadsFile {
    /// Writes a new file that says `heads`, in place of any that is there.
    pub(in crate::store) fn replace(path: &Path, heads: &Heads) -> io::Result<HeadsFile> {
        let entries = heads.iter().flat_map(|(tenant, streams)| {
            streams.iter().map(move |(key, head)| (tenant, key, head))
        });
        let base = frame(BASE, entries);
        let fresh = beside(path);
        let mut file = create(&fresh)?;
        file.write_all(&base)?;
        let end = base.len() as u64;
        let reserved = reserve(&file, end)?;
        file.sync_all()?;
        fs::rename(&fresh, path)?;
        sync_dir(path.parent().expect("the heads file stands in a directory"))?;
        Ok(HeadsFile { path: path.to_owned(), file, end, reserved, base_bytes: end })
    }

    /// Appends the heads of one group; durable on return.
    pub(in crate::store) fn append(
        &mut self,
        changed: &BTreeMap<StreamId, Head>,
    ) -> io::Result<()> {
        let entries = changed.iter().map(|(stream, head)| (&stream.tenant, stream.key, head));
        let bytes = frame(GROUP, entries);
        let end = self.end + bytes.len() as u64;
        if end > self.reserved {
            self.reserved = reserve(&self.file, end)?;
            self.file.sync_all()?;
        }
        self.file.write_all_at(&bytes, self.end)?;
        self.file.sync_data()?;
        self.end = end;
        Ok(())
    }

    /// Rewrites the file when most of it is history.
    pub(in crate::store) fn compact_if_long(&mut self, heads: &Heads) -> io::Result<()> {
        if self.end > COMPACT_BYTES_MIN.max(4 * self.base_bytes) {
            *self = HeadsFile::replace(&self.path, heads)?;
        }
        Ok(())
    }

    /// None when there is no file.
    pub(in crate::store) fn read(path: &Path) -> io::Result<Option<HeadsRead>> {
        match fs::read(path) {
            Ok(bytes) => Ok(Some(parse(&bytes))),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }
}

fn reserve(file: &File, end: u64) -> io::Result<u64> {
    let reserved = (end / RESERVE_BYTES + 1) * RESERVE_BYTES;
    let mut at = end;
    while at < reserved {
        let zeros = [0; 4096];
        let count = (reserved - at).min(zeros.len() as u64);
        file.write_all_at(&zeros[..usize::try_from(count).expect("at most 4096")], at)?;
        at += count;
    }
    Ok(reserved)
}

fn frame<'a>(
    kind: u8,
    entries: impl Iterator<Item = (&'a TenantId, StreamKey, &'a Head)>,
) -> Vec<u8> {
    let mut payload = Vec::new();
    for (tenant, key, head) in entries {
        let name = tenant.as_str().as_bytes();
        payload.push(u8::try_from(name.len()).expect("a tenant's name is short (limits)"));
        payload.extend_from_slice(name);
        payload.extend_from_slice(&key.0);
        payload.extend_from_slice(&head.seq.to_be_bytes());
        payload.extend_from_slice(&head.digest.0);
    }
    let length = u32::try_from(payload.len()).expect("fewer than fifty million streams");
    let mut bytes = Vec::with_capacity(FRAME_HEAD_BYTES + payload.len());
    bytes.extend_from_slice(MAGIC);
    bytes.push(kind);
    bytes.extend_from_slice(&length.to_be_bytes());
    bytes.extend_from_slice(&checksum(kind, length, &payload).to_be_bytes());
    bytes.extend_from_slice(&payload);
    bytes
}

fn checksum(kind: u8, length: u32, payload: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&[kind]);
    hasher.update(&length.to_be_bytes());
    hasher.update(payload);
    hasher.finalize()
}

pub(in crate::store) fn parse(bytes: &[u8]) -> HeadsRead {
    let mut read = HeadsRead { heads: Heads::new(), damage: None };
    let mut at = 0;
    let mut expected = BASE;
    while let Some((kind, payload)) = frame_at(&bytes[at..]) {
        if kind != expected || fill(&mut read.heads, payload).is_none() {
            break;
        }
        expected = GROUP;
        at += FRAME_HEAD_BYTES + payload.len();
    }
    let rest = &bytes[at..];
    if at == 0 {
        read.damage = Some("its base frame is damaged".to_owned());
    } else if let Some(later) = (1..rest.len()).find(|&start| frame_at(&rest[start..]).is_some()) {
        // A group is only written when the one before it is durable: this is no torn write.
        let (from, to) = (at, at + later);
        read.damage = Some(format!("the bytes {from} to {to} are damaged"));
    }
    read
}

/// The frame at the start of `bytes`, if there is a whole one.
fn frame_at(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (&[kind], rest) = rest.split_first_chunk()?;
    let (length, rest) = rest.split_first_chunk()?;
    let (said, rest) = rest.split_first_chunk()?;
    let length = u32::from_be_bytes(*length);
    let payload = rest.get(..usize::try_from(length).ok()?)?;
    (checksum(kind, length, payload) == u32::from_be_bytes(*said)).then_some((kind, payload))
}

fn fill(heads: &mut Heads, mut payload: &[u8]) -> Option<()> {
    while let Some((&length, rest)) = payload.split_first() {
        let (name, rest) = rest.split_at_checked(usize::from(length))?;
        let (key, rest) = rest.split_first_chunk()?;
        let (seq, rest) = rest.split_first_chunk()?;
        let (digest, rest) = rest.split_first_chunk()?;
        let tenant = TenantId::new(std::str::from_utf8(name).ok()?).ok()?;
        let head = Head { seq: u64::from_be_bytes(*seq), digest: Digest(*digest) };
        heads.entry(tenant).or_default().insert(StreamKey(*key), head);
        payload = rest;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(key: u8, seq: u64) -> BTreeMap<StreamId, Head> {
        let stream = StreamId { tenant: TenantId::local(), key: StreamKey([key; 16]) };
        BTreeMap::from([(stream, Head { seq, digest: Digest([key; 32]) })])
    }

    fn seqs(read: &HeadsRead) -> Vec<u64> {
        read.heads.values().flat_map(|streams| streams.values().map(|head| head.seq)).collect()
    }

    fn written(dir: &Path) -> (PathBuf, HeadsFile) {
        let path = dir.join("HEADS");
        let mut file = HeadsFile::replace(&path, &Heads::new()).unwrap();
        for (key, seq) in [(1, 3), (2, 1), (1, 4)] {
            file.append(&group(key, seq)).unwrap();
        }
        (path, file)
    }

    #[test]
    fn the_latest_head_of_each_stream_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let (path, mut file) = written(dir.path());
        for seq in 5..50 {
            file.append(&group(1, seq)).unwrap();
            if seq == 20 {
                let heads = HeadsFile::read(&path).unwrap().unwrap().heads;
                file.end = u64::MAX;
                file.compact_if_long(&heads).unwrap();
            }
        }
        let read = HeadsFile::read(&path).unwrap().unwrap();
        assert_eq!((seqs(&read), read.damage), (vec![49, 1], None));
    }

    #[test]
    fn a_torn_last_group_is_no_damage_and_a_damaged_earlier_one_is() {
        let dir = tempfile::tempdir().unwrap();
        let (path, file) = written(dir.path());
        let end = usize::try_from(file.end).unwrap();
        let whole = fs::read(&path).unwrap();
        let group_bytes =
            frame(GROUP, group(1, 4).iter().map(|(s, h)| (&s.tenant, s.key, h))).len();
        for cut in 1..group_bytes {
            let torn = parse(&whole[..end - cut]);
            assert_eq!((seqs(&torn), torn.damage), (vec![3, 1], None), "{cut} bytes fewer");
        }
        // One bit in turn of base and all groups but the last: always noticed.
        for bit in 0..(end - group_bytes) * 8 {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(parse(&bytes).damage.is_some(), "bit {bit}");
        }
        assert!(parse(b"").damage.is_some());
    }
}
