use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use actix::dev::SendError;
use actix::{Actor, Context, Handler, Message, Recipient};

use super::Registrar;
use super::awake::{Awake, AwakeCount};
use super::meters::Meters;
use super::response::{Ask, ErrorCode, Hello, Response};
use super::submit::{Presence, Submit};
use crate::ids::{StreamId, TenantId, UserId};
use crate::limits::DIRECTORY_QUEUE_MAX;
use crate::sabotage;
use crate::store::KeyError;

/// Knows who is awake, wakes whoever is asked for, and is the only one who puts people to sleep:
/// an actor that stopped by itself while others hold its address would lose their messages.
pub(super) struct Directory {
    pub people: Box<dyn People>,
    /// People awake at once; then the longest idle one goes to sleep.
    pub awake_max: usize,
    pub hello: Hello,
    pub count: Arc<AwakeCount>,
    meters: Arc<Meters>,
    pub registrar: Registrar,
    /// People who are being erased: nobody wakes them.
    pub leaving: BTreeSet<StreamId>,
    entries: HashMap<StreamId, Entry>,
    /// For each tenant with somebody awake, from the tick of the last request to whose it was: the
    /// longest idle first.
    order: BTreeMap<TenantId, BTreeMap<u64, StreamId>>,
    ticks: u64,
}

/// Where people's actors come from; hides the domain from the directory and from the front ends.
pub(super) trait People: Send + Unpin + 'static {
    /// - errors: when the tenant's key cannot be read.
    fn stream_of(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, KeyError>;
    fn wake(&self, waking: Waking) -> Address;
}

/// What a new actor is given.
pub(super) struct Waking {
    pub stream: StreamId,
    pub user: UserId,
    /// Told apart from earlier actors of the same person.
    pub generation: u64,
    pub presence: Presence,
    pub _awake: Awake,
    pub leaving: Recipient<Leaving>,
}

/// The address of one person's actor.
pub(super) struct Address {
    pub submit: Recipient<Submit>,
    pub sleep: Recipient<Sleep>,
}

/// Sent to a person's actor after it was struck off the directory; its last message.
#[derive(Debug, Message)]
#[rtype(result = "()")]
pub(super) struct Sleep;

/// An actor asks to be struck off, because it cannot go on; the next request starts a new one.
#[derive(Debug, Message)]
#[rtype(result = "()")]
pub(super) struct Leaving {
    pub stream: StreamId,
    pub generation: u64,
}

/// Everybody is to go to sleep, and nobody to be woken any more.
#[derive(Debug, Message)]
#[rtype(result = "()")]
pub(super) struct SleepAll;

struct Entry {
    address: Address,
    presence: Presence,
    generation: u64,
    tick: u64,
}

/// Milliseconds after which a request that met a full queue may be sent again.
const RETRY_FULL_MS: u32 = 100;
/// Milliseconds after which a request may be sent again that found everybody busy.
const RETRY_CROWD_MS: u32 = 200;
/// How many of the longest idle are asked whether they may sleep before a request is refused.
const SLEEPERS_TRIED_MAX: usize = 64;

impl Directory {
    pub fn new(
        people: Box<dyn People>,
        awake_max: usize,
        hello: Hello,
        count: Arc<AwakeCount>,
        meters: Arc<Meters>,
        registrar: Registrar,
    ) -> Directory {
        Directory {
            people,
            awake_max,
            hello,
            count,
            meters,
            registrar,
            leaving: BTreeSet::new(),
            entries: HashMap::new(),
            order: BTreeMap::new(),
            ticks: 0,
        }
    }

    fn forward(&mut self, stream: StreamId, mut submit: Submit, ctx: &mut Context<Self>) {
        if self.leaving.contains(&stream) {
            let leaving = "this person is being erased; send it again in a moment";
            submit.answer.send(Response::busy(leaving, RETRY_CROWD_MS));
            return;
        }
        // Twice at most: an address that turns out to be closed is replaced by a fresh one.
        for _ in 0..2 {
            if !self.entries.contains_key(&stream)
                && let Err(response) = self.wake(&stream, &submit.user, ctx)
            {
                return submit.answer.send(*response);
            }
            self.touch(&stream);
            let entry = self.entries.get(&stream).expect("it was there or was just made");
            submit.answer.hold(entry.presence.attend());
            match entry.address.submit.try_send(submit) {
                Ok(()) => return,
                Err(SendError::Full(submit)) => {
                    let full = "you have too many requests waiting; send it again in a moment";
                    submit.answer.send(Response::busy(full, RETRY_FULL_MS));
                    return;
                }
                // The actor died, of a panic: what it was is in the log.
                Err(SendError::Closed(back)) => {
                    tracing::warn!(%stream, "an actor died; a new one is started from the log");
                    self.strike_off(&stream);
                    submit = back;
                }
            }
        }
    }

    /// - errors: the answer when nobody more can be awake.
    fn wake(
        &mut self,
        stream: &StreamId,
        user: &UserId,
        ctx: &mut Context<Self>,
    ) -> Result<(), Box<Response>> {
        use actix::AsyncContext;
        let tenant = &stream.tenant;
        // At its own limit a tenant makes room among its own people, never among others'.
        let awake = self.awake_of(tenant);
        let quota = self.meters.quotas(tenant).awake_users;
        if let Some(limit) = quota.filter(|limit| awake >= *limit as usize)
            && !self.put_to_sleep(tenant)
        {
            return Err(self.meters.refuse_waking(tenant, awake, limit));
        }
        if self.entries.len() >= self.awake_max && !self.put_anyone_to_sleep() {
            self.meters.note_busy(tenant);
            let crowd = "everybody who is awake is busy and no one else can be woken";
            return Err(Box::new(Response::busy(crowd, RETRY_CROWD_MS)));
        }
        self.ticks += 1;
        let (presence, generation) = (Presence::default(), self.ticks);
        let address = self.people.wake(Waking {
            stream: stream.clone(),
            user: user.clone(),
            generation,
            presence: presence.clone(),
            _awake: self.count.enter(),
            leaving: ctx.address().recipient(),
        });
        let entry = Entry { address, presence, generation, tick: self.ticks };
        self.order.entry(tenant.clone()).or_default().insert(self.ticks, stream.clone());
        self.entries.insert(stream.clone(), entry);
        self.meters.note_awake(tenant, self.awake_of(tenant));
        Ok(())
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
        let idle = order
            .values()
            .take(SLEEPERS_TRIED_MAX)
            .find(|stream| self.entries.get(*stream).is_some_and(|entry| entry.presence.is_idle()));
        let Some(stream) = idle.cloned() else { return false };
        self.strike_off(&stream);
        tracing::debug!(%stream, "sleeps");
        true
    }

    /// Removes the entry first and then tells the actor to stop, so that no message can follow.
    pub fn strike_off(&mut self, stream: &StreamId) {
        if let Some(entry) = self.entries.remove(stream) {
            if let Some(order) = self.order.get_mut(&stream.tenant) {
                order.remove(&entry.tick);
                if order.is_empty() {
                    self.order.remove(&stream.tenant);
                }
            }
            self.meters.note_awake(&stream.tenant, self.awake_of(&stream.tenant));
            entry.address.sleep.do_send(Sleep);
        }
    }

    /// What the person's actor has to do; none when they sleep.
    pub fn presence_of(&self, stream: &StreamId) -> Option<Presence> {
        self.entries.get(stream).map(|entry| entry.presence.clone())
    }

    fn touch(&mut self, stream: &StreamId) {
        self.ticks += 1;
        let entry = self.entries.get_mut(stream).expect("the caller looked");
        let order = self.order.entry(stream.tenant.clone()).or_default();
        order.remove(&entry.tick);
        entry.tick = self.ticks;
        order.insert(self.ticks, stream.clone());
    }
}

impl Actor for Directory {
    type Context = Context<Self>;

    fn started(&mut self, ctx: &mut Context<Self>) {
        ctx.set_mailbox_capacity(DIRECTORY_QUEUE_MAX);
    }
}

impl Handler<Submit> for Directory {
    type Result = ();

    fn handle(&mut self, submit: Submit, ctx: &mut Context<Self>) {
        if submit.ask == Ask::Hello {
            submit.answer.send(Response::Hello(self.hello.clone()));
            return;
        }
        sabotage::point("directory");
        match self.people.stream_of(&submit.tenant, &submit.user) {
            Ok(stream) => self.forward(stream, submit, ctx),
            Err(error) => {
                // Where the key stands is the operator's business.
                tracing::error!(tenant = %submit.tenant, %error, "a tenant's key cannot be used");
                let sentence = "this lab's key cannot be used now; an operator must look";
                submit.answer.send(Response::error(ErrorCode::Unavailable, sentence));
            }
        }
    }
}

impl Handler<Leaving> for Directory {
    type Result = ();

    fn handle(&mut self, leaving: Leaving, _: &mut Context<Self>) {
        let Leaving { stream, generation } = leaving;
        if self.entries.get(&stream).is_some_and(|entry| entry.generation == generation) {
            self.strike_off(&stream);
        }
    }
}

impl Handler<SleepAll> for Directory {
    type Result = ();

    fn handle(&mut self, _: SleepAll, _: &mut Context<Self>) {
        let streams: Vec<StreamId> = self.entries.keys().cloned().collect();
        self.awake_max = 0;
        for stream in streams {
            self.strike_off(&stream);
        }
    }
}
