//! Who is awake, without actix: [`Directory::step`] takes what happened and says what is to be done
//! about it. The service does it with actix (`directory/actor.rs`), the simulator in an order that
//! a seed decides (`tests/simulation/`).

pub(super) mod actor;
mod erasure;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use self::erasure::Erasure;
use super::presence::{Attention, Presence};
use crate::client::Response;
use crate::ids::{StreamId, TenantId, UserId};

/// Knows who is awake, wakes people when somebody asks for them, and alone puts people to sleep: a
/// seat that stopped by itself while others hold its address would lose their messages.
///
/// `L` is a request with its way back, `E` the way back of an erasure.
pub struct Directory<L, E> {
    /// People awake at once; then the longest idle one goes to sleep.
    awake_max: usize,
    /// Everybody was sent to sleep for good.
    stopping: bool,
    /// People who are being erased: nobody wakes them.
    leaving: BTreeMap<StreamId, Erasure<E>>,
    entries: BTreeMap<StreamId, Entry>,
    /// For each tenant with somebody awake, from the tick of the last request to whose it was: the
    /// longest idle first.
    order: BTreeMap<TenantId, BTreeMap<u64, StreamId>>,
    ticks: u64,
    effects: Vec<DirectoryEffect<L, E>>,
}

struct Entry {
    presence: Presence,
    generation: u64,
    tick: u64,
}

/// A request on its way to the seat of its person.
pub struct Letter<L> {
    pub stream: StreamId,
    pub user: UserId,
    /// People whom this tenant may have awake at once; none for no limit of its own.
    pub awake_limit: Option<u32>,
    pub content: L,
}

/// What happened to the directory.
pub enum DirectoryInput<L, E> {
    Asked(Letter<L>),
    /// The end of [`DirectoryEffect::Deliver`], when it could not be delivered.
    Undelivered(Undelivered<L>),
    /// A seat cannot go on.
    Leaving {
        stream: StreamId,
        generation: u64,
    },
    /// Somebody is to be erased.
    Erase {
        stream: StreamId,
        caller: E,
    },
    /// The time of [`DirectoryEffect::LookAgain`] is over.
    Look {
        stream: StreamId,
    },
    /// The end of [`DirectoryEffect::Erase`], whichever way it went.
    Erased {
        stream: StreamId,
    },
    /// Everybody is to go to sleep, and nobody to be woken any more.
    SleepAll,
}

/// A request that came back.
pub struct Undelivered<L> {
    pub letter: Letter<L>,
    pub generation: u64,
    pub reason: NotDelivered,
    /// It came back before.
    pub again: bool,
}

/// Why a request came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotDelivered {
    /// The seat has too many requests waiting.
    Full,
    /// The seat is gone, of a panic: what it was is in the log.
    Closed,
}

/// What the directory wants done.
pub enum DirectoryEffect<L, E> {
    /// Start a seat for this person.
    Wake {
        stream: StreamId,
        user: UserId,
        generation: u64,
        presence: Presence,
    },
    /// Hand a request to the seat of this generation. When it cannot be:
    /// [`DirectoryInput::Undelivered`], with the same `again`.
    Deliver {
        letter: Letter<L>,
        generation: u64,
        attention: Attention,
        again: bool,
    },
    Answer {
        content: L,
        response: Response,
    },
    /// Say that this tenant has too many people awake, all of them busy.
    RefuseWaking {
        content: L,
        tenant: TenantId,
        awake: usize,
        limit: u32,
    },
    /// Say that all tenants together have too many people awake, all of them busy.
    RefuseCrowd {
        content: L,
        tenant: TenantId,
    },
    /// So many people of this tenant are awake now.
    NoteAwake {
        tenant: TenantId,
        awake: usize,
    },
    /// Tell a seat to stop: the last message to it.
    Sleep {
        stream: StreamId,
        generation: u64,
    },
    /// Destroy this person's key; the end is [`DirectoryInput::Erased`].
    Erase {
        stream: StreamId,
        caller: E,
    },
    /// Say that this person is too busy to be erased.
    StillBusy {
        caller: E,
    },
    /// Hand in [`DirectoryInput::Look`] after this long.
    LookAgain {
        stream: StreamId,
        after: Duration,
    },
}

/// Milliseconds after which a request that met a full queue may be sent again.
const RETRY_FULL_MS: u32 = 100;
/// Milliseconds after which a request may be sent again that met an erasure.
const RETRY_ERASURE_MS: u32 = 200;
/// Milliseconds after which a request may be sent again whose seat died twice.
const RETRY_LOST_MS: u32 = 50;
/// How many of the longest idle are asked whether they may sleep before a request is refused.
const SLEEPERS_TRIED_MAX: usize = 64;

impl<L, E> Directory<L, E> {
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

    /// Takes what happened.
    ///
    /// - returns: what is to be done, in this order.
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

    /// The generation of the seat that speaks for this person; none when they sleep.
    pub fn generation_of(&self, stream: &StreamId) -> Option<u64> {
        self.entries.get(stream).map(|entry| entry.generation)
    }

    /// - `again`: it came back before.
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

    /// - errors: why nobody more can be awake.
    fn make_room(&mut self, letter: &Letter<L>) -> Result<(), NoRoom> {
        if self.stopping {
            return Err(NoRoom::OfAll);
        }
        let tenant = &letter.stream.tenant;
        // At its own limit a tenant makes room among its own people, never among others'.
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

    /// When all places are taken: the tenant with the most people awake gives one of them up.
    fn put_anyone_to_sleep(&mut self) -> bool {
        let mut tenants: Vec<(usize, TenantId)> =
            self.order.iter().map(|(tenant, awake)| (awake.len(), tenant.clone())).collect();
        tenants.sort_by(|one, other| other.cmp(one));
        tenants.iter().any(|(_, tenant)| self.put_to_sleep(tenant))
    }

    /// - returns: whether one of the tenant's longest idle had nothing to do and was told to sleep.
    fn put_to_sleep(&mut self, tenant: &TenantId) -> bool {
        let Some(order) = self.order.get(tenant) else { return false };
        let is_idle = |stream: &&StreamId| self.entries[*stream].presence.is_idle();
        let idle = order.values().take(SLEEPERS_TRIED_MAX).find(is_idle);
        let Some(stream) = idle.cloned() else { return false };
        tracing::debug!(%stream, "sleeps");
        self.strike_off(&stream, self.entries[&stream].generation);
        true
    }

    /// Removes the entry first and then tells the seat to stop, so that no message can follow.
    /// Nothing for a seat of an earlier generation.
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

/// Why nobody more can be awake.
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
