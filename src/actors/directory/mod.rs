//! Decides who is awake, without actix: [`Directory::step`] takes an input and returns effects. The
//! service carries them out with actix (`directory/actor.rs`), the simulator in an order that a
//! seed decides (`tests/simulation/`).

pub(super) mod actor;
mod erasure;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use self::erasure::Erasure;
use super::presence::{Attention, Presence};
use crate::client::Response;
use crate::ids::{StreamId, TenantId, UserId};

/// Knows who is awake. It wakes people when a request for them comes, and only it puts people to
/// sleep: a seat that stopped by itself would lose the messages that are on their way to it.
///
/// `L` is a request that can be answered, and `E` answers an erasure.
pub struct Directory<L, E> {
    /// People awake at the same time. For one more, the person who was idle longest goes to sleep.
    awake_max: usize,
    /// Everybody was put to sleep, and no person is woken again.
    stopping: bool,
    /// People who are being erased. They are not woken.
    leaving: BTreeMap<StreamId, Erasure<E>>,
    entries: BTreeMap<StreamId, Entry>,
    /// For each tenant with people awake: these people by the tick of their last request, so the
    /// one who was idle longest comes first.
    order: BTreeMap<TenantId, BTreeMap<u64, StreamId>>,
    ticks: u64,
    effects: Vec<DirectoryEffect<L, E>>,
}

struct Entry {
    presence: Presence,
    generation: u64,
    tick: u64,
}

/// A request that is to go to a person's seat.
pub struct Letter<L> {
    /// The person's stream.
    pub stream: StreamId,
    /// The person's name.
    pub user: UserId,
    /// People whom this tenant may have awake at the same time; none: it has no such quota.
    pub awake_limit: Option<u32>,
    /// The request.
    pub content: L,
}

/// What happened to the directory.
pub enum DirectoryInput<L, E> {
    /// A request came.
    Asked(Letter<L>),
    /// [`DirectoryEffect::Deliver`] failed.
    Undelivered(Undelivered<L>),
    /// A seat cannot continue.
    Leaving { stream: StreamId, generation: u64 },
    /// Erase a person.
    Erase { stream: StreamId, caller: E },
    /// The time of [`DirectoryEffect::LookAgain`] is over.
    Look { stream: StreamId },
    /// [`DirectoryEffect::Erase`] has ended, or has failed.
    Erased { stream: StreamId },
    /// Put everybody to sleep, and wake no person again.
    SleepAll,
}

/// A request that could not be delivered.
pub struct Undelivered<L> {
    /// The request.
    pub letter: Letter<L>,
    /// The seat that it was for.
    pub generation: u64,
    /// Why it was not delivered.
    pub reason: NotDelivered,
    /// This was the second attempt.
    pub again: bool,
}

/// Why a request was not delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotDelivered {
    /// The seat has too many requests waiting.
    Full,
    /// The seat has died of a panic. Its session is in the log.
    Closed,
}

/// What the directory wants done.
pub enum DirectoryEffect<L, E> {
    /// Start a seat for this person.
    Wake { stream: StreamId, user: UserId, generation: u64, presence: Presence },
    /// Give a request to the seat of this generation. If that fails,
    /// [`DirectoryInput::Undelivered`] follows, with the same `again`.
    Deliver { letter: Letter<L>, generation: u64, attention: Attention, again: bool },
    /// Answer a request.
    Answer { content: L, response: Response },
    /// Answer that this tenant has too many people awake, and all of them are busy.
    RefuseWaking { content: L, tenant: TenantId, awake: usize, limit: u32 },
    /// Answer that all tenants together have too many people awake, and all of them are busy.
    RefuseCrowd { content: L, tenant: TenantId },
    /// Note how many people of this tenant are awake.
    NoteAwake { tenant: TenantId, awake: usize },
    /// Tell a seat to stop. This is the last message to it.
    Sleep { stream: StreamId, generation: u64 },
    /// Destroy this person's key. [`DirectoryInput::Erased`] follows.
    Erase { stream: StreamId, caller: E },
    /// Answer that this person is too busy to be erased.
    StillBusy { caller: E },
    /// Give [`DirectoryInput::Look`] after this time.
    LookAgain { stream: StreamId, after: Duration },
}

/// Milliseconds after which a request may be sent again if the queue was full.
const RETRY_FULL_MS: u32 = 100;
/// Milliseconds after which a request may be sent again if the person is being erased.
const RETRY_ERASURE_MS: u32 = 200;
/// Milliseconds after which a request may be sent again if its seat died twice.
const RETRY_LOST_MS: u32 = 50;
/// How many people of a tenant are looked at, the longest idle first, before a request is refused.
const SLEEPERS_TRIED_MAX: usize = 64;

impl<L, E> Directory<L, E> {
    /// A directory in which all people are asleep.
    pub fn new(awake_max: usize) -> Directory<L, E> {
        Directory {
            awake_max,
            stopping: false,
            leaving: BTreeMap::new(),
            entries: BTreeMap::new(),
            order: BTreeMap::new(),
            ticks: 0,
            effects: Vec::new(),
        }
    }

    /// Takes an input.
    ///
    /// - returns: the effects, in the order in which they must be carried out.
    pub fn step(&mut self, input: DirectoryInput<L, E>) -> Vec<DirectoryEffect<L, E>> {
        match input {
            DirectoryInput::Asked(letter) => self.forward(letter, false),
            DirectoryInput::Undelivered(undelivered) => self.undelivered(undelivered),
            DirectoryInput::Leaving { stream, generation } => self.strike_off(&stream, generation),
            DirectoryInput::Erase { stream, caller } => self.erase(stream, caller),
            DirectoryInput::Look { stream } => self.look(stream),
            DirectoryInput::Erased { stream } => {
                self.leaving.remove(&stream);
            }
            DirectoryInput::SleepAll => self.sleep_all(),
        }
        std::mem::take(&mut self.effects)
    }

    /// The generation of the person's seat; none if the person is asleep.
    pub fn generation_of(&self, stream: &StreamId) -> Option<u64> {
        self.entries.get(stream).map(|entry| entry.generation)
    }

    /// - `again`: this is the second attempt.
    fn forward(&mut self, letter: Letter<L>, again: bool) {
        if self.leaving.contains_key(&letter.stream) {
            let leaving = "this person is being erased; send it again in a moment";
            return self.answer(letter.content, Response::busy(leaving, RETRY_ERASURE_MS));
        }
        if !self.entries.contains_key(&letter.stream) {
            if let Err(refused) = self.make_room(&letter) {
                return self.effects.push(refused.because_of(letter));
            }
            self.wake(&letter);
        }
        self.touch(&letter.stream);
        let entry = &self.entries[&letter.stream];
        let (generation, attention) = (entry.generation, entry.presence.attend());
        self.effects.push(DirectoryEffect::Deliver { letter, generation, attention, again });
    }

    fn undelivered(&mut self, undelivered: Undelivered<L>) {
        let Undelivered { letter, generation, reason, again } = undelivered;
        match reason {
            NotDelivered::Full => {
                let full = "you have too many requests waiting; send it again in a moment";
                self.answer(letter.content, Response::busy(full, RETRY_FULL_MS));
            }
            NotDelivered::Closed => {
                tracing::warn!(stream = %letter.stream, "an actor died; a new one is started");
                self.strike_off(&letter.stream, generation);
                match again {
                    false => self.forward(letter, true),
                    true => {
                        let lost = "the request was interrupted; send it again";
                        self.answer(letter.content, Response::busy(lost, RETRY_LOST_MS));
                    }
                }
            }
        }
    }

    /// Makes room for one more person.
    ///
    /// - errors: why there is none.
    fn make_room(&mut self, letter: &Letter<L>) -> Result<(), NoRoom> {
        if self.stopping {
            return Err(NoRoom::OfAll);
        }
        let tenant = &letter.stream.tenant;
        // At its own limit, a tenant must put one of its own people to sleep.
        let awake = self.awake_of(tenant);
        if let Some(limit) = letter.awake_limit.filter(|limit| awake >= *limit as usize)
            && !self.put_to_sleep(tenant)
        {
            return Err(NoRoom::OfTenant { awake, limit });
        }
        if self.entries.len() >= self.awake_max && !self.put_anyone_to_sleep() {
            return Err(NoRoom::OfAll);
        }
        Ok(())
    }

    fn wake(&mut self, letter: &Letter<L>) {
        let (stream, user) = (letter.stream.clone(), letter.user.clone());
        self.ticks += 1;
        let (presence, generation) = (Presence::default(), self.ticks);
        let entry = Entry { presence: presence.clone(), generation, tick: self.ticks };
        self.order.entry(stream.tenant.clone()).or_default().insert(self.ticks, stream.clone());
        self.entries.insert(stream.clone(), entry);
        self.note_awake(&stream.tenant);
        self.effects.push(DirectoryEffect::Wake { stream, user, generation, presence });
    }

    fn awake_of(&self, tenant: &TenantId) -> usize {
        self.order.get(tenant).map_or(0, BTreeMap::len)
    }

    /// Puts one person to sleep, of the tenant with the most people awake.
    fn put_anyone_to_sleep(&mut self) -> bool {
        let mut tenants: Vec<(usize, TenantId)> =
            self.order.iter().map(|(tenant, awake)| (awake.len(), tenant.clone())).collect();
        tenants.sort_by(|one, other| other.cmp(one));
        tenants.iter().any(|(_, tenant)| self.put_to_sleep(tenant))
    }

    /// Puts the person of this tenant to sleep who was idle longest.
    ///
    /// - returns: false if all of those looked at are busy.
    fn put_to_sleep(&mut self, tenant: &TenantId) -> bool {
        let Some(order) = self.order.get(tenant) else { return false };
        let is_idle = |stream: &&StreamId| self.entries[*stream].presence.is_idle();
        let idle = order.values().take(SLEEPERS_TRIED_MAX).find(is_idle);
        let Some(stream) = idle.cloned() else { return false };
        tracing::debug!(%stream, "sleeps");
        self.strike_off(&stream, self.entries[&stream].generation);
        true
    }

    /// Removes the entry and then tells the seat to stop, so that no message follows. Does nothing
    /// for a seat of an earlier generation.
    fn strike_off(&mut self, stream: &StreamId, generation: u64) {
        if self.generation_of(stream) != Some(generation) {
            return;
        }
        let Some(entry) = self.entries.remove(stream) else { return };
        if let Some(order) = self.order.get_mut(&stream.tenant) {
            order.remove(&entry.tick);
            if order.is_empty() {
                self.order.remove(&stream.tenant);
            }
        }
        self.note_awake(&stream.tenant);
        self.effects.push(DirectoryEffect::Sleep { stream: stream.clone(), generation });
    }

    fn touch(&mut self, stream: &StreamId) {
        self.ticks += 1;
        let Some(entry) = self.entries.get_mut(stream) else { return };
        let order = self.order.entry(stream.tenant.clone()).or_default();
        order.remove(&entry.tick);
        entry.tick = self.ticks;
        order.insert(self.ticks, stream.clone());
    }

    fn sleep_all(&mut self) {
        self.stopping = true;
        let awake: BTreeSet<(StreamId, u64)> =
            self.entries.iter().map(|(stream, it)| (stream.clone(), it.generation)).collect();
        for (stream, generation) in awake {
            self.strike_off(&stream, generation);
        }
    }

    fn note_awake(&mut self, tenant: &TenantId) {
        let awake = self.awake_of(tenant);
        self.effects.push(DirectoryEffect::NoteAwake { tenant: tenant.clone(), awake });
    }

    fn answer(&mut self, content: L, response: Response) {
        self.effects.push(DirectoryEffect::Answer { content, response });
    }
}

/// Why no more person can be awake.
enum NoRoom {
    OfTenant { awake: usize, limit: u32 },
    OfAll,
}

impl NoRoom {
    fn because_of<L, E>(self, letter: Letter<L>) -> DirectoryEffect<L, E> {
        let Letter { stream: StreamId { tenant, .. }, content, .. } = letter;
        match self {
            NoRoom::OfTenant { awake, limit } => {
                DirectoryEffect::RefuseWaking { content, tenant, awake, limit }
            }
            NoRoom::OfAll => DirectoryEffect::RefuseCrowd { content, tenant },
        }
    }
}
