use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::counters::{Counters, count};
use super::door::{Door, Incoming, Keyed, Sender};
use super::erasures::{Asked, Erasures};
use super::feed::{Feed, FeedDoor, Views, Watch};
use super::lock;
use super::outbox::{Inbox, Outbox};
use super::passes::Passes;
use super::rights::{self, Caller};
use super::unsent::{Parcel, Place, Unsent};
use super::zap::{Authenticator, Seal};
use crate::actors::{AnswerTo, Failure, Front, NotTaken, Registrar, Submit, list_tenants};
use crate::client::wire::{self, Refused};
use crate::client::{
    Ask, Context, CurveKey, DoorAsk, Endpoint, ErasedView, ErrorCode, Failed, Ordered, Response,
    TenantAsk, TenantVerb,
};
use crate::ids::{RequestId, TenantId, UserId};
use crate::limits::{IN_HAND_BYTES_MAX, UNSENT_BYTES_MAX, UNSENT_CONNECTION_BYTES_MAX};
use crate::sabotage;

/// The doors: one thread that owns their ROUTERs and polls them together with the outbox of the
/// actors.
#[derive(Debug)]
pub struct Gateway {
    open: Vec<String>,
    locked: Vec<String>,
    counters: Arc<Counters>,
    stopping: Arc<AtomicBool>,
    outbox: Outbox<Outgoing>,
    thread: Option<JoinHandle<()>>,
    feed: Option<Feed>,
    // After the gateway's thread has closed its sockets: without it handshakes fail open.
    _authenticator: Option<Authenticator>,
}

/// Where a gateway listens.
#[derive(Debug)]
pub struct Doors<'a> {
    /// The name inside the process, in the context it is opened in.
    pub inner: &'a str,
    /// Without keys: whoever reaches these is the single user of this machine.
    pub open: &'a [Endpoint],
    /// With keys.
    pub locked: Option<LockedDoor<'a>>,
}

/// Where only those come in whose key was admitted.
#[derive(Debug)]
pub struct LockedDoor<'a> {
    pub endpoints: &'a [Endpoint],
    pub key: &'a CurveKey,
    /// Where what becomes durable is published.
    pub feed: Option<FeedDoor<'a>>,
}

/// Why the gateway did not open.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GatewayError {
    #[error("cannot listen on {endpoint}: {reason}")]
    Bind { endpoint: String, reason: String },
    #[error(
        "this build of ZeroMQ has no CURVE, so nobody could tell who is knocking; {}",
        crate::client::REBUILD_WITH_CURVE
    )]
    NoCurve,
    #[error("the gateway did not start: {reason}")]
    Start { reason: String },
}

/// An answer on its way to a peer.
#[derive(Debug)]
struct Outgoing {
    peer: Peer,
    parcel: Parcel,
}

/// Whom a message came from. Only a way back: never a proof of who they are.
#[derive(Debug, Clone)]
struct Peer {
    /// The place of its door in [`EventLoop::doors`].
    door: usize,
    routing_id: Vec<u8>,
    /// REQ sockets put an empty frame between envelope and message and want it back.
    delimiter: bool,
    /// Whose bytes its answers count as; none: of a key that is not admitted any more.
    tenant: Option<TenantId>,
}

/// Milliseconds after which a request that met a full gateway may be sent again.
const RETRY_FULL_MS: u32 = 200;
/// How long a stop waits for requests that actors already have.
const DRAIN: Duration = Duration::from_secs(10);
/// Messages read before answers are sent again, so that neither direction starves.
const BURST: usize = 256;

impl Gateway {
    /// Opens all of `doors`.
    ///
    /// - errors: an address that is taken or does not exist; keys wanted where ZeroMQ has none.
    pub fn open(
        context: &Context,
        doors: Doors<'_>,
        front: Front,
        registrar: Registrar,
        failure: Failure,
    ) -> Result<Gateway, GatewayError> {
        let start = |reason: String| GatewayError::Start { reason };
        let (outbox, inbox) = Outbox::new().map_err(|error| start(error.to_string()))?;
        let counters = Arc::new(Counters::default());
        let door = Door::new(context, None)?;
        door.bind_inner(doors.inner)?;
        let open = door.bind(doors.open)?;
        let mut locked = Vec::new();
        let mut routers = vec![door];
        let (mut authenticator, mut feed) = (None, None);
        if let Some(LockedDoor { endpoints, key, feed: wanted }) = doors.locked {
            lock::check(zmq::has("curve"))?;
            let (seal, wake) = (Seal::fresh(), outbox.clone());
            let (admissions, passes) = (registrar.admissions().clone(), Passes::new());
            let keeper = Authenticator::start(
                context,
                seal.clone(),
                admissions.clone(),
                passes.clone(),
                counters.clone(),
                failure.clone(),
                move || wake.wake(),
            );
            authenticator = Some(keeper.map_err(start)?);
            let watch = Watch {
                admissions: admissions.clone(),
                seal: seal.clone(),
                passes: passes.clone(),
                counters: counters.clone(),
                front: front.clone(),
            };
            let door = Door::new(context, Some(Keyed { key, admissions, seal, passes }))?;
            locked = door.bind(endpoints)?;
            routers.push(door);
            let open = |wanted| Feed::open(context, wanted, key, watch, failure.clone());
            feed = wanted.map(open).transpose()?;
        }
        let stopping = Arc::new(AtomicBool::new(false));
        let packer = Packer {
            unsent: Unsent::new(UNSENT_BYTES_MAX),
            denials: Unsent::new(UNSENT_CONNECTION_BYTES_MAX),
            counters: counters.clone(),
            front: front.clone(),
        };
        let hall = EventLoop {
            doors: routers,
            front,
            registrar,
            erasures: Erasures::new(),
            feed: feed.as_ref().map(|feed| feed.views().clone()),
            failure: failure.clone(),
            counters: counters.clone(),
            stopping: stopping.clone(),
            in_flight: Arc::new(AtomicUsize::new(0)),
            outbox: outbox.clone(),
            packer,
            in_hand: Unsent::new(IN_HAND_BYTES_MAX),
        };
        let (ready, started) = mpsc::channel();
        let thread = thread::Builder::new()
            .name("gateway".to_owned())
            .spawn(move || {
                let _alarm = failure.alarm("the gateway's thread ended");
                let _ = ready.send(());
                hall.serve(inbox);
            })
            .map_err(|error| start(error.to_string()))?;
        started.recv().map_err(|_| start("its thread ended at once".to_owned()))?;
        tracing::info!(?open, with_keys = ?locked, "listening");
        Ok(Gateway {
            open,
            locked,
            counters,
            stopping,
            outbox,
            thread: Some(thread),
            feed,
            _authenticator: authenticator,
        })
    }

    /// The endpoints without keys as they are bound, with the ports that were taken.
    pub fn open_endpoints(&self) -> &[String] {
        &self.open
    }

    /// The endpoints with keys.
    pub fn locked_endpoints(&self) -> &[String] {
        &self.locked
    }

    /// The endpoints of the feed, with their tenants and whether records are in the clear there.
    pub fn feed_endpoints(&self) -> Vec<(TenantId, bool, String)> {
        self.feed.as_ref().map(|feed| feed.views().all()).unwrap_or_default()
    }

    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Takes no more requests, answers those that actors already have, and closes the sockets.
    pub fn close(&mut self) {
        self.stopping.store(true, Ordering::SeqCst);
        self.outbox.wake();
        if let Some(thread) = self.thread.take() {
            // A panic in there was reported by its alarm.
            let _ = thread.join();
        }
        // After the last answers: what they say was recorded is published, too.
        if let Some(feed) = &mut self.feed {
            feed.close();
        }
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        self.close();
    }
}

/// What the gateway's thread owns.
struct EventLoop {
    doors: Vec<Door>,
    front: Front,
    registrar: Registrar,
    erasures: Erasures<ErasedView>,
    feed: Option<Views>,
    failure: Failure,
    counters: Arc<Counters>,
    stopping: Arc<AtomicBool>,
    /// Requests handed to actors and not yet answered.
    in_flight: Arc<AtomicUsize>,
    outbox: Outbox<Outgoing>,
    packer: Packer,
    /// Bytes of requests handed to actors and not yet answered.
    in_hand: Unsent,
}

/// Gives answers their place among those that have not left the process.
#[derive(Clone)]
struct Packer {
    unsent: Unsent,
    /// The same, for connections of keys that are not admitted any more.
    denials: Unsent,
    counters: Arc<Counters>,
    front: Front,
}

impl Packer {
    /// - returns: none when there is no room: the answer is dropped and counted. Asking again with
    ///   the same request id is always safe.
    fn pack(&self, peer: &Peer, bytes: Vec<u8>) -> Option<Parcel> {
        let line = Some((peer.door, peer.routing_id.clone()));
        let parcel = match &peer.tenant {
            Some(tenant) => self.unsent.pack(tenant, line, bytes),
            None => self.denials.pack(&TenantId::local(), line, bytes),
        };
        if parcel.is_none() {
            count(&self.counters.unread);
            peer.tenant.iter().for_each(|tenant| self.front.note_unread(tenant));
        }
        parcel
    }
}

impl EventLoop {
    fn serve(self, mut inbox: Inbox<Outgoing>) {
        let mut stop_by = None;
        loop {
            let timeout_ms = if stop_by.is_some() { 20 } else { 1_000 };
            let (knocks, bell) = match self.poll(&inbox, timeout_ms) {
                Ok(ready) => ready,
                Err(error) => {
                    self.failure.report(format!("the gateway cannot poll its socket: {error}"));
                    return;
                }
            };
            if bell {
                for outgoing in inbox.drain() {
                    self.send(outgoing);
                }
            }
            // A log that is poisoned acknowledges nothing: whoever asks now gets silence and
            // retries with the next process, never an answer that nothing stands behind.
            if self.failure.reason().is_some() {
                return;
            }
            for place in knocks {
                if let Err(error) = self.read(place) {
                    self.failure.report(format!("the gateway cannot read its socket: {error}"));
                    return;
                }
            }
            if self.stopping.load(Ordering::SeqCst) {
                let stop_by = *stop_by.get_or_insert_with(|| Instant::now() + DRAIN);
                let answered = self.in_flight.load(Ordering::SeqCst) == 0;
                if answered || Instant::now() >= stop_by {
                    inbox.drain().into_iter().for_each(|outgoing| self.send(outgoing));
                    return;
                }
            }
        }
    }

    /// - returns: the places of the doors that have messages, and whether the outbox has answers.
    fn poll(&self, inbox: &Inbox<Outgoing>, timeout_ms: i64) -> zmq::Result<(Vec<usize>, bool)> {
        let mut items = vec![zmq::PollItem::from_fd(inbox.fd(), zmq::POLLIN)];
        items.extend(self.doors.iter().map(|door| door.socket.as_poll_item(zmq::POLLIN)));
        match zmq::poll(&mut items, timeout_ms) {
            Ok(_) => {}
            Err(zmq::Error::EINTR) => return Ok((Vec::new(), false)),
            Err(error) => return Err(error),
        }
        let readable = |place: &usize| items[place + 1].is_readable();
        Ok(((0..self.doors.len()).filter(readable).collect(), items[0].is_readable()))
    }

    fn read(&self, place: usize) -> zmq::Result<()> {
        for _ in 0..BURST {
            match self.doors[place].receive() {
                Ok(message) => self.take(place, message),
                Err(zmq::Error::EAGAIN) => return Ok(()),
                Err(zmq::Error::EINTR) => continue,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn take(&self, place: usize, Incoming { frames, too_many, sender }: Incoming) {
        sabotage::point("gateway");
        let counters = &self.counters;
        count(&counters.received);
        let mut frames = frames.into_iter();
        let Some(routing_id) = frames.next() else { return };
        let mut rest: Vec<Vec<u8>> = frames.collect();
        if let Sender::Unvouched = sender {
            // Nothing is said to whoever came in although nobody answered their handshake.
            tracing::warn!("dropped a message from a connection that nobody vouched for");
            return count(&counters.unvouched);
        }
        let delimiter = rest.len() > 1 && rest[0].is_empty();
        if delimiter {
            rest.remove(0);
        }
        let own_address = self.doors[place].is_own_address(&routing_id);
        let tenant = match &sender {
            Sender::Known(caller) => Some(caller.tenant()),
            Sender::NotAdmitted(_) | Sender::Unvouched => None,
        };
        let peer = Peer { door: place, routing_id, delimiter, tenant };
        if too_many || rest.len() != 1 {
            // Which of the frames was meant to carry the id cannot be known.
            tracing::debug!(frames = rest.len(), "dropped a message that is not one frame");
            return count(&counters.dropped);
        }
        let read = wire::decode_request(&rest[0]);
        let id = match &read {
            Ok(request) => Some(request.id),
            Err(refused) => refused.id,
        };
        let Some(id) = id else {
            tracing::debug!("dropped a message without a request id");
            return count(&counters.dropped);
        };
        let caller = match sender {
            Sender::Known(caller) if own_address => caller,
            Sender::Known(_) => return self.deny(peer, id, rights::routing_id_chosen()),
            Sender::NotAdmitted(key) => {
                tracing::debug!(%key, "denied a message of a key that is not admitted");
                return self.deny(peer, id, rights::not_admitted());
            }
            Sender::Unvouched => return,
        };
        match read {
            Ok(request) => match caller.may(&request.ask) {
                Ok(()) => self.submit(peer, caller, request, rest[0].len()),
                Err(failed) => self.deny(peer, id, failed),
            },
            Err(Refused { failed, .. }) => {
                count(&counters.refused);
                self.answer(peer, id, Response::Error(failed));
            }
        }
    }

    /// - `bytes`: of the frame that the request was read from.
    fn submit(&self, peer: Peer, caller: Caller, request: wire::Request, bytes: usize) {
        let wire::Request { id, user, ask } = request;
        if self.stopping.load(Ordering::SeqCst) {
            return self.busy(peer, id, "the service is stopping");
        }
        let tenant = caller.tenant();
        let Some(in_hand) = self.in_hand.place(&tenant, None, bytes) else {
            return self.busy(peer, id, "the requests that the service has in hand are too large");
        };
        let mut answer = self.answer_to(peer, id, in_hand);
        if let Err(response) = self.front.let_in(&tenant, &ask, &mut answer) {
            return self.over(answer, *response);
        }
        let taken = match ask {
            Ask::Person(ask) => {
                self.front.submit(Submit { tenant, user, request: id, ask, answer })
            }
            Ask::Archive(ask) => self.front.ask_archive(tenant, ask, answer),
            Ask::Door(DoorAsk::Hello) => self.front.greet(answer),
            Ask::Door(DoorAsk::Feed) => return answer.send(self.feed_of(&caller)),
            Ask::Order(order) => return self.order(&caller, order, id, answer),
        };
        match taken {
            Ok(()) => {}
            Err(NotTaken::Full(answer)) => {
                count(&self.counters.busy);
                let full = "the service has too many requests in hand";
                answer.send(Response::busy(full, RETRY_FULL_MS));
            }
            Err(NotTaken::Closed(answer)) => {
                self.failure.report("the directory of people is gone");
                let gone = "the service is being restarted";
                answer.send(Response::error(ErrorCode::Unavailable, gone));
            }
        }
    }

    /// Where the feed of the caller's tenant is.
    fn feed_of(&self, caller: &Caller) -> Response {
        let plain = caller.is_one_of(rights::PLAIN);
        let view = |views: &Views| Response::Feed(views.view(&caller.tenant(), plain));
        let none = || Response::error(ErrorCode::Unavailable, "this service has no feed");
        self.feed.as_ref().map_or_else(none, view)
    }

    fn over(&self, answer: AnswerTo, response: Response) {
        let counter = match response {
            Response::QuotaExceeded(_) => &self.counters.over_quota,
            _ => &self.counters.busy,
        };
        count(counter);
        answer.send(response);
    }

    /// The way back for an answer that is not here yet.
    ///
    /// - `in_hand`: what ends with the answer.
    fn answer_to(&self, peer: Peer, id: RequestId, in_hand: Place) -> AnswerTo {
        self.in_flight.fetch_add(1, Ordering::SeqCst);
        let (in_flight, outbox) = (self.in_flight.clone(), self.outbox.clone());
        let packer = self.packer.clone();
        AnswerTo::new(move |response| {
            drop(in_hand);
            // Encoded here, by the actor's thread: the gateway's only carries.
            let bytes = wire::encode_response(id, response);
            if let Some(parcel) = packer.pack(&peer, bytes) {
                outbox.put(Outgoing { peer, parcel });
            }
            in_flight.fetch_sub(1, Ordering::SeqCst);
        })
    }

    /// Carries out an order of somebody who may give it.
    fn order(
        &self,
        caller: &Caller,
        TenantAsk { tenant, verb }: TenantAsk,
        id: RequestId,
        answer: AnswerTo,
    ) {
        match verb {
            TenantVerb::List => {
                let only = if caller.is_host() { tenant } else { Some(caller.tenant()) };
                let tenants = list_tenants(self.registrar.admissions(), only.as_ref());
                answer.send(Response::Tenants(tenants));
            }
            TenantVerb::Erase { user } => {
                self.erase(tenant.unwrap_or_else(|| caller.tenant()), user, id, answer);
            }
            TenantVerb::Give(order) => {
                let tenant = tenant.unwrap_or_else(|| caller.tenant());
                self.registrar.order(tenant.clone(), order.into(), move |obeyed| {
                    answer.send(match obeyed {
                        Ok(events) => {
                            Response::Ordered(Ordered { tenant, recorded: events.len() as u32 })
                        }
                        Err(error) => error.into(),
                    });
                });
            }
        }
    }

    fn erase(&self, tenant: TenantId, user: UserId, id: RequestId, answer: AnswerTo) {
        match self.erasures.ask(&tenant, id) {
            Asked::First => {}
            Asked::UnderWay => {
                let under_way = "this person is being erased; ask again in a moment";
                return answer.send(Response::busy(under_way, RETRY_FULL_MS));
            }
            Asked::Done(view) => return answer.send(Response::Erased(view)),
        }
        let erasures = self.erasures.clone();
        self.front.erase(tenant.clone(), user, move |erased| {
            let (view, response) = match erased {
                Ok(erased) => {
                    let view = ErasedView { tenant: tenant.clone(), erased };
                    (Some(view.clone()), Response::Erased(view))
                }
                Err(error) => (None, error.into()),
            };
            erasures.end(&tenant, id, view);
            answer.send(response);
        });
    }

    fn deny(&self, peer: Peer, id: RequestId, failed: Failed) {
        count(&self.counters.denied);
        self.answer(peer, id, Response::Error(failed));
    }

    fn busy(&self, peer: Peer, id: RequestId, why: &str) {
        count(&self.counters.busy);
        self.answer(peer, id, Response::busy(why, RETRY_FULL_MS));
    }

    fn answer(&self, peer: Peer, id: RequestId, response: Response) {
        if let Some(parcel) = self.packer.pack(&peer, wire::encode_response(id, response)) {
            self.send(Outgoing { peer, parcel });
        }
    }

    fn send(&self, Outgoing { peer, parcel }: Outgoing) {
        let door = &self.doors[peer.door];
        let mut frames = vec![peer.routing_id];
        if peer.delimiter {
            frames.push(Vec::new());
        }
        match door.socket.send_parcel(frames, parcel) {
            Ok(()) => count(&self.counters.answered),
            // Gone, or not reading. A retry with the same id finds the answer in the log.
            Err(_) => count(&self.counters.undelivered),
        }
    }
}
