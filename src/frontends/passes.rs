//! Which connections were let in and may still be there. ZeroMQ asks who may come in and does not
//! say who has left. So each connection gets a number at its handshake; its first message tells
//! which descriptor it has in this process; and when somebody asks for more connections than they
//! may have, it is looked which of those are still open.

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

/// The connections of the door with keys and of the feed.
#[derive(Debug, Clone)]
pub(super) struct Passes(Arc<Mutex<Held>>);

#[derive(Debug)]
struct Held {
    last: u64,
    /// The door's, and the feed's.
    rooms: [Room; 2],
    open: BTreeMap<u64, Pass>,
    /// Keys that are kept from the feed, and until when.
    cut_off: BTreeMap<PublicKey, Instant>,
    looked: Option<Instant>,
}

#[derive(Debug)]
struct Pass {
    feed: bool,
    key: PublicKey,
    tenant: TenantId,
    since: Instant,
    /// None until its first message.
    socket: Option<Socket>,
}

/// A descriptor, and what the system says it is.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Socket {
    descriptor: i32,
    name: String,
}

/// Between two looks at what is open: a look costs about a millisecond.
const LOOK_AGAIN: Duration = Duration::from_millis(100);
/// Where the system does not tell what is open, a connection counts for so long.
const BLIND: Duration = Duration::from_secs(60);

impl Passes {
    pub fn new() -> Passes {
        let rooms = [DOOR_CONNECTIONS_MAX, FEED_CONNECTIONS_MAX].map(Room::new);
        let (open, cut_off) = (BTreeMap::new(), BTreeMap::new());
        Passes(Arc::new(Mutex::new(Held { last: 0, rooms, open, cut_off, looked: None })))
    }

    /// Takes a place for a connection that is being made.
    ///
    /// - returns: its number; none when its key, its tenant or all together have too many.
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

    /// Notes which descriptor a connection has; to be called with its first message.
    pub fn seen(&self, number: u64, descriptor: i32) {
        let mut held = self.held();
        let Some(pass) = held.open.get_mut(&number).filter(|pass| pass.socket.is_none()) else {
            return;
        };
        pass.socket = name_of(descriptor).map(|name| Socket { descriptor, name });
    }

    /// Whether a connection's descriptor is still to be noted.
    pub fn is_new(&self, number: u64) -> bool {
        self.held().open.get(&number).is_some_and(|pass| pass.socket.is_none())
    }

    /// Keeps a key from the feed for [`CUT_OFF_S`].
    pub fn cut_off(&self, key: PublicKey) {
        let until = Instant::now() + Duration::from_secs(CUT_OFF_S);
        self.held().cut_off.insert(key, until);
    }

    pub fn is_cut_off(&self, key: &PublicKey) -> bool {
        let mut held = self.held();
        let now = Instant::now();
        held.cut_off.retain(|_, until| *until > now);
        held.cut_off.contains_key(key)
    }

    // Its holders leave it whole whenever they return.
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

    /// - `sockets`: what is open in this process; none when the system does not tell.
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
                // Which sockets are those that said nothing is not known, but how many there can be:
                // the oldest beyond that are gone.
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

/// The sockets of this process; none where the system has no such directory.
fn open_sockets() -> Option<BTreeSet<Socket>> {
    let entries = fs::read_dir(DESCRIPTORS).ok()?;
    let socket = |entry: fs::DirEntry| {
        let descriptor = entry.file_name().to_str()?.parse().ok()?;
        Some(Socket { descriptor, name: name_of(descriptor)? })
    };
    Some(entries.filter_map(Result::ok).filter_map(socket).collect())
}

/// `socket:[NUMBER]`, with a number that no other socket has.
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

    /// Without a look at the sockets of this process: other tests open and close them.
    fn unwatched() -> Passes {
        let passes = Passes::new();
        passes.held().looked = Some(Instant::now());
        passes
    }

    /// Lets in as many as it can, with keys of their own for every ten.
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
    fn who_has_left_makes_room_and_who_is_there_does_not() {
        let passes = unwatched();
        let numbers = fill(&passes, &lab("a"));
        let pairs: Vec<_> = numbers.iter().map(|_| UnixStream::pair().unwrap()).collect();
        for (number, (mine, _)) in numbers.iter().zip(&pairs) {
            assert!(passes.is_new(*number));
            passes.seen(*number, mine.as_raw_fd());
            assert!(!passes.is_new(*number));
        }
        let more = || {
            // As long after the last look as a look needs.
            passes.held().looked = None;
            passes.issue(false, &lab("a"), &key(200))
        };
        assert_eq!(more(), None);
        let left = pairs.into_iter().skip(3).collect::<Vec<_>>();
        assert!(more().is_some() && more().is_some() && more().is_some());
        assert!(left.len() > 3);
    }

    #[test]
    fn of_those_that_said_nothing_as_many_are_forgotten_as_cannot_be_there() {
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
        // The first is there, the second is not, and four are whose nobody knows.
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
