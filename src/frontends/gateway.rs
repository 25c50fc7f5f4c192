use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::counters::{Counters, count};
use super::erasures::{Asked, Erasures};
use super::feed::{Feed, FeedSettings, Views, Watch};
use super::listener::{Incoming, Keyed, Listener, Sender};
use super::lock;
use super::outbox::{Inbox, Outbox};
use super::passes::Passes;
use super::rights::{self, Caller};
use super::unsent::{Parcel, Place, Unsent};
use super::zap::{Authenticator, HandshakeSecret};
use crate::actors::{AnswerTo, Failure, Front, NotTaken, Registrar, Submit, list_tenants};
use crate::client::wire::{self, Refused};
use crate::client::{
    Ask, Context, CurveKey, Endpoint, ErasedView, ErrorCode, Failed, Ordered, Response, ServiceAsk,
    TenantAsk, TenantVerb,
};
use crate::ids::{RequestId, TenantId, UserId};
use crate::limits::{IN_HAND_BYTES_MAX, UNSENT_BYTES_MAX, UNSENT_CONNECTION_BYTES_MAX};
use crate::sabotage;

/// The thread that owns the ROUTER sockets. It polls them, and the outbox of the actors.
#[derive(Debug)]
pub struct Gateway {
    open: Vec<String>,
    keyed: Vec<String>,
    counters: Arc<Counters>,
    stopping: Arc<AtomicBool>,
    outbox: Outbox<Outgoing>,
    thread: Option<JoinHandle<()>>,
    feed: Option<Feed>,
    // Dropped last, when the gateway's thread has closed its sockets: without an authenticator
    // ZeroMQ accepts every connection.
    _authenticator: Option<Authenticator>,
}

/// Where a gateway listens.
#[derive(Debug)]
pub struct Endpoints<'a> {
    /// The name inside the process, in the gateway's context.
    pub inner: &'a str,
    /// Without keys: every client there is the single user of this machine.
    pub open: &'a [Endpoint],
    /// With keys.
    pub keyed: Option<KeyedEndpoints<'a>>,
}

/// Endpoints that accept only admitted keys.
#[derive(Debug)]
pub struct KeyedEndpoints<'a> {
    /// Where they are.
    pub endpoints: &'a [Endpoint],
    /// The service's own key.
    pub key: &'a CurveKey,
    /// The feed, if there is one.
    pub feed: Option<FeedSettings<'a>>,
}

/// Why the gateway did not open.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GatewayError {
    /// The address is in use or does not exist.
    #[error("cannot listen on {endpoint}: {reason}")]
    Bind { endpoint: String, reason: String },
    /// There are endpoints with keys, and ZeroMQ was built without CURVE.
    #[error(
        "this build of ZeroMQ has no CURVE, so the service could not know who connects; {}",
        crate::client::REBUILD_WITH_CURVE
    )]
    NoCurve,
    /// A socket cannot be made, or a thread does not start.
    #[error("the gateway did not start: {reason}")]
    Start { reason: String },
}

/// An answer that is to be sent.
#[derive(Debug)]
struct Outgoing {
    peer: Peer,
    parcel: Parcel,
}

/// Where an answer goes. It does not prove who sent the request.
#[derive(Debug, Clone)]
struct Peer {
    /// The place of its listener in [`EventLoop::listeners`].
    listener: usize,
    routing_id: Vec<u8>,
    /// A REQ socket puts an empty frame before the message, and needs one before the answer.
    delimiter: bool,
    /// The tenant whose bytes its answers count as; none if the key is not admitted now.
    tenant: Option<TenantId>,
}

/// Milliseconds after which a request may be sent again if the gateway was full.
const RETRY_FULL_MS: u32 = 200;
/// How long a stop waits for the answers to requests that actors already have.
const DRAIN: Duration = Duration::from_secs(10);
/// Messages that are read before answers are sent again, so that neither direction waits too long.
const BURST: usize = 256;

impl Gateway {
    /// Listens at all of `endpoints`.
    ///
    /// - errors: see [`GatewayError`].
    pub fn open(
        context: &Context,
        endpoints: Endpoints<'_>,
        front: Front,
        registrar: Registrar,
        failure: Failure,
    ) -> Result<Gateway, GatewayError> {
        let start = |reason: String| GatewayError::Start { reason };
        let (outbox, inbox) = Outbox::new().map_err(|error| start(error.to_string()))?;
        let counters = Arc::new(Counters::default());
        let listener = Listener::new(context, None)?;
        listener.bind_inner(endpoints.inner)?;
        let open = listener.bind(endpoints.open)?;
        let mut keyed = Vec::new();
        let mut listeners = vec![listener];
        let (mut authenticator, mut feed) = (None, None);
        if let Some(KeyedEndpoints { endpoints, key, feed: wanted }) = endpoints.keyed {
            lock::check(zmq::has("curve"))?;
            let (secret, wake) = (HandshakeSecret::fresh(), outbox.clone());
            let (admissions, passes) = (registrar.admissions().clone(), Passes::new());
            let started = Authenticator::start(
                context,
                secret.clone(),
                admissions.clone(),
                passes.clone(),
                counters.clone(),
                failure.clone(),
                move || wake.wake(),
            );
            authenticator = Some(started.map_err(start)?);
            let watch = Watch {
                admissions: admissions.clone(),
                secret: secret.clone(),
                passes: passes.clone(),
                counters: counters.clone(),
                front: front.clone(),
            };
            let listener = Listener::new(context, Some(Keyed { key, admissions, secret, passes }))?;
            keyed = listener.bind(endpoints)?;
            listeners.push(listener);
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
        let event_loop = EventLoop {
            listeners,
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
                event_loop.serve(inbox);
            })
            .map_err(|error| start(error.to_string()))?;
        started.recv().map_err(|_| start("its thread ended at once".to_owned()))?;
        tracing::info!(?open, with_keys = ?keyed, "listening");
        Ok(Gateway {
            open,
            keyed,
            counters,
            stopping,
            outbox,
            thread: Some(thread),
            feed,
            _authenticator: authenticator,
        })
    }

    /// The endpoints without keys, each with its port.
    pub fn open_endpoints(&self) -> &[String] {
        &self.open
    }

    /// The endpoints with keys, each with its port.
    pub fn keyed_endpoints(&self) -> &[String] {
        &self.keyed
    }

    /// The endpoints of the feed, each with its tenant and whether its records are decrypted.
    pub fn feed_endpoints(&self) -> Vec<(TenantId, bool, String)> {
        self.feed.as_ref().map(|feed| feed.views().all()).unwrap_or_default()
    }

    /// Counts what comes through the endpoints.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Refuses new requests, sends the answers to those that actors already have, and closes the
    /// sockets. Blocks.
    pub fn close(&mut self) {
        self.stopping.store(true, Ordering::SeqCst);
        self.outbox.wake();
        if let Some(thread) = self.thread.take() {
            // A panic in there was reported by its alarm.
            let _ = thread.join();
        }
        // After the last answers, so that the records of these answers are published, too.
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
    listeners: Vec<Listener>,
    front: Front,
    registrar: Registrar,
    erasures: Erasures<ErasedView>,
    feed: Option<Views>,
    failure: Failure,
    counters: Arc<Counters>,
    stopping: Arc<AtomicBool>,
    /// Requests that actors have and have not answered yet.
    in_flight: Arc<AtomicUsize>,
    outbox: Outbox<Outgoing>,
    packer: Packer,
    /// Bytes of these requests.
    in_hand: Unsent,
}

/// Reserves space for answers until they have left the process.
#[derive(Clone)]
struct Packer {
    unsent: Unsent,
    /// The same for connections whose key is not admitted now.
    denials: Unsent,
    counters: Arc<Counters>,
    front: Front,
}

impl Packer {
    /// - returns: none if there is no space: the answer is dropped and counted. It is always safe
    ///   to ask again with the same request id.
    fn pack(&self, peer: &Peer, bytes: Vec<u8>) -> Option<Parcel> {
        let connection = Some((peer.listener, peer.routing_id.clone()));
        let parcel = match &peer.tenant {
            Some(tenant) => self.unsent.pack(tenant, connection, bytes),
            None => self.denials.pack(&TenantId::local(), connection, bytes),
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
            let (readable, bell) = match self.poll(&inbox, timeout_ms) {
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
            // If the log is poisoned, no answer may be sent: nothing would prove it. Clients ask
            // again when the next process runs.
            if self.failure.reason().is_some() {
                return;
            }
            for place in readable {
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

    /// - returns: the places of the listeners that have messages, and whether the outbox has
    ///   answers.
    fn poll(&self, inbox: &Inbox<Outgoing>, timeout_ms: i64) -> zmq::Result<(Vec<usize>, bool)> {
        let mut items = vec![zmq::PollItem::from_fd(inbox.fd(), zmq::POLLIN)];
        items.extend(
            self.listeners.iter().map(|listener| listener.socket.as_poll_item(zmq::POLLIN)),
        );
        match zmq::poll(&mut items, timeout_ms) {
            Ok(_) => {}
            Err(zmq::Error::EINTR) => return Ok((Vec::new(), false)),
            Err(error) => return Err(error),
        }
        let readable = |place: &usize| items[place + 1].is_readable();
        Ok(((0..self.listeners.len()).filter(readable).collect(), items[0].is_readable()))
    }

    fn read(&self, place: usize) -> zmq::Result<()> {
        for _ in 0..BURST {
            match self.listeners[place].receive() {
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
            // Not even an error is sent to a connection that was never authenticated.
            tracing::warn!("dropped a message from a connection that was never authenticated");
            return count(&counters.unvouched);
        }
        let delimiter = rest.len() > 1 && rest[0].is_empty();
        if delimiter {
            rest.remove(0);
        }
        let own_address = self.listeners[place].is_own_address(&routing_id);
        let tenant = match &sender {
            Sender::Known(caller) => Some(caller.tenant()),
            Sender::NotAdmitted(_) | Sender::Unvouched => None,
        };
        let peer = Peer { listener: place, routing_id, delimiter, tenant };
        if too_many || rest.len() != 1 {
            // It is not known which of the frames has the id.
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

    /// Gives a request to whom it is for.
    ///
    /// - `bytes`: the size of its frame.
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
            Ask::Service(ServiceAsk::Hello) => self.front.greet(answer),
            Ask::Service(ServiceAsk::Feed) => return answer.send(self.feed_of(&caller)),
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

    /// Where an actor sends the answer to this request.
    ///
    /// - `in_hand`: the space of the request; it is free again with the answer.
    fn answer_to(&self, peer: Peer, id: RequestId, in_hand: Place) -> AnswerTo {
        self.in_flight.fetch_add(1, Ordering::SeqCst);
        let (in_flight, outbox) = (self.in_flight.clone(), self.outbox.clone());
        let packer = self.packer.clone();
        AnswerTo::new(move |response| {
            drop(in_hand);
            // Encoded on the actor's thread, so that the gateway's thread has less to do.
            let bytes = wire::encode_response(id, response);
            if let Some(parcel) = packer.pack(&peer, bytes) {
                outbox.put(Outgoing { peer, parcel });
            }
            in_flight.fetch_sub(1, Ordering::SeqCst);
        })
    }

    /// Carries out an order. The caller may give it.
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
        let listener = &self.listeners[peer.listener];
        let mut frames = vec![peer.routing_id];
        if peer.delimiter {
            frames.push(Vec::new());
        }
        match listener.socket.send_parcel(frames, parcel) {
            Ok(()) => count(&self.counters.answered),
            // The client is gone or does not read. If it asks again with the same id, the answer
            // comes from the log.
            Err(_) => count(&self.counters.undelivered),
        }
    }
}
