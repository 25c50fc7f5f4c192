use apprentice_core::ids::RequestId;
use apprentice_core::plain;
use apprentice_core::world::View;
use serde::{Deserialize, Serialize};

use super::{
    ErasedView, Heads, KnownExemplar, Ordered, PlainRecords, Reply, SealedRecords, Status,
    TenantView, Told,
};

/// Lists each response once: its variant, the field of the map that carries it, and what it is
/// called when another one was expected.
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

            /// What it carries, in the order of the list: one response, if it is sound.
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
    /// The command was recorded; this is what came of it.
    Reply(Reply) in reply, "a reply";
    Status(Status) in status, "a status";
    Look(View) in look, "a look";
    Known(Vec<KnownExemplar>) in known, "exemplars";
    Waited(Waited) in waited, "the end of a wait";
    Hello(Hello) in hello, "a hello";
    Feed(FeedView) in feed, "where a feed is";
    Heads(Heads) in heads, "heads of streams";
    Records(SealedRecords) in records, "records";
    PlainRecords(PlainRecords) in plain_records, "records";
    Ordered(Ordered) in ordered, "the end of an order";
    Tenants(Vec<TenantView>) in tenants, "tenants";
    Erased(ErasedView) in erased, "an erasure";
    /// Declined; nothing was recorded.
    Rejected(Rejected) in rejected, "a refusal";
    /// Not now. The same request id may be sent again.
    Busy(Busy) in busy, "a refusal";
    /// The tenant takes more than it may. Nothing was recorded.
    QuotaExceeded(QuotaExceeded) in quota_exceeded, "a refusal";
    /// Cannot be answered; sending it again does not help.
    Error(Failed) in error, "a refusal";
}

/// The answer to [`super::PersonAsk::Wait`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Waited {
    pub status: Status,
    /// How the last training ended: `learned` or `learning_failed`. Empty when none ended since
    /// this person was last woken; the status then says what the present mind is.
    pub told: Vec<Told>,
}

/// Who answers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// `apprentice`.
    pub service: String,
    /// The version of the binary.
    pub version: String,
    /// The name of the world, as in the records.
    pub domain: String,
    /// The recipe that new people start with.
    pub recipe: String,
}

/// Where new records are published.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FeedView {
    /// Names this run of the feed: its numbers begin anew with it.
    pub start: RequestId,
    /// The endpoint of sealed records; none when there is no feed, or it is being opened.
    pub sealed: Option<String>,
    /// The endpoint of records in the clear; none for whoever may not read them, too.
    pub plain: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rejected {
    pub code: RejectionCode,
    pub message: String,
}

/// What a program may branch on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RejectionCode {
    BadUtterance,
    BadStage,
    /// A free text that is neither an utterance nor of a stage: the reason of `close`.
    BadText,
    WrongPhase,
    StillLearning,
    Closed,
    BadTeach,
    Clash,
    NoSuchLesson,
    LimitReached,
    RequestIdReused,
    Internal,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Busy {
    pub message: String,
    pub retry_after_ms: u32,
}

/// A tenant's limit, and how it stands to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct QuotaExceeded {
    pub quota: Quota,
    pub used: u64,
    pub limit: u64,
    /// When the same request id may be sent again; none when time alone does not help.
    pub retry_after_ms: Option<u32>,
    pub message: String,
}

/// What a tenant can have too much of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quota {
    /// People awake at once.
    AwakeUsers,
    /// Requests taken and not yet answered.
    InFlight,
    /// Utterances, and other commands, a second; a query counts a tenth.
    Utterances,
    /// Bytes in the log.
    SealedBytes,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failed {
    pub code: ErrorCode,
    pub message: String,
}

/// What a program may branch on when a request could not be answered at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorCode {
    /// The message is no request.
    Malformed,
    /// The message is larger than is read.
    TooLarge,
    /// The message is of another wire version.
    UnsupportedVersion,
    /// No such command or query.
    UnknownVerb,
    /// The command exists, but only inside the service.
    InternalVerb,
    /// Whoever asks may not ask this.
    Denied,
    /// An order that does not fit the tenant as it stands, or a name that nobody new may have;
    /// nothing was recorded.
    Refused,
    /// This person's stream cannot be read or written now; an operator must look.
    Unavailable,
    /// We are wrong: a defect, with what is known about it.
    Internal,
}

impl Response {
    pub fn busy(message: impl Into<String>, retry_after_ms: u32) -> Response {
        Response::Busy(Busy { message: message.into(), retry_after_ms })
    }

    pub fn error(code: ErrorCode, message: impl Into<String>) -> Response {
        let message = plain::escape_lines(&message.into()).into_owned();
        Response::Error(Failed { code, message })
    }
}
