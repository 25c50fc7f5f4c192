//! Who is let in: ZeroMQ asks for each connection at the door with keys (ZAP, RFC 27), and a thread
//! of its own answers from the register of admitted keys.
//!
//! Three things keep a stranger out, each of them enough: the answer to the handshake; the register,
//! which is asked again for each message, so that an open connection ends with its key; and the
//! [`Seal`], because a server whose ZAP thread is gone would let everybody in.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use data_encoding::HEXLOWER;

use super::counters::{Counters, count};
use super::outbox::{Inbox, Outbox};
use super::passes::Passes;
use super::rights;
use crate::actors::Failure;
use crate::client::Context;
use crate::ids::{PublicKey, TenantId};
use crate::sabotage;
use crate::tenancy::{Admissions, Admitted};

/// Where ZeroMQ looks for whoever answers; one for each context.
const ADDRESS: &str = "inproc://zeromq.zap.01";
/// Names the door with keys in ZeroMQ's questions.
pub(super) const DOMAIN: &str = "apprentice";

/// Where somebody knocks: ZeroMQ's word is *domain*.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Gate {
    /// The door with keys, where each message is held against the register again.
    Door,
    /// One tenant's feed of sealed records, or of plain ones. What comes out of it is held against
    /// nothing any more: only those get in who may have all of it.
    Feed { tenant: TenantId, plain: bool },
}

impl Gate {
    pub fn domain(&self) -> String {
        match self {
            Gate::Door => DOMAIN.to_owned(),
            Gate::Feed { tenant, plain: false } => format!("{SEALED_FEED}{tenant}"),
            Gate::Feed { tenant, plain: true } => format!("{PLAIN_FEED}{tenant}"),
        }
    }

    fn read(domain: &[u8]) -> Option<Gate> {
        let domain = std::str::from_utf8(domain).ok()?;
        let feed = |prefix, plain| {
            let tenant = TenantId::new(domain.strip_prefix(prefix)?).ok()?;
            Some(Gate::Feed { tenant, plain })
        };
        match domain == DOMAIN {
            true => Some(Gate::Door),
            false => feed(SEALED_FEED, false).or_else(|| feed(PLAIN_FEED, true)),
        }
    }

    pub fn lets_in(&self, admitted: &Admitted) -> bool {
        match self {
            Gate::Door => true,
            Gate::Feed { tenant, plain } => {
                let roles = if *plain { rights::PLAIN } else { rights::SEALED };
                admitted.tenant == *tenant && roles.contains(&admitted.role)
            }
        }
    }
}

/// ZAP's code of a refusal that may be over soon.
const CROWDED: &str = "300";

const SEALED_FEED: &str = "apprentice/sealed/";
const PLAIN_FEED: &str = "apprentice/plain/";

/// More frames than this are not kept; ZeroMQ itself never sends so many.
const FRAMES_READ_MAX: usize = 16;

/// A secret of one service that turns a key into what ZeroMQ keeps as the `User-Id` of a connection.
/// A client can send a `User-Id` of its own, which counts when nobody answered the handshake; it
/// cannot guess this.
#[derive(Clone)]
pub(super) struct Seal(String);

impl Seal {
    pub fn fresh() -> Seal {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).expect("the operating system gives random bytes");
        Seal(HEXLOWER.encode(&bytes))
    }

    fn stamp(&self, number: u64, key: &PublicKey) -> String {
        format!("{}:{number}:{key}", self.0)
    }

    /// The number and the key of a connection whose handshake was answered here.
    pub fn read(&self, user_id: &str) -> Option<(u64, PublicKey)> {
        let rest = user_id.strip_prefix(self.0.as_str())?.strip_prefix(':')?;
        let (number, key) = rest.split_once(':')?;
        Some((number.parse().ok()?, key.parse().ok()?))
    }
}

/// The thread that answers handshakes. Ends when dropped, which must come after the sockets that
/// need it are closed.
#[derive(Debug)]
pub(super) struct Authenticator {
    bell: Outbox<()>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread owns. The guard comes first, so that the end is reported before the socket is
/// closed: from then on handshakes fail open.
struct Handshakes<W: Fn()> {
    guard: Guard<W>,
    socket: zmq::Socket,
    inbox: Inbox<()>,
    seal: Seal,
    admissions: Admissions,
    passes: Passes,
    counters: Arc<Counters>,
}

/// Reports the end of the thread, however it ends, unless it was told to end.
struct Guard<W: Fn()> {
    failure: Failure,
    /// Wakes whoever must see the failure.
    wake: W,
    told: bool,
}

impl<W: Fn()> Drop for Guard<W> {
    fn drop(&mut self) {
        if !self.told {
            self.failure.report("the thread that authenticates new connections ended");
            (self.wake)();
        }
    }
}

impl Authenticator {
    /// Must be there before the first socket that needs it listens.
    ///
    /// - `wake`: called when the thread ended without having been told to, after that was reported.
    /// - errors: why it did not start.
    pub fn start(
        context: &Context,
        seal: Seal,
        admissions: Admissions,
        passes: Passes,
        counters: Arc<Counters>,
        failure: Failure,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Authenticator, String> {
        let socket = context.socket(zmq::REP).map_err(|error| error.to_string())?;
        socket
            .set_linger(0)
            .and_then(|()| socket.bind(ADDRESS))
            .map_err(|error| format!("new connections cannot be authenticated: {error}"))?;
        let (bell, inbox) = Outbox::new().map_err(|error| error.to_string())?;
        let guard = Guard { failure: failure.clone(), wake, told: false };
        let mut desk = Handshakes { guard, socket, inbox, seal, admissions, passes, counters };
        let thread = thread::Builder::new()
            .name("authenticator".to_owned())
            .spawn(move || {
                if let Err(error) = desk.serve() {
                    failure
                        .report(format!("new connections can no longer be authenticated: {error}"));
                }
            })
            .map_err(|error| error.to_string())?;
        Ok(Authenticator { bell, thread: Some(thread) })
    }
}

impl Drop for Authenticator {
    fn drop(&mut self) {
        self.bell.put(());
        if let Some(thread) = self.thread.take() {
            // A panic in there was reported by its alarm.
            let _ = thread.join();
        }
    }
}

impl<W: Fn()> Handshakes<W> {
    fn serve(&mut self) -> zmq::Result<()> {
        loop {
            let mut items = [
                self.socket.as_poll_item(zmq::POLLIN),
                zmq::PollItem::from_fd(self.inbox.fd(), zmq::POLLIN),
            ];
            match zmq::poll(&mut items, -1) {
                Ok(_) | Err(zmq::Error::EINTR) => {}
                Err(error) => return Err(error),
            }
            let (asked, told) = (items[0].is_readable(), items[1].is_readable());
            if told && !self.inbox.drain().is_empty() {
                self.guard.told = true;
                return Ok(());
            }
            if asked {
                sabotage::point("authenticator");
                let question = match self.question() {
                    Ok(question) => question,
                    Err(zmq::Error::EAGAIN | zmq::Error::EINTR) => continue,
                    Err(error) => return Err(error),
                };
                let answer = self.answer(&question);
                self.socket.send_multipart(answer, 0)?;
            }
        }
    }

    fn question(&self) -> zmq::Result<Vec<Vec<u8>>> {
        let mut frames = vec![self.socket.recv_bytes(zmq::DONTWAIT)?];
        while self.socket.get_rcvmore()? {
            let frame = self.socket.recv_bytes(0)?;
            if frames.len() < FRAMES_READ_MAX {
                frames.push(frame);
            }
        }
        Ok(frames)
    }

    /// Version, request id, status code, status text, user id, metadata.
    fn answer(&self, question: &[Vec<u8>]) -> [Vec<u8>; 6] {
        let (code, text, user_id) = match self.judge(question) {
            Ok((number, key)) => {
                count(&self.counters.handshakes);
                ("200", "", self.seal.stamp(number, &key))
            }
            Err((code, text)) => {
                match code {
                    CROWDED => count(&self.counters.handshakes_crowded),
                    _ => count(&self.counters.handshakes_denied),
                }
                // At debug level: a stranger must not be able to fill the operator's log.
                tracing::debug!(code, text, "a connection was refused");
                (code, text, String::new())
            }
        };
        let id = question.get(1).cloned().unwrap_or_default();
        let (code, text) = (code.as_bytes().to_vec(), text.as_bytes().to_vec());
        [b"1.0".to_vec(), id, code, text, user_id.into_bytes(), Vec::new()]
    }

    /// A question has version, request id, domain, address, routing id, mechanism and key.
    ///
    /// - errors: the status code and text. Whether a key is unknown, retired or its lab closed is
    ///   not told: a stranger must not learn which keys there are.
    fn judge(
        &self,
        question: &[Vec<u8>],
    ) -> Result<(u64, PublicKey), (&'static str, &'static str)> {
        let [version, _, domain, _, _, mechanism, key] = question else {
            return Err(("500", "not a question about a CURVE key"));
        };
        let gate = Gate::read(domain);
        let (b"1.0", Some(gate), b"CURVE") = (&version[..], gate, &mechanism[..]) else {
            return Err(("500", "not a question about a CURVE key"));
        };
        let denied = ("400", "not admitted");
        let key = PublicKey(key.as_slice().try_into().map_err(|_| denied)?);
        let admitted = self.admissions.admit(&key);
        let admitted = admitted.filter(|admitted| gate.lets_in(admitted)).ok_or(denied)?;
        let feed = gate != Gate::Door;
        if feed && self.passes.is_cut_off(&key) {
            return Err(denied);
        }
        // Tried again by ZeroMQ itself, as a connection that was denied is not.
        let number = self.passes.issue(feed, &admitted.tenant, &key);
        number.map(|number| (number, key)).ok_or((CROWDED, "too many connections"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actors::wall_clock;
    use crate::tenancy::Role;

    /// A authenticator, and a socket that asks it what ZeroMQ asks.
    fn desk() -> (Authenticator, zmq::Socket, Failure) {
        let (context, failure) = (Context::new(), Failure::default());
        let (admissions, counters) = (Admissions::new(wall_clock()), Arc::default());
        let keeper = Authenticator::start(
            &context,
            Seal::fresh(),
            admissions,
            Passes::new(),
            counters,
            failure.clone(),
            || {},
        );
        let socket = context.socket(zmq::REQ).unwrap();
        socket.connect(ADDRESS).unwrap();
        (keeper.unwrap(), socket, failure)
    }

    #[test]
    fn questions_that_are_none_are_answered_with_an_error_and_the_next_one_is_heard() {
        let (keeper, socket, failure) = desk();
        let key = [7u8; 32];
        let question = |version: &'static [u8], domain: &'static [u8], key: &'static [u8]| {
            vec![version, b"1", domain, b"127.0.0.1", b"", b"CURVE", key]
        };
        let short: &'static [u8] = b"short";
        let key: &'static [u8] = Box::leak(Box::new(key));
        for (asked, code) in [
            (question(b"1.0", b"apprentice", key), "400"),
            (question(b"1.0", b"apprentice", short), "400"),
            (question(b"9.0", b"apprentice", key), "500"),
            (question(b"1.0", b"elsewhere", key), "500"),
            (vec![&b"1.0"[..]], "500"),
            (vec![&b""[..]; 40], "500"),
        ] {
            socket.send_multipart(asked, 0).unwrap();
            let answer = socket.recv_multipart(0).unwrap();
            assert_eq!(answer.len(), 6);
            assert_eq!(answer[2], code.as_bytes());
            assert!(answer[4].is_empty(), "nobody is named who is not let in");
        }
        drop(keeper);
        assert_eq!(failure.reason(), None, "an end that was asked for is no failure");
    }

    #[test]
    fn whatever_frames_come_nobody_is_let_in_and_the_authenticator_stays() {
        use proptest::prelude::*;
        let (keeper, socket, failure) = desk();
        let part = || {
            prop_oneof![
                Just(b"1.0".to_vec()),
                Just(b"apprentice".to_vec()),
                Just(b"apprentice/plain/lab".to_vec()),
                Just(b"CURVE".to_vec()),
                Just(vec![7; 32]),
                prop::collection::vec(any::<u8>(), 0..600),
            ]
        };
        let question = prop::collection::vec(part(), 1..12);
        proptest!(|(question in question)| {
            socket.send_multipart(&question, 0).unwrap();
            let answer = socket.recv_multipart(0).unwrap();
            prop_assert_eq!(answer.len(), 6);
            prop_assert!(answer[2] == b"400" || answer[2] == b"500");
            prop_assert!(answer[4].is_empty());
        });
        drop(keeper);
        assert_eq!(failure.reason(), None);
    }

    #[test]
    fn a_user_id_that_was_not_given_here_names_nobody() {
        let (seal, other) = (Seal::fresh(), Seal::fresh());
        let key = PublicKey([9; 32]);
        assert_eq!(seal.read(&seal.stamp(3, &key)), Some((3, key)));
        let forged = [other.stamp(3, &key), key.to_string(), format!(":3:{key}"), String::new()];
        for user_id in forged {
            assert_eq!(seal.read(&user_id), None, "{user_id}");
        }
    }

    #[test]
    fn a_feed_lets_in_its_own_tenants_auditors_and_operators_and_the_plain_one_no_auditor() {
        let [lab, other] = ["lab", "other"].map(|name| TenantId::new(name).unwrap());
        let feed = |plain| Gate::Feed { tenant: lab.clone(), plain };
        for gate in [Gate::Door, feed(false), feed(true)] {
            assert_eq!(Gate::read(gate.domain().as_bytes()), Some(gate));
        }
        for domain in ["", "apprentice/", "apprentice/sealed/", "apprentice/plain/../x"] {
            assert_eq!(Gate::read(domain.as_bytes()), None, "{domain}");
        }
        let lets_in = |gate: &Gate, tenant: &TenantId| {
            [Role::Gateway, Role::Operator, Role::Auditor]
                .map(|role| gate.lets_in(&Admitted { tenant: tenant.clone(), role }))
        };
        assert_eq!(lets_in(&feed(false), &lab), [false, true, true]);
        assert_eq!(lets_in(&feed(true), &lab), [false, true, false]);
        for gate in [feed(false), feed(true)] {
            assert_eq!(lets_in(&gate, &other), [false; 3]);
            assert_eq!(lets_in(&gate, &TenantId::local()), [false; 3]);
        }
    }
}
