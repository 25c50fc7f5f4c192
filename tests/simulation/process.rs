//! One process of the service: the shipped directory, seats and tenant registry, each with its
//! mailbox. What actix does in the service is done here one step at a time, when dice say so.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use apprentice::actors::{
    Attention, Directory, DirectoryInput, NewSession, PersonAsk, Presence, Seat, TenantRegistry,
    Timer,
};
use apprentice::ids::{Digest, RequestId, StreamId, UserId};
use apprentice::learning::{Lesson, Mind, Recipe};
use apprentice::replay::Minds;
use apprentice::session::Session;
use apprentice::store::Pending;
use apprentice::world::World;

use crate::support::toy::Bells;

/// Requests that wait for one seat.
pub const MAILBOX_MAX: usize = 2;

/// What one process holds in memory, lost when it dies.
pub struct Process {
    pub directory: Directory<Parcel, usize>,
    pub to_directory: VecDeque<ToDirectory>,
    /// By generation.
    pub actors: BTreeMap<u64, Actor>,
    pub minds: Minds,
    /// None until it is needed, and when it could not be read.
    pub registry: Option<TenantRegistry>,
    /// Numbers of the requests that this process has taken and not answered.
    pub unanswered: BTreeSet<u64>,
    /// It was told to stop: whoever sleeps stays asleep.
    pub stops: bool,
}

/// A way back: whom to answer.
pub struct Ticket {
    pub number: u64,
    /// None for a question that changes nothing.
    pub asked: Option<Asked>,
    pub attention: Option<Attention>,
}

/// Which request of which person.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asked {
    pub person: usize,
    /// How often the name was erased before.
    pub era: u64,
    pub index: usize,
}

/// A request with its way back.
pub struct Parcel {
    pub ticket: Ticket,
    pub ask: PersonAsk,
    pub request: RequestId,
}

pub enum ToDirectory {
    Asked { stream: StreamId, user: UserId, parcel: Parcel },
    Other(DirectoryInput<Parcel, usize>),
}

/// A seat and its mailbox.
pub struct Actor {
    pub stream: StreamId,
    pub generation: u64,
    pub seat: Seat<Bells, Ticket>,
    pub mailbox: VecDeque<Mail>,
    pub woken: bool,
    pub pending: Option<Pending>,
    /// Of a training that is being recorded.
    pub attention: Option<Attention>,
    /// Whose request it works on.
    pub current: Option<(u64, Option<Asked>)>,
    pub presence: Presence,
    pub timers: Vec<Timer>,
}

pub enum Mail {
    Asked(Parcel),
    Trained { recipe: Digest, outcome: Result<Arc<Mind>, String>, attention: Attention },
    Sleep,
}

/// A training that is due.
pub struct Job {
    pub process: usize,
    pub generation: u64,
    pub stream: StreamId,
    pub recipe: Arc<Recipe>,
    pub lessons: Vec<Lesson<<Bells as World>::Scene, <Bells as World>::Task>>,
    pub attention: Attention,
}

impl Process {
    pub fn new(awake_max: usize) -> Process {
        Process {
            directory: Directory::new(awake_max),
            to_directory: VecDeque::new(),
            actors: BTreeMap::new(),
            minds: Minds::default(),
            registry: None,
            unanswered: BTreeSet::new(),
            stops: false,
        }
    }

    /// The session of the seat that speaks for a person.
    pub fn session_of(&self, stream: &StreamId) -> Option<&Session<Bells>> {
        let session = self.actors.get(&self.directory.generation_of(stream)?)?.seat.session();
        session.filter(|session| session.is_open())
    }

    /// The directory's next message. Each sender's come in their order, but what seats say may come
    /// later than what clients ask.
    ///
    /// - `delayed`: let requests overtake what a seat says.
    pub fn next_to_directory(&mut self, delayed: bool) -> Option<ToDirectory> {
        let is_asked = |message: &ToDirectory| matches!(message, ToDirectory::Asked { .. });
        let overtakes = self.to_directory.iter().position(is_asked).filter(|_| delayed);
        self.to_directory.remove(overtakes.unwrap_or(0))
    }

    /// Whether everything that came in was worked off, but for timers and trainings.
    pub fn is_quiet(&self) -> bool {
        self.to_directory.is_empty() && self.actors.values().all(|actor| !actor.can_act())
    }
}

impl Actor {
    pub fn new(
        stream: StreamId,
        user: UserId,
        generation: u64,
        presence: Presence,
        new: Arc<NewSession>,
    ) -> Actor {
        Actor {
            seat: Seat::new(stream.clone(), user, new),
            stream,
            generation,
            mailbox: VecDeque::new(),
            woken: false,
            pending: None,
            attention: None,
            current: None,
            presence,
            timers: Vec::new(),
        }
    }

    pub fn can_act(&self) -> bool {
        !self.woken || self.pending.is_some() || !self.mailbox.is_empty()
    }

    /// Whether it may still append in the person's name.
    pub fn speaks(&self) -> bool {
        let has_work = self.mailbox.iter().any(|mail| !matches!(mail, Mail::Sleep));
        !self.is_leaving() && (self.pending.is_some() || has_work)
    }

    /// Whether it told the directory that it cannot go on.
    pub fn is_leaving(&self) -> bool {
        self.woken && self.seat.session().is_none()
    }

    /// Requests that wait; what the service itself sends does not count.
    pub fn waiting(&self) -> usize {
        self.mailbox.iter().filter(|mail| matches!(mail, Mail::Asked(_))).count()
    }
}
