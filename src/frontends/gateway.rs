use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::outbox::{Inbox, Outbox};
use super::wire::{self, Refused};
use super::{Context, Endpoint};
use crate::actors::{AnswerTo, ErrorCode, Failure, Front, NotTaken, Response, Submit};
use crate::ids::{RequestId, TenantId};
use crate::limits::{FRAME_BYTES_MAX, FRAMES_MAX};
use crate::sabotage;

/// The door: one thread that owns the ROUTER and polls it together with the outbox of the actors.
#[derive(Debug)]
pub struct Gateway {
    endpoints: Vec<String>,
    counters: Arc<Counters>,
    stopping: Arc<AtomicBool>,
    outbox: Outbox<Outgoing>,
    thread: Option<JoinHandle<()>>,
}

/// Why the gateway did not open.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GatewayError {
    #[error("cannot listen on {endpoint}: {reason}")]
    Bind { endpoint: String, reason: String },
    #[error("the gateway did not start: {reason}")]
    Start { reason: String },
}

/// An answer on its way to a peer.
#[derive(Debug)]
struct Outgoing {
    peer: Peer,
    bytes: Vec<u8>,
}

/// Whom a message came from. Only a way back: never a proof of who they are.
#[derive(Debug, Clone)]
struct Peer {
    routing_id: Vec<u8>,
    /// REQ sockets put an empty frame between envelope and message and want it back.
    delimiter: bool,
}

/// Milliseconds after which a request that met a full gateway may be sent again.
const RETRY_FULL_MS: u32 = 200;
/// How long a stop waits for requests that actors already have.
const DRAIN: Duration = Duration::from_secs(10);
/// Messages read before answers are sent again, so that neither direction starves.
const BURST: usize = 256;
/// Milliseconds that answers already sent may take to leave the process at a stop.
const LINGER_MS: i32 = 1_000;

impl Gateway {
    /// Listens on `inner` (an inproc name of `context`) and on all of `outer`.
    ///
    /// - `tenant`: whose door this is; no request can say otherwise.
    /// - errors: an address that is taken or does not exist.
    pub fn open(
        context: &Context,
        inner: &str,
        outer: &[Endpoint],
        tenant: TenantId,
        front: Front,
        failure: Failure,
    ) -> Result<Gateway, GatewayError> {
        let start = |reason: String| GatewayError::Start { reason };
        let (outbox, inbox) = Outbox::new().map_err(|error| start(error.to_string()))?;
        let (router, endpoints) = bind(context, inner, outer)?;
        let counters = Arc::new(Counters::default());
        let stopping = Arc::new(AtomicBool::new(false));
        let door = Door {
            router,
            tenant,
            front,
            failure: failure.clone(),
            counters: counters.clone(),
            stopping: stopping.clone(),
            in_flight: Arc::new(AtomicUsize::new(0)),
            outbox: outbox.clone(),
        };
        let (ready, started) = mpsc::channel();
        let thread = thread::Builder::new()
            .name("gateway".to_owned())
            .spawn(move || {
                let _alarm = failure.alarm("the gateway's thread ended");
                let _ = ready.send(());
                door.serve(inbox);
            })
            .map_err(|error| start(error.to_string()))?;
        started.recv().map_err(|_| start("its thread ended at once".to_owned()))?;
        tracing::info!(?endpoints, "listening");
        Ok(Gateway { endpoints, counters, stopping, outbox, thread: Some(thread) })
    }

    /// The outer endpoints as they are bound, with the ports that were taken.
    pub fn endpoints(&self) -> &[String] {
        &self.endpoints
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
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        self.close();
    }
}

fn bind(
    context: &Context,
    inner: &str,
    outer: &[Endpoint],
) -> Result<(zmq::Socket, Vec<String>), GatewayError> {
    let start = |error: zmq::Error| GatewayError::Start { reason: error.to_string() };
    let router = context.socket(zmq::ROUTER).map_err(start)?;
    // An answer for a peer that is gone, or that does not read, is an error that is counted; it
    // must neither vanish silently nor block everybody else.
    router.set_router_mandatory(true).map_err(start)?;
    // A peer that sends larger frames than this is disconnected before its bytes fill the memory;
    // between the two bounds it gets a sentence.
    router.set_maxmsgsize(2 * FRAME_BYTES_MAX as i64).map_err(start)?;
    router.set_linger(LINGER_MS).map_err(start)?;
    router.set_ipv6(outer.iter().any(is_ipv6)).map_err(start)?;
    router.bind(inner).map_err(start)?;
    let mut endpoints = Vec::new();
    for endpoint in outer {
        let endpoint = endpoint.to_string();
        let refused = |reason: String| GatewayError::Bind { endpoint: endpoint.clone(), reason };
        router.bind(&endpoint).map_err(|error| refused(error.to_string()))?;
        let bound = router.get_last_endpoint().map_err(|error| refused(error.to_string()))?;
        endpoints.push(bound.map_err(|_| refused("its name is not UTF-8".to_owned()))?);
    }
    Ok((router, endpoints))
}

fn is_ipv6(endpoint: &Endpoint) -> bool {
    matches!(endpoint, Endpoint::Loopback(address) if address.is_ipv6())
}

/// What the gateway's thread owns.
struct Door {
    router: zmq::Socket,
    tenant: TenantId,
    front: Front,
    failure: Failure,
    counters: Arc<Counters>,
    stopping: Arc<AtomicBool>,
    /// Requests handed to actors and not yet answered.
    in_flight: Arc<AtomicUsize>,
    outbox: Outbox<Outgoing>,
}

impl Door {
    fn serve(self, mut inbox: Inbox<Outgoing>) {
        let mut stop_by = None;
        loop {
            let timeout_ms = if stop_by.is_some() { 20 } else { 1_000 };
            let (knock, bell) = match self.poll(&inbox, timeout_ms) {
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
            if knock && let Err(error) = self.read() {
                self.failure.report(format!("the gateway cannot read its socket: {error}"));
                return;
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

    /// - returns: whether the ROUTER has messages, and whether the outbox has answers.
    fn poll(&self, inbox: &Inbox<Outgoing>, timeout_ms: i64) -> zmq::Result<(bool, bool)> {
        let mut items = [
            self.router.as_poll_item(zmq::POLLIN),
            zmq::PollItem::from_fd(inbox.fd(), zmq::POLLIN),
        ];
        match zmq::poll(&mut items, timeout_ms) {
            Ok(_) => Ok((items[0].is_readable(), items[1].is_readable())),
            Err(zmq::Error::EINTR) => Ok((false, false)),
            Err(error) => Err(error),
        }
    }

    fn read(&self) -> zmq::Result<()> {
        for _ in 0..BURST {
            match self.receive() {
                Ok(message) => self.take(message),
                Err(zmq::Error::EAGAIN) => return Ok(()),
                Err(zmq::Error::EINTR) => continue,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// One whole message, of which no more than [`FRAMES_MAX`] frames are kept; the bool says
    /// whether there were more.
    fn receive(&self) -> zmq::Result<(Vec<Vec<u8>>, bool)> {
        let mut frames = vec![self.router.recv_bytes(zmq::DONTWAIT)?];
        let mut too_many = false;
        while self.router.get_rcvmore()? {
            // The frames of one message arrive together: this does not wait.
            let frame = self.router.recv_msg(0)?;
            match frames.len() < FRAMES_MAX {
                true => frames.push(frame.to_vec()),
                false => too_many = true,
            }
        }
        Ok((frames, too_many))
    }

    fn take(&self, (frames, too_many): (Vec<Vec<u8>>, bool)) {
        sabotage::point("gateway");
        let counters = &self.counters;
        counters.received.fetch_add(1, Ordering::Relaxed);
        let mut frames = frames.into_iter();
        let Some(routing_id) = frames.next() else { return };
        let mut rest: Vec<Vec<u8>> = frames.collect();
        let delimiter = rest.len() > 1 && rest[0].is_empty();
        if delimiter {
            rest.remove(0);
        }
        let peer = Peer { routing_id, delimiter };
        if too_many || rest.len() != 1 {
            // Which of the frames was meant to carry the id cannot be known.
            tracing::debug!(frames = rest.len(), "dropped a message that is not one frame");
            counters.dropped.fetch_add(1, Ordering::Relaxed);
            return;
        }
        match wire::decode_request(&rest[0]) {
            Ok(request) => self.submit(peer, request),
            Err(Refused { id: Some(id), failed }) => {
                counters.refused.fetch_add(1, Ordering::Relaxed);
                self.answer(peer, id, Response::Error(failed));
            }
            Err(Refused { id: None, failed }) => {
                counters.dropped.fetch_add(1, Ordering::Relaxed);
                tracing::debug!(code = ?failed.code, "dropped a message without a request id");
            }
        }
    }

    fn submit(&self, peer: Peer, request: wire::Request) {
        let wire::Request { id, user, ask } = request;
        if self.stopping.load(Ordering::SeqCst) {
            return self.busy(peer, id, "the service is stopping");
        }
        self.in_flight.fetch_add(1, Ordering::SeqCst);
        let (in_flight, outbox) = (self.in_flight.clone(), self.outbox.clone());
        let answer = AnswerTo::new(move |response| {
            // Encoded here, by the actor's thread: the gateway's only carries.
            let bytes = wire::encode_response(id, response);
            outbox.put(Outgoing { peer, bytes });
            in_flight.fetch_sub(1, Ordering::SeqCst);
        });
        let submit = Submit { tenant: self.tenant.clone(), user, request: id, ask, answer };
        match self.front.submit(submit) {
            Ok(()) => {}
            Err(NotTaken::Full(submit)) => {
                self.counters.busy.fetch_add(1, Ordering::Relaxed);
                let full = "the service has too many requests in hand";
                submit.answer.send(Response::busy(full, RETRY_FULL_MS));
            }
            Err(NotTaken::Over(submit, response)) => {
                let counter = match *response {
                    Response::QuotaExceeded(_) => &self.counters.over_quota,
                    _ => &self.counters.busy,
                };
                counter.fetch_add(1, Ordering::Relaxed);
                submit.answer.send(*response);
            }
            Err(NotTaken::Closed(submit)) => {
                self.failure.report("the directory of people is gone");
                let gone = "the service is being restarted";
                submit.answer.send(Response::error(ErrorCode::Unavailable, gone));
            }
        }
    }

    fn busy(&self, peer: Peer, id: RequestId, why: &str) {
        self.counters.busy.fetch_add(1, Ordering::Relaxed);
        self.answer(peer, id, Response::busy(why, RETRY_FULL_MS));
    }

    fn answer(&self, peer: Peer, id: RequestId, response: Response) {
        self.send(Outgoing { peer, bytes: wire::encode_response(id, response) });
    }

    fn send(&self, Outgoing { peer, bytes }: Outgoing) {
        let mut frames = vec![peer.routing_id];
        if peer.delimiter {
            frames.push(Vec::new());
        }
        frames.push(bytes);
        match self.router.send_multipart(frames, zmq::DONTWAIT) {
            Ok(()) => self.counters.answered.fetch_add(1, Ordering::Relaxed),
            // Gone, or not reading. A retry with the same id finds the answer in the log.
            Err(_) => self.counters.undelivered.fetch_add(1, Ordering::Relaxed),
        };
    }
}

/// What came through the door since it was opened.
#[derive(Debug, Default)]
pub struct Counters {
    received: AtomicU64,
    answered: AtomicU64,
    dropped: AtomicU64,
    refused: AtomicU64,
    busy: AtomicU64,
    over_quota: AtomicU64,
    undelivered: AtomicU64,
}

/// [`Counters`] at one moment, in messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub received: u64,
    pub answered: u64,
    /// Malformed beyond an answer: not one frame, or no request id.
    pub dropped: u64,
    /// Answered with an error, because they were no request.
    pub refused: u64,
    /// Turned away by the gateway itself because of too much work.
    pub busy: u64,
    /// Turned away by the gateway because their tenant takes more than it may.
    pub over_quota: u64,
    /// Answers whose peer was gone or did not read.
    pub undelivered: u64,
}

impl Counters {
    pub fn now(&self) -> Counts {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Counts {
            received: read(&self.received),
            answered: read(&self.answered),
            dropped: read(&self.dropped),
            refused: read(&self.refused),
            busy: read(&self.busy),
            over_quota: read(&self.over_quota),
            undelivered: read(&self.undelivered),
        }
    }
}
