//! Decides which connections are accepted. ZeroMQ asks for each connection at an endpoint with keys
//! (ZAP, RFC 27), and a thread answers from the register of admitted keys.
//!
//! Three things keep a stranger out, and each of them is enough: the answer to the handshake; the
//! register, which is asked again for each message, so that an open connection ends with its key;
//! and the [`HandshakeSecret`], because ZeroMQ accepts every connection if the ZAP thread has died.

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

/// Where ZeroMQ sends its questions. Each context has one.
const ADDRESS: &str = "inproc://zeromq.zap.01";
/// Names the endpoint for requests in ZeroMQ's questions.
pub(super) const DOMAIN: &str = "apprentice";

/// What a client connects to. ZeroMQ calls it the *domain* of a question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ZapDomain {
    /// The endpoint for requests. Each message there is compared with the register again.
    Requests,
    /// One tenant's feed of encrypted records, or of decrypted ones. Its messages are not checked
    /// one by one, so only those may connect who may read all of it.
    Feed { tenant: TenantId, plain: bool },
}

impl ZapDomain {
    pub fn name(&self) -> String {
        match self {
            ZapDomain::Requests => DOMAIN.to_owned(),
            ZapDomain::Feed { tenant, plain: false } => format!("{SEALED_FEED}{tenant}"),
            ZapDomain::Feed { tenant, plain: true } => format!("{PLAIN_FEED}{tenant}"),
        }
    }

    fn read(name: &[u8]) -> Option<ZapDomain> {
        let name = std::str::from_utf8(name).ok()?;
        let feed = |prefix, plain| {
            let tenant = TenantId::new(name.strip_prefix(prefix)?).ok()?;
            Some(ZapDomain::Feed { tenant, plain })
        };
        match name == DOMAIN {
            true => Some(ZapDomain::Requests),
            false => feed(SEALED_FEED, false).or_else(|| feed(PLAIN_FEED, true)),
        }
    }

    /// True if a key of this tenant and role may connect.
    pub fn accepts(&self, admitted: &Admitted) -> bool {
        match self {
            ZapDomain::Requests => true,
            ZapDomain::Feed { tenant, plain } => {
                let roles = if *plain { rights::PLAIN } else { rights::SEALED };
                admitted.tenant == *tenant && roles.contains(&admitted.role)
            }
        }
    }
}

/// The ZAP code of a refusal that may end soon.
const CROWDED: &str = "300";

const SEALED_FEED: &str = "apprentice/sealed/";
const PLAIN_FEED: &str = "apprentice/plain/";

/// Frames of a question that are kept. ZeroMQ itself never sends so many.
const FRAMES_READ_MAX: usize = 16;

/// A secret of one running service. With it, the answer to a handshake sets the `User-Id` of the
/// connection. If no thread answers handshakes, ZeroMQ uses a `User-Id` that the client sends. The
/// client does not know this secret, so such a `User-Id` is recognised.
#[derive(Clone)]
pub(super) struct HandshakeSecret(String);

impl HandshakeSecret {
    pub fn fresh() -> HandshakeSecret {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).expect("the operating system gives random bytes");
        HandshakeSecret(HEXLOWER.encode(&bytes))
    }

    fn stamp(&self, number: u64, key: &PublicKey) -> String {
        format!("{}:{number}:{key}", self.0)
    }

    /// The number and the key of a connection, from its `User-Id`.
    ///
    /// - returns: none if this service did not set it.
    pub fn read(&self, user_id: &str) -> Option<(u64, PublicKey)> {
        let rest = user_id.strip_prefix(self.0.as_str())?.strip_prefix(':')?;
        let (number, key) = rest.split_once(':')?;
        Some((number.parse().ok()?, key.parse().ok()?))
    }
}

/// The thread that answers handshakes. It ends when this is dropped. Close the sockets that need it
/// first.
#[derive(Debug)]
pub(super) struct Authenticator {
    bell: Outbox<()>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread owns. The guard is dropped first, so that the end is reported before the socket
/// is closed. From then on ZeroMQ accepts every connection.
struct Handshakes<W: Fn()> {
    guard: Guard<W>,
    socket: zmq::Socket,
    inbox: Inbox<()>,
    secret: HandshakeSecret,
    admissions: Admissions,
    passes: Passes,
    counters: Arc<Counters>,
}

/// Reports the end of the thread, also after a panic, unless the thread was told to end.
struct Guard<W: Fn()> {
    failure: Failure,
    /// Wakes the thread that must see the failure.
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
    /// Starts the thread. Call it before the first socket that needs it listens.
    ///
    /// - `wake`: called after a failure of the thread was reported.
    /// - errors: why it did not start.
    pub fn start(
        context: &Context,
        secret: HandshakeSecret,
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
        let mut handshakes =
            Handshakes { guard, socket, inbox, secret, admissions, passes, counters };
        let thread = thread::Builder::new()
            .name("authenticator".to_owned())
            .spawn(move || {
                if let Err(error) = handshakes.serve() {
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

    /// The frames of an answer: version, request id, status code, status text, user id, metadata.
    fn answer(&self, question: &[Vec<u8>]) -> [Vec<u8>; 6] {
        let (code, text, user_id) = match self.judge(question) {
            Ok((number, key)) => {
                count(&self.counters.handshakes);
                ("200", "", self.secret.stamp(number, &key))
            }
            Err((code, text)) => {
                match code {
                    CROWDED => count(&self.counters.handshakes_crowded),
                    _ => count(&self.counters.handshakes_denied),
                }
                // At debug level, because strangers must not be able to fill the operator's log.
                tracing::debug!(code, text, "a connection was refused");
                (code, text, String::new())
            }
        };
        let id = question.get(1).cloned().unwrap_or_default();
        let (code, text) = (code.as_bytes().to_vec(), text.as_bytes().to_vec());
        [b"1.0".to_vec(), id, code, text, user_id.into_bytes(), Vec::new()]
    }

    /// Decides about a question, whose frames are version, request id, domain, address, routing id,
    /// mechanism and key.
    ///
    /// - returns: the number of the connection, and its key.
    /// - errors: the status code and text. They are the same for an unknown key, a retired one and
    ///   one of a disabled lab: a stranger must not learn which keys exist.
    fn judge(
        &self,
        question: &[Vec<u8>],
    ) -> Result<(u64, PublicKey), (&'static str, &'static str)> {
        let [version, _, domain, _, _, mechanism, key] = question else {
            return Err(("500", "not a question about a CURVE key"));
        };
        let domain = ZapDomain::read(domain);
        let (b"1.0", Some(domain), b"CURVE") = (&version[..], domain, &mechanism[..]) else {
            return Err(("500", "not a question about a CURVE key"));
        };
        let denied = ("400", "not admitted");
        let key = PublicKey(key.as_slice().try_into().map_err(|_| denied)?);
        let admitted = self.admissions.admit(&key);
        let admitted = admitted.filter(|admitted| domain.accepts(admitted)).ok_or(denied)?;
        let feed = domain != ZapDomain::Requests;
        if feed && self.passes.is_cut_off(&key) {
            return Err(denied);
        }
        // After this code the client's ZeroMQ tries again. After `denied` it does not.
        let number = self.passes.issue(feed, &admitted.tenant, &key);
        number.map(|number| (number, key)).ok_or((CROWDED, "too many connections"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actors::wall_clock;
    use crate::tenancy::Role;

    /// An authenticator, and a socket that asks it what ZeroMQ asks.
    fn authenticator() -> (Authenticator, zmq::Socket, Failure) {
        let (context, failure) = (Context::new(), Failure::default());
        let (admissions, counters) = (Admissions::new(wall_clock()), Arc::default());
        let authenticator = Authenticator::start(
            &context,
            HandshakeSecret::fresh(),
            admissions,
            Passes::new(),
            counters,
            failure.clone(),
            || {},
        );
        let socket = context.socket(zmq::REQ).unwrap();
        socket.connect(ADDRESS).unwrap();
        (authenticator.unwrap(), socket, failure)
    }

    #[test]
    fn malformed_questions_are_answered_with_an_error_and_the_next_one_is_read() {
        let (authenticator, socket, failure) = authenticator();
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
            assert!(answer[4].is_empty(), "a refusal names no user");
        }
        drop(authenticator);
        assert_eq!(failure.reason(), None, "an end that was requested is no failure");
    }

    #[test]
    fn no_frames_are_accepted_or_end_the_authenticator() {
        use proptest::prelude::*;
        let (authenticator, socket, failure) = authenticator();
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
        drop(authenticator);
        assert_eq!(failure.reason(), None);
    }

    #[test]
    fn a_user_id_that_another_service_set_is_not_read() {
        let (secret, other) = (HandshakeSecret::fresh(), HandshakeSecret::fresh());
        let key = PublicKey([9; 32]);
        assert_eq!(secret.read(&secret.stamp(3, &key)), Some((3, key)));
        let forged = [other.stamp(3, &key), key.to_string(), format!(":3:{key}"), String::new()];
        for user_id in forged {
            assert_eq!(secret.read(&user_id), None, "{user_id}");
        }
    }

    #[test]
    fn a_feed_accepts_auditors_and_operators_of_its_tenant_and_the_plain_one_no_auditor() {
        let [lab, other] = ["lab", "other"].map(|name| TenantId::new(name).unwrap());
        let feed = |plain| ZapDomain::Feed { tenant: lab.clone(), plain };
        for domain in [ZapDomain::Requests, feed(false), feed(true)] {
            assert_eq!(ZapDomain::read(domain.name().as_bytes()), Some(domain));
        }
        for domain in ["", "apprentice/", "apprentice/sealed/", "apprentice/plain/../x"] {
            assert_eq!(ZapDomain::read(domain.as_bytes()), None, "{domain}");
        }
        let accepts = |domain: &ZapDomain, tenant: &TenantId| {
            [Role::Gateway, Role::Operator, Role::Auditor]
                .map(|role| domain.accepts(&Admitted { tenant: tenant.clone(), role }))
        };
        assert_eq!(accepts(&feed(false), &lab), [false, true, true]);
        assert_eq!(accepts(&feed(true), &lab), [false, true, false]);
        for domain in [feed(false), feed(true)] {
            assert_eq!(accepts(&domain, &other), [false; 3]);
            assert_eq!(accepts(&domain, &TenantId::local()), [false; 3]);
        }
    }
}
