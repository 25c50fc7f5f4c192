use apprentice_core::ids::{Seq, StreamKey, TenantId, UserId};

use super::{Command, Order, Query};

/// What may be asked of the service, by who answers it.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    /// About one person. Wakes that person.
    Person(PersonAsk),
    /// About the records of the caller's own tenant. Wakes no person.
    Archive(ArchiveAsk),
    /// About the service itself. Wakes no person.
    Service(ServiceAsk),
    /// About a tenant, from an operator. Wakes no person.
    Order(TenantAsk),
}

/// What may be asked about one person.
#[derive(Debug, Clone, PartialEq)]
pub enum PersonAsk {
    /// Something that is recorded or refused.
    Command(Command),
    /// Something that changes nothing.
    Query(Query),
    /// Answered as soon as the phase is not Learning, or when the time is over.
    Wait {
        /// Seconds, at most [`WAIT_S_MAX`](apprentice_core::limits::WAIT_S_MAX).
        seconds: u32,
    },
}

/// What may be asked about the service itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServiceAsk {
    /// Which service this is.
    Hello,
    /// Where the feed of the caller's tenant is.
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

impl From<ServiceAsk> for Ask {
    fn from(ask: ServiceAsk) -> Ask {
        Ask::Service(ask)
    }
}

/// A question about the records of the caller's tenant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArchiveAsk {
    /// Where the streams end.
    Heads {
        /// Only streams with a greater key; none: from the first stream on.
        after: Option<StreamKey>,
        /// Streams, at most [`HEADS_IN_REPLY_MAX`](apprentice_core::limits::HEADS_IN_REPLY_MAX).
        limit: u32,
    },
    /// Records as the log keeps them: encrypted.
    Sealed {
        /// The stream to read.
        stream: StreamKey,
        /// The first record to read.
        from: Seq,
        /// Records, at most
        /// [`RECORDS_IN_REPLY_MAX`](apprentice_core::limits::RECORDS_IN_REPLY_MAX).
        limit: u32,
    },
    /// Records, decrypted.
    Plain {
        /// The stream to read.
        stream: StreamKey,
        /// The first record to read.
        from: Seq,
        /// Records, at most
        /// [`RECORDS_IN_REPLY_MAX`](apprentice_core::limits::RECORDS_IN_REPLY_MAX).
        limit: u32,
    },
}

/// What an operator asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct TenantAsk {
    /// The tenant that it is about. None: the operator's own tenant. For a list: every tenant that
    /// this operator may see.
    pub tenant: Option<TenantId>,
    /// What is to be done.
    pub verb: TenantVerb,
}

/// What an operator may do with a tenant.
#[derive(Debug, Clone, PartialEq)]
pub enum TenantVerb {
    /// Show its keys, its quotas and whether it is disabled.
    List,
    /// Change it.
    Give(Order),
    /// Destroy a person's key, so that the person's records can no longer be decrypted.
    Erase {
        /// The person's name.
        user: UserId,
    },
}
