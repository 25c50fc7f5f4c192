use apprentice_core::ids::{Seq, StreamKey, TenantId, UserId};

use super::{Command, Order, Query};

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

/// A question about what a tenant's log holds. Whose log: that of whoever asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArchiveAsk {
    /// Where the streams end, those after `after` in the order of their keys.
    Heads { after: Option<StreamKey>, limit: u32 },
    /// Records as they are kept.
    Sealed { stream: StreamKey, from: Seq, limit: u32 },
    /// Records opened.
    Plain { stream: StreamKey, from: Seq, limit: u32 },
}

/// What an operator asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct TenantAsk {
    /// Whom it is about; none: the operator's own tenant, and for a list every tenant that this
    /// operator may see.
    pub tenant: Option<TenantId>,
    pub verb: TenantVerb,
}

#[derive(Debug, Clone, PartialEq)]
pub enum TenantVerb {
    List,
    Give(Order),
    /// Destroy a person's key.
    Erase {
        user: UserId,
    },
}
