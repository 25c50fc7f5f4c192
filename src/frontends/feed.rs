//! The feed publishes new records. Each tenant has two sockets: one for encrypted records and one
//! for decrypted ones. A slow subscriber misses messages. Each message has a number, so the
//! subscriber notices and requests the missed records from the service (`heads`, `records`,
//! `plain_records`).
//!
//! Messages are authorised when a subscriber connects, not when they are sent. So revoking a key
//! closes and reopens the tenant's sockets before the next message is published. The other
//! subscribers reconnect by themselves and request what they missed.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::counters::{Counters, count};
use super::listener::vouched;
use super::outbox::{Inbox, Outbox};
use super::passes::Passes;
use super::raw::Outlet;
use super::unsent::Unsent;
use super::zap::{HandshakeSecret, ZapDomain};
use super::{GatewayError, lock, rights};
use crate::actors::{ArchiveReader, CommitNotification, CommitNotifications, Failure, Front};
use crate::client::{BEAT, Context, CurveKey, Endpoint, FeedMessage, FeedView, wire};
use crate::ids::{PublicKey, RequestId, Seq, StreamKey, TenantId};
use crate::limits::{CUT_OFF_S, FEED_UNSENT_BYTES_MAX, FOREIGN_TOPICS_MAX, TOPICS_MAX};
use crate::tenancy::Admissions;

/// What a feed needs.
#[derive(Debug)]
pub struct FeedSettings<'a> {
    /// The first endpoint of the first tenant. The others get the next ports, or longer paths.
    pub endpoint: &'a Endpoint,
    /// Messages that may wait for one subscriber; see [`crate::limits::FEED_WAITING_MAX`].
    pub waiting_max: i32,
    /// Tell which records are new.
    pub notifications: CommitNotifications,
    /// Reads these records.
    pub reader: ArchiveReader,
}

/// What decides who may subscribe, and how much.
pub(super) struct Watch {
    pub admissions: Admissions,
    pub secret: HandshakeSecret,
    pub passes: Passes,
    pub counters: Arc<Counters>,
    pub front: Front,
}

/// The thread that publishes. It ends when this is dropped.
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

/// The time between two beats. Keys whose overlap has ended are noticed within this time.
const BEAT_EVERY: Duration = Duration::from_secs(1);
/// How long messages may take to leave the process when the service stops, in milliseconds.
const LINGER_MS: i32 = 500;

impl Views {
    fn new() -> Views {
        let mut start = [0; 16];
        getrandom::fill(&mut start).expect("the operating system gives random bytes");
        Views { start: RequestId(start), endpoints: Arc::default() }
    }

    /// What a caller is told about the feed of a tenant.
    ///
    /// - `plain`: the caller may read decrypted records.
    pub fn view(&self, tenant: &TenantId, plain: bool) -> FeedView {
        let endpoints = self.endpoints.read().unwrap_or_else(PoisonError::into_inner);
        let [sealed, open] = endpoints.get(tenant).cloned().unwrap_or_default();
        FeedView { start: self.start, sealed, plain: open.filter(|_| plain) }
    }

    /// Every endpoint, with its tenant and whether its records are decrypted.
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
    /// Opens the sockets and starts the thread. The authenticator must run already, and must end
    /// later.
    ///
    /// - errors: an endpoint is in use, or the thread does not start.
    pub fn open(
        context: &Context,
        settings: FeedSettings<'_>,
        key: &CurveKey,
        watch: Watch,
        failure: Failure,
    ) -> Result<Feed, GatewayError> {
        let start = |error: std::io::Error| GatewayError::Start { reason: error.to_string() };
        let FeedSettings { endpoint, waiting_max, notifications, reader } = settings;
        let (bell, inbox) = Outbox::new().map_err(start)?;
        let (views, stopping) = (Views::new(), Arc::new(AtomicBool::new(false)));
        let mut publisher = Publisher {
            context: context.clone(),
            base: endpoint.clone(),
            ports_taken: 0,
            waiting_max,
            key: key.clone(),
            watch,
            unsent: Unsent::new(FEED_UNSENT_BYTES_MAX),
            notifications: notifications.clone(),
            reader,
            failure: failure.clone(),
            views: views.clone(),
            feeds: BTreeMap::new(),
        };
        publisher.open_all()?;
        let (wake, stopped) = (bell.clone(), stopping.clone());
        notifications.listen(move || wake.wake());
        let thread = thread::Builder::new()
            .name("feed".to_owned())
            .spawn(move || {
                let _alarm = failure.alarm("the feed's thread ended");
                publisher.serve(inbox, &stopped);
            })
            .map_err(start)?;
        Ok(Feed { views, stopping, bell, thread: Some(thread) })
    }

    pub fn views(&self) -> &Views {
        &self.views
    }

    /// Publishes the records that are already noted, and closes the sockets.
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
struct Publisher {
    context: Context,
    base: Endpoint,
    /// Ports after that of `base` that are in use.
    ports_taken: u16,
    waiting_max: i32,
    key: CurveKey,
    watch: Watch,
    /// Messages that have not left the process yet.
    unsent: Unsent,
    notifications: CommitNotifications,
    reader: ArchiveReader,
    failure: Failure,
    views: Views,
    feeds: BTreeMap<TenantId, TenantFeed>,
}

/// One tenant's sockets, the sealed one first.
struct TenantFeed {
    tenant: TenantId,
    sockets: [Option<Subscribed>; 2],
    /// Where they are, or will be.
    endpoints: [String; 2],
    /// Keys of followers that were already revoked when the sockets were opened.
    ended: BTreeSet<PublicKey>,
    /// The log already says that they cannot be opened.
    warned: bool,
}

/// A socket, and the topics that are subscribed to.
struct Subscribed {
    socket: Outlet,
    topics: Topics,
}

/// Limits how many topics each key may subscribe to. `libzmq` keeps all topics in memory, without a
/// limit. It tells when a topic gets its first subscriber and when it loses its last.
#[derive(Debug, Default)]
struct Topics {
    of: HashMap<Vec<u8>, PublicKey>,
    /// For each key: its topics that can be published, and its other topics.
    counts: BTreeMap<PublicKey, [usize; 2]>,
}

impl Topics {
    /// - returns: true if the key has now subscribed to too many topics.
    fn add(&mut self, topic: &[u8], key: PublicKey) -> bool {
        let foreign = usize::from(!is_published(topic));
        if self.of.insert(topic.to_vec(), key).is_some() {
            return false;
        }
        let counts = self.counts.entry(key).or_default();
        counts[foreign] += 1;
        counts[foreign] > [TOPICS_MAX, FOREIGN_TOPICS_MAX][foreign]
    }

    fn remove(&mut self, topic: &[u8]) {
        let Some(key) = self.of.remove(topic) else { return };
        if let Some(counts) = self.counts.get_mut(&key) {
            let foreign = usize::from(!is_published(topic));
            counts[foreign] = counts[foreign].saturating_sub(1);
            if *counts == [0, 0] {
                self.counts.remove(&key);
            }
        }
    }
}

/// True if a message can have this topic, or a topic that begins with it.
fn is_published(topic: &[u8]) -> bool {
    let hex = |byte: &u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(byte);
    BEAT.as_bytes().starts_with(topic)
        || (topic.len() <= 2 * size_of::<StreamKey>() && topic.iter().all(hex))
}

impl Subscribed {
    /// Reads what subscribers have sent.
    ///
    /// - returns: a key that has subscribed to too many topics; none if there is none.
    fn hear(&mut self, watch: &Watch) -> zmq::Result<Option<PublicKey>> {
        for _ in 0..BURST {
            let mut frame = match self.socket.recv_msg(zmq::DONTWAIT) {
                Ok(frame) => frame,
                Err(zmq::Error::EAGAIN | zmq::Error::EINTR) => return Ok(None),
                Err(error) => return Err(error),
            };
            let key = vouched(&watch.secret, &watch.passes, &mut frame);
            match (frame.split_first(), key) {
                (Some((1, topic)), Some(key)) if self.topics.add(topic, key) => {
                    return Ok(Some(key));
                }
                (Some((0, topic)), _) => self.topics.remove(topic),
                // Not a subscription, or the authenticator did not answer the handshake.
                _ => {}
            }
        }
        Ok(None)
    }
}

impl Publisher {
    fn serve(mut self, mut inbox: Inbox<()>, stopping: &AtomicBool) {
        let mut beaten = Instant::now();
        loop {
            let due = BEAT_EVERY.saturating_sub(beaten.elapsed());
            let mut items = vec![zmq::PollItem::from_fd(inbox.fd(), zmq::POLLIN)];
            let sockets = self.feeds.values().flat_map(|feed| feed.sockets.iter().flatten());
            items.extend(sockets.map(|at| at.socket.as_poll_item(zmq::POLLIN)));
            match zmq::poll(&mut items, due.as_millis() as i64) {
                Ok(_) | Err(zmq::Error::EINTR) => {}
                Err(error) => {
                    return self.failure.report(format!("the feed cannot wait: {error}"));
                }
            }
            drop(items);
            inbox.drain();
            self.hear();
            let stops = stopping.load(Ordering::SeqCst);
            let mut published = 0u32;
            while let Some(notification) = self.notifications.next() {
                self.publish(&notification);
                published += 1;
                // While it sends, ZeroMQ also reads subscriptions. They must be counted in between.
                if published.is_multiple_of(HEAR_EVERY) {
                    self.hear();
                }
            }
            // If the ZAP thread has died, newer connections were never authenticated. Publish
            // nothing more.
            if self.failure.reason().is_some() {
                return self.feeds.values_mut().for_each(TenantFeed::close);
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

    /// Reads subscriptions, and blocks a key that subscribes to too many topics. ZeroMQ cannot end
    /// one connection, so the sockets of the tenant are closed, which forgets all topics, and
    /// reopened.
    fn hear(&mut self) {
        let Publisher { feeds, watch, .. } = self;
        for feed in feeds.values_mut() {
            let mut cut_off = None;
            for subscribed in feed.sockets.iter_mut().flatten() {
                match subscribed.hear(watch) {
                    Ok(None) => {}
                    Ok(Some(key)) => cut_off = Some(key),
                    Err(error) => tracing::warn!(%error, "subscriptions cannot be read"),
                }
            }
            if let Some(key) = cut_off {
                let tenant = &feed.tenant;
                tracing::warn!(
                    %tenant, %key, seconds = CUT_OFF_S,
                    "a key subscribed to too many topics: it is blocked, and its feed is reopened"
                );
                watch.passes.cut_off(key);
                feed.close();
            }
        }
    }

    /// - errors: an endpoint is in use.
    fn open_all(&mut self) -> Result<(), GatewayError> {
        for tenant in self.watch.admissions.tenants() {
            self.tend(&tenant);
            let Some(feed) = self.feeds.get(&tenant) else { continue };
            if let Some(at) = feed.sockets.iter().position(Option::is_none) {
                let (endpoint, reason) = (feed.endpoints[at].clone(), "the feed needs it".into());
                return Err(GatewayError::Bind { endpoint, reason });
            }
        }
        Ok(())
    }

    /// Opens, reopens or closes a tenant's sockets as its keys require: none without a key of a
    /// follower, and new ones after such a key was revoked.
    fn tend(&mut self, tenant: &TenantId) {
        let Some(standing) = self.watch.admissions.standing(tenant) else { return };
        // Read after the register: see `Admissions`.
        let wall = self.watch.admissions.clock().read();
        let may_follow =
            standing.keys().iter().filter(|(_, key)| rights::SEALED.contains(&key.role));
        let (admitted, ended): (BTreeSet<PublicKey>, BTreeSet<PublicKey>) =
            may_follow.map(|(key, _)| *key).partition(|key| standing.admits(key, wall).is_some());
        if admitted.is_empty() && !self.feeds.contains_key(tenant) {
            return;
        }
        if !self.feeds.contains_key(tenant) {
            let endpoints = [false, true].map(|plain| self.place(tenant, plain));
            let (tenant, ended) = (tenant.clone(), ended.clone());
            let sockets = [None, None];
            let feed =
                TenantFeed { tenant: tenant.clone(), sockets, endpoints, ended, warned: false };
            self.feeds.insert(tenant, feed);
        }
        let feed = self.feeds.get_mut(tenant).expect("it was just looked for");
        if !ended.is_subset(&feed.ended) {
            tracing::info!(%tenant, "a follower's key was revoked: its feed is reopened");
            feed.close();
        }
        feed.ended = ended;
        if admitted.is_empty() {
            feed.close();
        }
        for place in 0..2 {
            if feed.sockets[place].is_none() && !admitted.is_empty() {
                feed.open(place, &self.context, &self.key, self.waiting_max);
            }
            let there = feed.sockets[place].is_some();
            self.views.set(tenant, place, there.then(|| feed.endpoints[place].clone()));
        }
    }

    /// The endpoint of a tenant's next socket.
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

    fn publish(&mut self, notification: &CommitNotification) {
        let tenant = &notification.stream.tenant;
        self.tend(tenant);
        if self.failure.reason().is_some() {
            return;
        }
        let Some(feed) = self.feeds.get(tenant) else { return };
        let count = (notification.last.get() - notification.first.get() + 1) as u32;
        let number = |seq: Seq| notification.number + (seq.get() - notification.first.get());
        let start = self.views.start;
        if let Some(Subscribed { socket, .. }) = &feed.sockets[0] {
            match self.reader.sealed(&notification.stream, notification.first, count) {
                Ok(read) => {
                    for record in read.records {
                        let topic = record.stream.to_hex();
                        let number = number(record.seq);
                        let sealed = Some(record);
                        let v = wire::VERSION;
                        let message = FeedMessage { v, start, number, sealed, plain: None };
                        self.send(tenant, socket, topic, &message);
                    }
                }
                // A client that requests these records gets the error, too.
                Err(error) => tracing::error!(%tenant, %error, "records cannot be published"),
            }
        }
        if let Some(Subscribed { socket, .. }) = &feed.sockets[1] {
            match self.reader.plain(&notification.stream, notification.first, count) {
                Ok(read) => {
                    for record in read.records {
                        let topic = record.stream.to_hex();
                        let number = number(record.seq);
                        let plain = Some(record);
                        let v = wire::VERSION;
                        let message = FeedMessage { v, start, number, sealed: None, plain };
                        self.send(tenant, socket, topic, &message);
                    }
                }
                Err(error) => tracing::error!(%tenant, %error, "records cannot be published"),
            }
        }
    }

    fn send(&self, tenant: &TenantId, socket: &Outlet, topic: String, message: &FeedMessage) {
        let Some(parcel) = self.unsent.pack(tenant, None, message.encode()) else {
            count(&self.watch.counters.feed_unread);
            return self.watch.front.note_unread(tenant);
        };
        // A publisher never waits. A subscriber that misses this message notices its number.
        if let Err(error) = socket.send_parcel(vec![topic.into_bytes()], parcel) {
            tracing::warn!(%error, "a message of the feed was not sent");
        }
    }

    fn beat(&mut self) {
        for tenant in self.watch.admissions.tenants() {
            self.tend(&tenant);
        }
        let Some(numbers) = self.notifications.all_taken() else { return };
        let (v, start) = (wire::VERSION, self.views.start);
        for (tenant, feed) in &self.feeds {
            let number = numbers.get(tenant).copied().unwrap_or(0);
            let beat = FeedMessage { v, start, number, sealed: None, plain: None };
            for Subscribed { socket, .. } in feed.sockets.iter().flatten() {
                self.send(tenant, socket, BEAT.to_owned(), &beat);
            }
        }
    }
}

impl Drop for Publisher {
    fn drop(&mut self) {
        if self.failure.reason().is_some() {
            self.feeds.values_mut().for_each(TenantFeed::close);
        }
    }
}

impl TenantFeed {
    /// Ends all connections at once, and drops the messages that wait for them.
    fn close(&mut self) {
        for subscribed in self.sockets.iter_mut().filter_map(Option::take) {
            // This fails only for a closed socket, and this one is open.
            let _ = subscribed.socket.set_linger(0);
        }
    }

    fn open(&mut self, place: usize, context: &Context, key: &CurveKey, waiting_max: i32) {
        let domain = ZapDomain::Feed { tenant: self.tenant.clone(), plain: place == 1 };
        let endpoint = &self.endpoints[place];
        let open = || -> zmq::Result<(Outlet, String)> {
            // XPUB is PUB that also tells what is subscribed to.
            let socket = Outlet::new(context.socket(zmq::XPUB)?);
            socket.bound_sending()?;
            // So that a flood of subscriptions waits at its connection until it is counted. With 1,
            // libzmq 4.3.5 reads nothing at all behind a ZAP handler.
            socket.set_rcvhwm(2)?;
            lock::put_on(&socket, key, &domain.name())?;
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
                self.sockets[place] = Some(Subscribed { socket, topics: Topics::default() });
                self.endpoints[place] = bound;
                self.warned = false;
            }
            // The socket that was just closed may keep the port for a moment.
            Err(error) if !self.warned => {
                tracing::warn!(tenant = %self.tenant, %endpoint, %error, "the feed is not open yet");
                self.warned = true;
            }
            Err(_) => {}
        }
    }
}

/// Bytes of a frame from a subscriber. A topic has 32, and a frame of the handshake has about 300.
const SUBSCRIPTION_BYTES_MAX: i64 = 1_024;
/// Notifications published before subscriptions are read.
const HEAR_EVERY: u32 = 64;
/// Subscriptions read before messages are sent again.
const BURST: usize = 1_024;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_is_the_beat_or_a_stream_or_the_beginning_of_one_of_them() {
        let stream = StreamKey([0xab; 16]).to_hex();
        for topic in ["", "b", "beat", "0", "ab12", &*stream] {
            assert!(is_published(topic.as_bytes()), "{topic}");
        }
        let long = format!("{stream}0");
        for topic in ["beats", "x", "AB", "ab ", &*long] {
            assert!(!is_published(topic.as_bytes()), "{topic}");
        }
    }

    #[test]
    fn each_key_has_so_many_topics_until_it_gives_some_up() {
        let (mut topics, [ada, eve]) = (Topics::default(), [1, 2].map(|n| PublicKey([n; 32])));
        let topic = |n: usize| format!("{n:08x}").into_bytes();
        for n in 0..TOPICS_MAX {
            assert!(!topics.add(&topic(n), ada));
        }
        assert!(!topics.add(&topic(0), ada), "known already");
        assert!(!topics.add(&topic(TOPICS_MAX), eve));
        topics.remove(&topic(7));
        assert!(!topics.add(&topic(TOPICS_MAX + 1), ada));
        assert!(topics.add(&topic(TOPICS_MAX + 2), ada));
        let foreign = |topics: &mut Topics, n| topics.add(format!("nothing {n}").as_bytes(), eve);
        assert!(!(0..FOREIGN_TOPICS_MAX).any(|n| foreign(&mut topics, n)));
        assert!(foreign(&mut topics, FOREIGN_TOPICS_MAX));
        for n in 0..=FOREIGN_TOPICS_MAX {
            topics.remove(format!("nothing {n}").as_bytes());
        }
        topics.remove(&topic(TOPICS_MAX));
        assert_eq!(topics.counts.keys().collect::<Vec<_>>(), [&ada]);
    }
}
