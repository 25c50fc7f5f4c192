use apprentice_core::ids::RequestId;
use apprentice_core::plain;
use apprentice_core::world::View;
use serde::{Deserialize, Serialize};

use super::{
    ErasedView, Heads, KnownExemplar, Ordered, PlainRecords, Reply, SealedRecords, Status,
    TenantView, Told,
};

/// Lists each response once: its variant, the field of the map that carries it, and its name in a
/// message when another one was expected.
macro_rules! responses {
    ($($(#[$doc:meta])* $variant:ident($body:ty) in $field:ident, $name:literal;)*) => {
        /// What the service answers.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Response {
            $($(#[$doc])* $variant($body),)*
        }

        /// A response as it travels: the id of the request, and exactly one of the other fields.
        #[derive(Debug, Default, Serialize, Deserialize)]
        #[serde(default)]
        pub(crate) struct ResponseMap {
            pub v: u64,
            #[serde(skip_serializing_if = "Option::is_none")]
            pub id: Option<RequestId>,
            $(#[serde(skip_serializing_if = "Option::is_none")] $field: Option<$body>,)*
        }

        impl ResponseMap {
            pub fn new(v: u64, id: RequestId, response: Response) -> ResponseMap {
                let mut map = ResponseMap { v, id: Some(id), ..ResponseMap::default() };
                match response {
                    $(Response::$variant(body) => map.$field = Some(body),)*
                }
                map
            }

            /// What it carries, in the order of the list: exactly one response, if it is correct.
            pub fn carried(self) -> impl Iterator<Item = Response> {
                [$(self.$field.map(Response::$variant),)*].into_iter().flatten()
            }
        }

        impl Response {
            /// What kind of answer it is, for a message.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Response::$variant(_) => $name,)*
                }
            }
        }
    };
}

responses! {
    /// The command was recorded; this is what it led to.
    Reply(Reply) in reply, "a reply";
    /// Phase, goal, progress, actions so far and what may be taught.
    Status(Status) in status, "a status";
    /// What the robot sees and holds.
    Look(View) in look, "a look";
    /// The exemplars that answers come from.
    Known(Vec<KnownExemplar>) in known, "exemplars";
    /// The training is over, or the time to wait.
    Waited(Waited) in waited, "the end of a wait";
    /// Which service this is.
    Hello(Hello) in hello, "a hello";
    /// Where the feed is.
    Feed(FeedView) in feed, "where a feed is";
    /// Where streams end.
    Heads(Heads) in heads, "heads of streams";
    /// Records, encrypted.
    Records(SealedRecords) in records, "records";
    /// Records, decrypted.
    PlainRecords(PlainRecords) in plain_records, "records";
    /// An order was carried out.
    Ordered(Ordered) in ordered, "the end of an order";
    /// The tenants that the operator may see.
    Tenants(Vec<TenantView>) in tenants, "tenants";
    /// A person was erased.
    Erased(ErasedView) in erased, "an erasure";
    /// Declined; nothing was recorded.
    Rejected(Rejected) in rejected, "a refusal";
    /// Not now; the same request may be sent again.
    Busy(Busy) in busy, "a refusal";
    /// The tenant is over a quota; nothing was recorded.
    QuotaExceeded(QuotaExceeded) in quota_exceeded, "a refusal";
    /// Cannot be answered; sending it again does not help.
    Error(Failed) in error, "a refusal";
}

/// The answer to [`super::PersonAsk::Wait`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Waited {
    /// The status at this moment.
    pub status: Status,
    /// How the last training ended: `learned` or `learning_failed`. Empty if none ended since this
    /// person was last woken; then the status names the present mind.
    pub told: Vec<Told>,
}

/// The answer to [`ServiceAsk::Hello`](super::ServiceAsk::Hello): which service this is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// `apprentice`.
    pub service: String,
    /// The version of the program.
    pub version: String,
    /// The name of the world, as in the records.
    pub domain: String,
    /// The recipe that new people start with.
    pub recipe: String,
}

/// The answer to [`ServiceAsk::Feed`](super::ServiceAsk::Feed): where new records are published.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FeedView {
    /// Names this run of the feed. Each run numbers its messages from 1.
    pub start: RequestId,
    /// The endpoint of encrypted records; none while the feed is closed.
    pub sealed: Option<String>,
    /// The endpoint of decrypted records; none while the feed is closed, and for callers who may
    /// not read them.
    pub plain: Option<String>,
}

/// A request that the session declines. This is normal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rejected {
    /// For programs.
    pub code: RejectionCode,
    /// For people: one sentence.
    pub message: String,
}

/// Why a session declines. Programs may branch on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RejectionCode {
    /// The utterance is empty, too long, or has a character that is not allowed.
    BadUtterance,
    /// The scene or the task cannot be read, or does not fit this world.
    BadStage,
    /// The reason of `close` is too long, or has a character that is not allowed.
    BadText,
    /// The command is not accepted in this phase.
    WrongPhase,
    /// A training runs. Send the command again when it is over.
    StillLearning,
    /// The person has withdrawn.
    Closed,
    /// The utterance cannot be taught with these actions.
    BadTeach,
    /// The same words were taught before and mean something else.
    Clash,
    /// There is no act that could be marked as wrong, or it was marked already.
    NothingToMark,
    /// No lesson has this record, or it was forgotten.
    NoSuchLesson,
    /// The session has reached a limit, such as the number of lessons.
    LimitReached,
    /// The request id was used before, with another command.
    RequestIdReused,
    /// A defect of the service.
    Internal,
}

/// The service has too much work. Nothing was recorded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Busy {
    /// For people: one sentence.
    pub message: String,
    /// Milliseconds after which the same request may be sent again, with the same id.
    pub retry_after_ms: u32,
}

/// A tenant is over one of its quotas. Nothing was recorded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct QuotaExceeded {
    /// Which quota.
    pub quota: Quota,
    /// What the tenant uses now, in the unit of the quota.
    pub used: u64,
    /// What it may use, in the unit of the quota.
    pub limit: u64,
    /// Milliseconds after which the same request may be sent again, with the same id. None: waiting
    /// does not help.
    pub retry_after_ms: Option<u32>,
    /// For people: one sentence.
    pub message: String,
}

/// What a quota limits, and its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quota {
    /// People awake at once.
    AwakeUsers,
    /// Requests accepted and not yet answered.
    InFlight,
    /// Utterances and other commands in a second; a query counts as a tenth.
    Utterances,
    /// Bytes in the log.
    SealedBytes,
}

/// A request that cannot be answered.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failed {
    /// For programs.
    pub code: ErrorCode,
    /// For people: one sentence.
    pub message: String,
}

/// Why a request cannot be answered. Programs may branch on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorCode {
    /// The message is no request.
    Malformed,
    /// The message has more bytes than the service reads.
    TooLarge,
    /// The message has another wire version.
    UnsupportedVersion,
    /// There is no such command, query or order.
    UnknownVerb,
    /// The command exists, but only inside the service.
    InternalVerb,
    /// The caller may not ask this.
    Denied,
    /// The order does not fit the state of the tenant, or a new person may not have this name.
    /// Nothing was recorded.
    Refused,
    /// The records cannot be read or written now; an operator must look.
    Unavailable,
    /// A defect of the service, with what is known about it.
    Internal,
}

impl Response {
    /// [`Response::Busy`].
    pub fn busy(message: impl Into<String>, retry_after_ms: u32) -> Response {
        Response::Busy(Busy { message: message.into(), retry_after_ms })
    }

    /// [`Response::Error`]. Characters that could forge a line are escaped.
    pub fn error(code: ErrorCode, message: impl Into<String>) -> Response {
        let message = plain::escape_lines(&message.into()).into_owned();
        Response::Error(Failed { code, message })
    }
}
