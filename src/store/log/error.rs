use crate::events::{DecodeError, HeaderError};
use crate::ids::StreamId;
use crate::invariants::Invariant;

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
    #[error(
        "record {seq}: its predecessor is {expected}, but it names {found} ({})",
        Invariant::Chained
    )]
    Chain { seq: u64, expected: String, found: String },
    #[error(
        "expected record {expected}, found {found}: records are missing ({})",
        Invariant::DenseSeq
    )]
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
