//! A log whose reading can be interrupted, as by a crash during recovery.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use apprentice::events::{Batch, Head, Record};
use apprentice::ids::{Seq, StreamId, TenantId};
use apprentice::store::{EventLog, FaultyLog, Pending, ReadError, SealedRecords};

const NEVER: usize = usize::MAX;

pub struct Disturbed {
    inner: Arc<FaultyLog>,
    /// Records that may still be read before the reader dies.
    left: AtomicUsize,
}

impl Disturbed {
    pub fn new(inner: Arc<FaultyLog>) -> Disturbed {
        Disturbed { inner, left: AtomicUsize::new(NEVER) }
    }

    /// The reader dies after `records` more. None: it never dies.
    pub fn die_after(&self, records: Option<usize>) {
        self.left.store(records.unwrap_or(NEVER), Ordering::Relaxed);
    }

    /// True if the log's own crash has come.
    pub fn is_down(&self) -> bool {
        self.inner.crashed()
    }

    fn read_one(&self) -> Result<(), ReadError> {
        match self.left.load(Ordering::Relaxed) {
            NEVER => Ok(()),
            0 => Err(ReadError::Store { reason: "the reader died".to_owned() }),
            left => {
                self.left.store(left - 1, Ordering::Relaxed);
                Ok(())
            }
        }
    }
}

impl EventLog for Disturbed {
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending {
        self.inner.append(stream, after, batch)
    }

    fn read<'a>(
        &'a self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError> {
        let records = self.inner.read(stream, from)?;
        Ok(Box::new(records.map(|record| self.read_one().and(record))))
    }

    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError> {
        let records = self.inner.sealed(stream, from)?;
        Ok(Box::new(records.map(|record| self.read_one().and(record))))
    }

    fn head(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.inner.head(stream)
    }

    fn tenants(&self) -> Result<Vec<TenantId>, ReadError> {
        self.inner.tenants()
    }

    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.inner.walk(stream)
    }

    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError> {
        self.inner.sealed_bytes(tenant)
    }

    fn streams(&self, tenant: &TenantId) -> Result<Vec<StreamId>, ReadError> {
        self.inner.streams(tenant)
    }
}
