//! One process of the service: the shipped directory, seats and tenants' writer, each with its
//! mailbox. What actix does in the service is done here one step at a time, when dice say so.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use apprentice::actors::{
    Attention, Directory, DirectoryInput, NewSession, Presence, Seat, TenantWork, TenantWriter,
    Timer, WriterInput,
};
use apprentice::client::PersonAsk;
use apprentice::ids::{Digest, RequestId, StreamId, UserId};
use apprentice::learning::{Lesson, Mind, Recipe};
use apprentice::replay::Minds;
use apprentice::session::Session;
use apprentice::store::Pending;
use apprentice::tenancy::{Admissions, Clock};
use apprentice::world::Domain;

use apprentice_testkit::toy::Bells;

/// The most requests that may wait for one seat.
pub const MAILBOX_MAX: usize = 2;
/// Work that waits for one registrar.
pub const WORK_MAX: usize = 6;

/// The memory of one process. It is lost when the process dies.
pub struct Process {
    pub directory: Directory<Parcel, usize>,
    pub to_directory: VecDeque<ToDirectory>,
    /// Actors by their generation, the number of the seat.
    pub actors: BTreeMap<u64, Actor>,
    pub minds: Minds,
    pub registrar: Registrar,
    /// Numbers of the requests that this process has taken and not answered.
    pub unanswered: BTreeSet<u64>,
    /// It was told to stop: it wakes no user any more.
    pub stops: bool,
}

/// The tenants' writer, and what waits for it.
pub struct Registrar {
    /// None until it is needed, and when the log could not be read.
    pub writer: Option<TenantWriter<Caller>>,
    pub doors: Admissions,
    pub queue: VecDeque<(TenantWork, Caller)>,
    pub pending: Option<Pending>,
    /// The end of what was carried out last, not told yet.
    pub end: Option<WriterInput<Caller>>,
    /// Whose work it does.
    pub current: Option<Caller>,
    /// With a defect: a key that is destroyed later.
    pub spared: Option<StreamId>,
}

/// Who waits for the end of work.
#[derive(Debug, Clone)]
pub struct Caller {
    pub number: u64,
    pub whom: Whom,
}

#[derive(Debug, Clone)]
pub enum Whom {
    /// Who gave an order, by its number.
    Operator(usize),
    Auditor,
    /// A seat, which hears nothing.
    Seat,
    /// The directory, while a person is erased.
    Directory(StreamId),
    /// The start of the process, which finishes what the one before left.
    Start,
}

/// A way back: whom to answer.
pub struct Ticket {
    pub number: u64,
    /// None for a query, which changes nothing.
    pub asked: Option<Asked>,
    pub attention: Option<Attention>,
}

/// One request of one person.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asked {
    pub person: usize,
    /// How often the name had been erased before.
    pub era: u64,
    pub index: usize,
}

/// A request, with its ticket for the answer.
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
    /// The request that it works on.
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
    pub lessons: Vec<Lesson<<Bells as Domain>::Scene, <Bells as Domain>::Task>>,
    pub attention: Attention,
}

impl Process {
    pub fn new(awake_max: usize, clock: &Clock) -> Process {
        Process {
            directory: Directory::new(awake_max),
            to_directory: VecDeque::new(),
            actors: BTreeMap::new(),
            minds: Minds::default(),
            registrar: Registrar::new(clock),
            unanswered: BTreeSet::new(),
            stops: false,
        }
    }

    /// The session of the seat that speaks for a person.
    pub fn session_of(&self, stream: &StreamId) -> Option<&Session<Bells>> {
        let session = self.actors.get(&self.directory.generation_of(stream)?)?.seat.session();
        session.filter(|session| session.is_open())
    }

    /// The directory's next message. The messages of one sender stay in order. Messages of seats
    /// may come later than requests of clients.
    ///
    /// - `delayed`: lets requests overtake messages of seats.
    pub fn next_to_directory(&mut self, delayed: bool) -> Option<ToDirectory> {
        let is_asked = |message: &ToDirectory| matches!(message, ToDirectory::Asked { .. });
        let overtakes = self.to_directory.iter().position(is_asked).filter(|_| delayed);
        self.to_directory.remove(overtakes.unwrap_or(0))
    }

    /// True if all work is done, except timers and trainings.
    pub fn is_quiet(&self) -> bool {
        self.to_directory.is_empty()
            && self.actors.values().all(|actor| !actor.can_act())
            && !self.registrar.can_act()
    }
}

impl Registrar {
    fn new(clock: &Clock) -> Registrar {
        Registrar {
            writer: None,
            doors: Admissions::new(clock.clone()),
            queue: VecDeque::new(),
            pending: None,
            end: None,
            current: None,
            spared: None,
        }
    }

    pub fn can_act(&self) -> bool {
        self.pending.is_some() || self.end.is_some() || !self.queue.is_empty()
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

    /// True if it may still append for the person.
    pub fn speaks(&self) -> bool {
        let has_work = self.mailbox.iter().any(|mail| !matches!(mail, Mail::Sleep));
        !self.is_leaving() && (self.pending.is_some() || has_work)
    }

    /// True if it told the directory that it cannot continue.
    pub fn is_leaving(&self) -> bool {
        self.woken && self.seat.session().is_none()
    }

    /// Requests that wait. Messages from inside the service do not count.
    pub fn waiting(&self) -> usize {
        self.mailbox.iter().filter(|mail| matches!(mail, Mail::Asked(_))).count()
    }
}
