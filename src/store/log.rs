use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::sync::oneshot;

use crate::events::{Batch, DecodeError, Durable, Head, Header, HeaderError, Record};
use crate::ids::{Digest, Seq, StreamId, TenantId};

/// The port: one total order per stream, no promise across streams. Any backend passes
/// `store::conformance`.
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
    /// checked as it is read in all that needs no key: it works for whoever has none, and for a
    /// person who was erased. A damaged record is one error, and the last item.
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

/// A record as it is kept: whoever has it can compute its digest, and nobody without the person's
/// key can read it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SealedRecord {
    pub header: Header,
    pub digest: Digest,
    /// Header and sealed body, what the digest is over.
    pub frame: Vec<u8>,
}

/// The end of a promise that keeps it.
pub(super) type Promise = oneshot::Sender<Result<Durable, AppendError>>;

/// The promise of an append: a future of [`Durable`] or [`AppendError`].
#[derive(Debug)]
pub struct Pending(oneshot::Receiver<Result<Durable, AppendError>>);

impl Pending {
    /// For backends of this room only: the promise and the end that keeps it.
    pub(super) fn promise() -> (Promise, Pending) {
        let (sender, receiver) = oneshot::channel();
        (sender, Pending(receiver))
    }

    /// A promise that is kept already.
    pub(super) fn kept(result: Result<Durable, AppendError>) -> Pending {
        let (sender, pending) = Pending::promise();
        sender.send(result).expect("the other end is held right here");
        pending
    }

    /// Blocks until the promise is kept; for tools and tests, never inside an actor.
    pub fn wait(self) -> Result<Durable, AppendError> {
        self.0.blocking_recv().unwrap_or(Err(AppendError::Gone))
    }
}

impl Future for Pending {
    type Output = Result<Durable, AppendError>;
    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let received = Pin::new(&mut self.0).poll(context);
        received.map(|result| result.unwrap_or(Err(AppendError::Gone)))
    }
}

/// Milliseconds after which a request may be sent again that met another writer, or a full log.
const RETRY_APPEND_MS: u32 = 100;

/// Why a batch was not appended, or cannot be known to be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AppendError {
    #[error(
        "stream {stream}: expected head {expected}, found {found}; another writer added records"
    )]
    Conflict { stream: StreamId, expected: u64, found: u64 },
    /// Retry later: nothing was appended.
    #[error("the log is busy: {waiting} batches are waiting; try again")]
    Busy { waiting: usize },
    /// The log stopped after an I/O error; only a restart helps. The batch may or may not be there.
    #[error("the log is poisoned and acknowledges nothing until you restart the service: {reason}")]
    Poisoned { reason: String },
    #[error("the batch is too large: {reason}")]
    TooLarge { reason: String },
    #[error("the user of this stream was erased")]
    Erased,
    /// Nothing was appended: the body cannot be sealed.
    #[error("no record of this stream can be sealed: {reason}")]
    Key { reason: String },
    /// The committer is gone; the batch may or may not be there.
    #[error("the log was closed before it answered")]
    Gone,
}

impl AppendError {
    /// Whether it is certain that nothing was appended. Then the writer may go on. Otherwise it must
    /// read the log first.
    pub fn is_certain(&self) -> bool {
        match self {
            AppendError::Busy { .. } | AppendError::TooLarge { .. } => true,
            // Another writer appended: the state that the batch was decided on is old.
            AppendError::Conflict { .. } => false,
            AppendError::Erased | AppendError::Key { .. } => false,
            AppendError::Poisoned { .. } | AppendError::Gone => false,
        }
    }

    /// Whether the log takes nothing more until the service is restarted.
    pub fn is_fatal(&self) -> bool {
        matches!(self, AppendError::Poisoned { .. } | AppendError::Gone)
    }

    /// Milliseconds after which the same request may succeed; none when time does not help.
    pub fn retry_after_ms(&self) -> Option<u32> {
        let passes = matches!(self, AppendError::Busy { .. } | AppendError::Conflict { .. });
        passes.then_some(RETRY_APPEND_MS)
    }
}

/// Why a stream cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReadError {
    #[error("record {seq}: {error}")]
    Header { seq: u64, error: HeaderError },
    #[error("record {seq}: its predecessor is {expected}, but it names {found}")]
    Chain { seq: u64, expected: String, found: String },
    #[error("expected record {expected}, found {found}: records are missing")]
    Gap { expected: u64, found: u64 },
    #[error("record {seq}: its chunks are incomplete: {reason}")]
    Chunks { seq: u64, reason: String },
    #[error("record {seq} cannot be decrypted with this user's key: {reason}")]
    Seal { seq: u64, reason: String },
    #[error("record {seq}: {error}")]
    Decode { seq: u64, error: DecodeError },
    #[error("the user of this stream was erased")]
    Erased,
    #[error("the store cannot be read: {reason}")]
    Store { reason: String },
}
