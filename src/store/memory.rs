use std::collections::BTreeMap;
use std::sync::{Arc, RwLock};

use crate::events::{Batch, Head, Header, Record};
use crate::ids::{Seq, StreamId, StreamKey, TenantId, WithinTenant};
use crate::store::checks;
use crate::store::log::{AppendError, Durable, EventLog, Pending, ReadError, SealedRecords};
use crate::store::sealing::keys::Keys;
use crate::store::sealing::seal::{Draft, Walk, before};

/// The log without a disk: the same bytes, the same checks, and its promises are kept at once.
///
/// *Durable* here means: as long as the value lives.
pub struct MemoryLog {
    keys: Arc<Keys>,
    streams: RwLock<BTreeMap<TenantId, WithinTenant<Stream>>>,
    /// Of all frames of a tenant.
    bytes: RwLock<BTreeMap<TenantId, u64>>,
}

struct Stream {
    head: Head,
    frames: Frames,
}

type Frames = Vec<Arc<[u8]>>;

impl Stream {
    /// The frames from record `from` on as they stand now, and a walk that begins there. They are
    /// shared, so a later append does not show up here.
    fn from(&self, key: StreamKey, from: Seq) -> Result<(Walk, Frames), ReadError> {
        let start = usize::try_from(from.get() - 1).unwrap_or(usize::MAX).min(self.frames.len());
        let last = match before(from).and_then(|_| self.frames[..start].last()) {
            None => Head::EMPTY,
            Some(frame) => {
                let seq = start as u64;
                let (header, _, digest) =
                    Header::unframe(frame).map_err(|error| ReadError::Header { seq, error })?;
                Head { seq: header.seq.get(), digest }
            }
        };
        Ok((Walk::after(key, last), self.frames[start..].to_vec()))
    }
}

impl MemoryLog {
    pub fn new(keys: Arc<Keys>) -> MemoryLog {
        MemoryLog { keys, streams: RwLock::default(), bytes: RwLock::default() }
    }

    fn append_now(
        &self,
        stream: &StreamId,
        after: Head,
        batch: Batch,
    ) -> Result<Durable, AppendError> {
        let draft = Draft::encode(batch)?;
        let mut streams = self.streams.write().expect("no append panics while it holds the log");
        let found = streams
            .get(&stream.tenant)
            .and_then(|tenant| tenant.get(&stream.key))
            .map_or(Head::EMPTY, |stream| stream.head);
        checks::head(stream, after, found)?;
        let key = checks::key_to_append(&self.keys, stream, found)?;
        let sealed = draft.seal(&key, self.keys.entropy(), stream.key, after);
        if !sealed.frames.is_empty() {
            let tenant = streams.entry(stream.tenant.clone()).or_default();
            let kept = tenant
                .entry(stream.key)
                .or_insert_with(|| Stream { head: Head::EMPTY, frames: Vec::new() });
            kept.head = sealed.head;
            let mut bytes = self.bytes.write().expect("no append panics while it holds the count");
            *bytes.entry(stream.tenant.clone()).or_default() +=
                sealed.bytes() + checks::key_bytes(found);
            kept.frames.extend(sealed.frames.into_iter().map(Arc::from));
        }
        Ok(Durable::mint(sealed.records, sealed.head))
    }
}

impl EventLog for MemoryLog {
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending {
        Pending::kept(self.append_now(stream, after, batch))
    }

    fn read<'a>(
        &'a self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError> {
        let streams = self.streams.read().expect("no append panics while it holds the log");
        let kept = streams.get(&stream.tenant).and_then(|tenant| tenant.get(&stream.key));
        let Some(kept) = kept else { return Ok(Box::new(std::iter::empty())) };
        let key = checks::key_to_read(&self.keys, stream)?;
        let (mut walk, frames) = kept.from(stream.key, from)?;
        let mut failed = false;
        Ok(Box::new(frames.into_iter().map_while(move |frame| {
            if failed {
                return None;
            }
            let record = walk.open(&key, &frame);
            failed = record.is_err();
            Some(record)
        })))
    }

    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError> {
        let streams = self.streams.read().expect("no append panics while it holds the log");
        let kept = streams.get(&stream.tenant).and_then(|tenant| tenant.get(&stream.key));
        let Some(kept) = kept else { return Ok(Box::new(std::iter::empty())) };
        let (mut walk, frames) = kept.from(stream.key, from)?;
        let mut failed = false;
        Ok(Box::new(frames.into_iter().map_while(move |frame| {
            (!failed).then(|| walk.sealed(frame.to_vec())).inspect(|read| failed = read.is_err())
        })))
    }

    fn head(&self, stream: &StreamId) -> Result<Head, ReadError> {
        let streams = self.streams.read().expect("no append panics while it holds the log");
        let kept = streams.get(&stream.tenant).and_then(|tenant| tenant.get(&stream.key));
        Ok(kept.map_or(Head::EMPTY, |stream| stream.head))
    }

    fn streams(&self, tenant: &TenantId) -> Result<Vec<StreamId>, ReadError> {
        let streams = self.streams.read().expect("no append panics while it holds the log");
        let keys = streams.get(tenant).into_iter().flat_map(WithinTenant::keys);
        Ok(keys.map(|key| StreamId { tenant: tenant.clone(), key }).collect())
    }

    fn tenants(&self) -> Result<Vec<TenantId>, ReadError> {
        let streams = self.streams.read().expect("no append panics while it holds the log");
        Ok(streams.keys().cloned().collect())
    }

    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError> {
        let streams = self.streams.read().expect("no append panics while it holds the log");
        let kept = streams.get(&stream.tenant).and_then(|tenant| tenant.get(&stream.key));
        let mut walk = Walk::after(stream.key, Head::EMPTY);
        for frame in kept.iter().flat_map(|stream| &stream.frames) {
            walk.step(frame)?;
        }
        Ok(walk.last())
    }

    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError> {
        let bytes = self.bytes.read().expect("no append panics while it holds the count");
        Ok(bytes.get(tenant).copied().unwrap_or(0))
    }
}
