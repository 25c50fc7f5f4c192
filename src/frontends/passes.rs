//! Counts open connections, and limits them. ZeroMQ asks before it accepts a connection and does
//! not tell when one ends. So each connection gets a number at its handshake. Its first message
//! shows its file descriptor in this process. When a key or a tenant has too many connections, this
//! file looks which of their descriptors are still open.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::fairness::Room;
use crate::ids::{PublicKey, TenantId};
use crate::limits::{
    CUT_OFF_S, DOOR_CONNECTIONS_MAX, FEED_CONNECTIONS_MAX, KEY_CONNECTIONS_MAX, KEY_FOLLOWERS_MAX,
};

/// The connections of the endpoints with keys, and of the feed.
#[derive(Debug, Clone)]
pub(super) struct Passes(Arc<Mutex<Held>>);

#[derive(Debug)]
struct Held {
    last: u64,
    /// Of the endpoints with keys, and of the feed.
    rooms: [Room; 2],
    open: BTreeMap<u64, Pass>,
    /// Keys that may not connect to the feed, each with the end of that time.
    cut_off: BTreeMap<PublicKey, Instant>,
    looked: Option<Instant>,
}

/// One connection.
#[derive(Debug)]
struct Pass {
    feed: bool,
    key: PublicKey,
    tenant: TenantId,
    since: Instant,
    /// None until its first message.
    socket: Option<Socket>,
}

/// A file descriptor, and the name that the operating system gives it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Socket {
    descriptor: i32,
    name: String,
}

/// The time between two looks at the open descriptors. A look takes about a millisecond.
const LOOK_AGAIN: Duration = Duration::from_millis(100);
/// How long a connection counts if the operating system does not show open descriptors.
const BLIND: Duration = Duration::from_secs(60);

impl Passes {
    pub fn new() -> Passes {
        let rooms = [DOOR_CONNECTIONS_MAX, FEED_CONNECTIONS_MAX].map(Room::new);
        let (open, cut_off) = (BTreeMap::new(), BTreeMap::new());
        Passes(Arc::new(Mutex::new(Held { last: 0, rooms, open, cut_off, looked: None })))
    }

    /// Counts a new connection.
    ///
    /// - returns: its number; none if its key, its tenant or all tenants together have too many.
    pub fn issue(&self, feed: bool, tenant: &TenantId, key: &PublicKey) -> Option<u64> {
        let mut held = self.held();
        if held.take(feed, tenant, key) {
            return Some(held.issue(feed, tenant, key));
        }
        let now = Instant::now();
        if held.looked.is_some_and(|looked| now - looked < LOOK_AGAIN) {
            return None;
        }
        held.looked = Some(now);
        held.forget_the_gone(open_sockets().as_ref(), now);
        held.take(feed, tenant, key).then(|| held.issue(feed, tenant, key))
    }

    /// Notes the file descriptor of a connection. Call it with the first message.
    pub fn seen(&self, number: u64, descriptor: i32) {
        let mut held = self.held();
        let Some(pass) = held.open.get_mut(&number).filter(|pass| pass.socket.is_none()) else {
            return;
        };
        pass.socket = name_of(descriptor).map(|name| Socket { descriptor, name });
    }

    /// True if the file descriptor of a connection was not noted yet.
    pub fn is_new(&self, number: u64) -> bool {
        self.held().open.get(&number).is_some_and(|pass| pass.socket.is_none())
    }

    /// Keeps a key from the feed for [`CUT_OFF_S`] seconds.
    pub fn cut_off(&self, key: PublicKey) {
        let until = Instant::now() + Duration::from_secs(CUT_OFF_S);
        self.held().cut_off.insert(key, until);
    }

    /// True if the key is kept from the feed now.
    pub fn is_cut_off(&self, key: &PublicKey) -> bool {
        let mut held = self.held();
        let now = Instant::now();
        held.cut_off.retain(|_, until| *until > now);
        held.cut_off.contains_key(key)
    }

    // A panic while the lock is held leaves nothing half changed.
    fn held(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Held {
    fn take(&mut self, feed: bool, tenant: &TenantId, key: &PublicKey) -> bool {
        let most = if feed { KEY_FOLLOWERS_MAX } else { KEY_CONNECTIONS_MAX };
        let of_key = self.open.values().filter(|pass| pass.feed == feed && pass.key == *key);
        of_key.count() < most && self.rooms[usize::from(feed)].take(tenant, 1)
    }

    fn issue(&mut self, feed: bool, tenant: &TenantId, key: &PublicKey) -> u64 {
        self.last += 1;
        let (tenant, since) = (tenant.clone(), Instant::now());
        self.open.insert(self.last, Pass { feed, key: *key, tenant, since, socket: None });
        self.last
    }

    /// Stops counting the connections that have ended.
    ///
    /// - `sockets`: the open sockets of this process; none if the operating system does not show
    ///   them.
    fn forget_the_gone(&mut self, sockets: Option<&BTreeSet<Socket>>, now: Instant) {
        let gone: Vec<u64> = match sockets {
            None => {
                let old = self.open.iter().filter(|(_, pass)| now - pass.since > BLIND);
                old.map(|(number, _)| *number).collect()
            }
            Some(sockets) => {
                let noted = |pass: &Pass| pass.socket.as_ref().map(|at| sockets.contains(at));
                let of = |wanted| {
                    let open = self.open.iter().filter(move |(_, pass)| noted(pass) == wanted);
                    open.map(|(number, _)| *number).collect::<Vec<u64>>()
                };
                let (there, mut gone, mute) = (of(Some(true)), of(Some(false)), of(None));
                // The sockets of connections without a message are not known, but their number is
                // bounded by the sockets that are left. The oldest beyond that number are gone.
                let others = sockets.len().saturating_sub(there.len());
                gone.extend(&mute[..mute.len().saturating_sub(others)]);
                gone
            }
        };
        for number in gone {
            let Some(Pass { feed, tenant, .. }) = self.open.remove(&number) else { continue };
            self.rooms[usize::from(feed)].give_back(&tenant, 1);
        }
    }
}

const DESCRIPTORS: &str = "/proc/self/fd";

/// The open sockets of this process; none if the operating system has no such directory.
fn open_sockets() -> Option<BTreeSet<Socket>> {
    let entries = fs::read_dir(DESCRIPTORS).ok()?;
    let socket = |entry: fs::DirEntry| {
        let descriptor = entry.file_name().to_str()?.parse().ok()?;
        Some(Socket { descriptor, name: name_of(descriptor)? })
    };
    Some(entries.filter_map(Result::ok).filter_map(socket).collect())
}

/// `socket:[NUMBER]`, with a number that no other socket has; none if it is not a socket.
fn name_of(descriptor: i32) -> Option<String> {
    let path = Path::new(DESCRIPTORS).join(descriptor.to_string());
    let name = fs::read_link(path).ok()?.to_str()?.to_owned();
    name.starts_with("socket:").then_some(name)
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsRawFd;
    use std::os::unix::net::UnixStream;

    use super::*;

    fn lab(name: &str) -> TenantId {
        TenantId::new(name).unwrap()
    }

    fn key(number: u8) -> PublicKey {
        PublicKey([number; 32])
    }

    /// It does not look at the sockets of this process, because other tests open and close some.
    fn unwatched() -> Passes {
        let passes = Passes::new();
        passes.held().looked = Some(Instant::now());
        passes
    }

    /// Opens as many connections as it can, with another key for every ten.
    fn fill(passes: &Passes, tenant: &TenantId) -> Vec<u64> {
        let issue = |n: usize| passes.issue(false, tenant, &key((n / 10) as u8));
        (0..1_000).map_while(issue).collect()
    }

    #[test]
    fn a_key_and_a_lab_have_so_many_connections_and_the_next_lab_has_some() {
        let passes = unwatched();
        let one_key = || passes.issue(false, &lab("a"), &key(99));
        let of_key = std::iter::from_fn(one_key).count();
        assert_eq!(of_key, KEY_CONNECTIONS_MAX);
        assert_eq!(of_key + fill(&passes, &lab("a")).len(), DOOR_CONNECTIONS_MAX);
        assert_eq!(fill(&passes, &lab("b")).len(), DOOR_CONNECTIONS_MAX / 2);
        let follower = || passes.issue(true, &lab("a"), &key(99));
        assert_eq!(std::iter::from_fn(follower).count(), KEY_FOLLOWERS_MAX, "counted apart");
    }

    #[test]
    fn an_ended_connection_makes_room_and_an_open_one_does_not() {
        let passes = unwatched();
        let numbers = fill(&passes, &lab("a"));
        let pairs: Vec<_> = numbers.iter().map(|_| UnixStream::pair().unwrap()).collect();
        for (number, (mine, _)) in numbers.iter().zip(&pairs) {
            assert!(passes.is_new(*number));
            passes.seen(*number, mine.as_raw_fd());
            assert!(!passes.is_new(*number));
        }
        let more = || {
            // As if the last look was long ago.
            passes.held().looked = None;
            passes.issue(false, &lab("a"), &key(200))
        };
        assert_eq!(more(), None);
        let left = pairs.into_iter().skip(3).collect::<Vec<_>>();
        assert!(more().is_some() && more().is_some() && more().is_some());
        assert!(left.len() > 3);
    }

    #[test]
    fn connections_without_a_message_are_forgotten_if_there_are_fewer_sockets() {
        let mut held = Held {
            last: 0,
            rooms: [10, 10].map(Room::new),
            open: BTreeMap::new(),
            cut_off: BTreeMap::new(),
            looked: None,
        };
        for _ in 0..10 {
            assert!(held.take(false, &lab("a"), &key(1)));
            held.issue(false, &lab("a"), &key(1));
        }
        let socket =
            |descriptor: i32| Socket { descriptor, name: format!("socket:[{descriptor}]") };
        held.open.get_mut(&1).unwrap().socket = Some(socket(1));
        held.open.get_mut(&2).unwrap().socket = Some(socket(2));
        let now = Instant::now();
        // The first is open, the second is not, and four sockets are of unknown connections.
        let there = BTreeSet::from([1, 11, 12, 13, 14].map(socket));
        held.forget_the_gone(Some(&there), now);
        assert_eq!(held.open.keys().copied().collect::<Vec<_>>(), [1, 7, 8, 9, 10]);
        assert_eq!(held.rooms[0].total(), 5);
        held.forget_the_gone(None, now);
        assert_eq!(held.open.len(), 5);
        held.forget_the_gone(None, now + 2 * BLIND);
        assert!(held.open.is_empty());
    }
}
