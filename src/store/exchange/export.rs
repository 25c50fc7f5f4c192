//! One tenant in two files: everything sealed in one, and the secret that opens it in the other.
//!
//! The first file is a row of frames, big-endian, numbered from 1 in messages:
//!
//! | bytes | field |
//! |---|---|
//! | 4 | magic `APX1` |
//! | 1 | kind |
//! | 4 | length of the payload |
//! | 4 | CRC-32 (IEEE) over kind, length and payload |
//!
//! Payloads by kind: 1 *tenant*: its name. 2 *person*: stream key (16), number and digest of the last
//! record (8, 32), then the file of the wrapped key, empty for a person who was erased. 3 *record*: a
//! framed record of the person before it, sealed as it stands in the log. 4 *end*: the number of frames
//! before it (8) and BLAKE3 over all their bytes (32).
//!
//! The second file, `<first>.key`, is the tenant's secret as it stands in `keys/<tenant>.key`, mode
//! 0600. Without it the first shows who many people there are, how much they said and when, and no
//! word; with it, everything.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use super::rescue::{Rescue, RescueError, StreamFound};
use crate::events::Head;
use crate::ids::{Digest, StreamKey, TenantId};
use crate::limits::RECORD_BYTES_MAX;
use crate::store::disk::files::{beside, create, sync_dir, write_whole};
use crate::store::sealing::keys::user_file;

const MAGIC: &[u8; 4] = b"APX1";
const HEAD_BYTES: usize = 4 + 1 + 4 + 4;
/// More than any record or key file has.
const PAYLOAD_BYTES_MAX: usize = RECORD_BYTES_MAX + 64 * 1024;

const SHORT: &str = "the file ends in the middle of it";

const TENANT: u8 = 1;
const PERSON: u8 = 2;
const RECORD: u8 = 3;
const END: u8 = 4;

/// What an export holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exported {
    pub people: u64,
    pub records: u64,
}

/// Why a tenant was not exported; no file is left behind.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error(transparent)]
    Source(#[from] RescueError),
    #[error("there are no records of tenant {tenant}")]
    Empty { tenant: TenantId },
    #[error(
        "stream {}: lost: {}; nothing was exported: run `apprentice salvage` first, then export its \
         result", found.stream, found.losses[0]
    )]
    Damaged { found: Box<StreamFound> },
    #[error("the heads file is damaged ({reason}); run `apprentice salvage` first")]
    Heads { reason: String },
    #[error("{path} cannot be written: {reason}")]
    Io { path: String, reason: String },
    #[error("{path} already exists; name another file")]
    Occupied { path: String },
}

/// Where the secret of an export is kept by default.
pub fn key_file_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".key");
    PathBuf::from(name)
}

/// Writes the tenant of the closed data directory `dir` to `path` and its secret to [`key_file_of`]
/// that; durable on return. Reads the directory without opening or changing it.
pub fn export(dir: &Path, tenant: &TenantId, path: &Path) -> Result<Exported, ExportError> {
    let failed = |path: &Path, error: &dyn std::fmt::Display| ExportError::Io {
        path: path.display().to_string(),
        reason: error.to_string(),
    };
    let key_path = key_file_of(path);
    if let Some(occupied) = [path, &*key_path].into_iter().find(|path| path.exists()) {
        return Err(ExportError::Occupied { path: occupied.display().to_string() });
    }
    let rescue = Rescue::open(dir)?;
    if let Some(reason) = rescue.heads_damage() {
        return Err(ExportError::Heads { reason: reason.to_owned() });
    }
    let (mut streams, _) = rescue.streams();
    streams.retain(|stream| stream.tenant == *tenant);
    // First how far each goes, then its records: only one of them is in memory at a time.
    let mut whole = Vec::new();
    for stream in streams {
        let found = rescue.walk(&stream, |_, _| Ok::<(), ExportError>(()))?;
        if !found.losses.is_empty() {
            return Err(ExportError::Damaged { found: Box::new(found) });
        }
        whole.extend((found.valid != Head::EMPTY).then_some((stream, found.valid)));
    }
    if whole.is_empty() {
        return Err(ExportError::Empty { tenant: tenant.clone() });
    }
    let fresh = beside(path);
    let file = create(&fresh).map_err(|error| failed(&fresh, &error))?;
    let mut out =
        ExportWriter { out: BufWriter::new(file), hasher: blake3::Hasher::new(), frames: 0 };
    let mut exported = Exported { people: 0, records: 0 };
    let written = (|| {
        out.frame(TENANT, &[tenant.as_str().as_bytes()]).map_err(|e| failed(path, &e))?;
        for (stream, head) in whole {
            let key_path = dir.join("keys").join(user_file(&stream));
            let key = match fs::read(&key_path) {
                Ok(key) => key,
                Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
                Err(error) => return Err(failed(&key_path, &error)),
            };
            let (seq, digest) = (head.seq.to_be_bytes(), head.digest.0);
            out.frame(PERSON, &[&stream.key.0, &seq, &digest, &key])
                .map_err(|e| failed(path, &e))?;
            rescue.walk(&stream, |_, frame| {
                out.frame(RECORD, &[frame]).map_err(|error| failed(path, &error))
            })?;
            exported.people += u64::from(!stream.is_tenants());
            exported.records += head.seq;
        }
        let (frames, digest) = (out.frames.to_be_bytes(), *out.hasher.finalize().as_bytes());
        out.frame(END, &[&frames, &digest]).map_err(|error| failed(path, &error))?;
        let secret = dir.join("keys").join(format!("{tenant}.key"));
        let secret = fs::read(&secret).map_err(|error| failed(&secret, &error))?;
        let secret = zeroize::Zeroizing::new(secret);
        let done = out.out.into_inner().map_err(io::IntoInnerError::into_error);
        done.and_then(|file| file.sync_all())
            .and_then(|()| write_whole(&key_path, &secret))
            .and_then(|()| fs::rename(&fresh, path))
            .and_then(|()| sync_dir(directory_of(path)))
            .map_err(|error| failed(path, &error))
    })();
    if written.is_err() {
        // Half an export is of no use to anybody.
        let _ = fs::remove_file(&fresh);
    }
    written.map(|()| exported)
}

fn directory_of(path: &Path) -> &Path {
    path.parent().filter(|up| !up.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

struct ExportWriter {
    out: BufWriter<File>,
    hasher: blake3::Hasher,
    frames: u64,
}

impl ExportWriter {
    fn frame(&mut self, kind: u8, parts: &[&[u8]]) -> io::Result<()> {
        let length: usize = parts.iter().map(|part| part.len()).sum();
        let length = u32::try_from(length).expect("a record is below 4 GiB (limits)").to_be_bytes();
        let checksum = checksum(kind, length, parts).to_be_bytes();
        let head: [&[u8]; 4] = [MAGIC, &[kind], &length, &checksum];
        for bytes in head.iter().chain(parts) {
            self.hasher.update(bytes);
            self.out.write_all(bytes)?;
        }
        self.frames += 1;
        Ok(())
    }
}

fn checksum(kind: u8, length: [u8; 4], parts: &[&[u8]]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&[kind]);
    hasher.update(&length);
    parts.iter().for_each(|part| hasher.update(part));
    hasher.finalize()
}

/// What a frame of an export says.
pub(in crate::store) enum ExportFrame {
    Tenant(TenantId),
    /// The key file's bytes; none for a person who was erased.
    Person {
        key: StreamKey,
        head: Head,
        wrapped: Option<Vec<u8>>,
    },
    Record(Vec<u8>),
    End,
}

/// What is wrong with a file: the number of the frame where it shows, and a sentence.
pub(in crate::store) type BadFrame = (u64, String);

/// Reads an export frame by frame, proving each.
pub(in crate::store) struct ExportReader<R> {
    input: R,
    hasher: blake3::Hasher,
    pub(in crate::store) frames: u64,
}

impl ExportReader<BufReader<File>> {
    pub(in crate::store) fn open(path: &Path) -> io::Result<ExportReader<BufReader<File>>> {
        Ok(ExportReader::of(BufReader::new(File::open(path)?)))
    }
}

impl<R: Read> ExportReader<R> {
    pub(in crate::store) fn of(input: R) -> ExportReader<R> {
        ExportReader { input, hasher: blake3::Hasher::new(), frames: 0 }
    }

    /// The next frame. After [`ExportFrame::End`] the file must end.
    pub(in crate::store) fn next(&mut self) -> Result<ExportFrame, BadFrame> {
        let number = self.frames + 1;
        self.read().map_err(|reason| (number, reason)).inspect(|_| self.frames = number)
    }

    fn read(&mut self) -> Result<ExportFrame, String> {
        let mut head = [0; HEAD_BYTES];
        self.fill(&mut head)?;
        let kind = head[4];
        let length: [u8; 4] = *head[5..].first_chunk().expect("a head has 13 bytes");
        let said = u32::from_be_bytes(*head[9..].first_chunk().expect("a head has 13 bytes"));
        let bytes = usize::try_from(u32::from_be_bytes(length)).unwrap_or(usize::MAX);
        if &head[..4] != MAGIC || bytes > PAYLOAD_BYTES_MAX {
            return Err("it does not begin like a frame".to_owned());
        }
        // What the length says is believed as far as there are bytes, and no memory is taken before.
        let mut payload = Vec::new();
        let read = self.input.by_ref().take(bytes as u64).read_to_end(&mut payload);
        if read.map_err(|error| error.to_string())? < bytes {
            return Err(SHORT.to_owned());
        }
        let found = checksum(kind, length, &[&payload]);
        if found != said {
            return Err(format!("its checksum is {found:08x}, but it says {said:08x}"));
        }
        if kind == END {
            return self.end(&payload);
        }
        self.hasher.update(&head);
        self.hasher.update(&payload);
        frame_of(kind, payload).ok_or_else(|| "this version does not know its kind".to_owned())
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), String> {
        self.input.read_exact(bytes).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => SHORT.to_owned(),
            _ => error.to_string(),
        })
    }

    fn end(&mut self, payload: &[u8]) -> Result<ExportFrame, String> {
        let digest = *self.hasher.finalize().as_bytes();
        if payload != [&self.frames.to_be_bytes()[..], &digest].concat() {
            return Err("the frames before it were changed".to_owned());
        }
        match self.input.read(&mut [0]) {
            Ok(0) => Ok(ExportFrame::End),
            Ok(_) => Err("there are bytes after the end".to_owned()),
            Err(error) => Err(error.to_string()),
        }
    }
}

fn frame_of(kind: u8, payload: Vec<u8>) -> Option<ExportFrame> {
    match kind {
        TENANT => {
            let name = std::str::from_utf8(&payload).ok()?;
            Some(ExportFrame::Tenant(TenantId::new(name).ok()?))
        }
        PERSON => {
            let (key, rest) = payload.split_first_chunk()?;
            let (seq, rest) = rest.split_first_chunk()?;
            let (digest, wrapped) = rest.split_first_chunk()?;
            let head = Head { seq: u64::from_be_bytes(*seq), digest: Digest(*digest) };
            let wrapped = (!wrapped.is_empty()).then(|| wrapped.to_vec());
            Some(ExportFrame::Person { key: StreamKey(*key), head, wrapped })
        }
        RECORD => Some(ExportFrame::Record(payload)),
        _ => None,
    }
}
