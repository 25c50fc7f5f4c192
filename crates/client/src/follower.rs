//! Follows the feed, and asks the service for the records that the feed dropped.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use apprentice_core::ids::{Digest, RequestId, Seq, StreamKey, WithinTenant};

use crate::protocol::{HeadView, PlainView, SealedView};
use crate::{Client, ClientError, Context, FeedMessage};

/// Follows all streams of a tenant. It gives each record once, and the records of a stream in their
/// order. Records that the feed dropped are requested from the service. Every record is compared
/// with the digest of the record before it.
pub struct Follower {
    client: Client,
    kind: Kind,
    context: Context,
    socket: Option<(String, zmq::Socket)>,
    waiting_max: i32,
    /// The run of the feed, and the last number in it that is not missing.
    heard: Option<(RequestId, u64)>,
    positions: WithinTenant<Position>,
    ready: VecDeque<Followed>,
    /// When to ask the service for new records, unless the feed sends a message before.
    look_at: Instant,
    /// Records that the service was asked for.
    fetched: u64,
}

/// The last record of a stream that a follower has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// Its number in the stream.
    pub seq: Seq,
    /// Its digest.
    pub digest: Digest,
}

/// What a follower gives.
#[derive(Debug, Clone, PartialEq)]
pub enum Followed {
    /// An encrypted record.
    Sealed(SealedView),
    /// A decrypted record.
    Plain(PlainView),
    /// The person was erased. Their records can no longer be decrypted.
    Erased {
        /// The person's stream.
        stream: StreamKey,
        /// Its last record.
        last: Position,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Sealed,
    Plain,
}

/// Why a follower stops.
#[derive(Debug, thiserror::Error)]
pub enum FollowError {
    /// The service did not answer, or its answer was a refusal.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// ZeroMQ cannot connect to the feed or read from it.
    #[error("cannot connect to the feed at {endpoint}: {reason}")]
    Socket {
        /// The endpoint of the feed.
        endpoint: String,
        /// What ZeroMQ says.
        reason: String,
    },
    /// The log was changed: it contradicts a record that the follower has. Keep what you have and
    /// ask the operator.
    #[error("this is not the log that was followed before: {reason}")]
    Rewritten {
        /// Which record, and what is wrong with it.
        reason: String,
    },
}

/// How long the feed may be silent before the service is asked for new records. A feed sends a beat
/// every second.
const SILENCE: Duration = Duration::from_secs(5);
/// How long after a closed feed the service is asked again where it is.
const NOT_OPEN_YET: Duration = Duration::from_millis(500);

impl Follower {
    /// Follows encrypted records. Needs a key with the role auditor or operator.
    ///
    /// - `positions`: the last record of each stream that you already have; empty to get all.
    pub fn sealed(client: Client, positions: WithinTenant<Position>) -> Follower {
        Follower::new(client, Kind::Sealed, positions)
    }

    /// Follows decrypted records. Needs a key with the role operator.
    ///
    /// - `positions`: the last record of each stream that you already have; empty to get all.
    pub fn plain(client: Client, positions: WithinTenant<Position>) -> Follower {
        Follower::new(client, Kind::Plain, positions)
    }

    fn new(client: Client, kind: Kind, positions: WithinTenant<Position>) -> Follower {
        Follower {
            client,
            kind,
            context: Context::new(),
            socket: None,
            waiting_max: 10_000,
            heard: None,
            positions,
            ready: VecDeque::new(),
            look_at: Instant::now(),
            fetched: 0,
        }
    }

    /// Sets how many messages of the feed may wait to be read; 10,000 otherwise. Further messages
    /// are dropped, and their records are requested from the service.
    pub fn with_waiting_max(mut self, messages: i32) -> Follower {
        self.waiting_max = messages.max(1);
        self
    }

    /// The last record of each stream that was given. Keep it to continue later.
    pub fn positions(&self) -> &WithinTenant<Position> {
        &self.positions
    }

    /// Records that came from the service because the feed did not send them.
    pub fn fetched(&self) -> u64 {
        self.fetched
    }

    /// The next record.
    ///
    /// - returns: none if there was none within `limit`.
    /// - errors: [`FollowError::Client`] also if this key may not follow, or no longer.
    pub fn next(&mut self, limit: Duration) -> Result<Option<Followed>, FollowError> {
        let end = Instant::now() + limit;
        loop {
            if let Some(followed) = self.ready.pop_front() {
                return Ok(Some(followed));
            }
            if Instant::now() >= self.look_at {
                self.listen()?;
                self.catch_up()?;
                let heard = self.socket.is_some();
                self.look_at = Instant::now() + if heard { SILENCE } else { NOT_OPEN_YET };
                continue;
            }
            let now = Instant::now();
            if now >= end {
                return Ok(None);
            }
            let wait = (end - now).min(self.look_at.saturating_duration_since(now));
            if let Some(message) = self.receive(wait)? {
                self.look_at = Instant::now() + SILENCE;
                self.take(message)?;
            }
        }
    }

    /// Subscribes where the feed is now. This comes before [`Follower::catch_up`], so that no
    /// record is missed between the two.
    fn listen(&mut self) -> Result<(), FollowError> {
        let view = self.client.feed()?;
        let endpoint = match self.kind {
            Kind::Sealed => view.sealed,
            Kind::Plain => view.plain,
        };
        // A new socket even if the endpoint is the same: a connection that was refused once stays
        // silent, and shows no error.
        self.socket = None;
        // The feed is closed for a moment after a key was revoked.
        let Some(endpoint) = endpoint else { return Ok(()) };
        let endpoint = reachable(&endpoint, self.client.endpoint());
        let open = || -> zmq::Result<zmq::Socket> {
            let socket = self.context.socket(zmq::SUB)?;
            socket.set_linger(0)?;
            socket.set_rcvhwm(self.waiting_max)?;
            socket.set_ipv6(endpoint.contains('['))?;
            if let Some(identity) = self.client.identity() {
                identity.put_on(&socket)?;
            }
            socket.set_subscribe(b"")?;
            socket.connect(&endpoint)?;
            Ok(socket)
        };
        let socket = open().map_err(|error| FollowError::Socket {
            endpoint: endpoint.clone(),
            reason: error.to_string(),
        })?;
        self.socket = Some((endpoint, socket));
        Ok(())
    }

    fn receive(&self, wait: Duration) -> Result<Option<FeedMessage>, FollowError> {
        let Some((endpoint, socket)) = &self.socket else {
            std::thread::sleep(wait);
            return Ok(None);
        };
        let failed = |error: zmq::Error| FollowError::Socket {
            endpoint: endpoint.clone(),
            reason: error.to_string(),
        };
        match socket.poll(zmq::POLLIN, wait.as_micros().div_ceil(1_000) as i64) {
            Ok(0) | Err(zmq::Error::EINTR) => return Ok(None),
            Ok(_) => {}
            Err(error) => return Err(failed(error)),
        }
        let frames = match socket.recv_multipart(zmq::DONTWAIT) {
            Ok(frames) => frames,
            Err(zmq::Error::EAGAIN | zmq::Error::EINTR) => return Ok(None),
            Err(error) => return Err(failed(error)),
        };
        // A message that cannot be read counts as dropped: its number will be missing.
        let [_, body] = &frames[..] else { return Ok(None) };
        Ok(FeedMessage::decode(body).ok())
    }

    fn take(&mut self, message: FeedMessage) -> Result<(), FollowError> {
        let FeedMessage { start, number, sealed, plain, .. } = message;
        let known = self.heard.filter(|(heard, _)| *heard == start).map(|(_, number)| number);
        let found = match (sealed, plain) {
            (Some(record), _) => Some(Followed::Sealed(record)),
            (None, Some(record)) => Some(Followed::Plain(record)),
            (None, None) => None,
        };
        let in_turn = match (&found, known) {
            (_, None) => false,
            (Some(_), Some(known)) => number <= known + 1,
            (None, Some(known)) => number <= known,
        };
        if !in_turn {
            // All records up to this number are durable, so the service has them.
            self.catch_up()?;
        }
        let last = known.map_or(number, |known| known.max(number));
        self.heard = Some((start, last));
        match found {
            Some(record) => self.follow(record),
            None => Ok(()),
        }
    }

    /// Takes a record from the feed. If it is not the next of its stream, the records before it are
    /// requested as well.
    fn follow(&mut self, record: Followed) -> Result<(), FollowError> {
        let (stream, seq, digest) = match &record {
            Followed::Sealed(record) => (record.stream, record.seq, record.digest),
            Followed::Plain(record) => (record.stream, record.seq, record.digest),
            Followed::Erased { .. } => return Ok(()),
        };
        match self.positions.get(&stream) {
            Some(position) if seq < position.seq => Ok(()),
            Some(position) if seq == position.seq => match position.digest == digest {
                true => Ok(()),
                false => Err(rewritten(stream, seq)),
            },
            position if position.map_or(1, |at| at.seq.get() + 1) == seq.get() => self.give(record),
            _ => self.fetch(HeadView { stream, seq, digest }),
        }
    }

    /// Asks where all streams end, and requests the records that are missing.
    fn catch_up(&mut self) -> Result<(), FollowError> {
        let heads = self.client.heads()?;
        for head in &heads {
            self.fetch(*head)?;
        }
        let there = |stream: &StreamKey| heads.iter().any(|head| head.stream == *stream);
        match self.positions.keys().find(|stream| !there(stream)) {
            None => Ok(()),
            Some(stream) => {
                Err(FollowError::Rewritten { reason: format!("stream {stream} no longer exists") })
            }
        }
    }

    /// Requests the records of a stream up to `head` that are missing.
    fn fetch(&mut self, head: HeadView) -> Result<(), FollowError> {
        let stream = head.stream;
        loop {
            let position = self.positions.get(&stream).copied();
            let from = match position {
                Some(at) if at.seq == head.seq && at.digest != head.digest => {
                    return Err(rewritten(stream, head.seq));
                }
                Some(at) if at.seq >= head.seq => return Ok(()),
                Some(at) => at.seq.next(),
                None => Seq::FIRST,
            };
            let missing = || FollowError::Rewritten {
                reason: format!("record {from} of stream {stream} is missing"),
            };
            let records: Vec<Followed> = match self.kind {
                Kind::Sealed => {
                    let read = self.client.records(stream, from)?;
                    read.records.into_iter().map(Followed::Sealed).collect()
                }
                Kind::Plain => {
                    let read = self.client.plain_records(stream, from)?;
                    if read.erased {
                        let last = Position { seq: head.seq, digest: head.digest };
                        self.positions.insert(stream, last);
                        self.ready.push_back(Followed::Erased { stream, last });
                        return Ok(());
                    }
                    read.records.into_iter().map(Followed::Plain).collect()
                }
            };
            if records.is_empty() {
                return Err(missing());
            }
            self.fetched += records.len() as u64;
            for record in records {
                self.give(record)?;
            }
        }
    }

    /// Gives a record, which must be the next of its stream.
    fn give(&mut self, record: Followed) -> Result<(), FollowError> {
        let of = |stream: StreamKey| self.positions.get(&stream).copied();
        let (stream, at) = match &record {
            Followed::Sealed(sealed) => {
                let before = of(sealed.stream);
                let prev = before.map_or(Digest::ZERO, |at| at.digest);
                sealed.check(prev).map_err(|reason| FollowError::Rewritten { reason })?;
                let next = before.map_or(Seq::FIRST, |at| at.seq.next());
                if sealed.seq != next {
                    return Err(out_of_turn(sealed.stream, sealed.seq, next));
                }
                (sealed.stream, Position { seq: sealed.seq, digest: sealed.digest })
            }
            Followed::Plain(plain) => {
                let before = of(plain.stream);
                let next = before.map_or(Seq::FIRST, |at| at.seq.next());
                if plain.seq != next {
                    return Err(out_of_turn(plain.stream, plain.seq, next));
                }
                if plain.prev != before.map_or(Digest::ZERO, |at| at.digest) {
                    return Err(rewritten(plain.stream, plain.seq));
                }
                (plain.stream, Position { seq: plain.seq, digest: plain.digest })
            }
            Followed::Erased { stream, last } => (*stream, *last),
        };
        self.positions.insert(stream, at);
        self.ready.push_back(record);
        Ok(())
    }
}

fn out_of_turn(stream: StreamKey, found: Seq, next: Seq) -> FollowError {
    let reason = format!("stream {stream}: expected record {next}, but record {found} came");
    FollowError::Rewritten { reason }
}

fn rewritten(stream: StreamKey, seq: Seq) -> FollowError {
    let reason = format!("the digest of record {seq} of stream {stream} changed");
    FollowError::Rewritten { reason }
}

/// The endpoint of a feed as a client can reach it. A service that listens at all addresses names
/// none of them; then it is the address at which the client reached the service.
fn reachable(endpoint: &str, service: &str) -> String {
    let port = |host: &str| endpoint.strip_prefix(host).and_then(|rest| rest.strip_prefix(':'));
    let Some(port) = port("tcp://0.0.0.0").or_else(|| port("tcp://[::]")) else {
        return endpoint.to_owned();
    };
    match service.rsplit_once(':') {
        Some((host, _)) if host.starts_with("tcp://") => format!("{host}:{port}"),
        _ => format!("tcp://127.0.0.1:{port}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feed_on_all_addresses_is_reached_where_the_service_was() {
        let service = "tcp://robot.example:7117";
        assert_eq!(reachable("tcp://0.0.0.0:7200", service), "tcp://robot.example:7200");
        assert_eq!(reachable("tcp://[::]:7200", "tcp://[::1]:7117"), "tcp://[::1]:7200");
        assert_eq!(reachable("tcp://10.0.0.7:7200", service), "tcp://10.0.0.7:7200");
        assert_eq!(reachable("ipc:///run/feed.lab.sealed", service), "ipc:///run/feed.lab.sealed");
    }
}
