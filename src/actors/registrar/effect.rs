use super::OrderError;
use crate::events::{Batch, Event, Head, PersonErased, SegmentClosed};
use crate::ids::{RequestId, Seq, Signature, StreamId, TenantId, Timestamp};
use crate::replay::{CheckpointsError, Through};
use crate::store::{AppendError, Durable, KeyError, ReadError};
use crate::tenancy::{Order, Registry};

/// What is to be done about a tenant.
#[derive(Debug, Clone, PartialEq)]
pub enum TenantWork {
    /// Carry out an order.
    ///
    /// - `gone`: whether the doors know that its key ([`Order::key`]) never comes in again. They
    ///   may have seen its overlap end when no record says so yet.
    Obey { tenant: TenantId, order: Order, gone: bool },
    /// Close the segments of a person's stream that are due. Repeating it closes nothing more.
    Close { stream: StreamId, through: Through },
    /// Sign the tenant's tree as it is.
    Checkpoint { tenant: TenantId },
    /// Close what is due of each stream of the tenant, and sign.
    Sign { tenant: TenantId, through: Through },
    /// Erase a person: destroy their key, drop their minds and snapshots, and say so in the
    /// tenant's stream, signed. Repeating it is harmless. Nobody speaks for the person meanwhile.
    Erase { stream: StreamId },
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub enum Done {
    /// What was recorded; nothing when it was so already.
    Obeyed(Vec<Event>),
    /// So many segments were closed.
    Closed(usize),
    /// The signed checkpoint.
    Signed(String),
    /// As it stands in the tenant's stream.
    Erased(PersonErased),
}

/// What happened to the writer.
pub enum WriterInput<C> {
    /// Somebody asks.
    Asked { work: TenantWork, caller: C },
    /// The end of [`WriterEffect::Append`].
    Appended(Result<Durable, AppendError>),
    /// The end of [`WriterEffect::Fold`].
    Folded(Result<Registry, OrderError>),
    /// The end of [`WriterEffect::MakeSecret`].
    SecretMade(Result<(), KeyError>),
    /// The end of [`WriterEffect::ListStreams`].
    Streams(Result<Vec<StreamId>, ReadError>),
    /// The end of [`WriterEffect::FindDue`].
    Due(Result<Vec<SegmentClosed>, ReadError>),
    /// The end of [`WriterEffect::FindEnd`].
    End(Result<Head, ReadError>),
    /// The end of [`WriterEffect::DestroyKey`].
    KeyDestroyed(Result<(), KeyError>),
    /// The end of [`WriterEffect::SignStatement`].
    StatementSigned(Result<Signature, KeyError>),
    /// The end of [`WriterEffect::KeepCheckpoint`].
    CheckpointKept(Result<String, CheckpointsError>),
}

/// What the writer may use up in one step.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// What the wall clock reads.
    pub at: Timestamp,
    /// A request id that nobody used.
    pub fresh: RequestId,
}

/// What the writer wants done.
pub enum WriterEffect<C> {
    /// Append to a tenant's own stream; the end is [`WriterInput::Appended`].
    Append { stream: StreamId, after: Head, batch: Batch },
    /// Fold a tenant's own stream; the end is [`WriterInput::Folded`].
    Fold { tenant: TenantId },
    /// Make a new tenant's secret; the end is [`WriterInput::SecretMade`].
    MakeSecret { tenant: TenantId },
    /// List a tenant's streams; the end is [`WriterInput::Streams`].
    ListStreams { tenant: TenantId },
    /// Find the segments of a stream that are due; the end is [`WriterInput::Due`].
    FindDue { stream: StreamId, from: Seq, through: Through },
    /// Walk to the end of a stream, without a key; the end is [`WriterInput::End`].
    FindEnd { stream: StreamId },
    /// Destroy a person's key, minds and snapshots; the end is [`WriterInput::KeyDestroyed`].
    DestroyKey { stream: StreamId },
    /// Sign with a tenant's secret; the end is [`WriterInput::StatementSigned`].
    SignStatement { tenant: TenantId, statement: Vec<u8> },
    /// Sign the tree of [`TenantWriter::registry`](super::TenantWriter::registry) and keep the
    /// checkpoint; the end is [`WriterInput::CheckpointKept`].
    KeepCheckpoint { tenant: TenantId },
    /// From now on the doors go by [`TenantWriter::registry`](super::TenantWriter::registry).
    TellDoors { tenant: TenantId },
    /// Tell the feed that these records are durable. Comes after the doors know: whoever's key was
    /// taken back with them gets no record any more.
    Publish { stream: StreamId, durable: Durable },
    /// Answer a caller. Each caller is answered once.
    Answer { caller: C, outcome: Result<Done, OrderError> },
    /// The log takes nothing more: the service ends, for this reason.
    Fatal(String),
}
