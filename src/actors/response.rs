use serde::{Deserialize, Serialize};

use super::archive::{ArchiveAsk, Heads, PlainRecords, SealedRecords};
use super::operator::{ErasedView, Ordered, TenantAsk, TenantView};
use crate::ids::RequestId;
use crate::plain;
use crate::session::{
    Command, KnownExemplar, Query, Rejection, RejectionCode, Reply, Status, Told,
};
use crate::world::View;

/// What may be asked of the service, by who answers it.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    Person(PersonAsk),
    /// About the records of one's own tenant. Wakes nobody.
    Archive(ArchiveAsk),
    /// About the service itself. Wakes nobody.
    Door(DoorAsk),
    /// An operator's, about a tenant. Wakes nobody.
    Order(TenantAsk),
}

/// What may be asked of a person's actor.
#[derive(Debug, Clone, PartialEq)]
pub enum PersonAsk {
    Command(Command),
    Query(Query),
    /// Answered as soon as the phase is not Learning, or after this many seconds.
    Wait {
        seconds: u32,
    },
}

/// What may be asked about the service itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DoorAsk {
    /// Who is there.
    Hello,
    /// Where the feed of one's own tenant is.
    Feed,
}

impl From<Command> for Ask {
    fn from(command: Command) -> Ask {
        Ask::Person(PersonAsk::Command(command))
    }
}

impl From<Query> for Ask {
    fn from(query: Query) -> Ask {
        Ask::Person(PersonAsk::Query(query))
    }
}

impl From<DoorAsk> for Ask {
    fn from(ask: DoorAsk) -> Ask {
        Ask::Door(ask)
    }
}

/// What the service answers.
#[derive(Debug, Clone, PartialEq)]
pub enum Response {
    /// The command was recorded; this is what came of it.
    Reply(Reply),
    Status(Status),
    Look(View),
    Known(Vec<KnownExemplar>),
    Waited(Waited),
    Hello(Hello),
    Heads(Heads),
    Records(SealedRecords),
    PlainRecords(PlainRecords),
    Feed(FeedView),
    Ordered(Ordered),
    Tenants(Vec<TenantView>),
    Erased(ErasedView),
    /// Declined; nothing was recorded.
    Rejected(Rejected),
    /// Not now. The same request id may be sent again.
    Busy(Busy),
    /// The tenant takes more than it may. Nothing was recorded.
    QuotaExceeded(QuotaExceeded),
    /// Cannot be answered; sending it again does not help.
    Error(Failed),
}

/// The answer to [`PersonAsk::Wait`].
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

impl From<Rejection> for Response {
    fn from(rejection: Rejection) -> Response {
        // It may quote what the person sent.
        let message = plain::escape(&rejection.to_string()).into_owned();
        Response::Rejected(Rejected { code: rejection.code(), message })
    }
}
