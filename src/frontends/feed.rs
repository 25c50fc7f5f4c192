//! The feed: what becomes durable is published, each tenant's at sockets of its own: one of sealed
//! records, one of plain ones. A subscriber that is slow misses messages, as it is with PUB; each
//! says which number it has, so that it is noticed, and what was missed is asked for at the door
//! (`heads`, `records`, `plain_records`). The log is the record; the feed only says that it grew.
//!
//! Nothing of what goes out is held against a key again. So a tenant's sockets are closed, and
//! opened anew, before anything is published after a key that could have come in was taken back:
//! everybody else reconnects by themselves and fetches what they missed.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::outbox::{Inbox, Outbox};
use super::zap::Gate;
use super::{Context, CurveKey, Endpoint, GatewayError, lock, rights, wire};
use crate::actors::{Failure, FeedView, Growth, Growths, PlainView, Reader, SealedView};
use crate::ids::{PublicKey, RequestId, Seq, TenantId};
use crate::tenancy::Admissions;

/// A message of the feed, beside its topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeedMessage {
    pub v: u64,
    /// Names this run of the feed.
    pub start: RequestId,
    /// Its place among all records of the tenant since then, from 1 on; of a beat, how many there
    /// were.
    pub number: u64,
    /// Of the sealed feed; none for a beat.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sealed: Option<SealedView>,
    /// Of the plain feed; none for a beat.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub plain: Option<PlainView>,
}

impl FeedMessage {
    /// One MessagePack map.
    pub fn encode(&self) -> Vec<u8> {
        wire::pack(self)
    }

    /// - errors: a sentence; never panics, whatever the bytes.
    pub fn decode(bytes: &[u8]) -> Result<FeedMessage, String> {
        let message: FeedMessage = wire::unpack(bytes)?;
        match message.v == wire::VERSION {
            true => Ok(message),
            false => Err(format!("wire version {} is not spoken here", message.v)),
        }
    }
}

/// The topic of messages that carry no record, and tell how many there were. A record's topic is its
/// stream, in hexadecimal digits.
pub const BEAT: &str = "beat";

/// What a feed is made of.
#[derive(Debug)]
pub struct FeedDoor<'a> {
    /// The first tenant's first endpoint; the others follow.
    pub endpoint: &'a Endpoint,
    /// Messages that wait for one subscriber; see [`crate::limits::FEED_WAITING_MAX`].
    pub waiting_max: i32,
    pub growths: Growths,
    pub reader: Reader,
}

/// The thread that publishes. Closes its sockets when dropped.
#[derive(Debug)]
pub(super) struct Feed {
    views: Views,
    stopping: Arc<AtomicBool>,
    bell: Outbox<()>,
    thread: Option<JoinHandle<()>>,
}

/// Where each tenant's feed is.
#[derive(Debug, Clone)]
pub(super) struct Views {
    start: RequestId,
    endpoints: Arc<RwLock<BTreeMap<TenantId, [Option<String>; 2]>>>,
}

/// Seconds between two beats, and after which keys whose time is over are noticed at the latest.
const BEAT_EVERY: Duration = Duration::from_secs(1);
/// Milliseconds that messages may take to leave the process when the service stops.
const LINGER_MS: i32 = 500;

impl Views {
    fn new() -> Views {
        let mut start = [0; 16];
        getrandom::fill(&mut start).expect("the operating system gives random bytes");
        Views { start: RequestId(start), endpoints: Arc::default() }
    }

    /// - `plain`: whoever asks may have records in the clear.
    pub fn view(&self, tenant: &TenantId, plain: bool) -> FeedView {
        let endpoints = self.endpoints.read().unwrap_or_else(PoisonError::into_inner);
        let [sealed, open] = endpoints.get(tenant).cloned().unwrap_or_default();
        FeedView { start: self.start, sealed, plain: open.filter(|_| plain) }
    }

    /// Every endpoint, with its tenant and whether it is a plain one.
    pub fn all(&self) -> Vec<(TenantId, bool, String)> {
        let endpoints = self.endpoints.read().unwrap_or_else(PoisonError::into_inner);
        let of = |(tenant, both): (&TenantId, &[Option<String>; 2])| {
            let (tenant, both) = (tenant.clone(), both.clone());
            both.into_iter()
                .zip([false, true])
                .filter_map(move |(endpoint, plain)| Some((tenant.clone(), plain, endpoint?)))
        };
        endpoints.iter().flat_map(of).collect()
    }

    fn set(&self, tenant: &TenantId, place: usize, endpoint: Option<String>) {
        let mut endpoints = self.endpoints.write().unwrap_or_else(PoisonError::into_inner);
        endpoints.entry(tenant.clone()).or_default()[place] = endpoint;
    }
}

impl Feed {
    /// The doorkeeper must be there already, and must outlive it.
    pub fn open(
        context: &Context,
        door: FeedDoor<'_>,
        key: &CurveKey,
        admissions: Admissions,
        failure: Failure,
    ) -> Result<Feed, GatewayError> {
        let start = |error: std::io::Error| GatewayError::Start { reason: error.to_string() };
        let FeedDoor { endpoint, waiting_max, growths, reader } = door;
        let (bell, inbox) = Outbox::new().map_err(start)?;
        let (views, stopping) = (Views::new(), Arc::new(AtomicBool::new(false)));
        let mut press = Press {
            context: context.clone(),
            base: endpoint.clone(),
            ports_taken: 0,
            waiting_max,
            key: key.clone(),
            admissions,
            growths: growths.clone(),
            reader,
            failure: failure.clone(),
            views: views.clone(),
            stands: BTreeMap::new(),
        };
        press.open_all()?;
        let (wake, stopped) = (bell.clone(), stopping.clone());
        growths.listen(move || wake.wake());
        let thread = thread::Builder::new()
            .name("feed".to_owned())
            .spawn(move || {
                let _alarm = failure.alarm("the feed's thread ended");
                press.serve(inbox, &stopped);
            })
            .map_err(start)?;
        Ok(Feed { views, stopping, bell, thread: Some(thread) })
    }

    pub fn views(&self) -> &Views {
        &self.views
    }

    /// Publishes what is noted and closes the sockets.
    pub fn close(&mut self) {
        self.stopping.store(true, Ordering::SeqCst);
        self.bell.wake();
        if let Some(thread) = self.thread.take() {
            // A panic in there was reported by its alarm.
            let _ = thread.join();
        }
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.close();
    }
}

/// What the feed's thread owns.
struct Press {
    context: Context,
    base: Endpoint,
    /// Ports after the base's that were given away.
    ports_taken: u16,
    waiting_max: i32,
    key: CurveKey,
    admissions: Admissions,
    growths: Growths,
    reader: Reader,
    failure: Failure,
    views: Views,
    stands: BTreeMap<TenantId, Stand>,
}

/// One tenant's sockets, the sealed one first.
struct Stand {
    tenant: TenantId,
    sockets: [Option<zmq::Socket>; 2],
    /// Where they are, or are to be.
    endpoints: [String; 2],
    /// Keys that could have come in and may not any more, when the sockets were opened.
    ended: BTreeSet<PublicKey>,
    /// Said once that they cannot be opened.
    warned: bool,
}

impl Press {
    fn serve(mut self, mut inbox: Inbox<()>, stopping: &AtomicBool) {
        let mut beaten = Instant::now();
        loop {
            let due = BEAT_EVERY.saturating_sub(beaten.elapsed());
            let mut items = [zmq::PollItem::from_fd(inbox.fd(), zmq::POLLIN)];
            match zmq::poll(&mut items, due.as_millis() as i64) {
                Ok(_) | Err(zmq::Error::EINTR) => {}
                Err(error) => {
                    return self.failure.report(format!("the feed cannot wait: {error}"));
                }
            }
            inbox.drain();
            let stops = stopping.load(Ordering::SeqCst);
            while let Some(growth) = self.growths.next() {
                self.publish(&growth);
            }
            // Whoever failed answers handshakes no more: nothing goes out to whoever came in then.
            if self.failure.reason().is_some() {
                return self.stands.values_mut().for_each(Stand::close);
            }
            if stops {
                return;
            }
            if beaten.elapsed() >= BEAT_EVERY {
                beaten = Instant::now();
                self.beat();
            }
        }
    }

    /// - errors: an endpoint is taken.
    fn open_all(&mut self) -> Result<(), GatewayError> {
        for tenant in self.admissions.tenants() {
            self.tend(&tenant);
            let Some(stand) = self.stands.get(&tenant) else { continue };
            if let Some(at) = stand.sockets.iter().position(Option::is_none) {
                let (endpoint, reason) = (stand.endpoints[at].clone(), "the feed needs it".into());
                return Err(GatewayError::Bind { endpoint, reason });
            }
        }
        Ok(())
    }

    /// Brings a tenant's sockets up to date with its register: none for who has no followers, and
    /// new ones when somebody who could have come in may not any more.
    fn tend(&mut self, tenant: &TenantId) {
        let Some(standing) = self.admissions.standing(tenant) else { return };
        // Read after the register: see `Admissions`.
        let wall = self.admissions.clock().read();
        let may_follow =
            standing.keys().iter().filter(|(_, key)| rights::SEALED.contains(&key.role));
        let (admitted, ended): (BTreeSet<PublicKey>, BTreeSet<PublicKey>) =
            may_follow.map(|(key, _)| *key).partition(|key| standing.admits(key, wall).is_some());
        if admitted.is_empty() && !self.stands.contains_key(tenant) {
            return;
        }
        if !self.stands.contains_key(tenant) {
            let endpoints = [false, true].map(|plain| self.place(tenant, plain));
            let (tenant, ended) = (tenant.clone(), ended.clone());
            let sockets = [None, None];
            let stand = Stand { tenant: tenant.clone(), sockets, endpoints, ended, warned: false };
            self.stands.insert(tenant, stand);
        }
        let stand = self.stands.get_mut(tenant).expect("it was just looked for");
        if !ended.is_subset(&stand.ended) {
            tracing::info!(%tenant, "a follower's key was taken back: its feed is opened anew");
            stand.close();
        }
        stand.ended = ended;
        if admitted.is_empty() {
            stand.close();
        }
        for place in 0..2 {
            if stand.sockets[place].is_none() && !admitted.is_empty() {
                stand.open(place, &self.context, &self.key, self.waiting_max);
            }
            let there = stand.sockets[place].is_some();
            self.views.set(tenant, place, there.then(|| stand.endpoints[place].clone()));
        }
    }

    /// Where a tenant's next socket is to be.
    fn place(&mut self, tenant: &TenantId, plain: bool) -> String {
        let kind = if plain { "plain" } else { "sealed" };
        if let Endpoint::Ipc(path) = &self.base {
            return format!("ipc://{path}.{tenant}.{kind}");
        }
        let text = self.base.to_string();
        let (host, port) = text.rsplit_once(':').expect("an address has a port");
        match port.parse::<u16>().expect("an endpoint was read with its port") {
            0 => text,
            port => {
                let port = u32::from(port) + u32::from(self.ports_taken);
                self.ports_taken = self.ports_taken.saturating_add(1);
                format!("{host}:{port}")
            }
        }
    }

    fn publish(&mut self, growth: &Growth) {
        let tenant = &growth.stream.tenant;
        self.tend(tenant);
        if self.failure.reason().is_some() {
            return;
        }
        let Some(stand) = self.stands.get(tenant) else { return };
        let count = (growth.last.get() - growth.first.get() + 1) as u32;
        let number = |seq: Seq| growth.number + (seq.get() - growth.first.get());
        let start = self.views.start;
        if let Some(socket) = &stand.sockets[0] {
            match self.reader.sealed(&growth.stream, growth.first, count) {
                Ok(read) => {
                    for record in read.records {
                        let topic = record.stream.to_hex();
                        let number = number(record.seq);
                        let sealed = Some(record);
                        let v = wire::VERSION;
                        send(socket, topic, &FeedMessage { v, start, number, sealed, plain: None });
                    }
                }
                // Whoever asks at the door hears it, and the operator's log says it.
                Err(error) => tracing::error!(%tenant, %error, "records cannot be published"),
            }
        }
        if let Some(socket) = &stand.sockets[1] {
            match self.reader.plain(&growth.stream, growth.first, count) {
                Ok(read) => {
                    for record in read.records {
                        let topic = record.stream.to_hex();
                        let number = number(record.seq);
                        let plain = Some(record);
                        let v = wire::VERSION;
                        send(socket, topic, &FeedMessage { v, start, number, sealed: None, plain });
                    }
                }
                Err(error) => tracing::error!(%tenant, %error, "records cannot be published"),
            }
        }
    }

    fn beat(&mut self) {
        for tenant in self.admissions.tenants() {
            self.tend(&tenant);
        }
        let Some(numbers) = self.growths.all_taken() else { return };
        let (v, start) = (wire::VERSION, self.views.start);
        for (tenant, stand) in &self.stands {
            let number = numbers.get(tenant).copied().unwrap_or(0);
            let beat = FeedMessage { v, start, number, sealed: None, plain: None };
            for socket in stand.sockets.iter().flatten() {
                send(socket, BEAT.to_owned(), &beat);
            }
        }
    }
}

impl Drop for Press {
    fn drop(&mut self) {
        if self.failure.reason().is_some() {
            self.stands.values_mut().for_each(Stand::close);
        }
    }
}

fn send(socket: &zmq::Socket, topic: String, message: &FeedMessage) {
    let frames = [topic.into_bytes(), message.encode()];
    // A publisher never waits; whoever did not get it will see that its number is missing.
    if let Err(error) = socket.send_multipart(frames, zmq::DONTWAIT) {
        tracing::warn!(%error, "a message of the feed was not sent");
    }
}

impl Stand {
    /// Ends every connection at once, and what waits for them.
    fn close(&mut self) {
        for socket in self.sockets.iter_mut().filter_map(Option::take) {
            // Fails for a closed socket only, which this is not.
            let _ = socket.set_linger(0);
        }
    }

    fn open(&mut self, place: usize, context: &Context, key: &CurveKey, waiting_max: i32) {
        let gate = Gate::Feed { tenant: self.tenant.clone(), plain: place == 1 };
        let endpoint = &self.endpoints[place];
        let open = || -> zmq::Result<(zmq::Socket, String)> {
            let socket = context.socket(zmq::PUB)?;
            lock::put_on(&socket, key, &gate.domain())?;
            socket.set_sndhwm(waiting_max)?;
            socket.set_linger(LINGER_MS)?;
            // Subscriptions are all that subscribers may send.
            socket.set_maxmsgsize(SUBSCRIPTION_BYTES_MAX)?;
            socket.set_ipv6(endpoint.contains('['))?;
            socket.bind(endpoint)?;
            let bound = socket.get_last_endpoint()?.map_err(|_| zmq::Error::EINVAL)?;
            Ok((socket, bound))
        };
        match open() {
            Ok((socket, bound)) => {
                tracing::info!(tenant = %self.tenant, plain = place == 1, endpoint = %bound, "feed");
                self.sockets[place] = Some(socket);
                self.endpoints[place] = bound;
                self.warned = false;
            }
            // The one that was closed just now may hold the port for a moment.
            Err(error) if !self.warned => {
                tracing::warn!(tenant = %self.tenant, %endpoint, %error, "the feed is not open yet");
                self.warned = true;
            }
            Err(_) => {}
        }
    }
}

/// Bytes of a frame from a subscriber; a topic has 32.
const SUBSCRIPTION_BYTES_MAX: i64 = 1_024;
