use super::passes::Passes;
use super::raw::Outlet;
use super::rights::Caller;
use super::zap::{DOMAIN, HandshakeSecret};
use super::{GatewayError, lock};
use crate::client::{Context, CurveKey, Endpoint};
use crate::ids::PublicKey;
use crate::limits::{FRAME_BYTES_MAX, FRAMES_MAX, UNREAD_MAX};
use crate::tenancy::Admissions;

/// One ROUTER socket, and whose messages it accepts.
pub(super) struct Listener {
    pub socket: Outlet,
    access: Access,
}

enum Access {
    /// No keys: every client is the single user of this machine.
    Open,
    Keys {
        admissions: Admissions,
        secret: HandshakeSecret,
        passes: Passes,
    },
}

/// What a listener with keys needs.
pub(super) struct Keyed<'a> {
    pub key: &'a CurveKey,
    pub admissions: Admissions,
    pub secret: HandshakeSecret,
    pub passes: Passes,
}

/// One whole message.
pub(super) struct Incoming {
    /// The routing id first. At most [`FRAMES_MAX`] frames are kept.
    pub frames: Vec<Vec<u8>>,
    /// The message had more frames than are kept.
    pub too_many: bool,
    pub sender: Sender,
}

/// Who sent a message, as far as the listener knows.
pub(super) enum Sender {
    Known(Caller),
    /// The connection has this key, and the key is not admitted now.
    NotAdmitted(PublicKey),
    /// The authenticator did not answer the handshake of this connection: see [`HandshakeSecret`].
    Unvouched,
}

/// How long answers may take to leave the process when the service stops, in milliseconds.
const LINGER_MS: i32 = 1_000;
/// The property of a message that the handshake of its connection has set.
const USER_ID: &str = "User-Id";
/// The property of a message with the file descriptor of its connection.
const DESCRIPTOR: &str = "__fd";

impl Listener {
    /// A listener that is bound to no endpoint yet.
    ///
    /// - `keys`: none: it accepts everybody.
    pub fn new(context: &Context, keys: Option<Keyed<'_>>) -> Result<Listener, GatewayError> {
        let start = |error: zmq::Error| GatewayError::Start { reason: error.to_string() };
        let socket = Outlet::new(context.socket(zmq::ROUTER).map_err(start)?);
        // An answer for a client that is gone or does not read is an error, which is counted. It
        // must not be lost in silence, and it must not block the answers to others.
        socket.set_router_mandatory(true).map_err(start)?;
        // A client that sends a larger frame than this is disconnected before its bytes fill the
        // memory. Between the two bounds it gets an error with a sentence.
        socket.set_maxmsgsize(2 * FRAME_BYTES_MAX as i64).map_err(start)?;
        socket.set_linger(LINGER_MS).map_err(start)?;
        socket.set_rcvhwm(UNREAD_MAX).map_err(start)?;
        socket.bound_sending().map_err(start)?;
        let access = match keys {
            None => Access::Open,
            Some(Keyed { key, admissions, secret, passes }) => {
                lock::put_on(&socket, key, DOMAIN).map_err(start)?;
                Access::Keys { admissions, secret, passes }
            }
        };
        Ok(Listener { socket, access })
    }

    /// Listens at an inproc name of its context.
    pub fn bind_inner(&self, name: &str) -> Result<(), GatewayError> {
        let start = |error: zmq::Error| GatewayError::Start { reason: error.to_string() };
        self.socket.bind(name).map_err(start)
    }

    /// Listens at these endpoints.
    ///
    /// - returns: the endpoints, each with its port.
    pub fn bind(&self, endpoints: &[Endpoint]) -> Result<Vec<String>, GatewayError> {
        endpoints.iter().map(|endpoint| self.bind_one(endpoint)).collect()
    }

    fn bind_one(&self, endpoint: &Endpoint) -> Result<String, GatewayError> {
        let name = endpoint.to_string();
        let refused = |reason: String| GatewayError::Bind { endpoint: name.clone(), reason };
        let failed = |error: zmq::Error| refused(error.to_string());
        self.socket.set_ipv6(endpoint.is_ipv6()).map_err(failed)?;
        self.socket.bind(&name).map_err(failed)?;
        let bound = self.socket.get_last_endpoint().map_err(failed)?;
        bound.map_err(|_| refused("its name is not UTF-8".to_owned()))
    }

    /// The next message, without waiting for one.
    pub fn receive(&self) -> zmq::Result<Incoming> {
        let mut frames = vec![self.socket.recv_bytes(zmq::DONTWAIT)?];
        let mut too_many = false;
        let mut sender = None;
        while self.socket.get_rcvmore()? {
            // The frames of a message arrive together, so this does not wait.
            let mut frame = self.socket.recv_msg(0)?;
            // All of them are from one connection.
            sender.get_or_insert_with(|| self.sender(&mut frame));
            match frames.len() < FRAMES_MAX {
                true => frames.push(frame.to_vec()),
                false => too_many = true,
            }
        }
        let sender = sender.unwrap_or(Sender::Unvouched);
        Ok(Incoming { frames, too_many, sender })
    }

    fn sender(&self, frame: &mut zmq::Message) -> Sender {
        let Access::Keys { admissions, secret, passes } = &self.access else {
            return Sender::Known(Caller::Local);
        };
        match vouched(secret, passes, frame) {
            None => Sender::Unvouched,
            // Asked for each message: a revoked key is refused at its next message.
            Some(key) => match admissions.admit(&key) {
                Some(admitted) => Sender::Known(Caller::Keyed(admitted)),
                None => Sender::NotAdmitted(key),
            },
        }
    }

    /// True if an answer to `routing_id` can only reach the client that has it now. An id that
    /// ZeroMQ gives is used once. An id that a client chose can be chosen by another client later.
    pub fn is_own_address(&self, routing_id: &[u8]) -> bool {
        match self.access {
            Access::Open => true,
            Access::Keys { .. } => routing_id.len() == GIVEN_ID_BYTES && routing_id[0] == 0,
        }
    }
}

/// The key of the connection of a frame. Notes the file descriptor of the connection.
///
/// - returns: none if the authenticator did not answer the handshake of the connection.
pub(super) fn vouched(
    secret: &HandshakeSecret,
    passes: &Passes,
    frame: &mut zmq::Message,
) -> Option<PublicKey> {
    let (number, key) = secret.read(frame.gets(USER_ID)?)?;
    if passes.is_new(number)
        && let Some(descriptor) = frame.gets(DESCRIPTOR).and_then(|text| text.parse().ok())
    {
        passes.seen(number, descriptor);
    }
    Some(key)
}

/// Bytes of a routing id that ZeroMQ gives: a zero and a number of 32 bits.
const GIVEN_ID_BYTES: usize = 5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actors::wall_clock;
    use crate::client::Identity;

    fn receive(listener: &Listener) -> Incoming {
        assert_eq!(listener.socket.poll(zmq::POLLIN, 10_000).unwrap(), 1, "a message within 10 s");
        listener.receive().unwrap()
    }

    /// If no thread answers handshakes, ZeroMQ accepts every connection. This test has no such
    /// thread.
    #[test]
    fn a_message_whose_handshake_was_not_answered_is_unvouched() {
        let (context, key) = (Context::new(), CurveKey::new().unwrap());
        let admissions = Admissions::new(wall_clock());
        let (secret, passes) = (HandshakeSecret::fresh(), Passes::new());
        let keyed = Keyed { key: &key, admissions, secret, passes };
        let listener = Listener::new(&context, Some(keyed)).unwrap();
        let endpoint = Endpoint::parse("tcp://127.0.0.1:0").unwrap();
        let bound = listener.bind(&[endpoint]).unwrap();
        let stranger = Context::new().socket(zmq::DEALER).unwrap();
        let identity = Identity { key: CurveKey::new().unwrap(), server: *key.public() };
        identity.put_on(&stranger).unwrap();
        stranger.connect(&bound[0]).unwrap();
        stranger.send("let me in", 0).unwrap();
        let incoming = receive(&listener);
        assert!(matches!(incoming.sender, Sender::Unvouched));
        assert_eq!(incoming.frames[1], b"let me in");
    }

    #[test]
    fn a_listener_without_keys_knows_one_user_and_keeps_few_frames() {
        let context = Context::new();
        let listener = Listener::new(&context, None).unwrap();
        listener.bind_inner("inproc://listener").unwrap();
        let local = context.socket(zmq::DEALER).unwrap();
        local.connect("inproc://listener").unwrap();
        local.send_multipart(vec!["x"; 100], 0).unwrap();
        let incoming = receive(&listener);
        assert!(matches!(incoming.sender, Sender::Known(Caller::Local)));
        assert_eq!((incoming.frames.len(), incoming.too_many), (FRAMES_MAX, true));
    }
}
