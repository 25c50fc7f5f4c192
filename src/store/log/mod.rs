//! The port that a log implements, the receipt for an append, and where streams end.

mod error;
pub(in crate::store) mod heads;
mod pending;
mod receipt;

pub use self::error::{AppendError, ReadError};
pub use self::pending::Pending;
pub(in crate::store) use self::pending::Promise;
pub use self::receipt::Durable;

use crate::events::{Batch, Head, Header, Record};
use crate::ids::{Digest, Seq, StreamId, TenantId};

/// The port: one total order per stream, no promise across streams. Any backend passes
/// `store::testing::conformance`.
pub trait EventLog: Send + Sync {
    /// Appends `batch` to `stream` if its head is still `after`. Returns at once; the promise
    /// resolves when the batch is durable (or certainly not appended).
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending;

    /// The records from `from` on, in order, as they stand now. Each is checked as it is read:
    /// checksum, dense sequence, chain, decoding. A damaged record is one error, and the last item.
    fn read<'a>(
        &'a self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError>;

    /// Where the stream ends; [`Head::EMPTY`] for one that does not exist.
    fn head(&self, stream: &StreamId) -> Result<Head, ReadError>;

    /// The streams of a tenant that have at least one record, in the order of their keys.
    fn streams(&self, tenant: &TenantId) -> Result<Vec<StreamId>, ReadError>;

    /// The tenants that have at least one stream, in the order of their names.
    fn tenants(&self) -> Result<Vec<TenantId>, ReadError>;

    /// The records from `from` on, sealed as they are kept, in order, as they stand now. Each is
    /// checked as it is read in all that needs no key: it also works without keys, and for an
    /// erased person. A damaged record is one error, and the last item.
    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError>;

    /// Walks a stream without opening a body: checksums, dense sequence, chain. What is left to
    /// check of a person who was erased.
    ///
    /// - returns: the last record.
    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError>;

    /// Bytes of all framed records of a tenant that are durable, those of its own stream too, and
    /// [`crate::limits::KEY_FILE_BYTES`] for the key of each stream. The first call may read all of
    /// them; later ones cost nothing.
    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError>;
}

/// What [`EventLog::sealed`] gives.
pub type SealedRecords<'a> = Box<dyn Iterator<Item = Result<SealedRecord, ReadError>> + 'a>;

/// A record as it is kept. Its digest can be computed from it; its content needs the person's key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SealedRecord {
    pub header: Header,
    pub digest: Digest,
    /// Header and sealed body, what the digest is over.
    pub frame: Vec<u8>,
}
