use super::passes::Passes;
use super::raw::Outlet;
use super::rights::Caller;
use super::zap::{DOMAIN, Seal};
use super::{GatewayError, lock};
use crate::client::{Context, CurveKey, Endpoint};
use crate::ids::PublicKey;
use crate::limits::{FRAME_BYTES_MAX, FRAMES_MAX, UNREAD_MAX};
use crate::tenancy::Admissions;

/// One ROUTER, and what it takes to come in through it.
pub(super) struct Door {
    pub socket: Outlet,
    bolt: Bolt,
}

enum Bolt {
    /// None: whoever reaches it is the single user of this machine.
    Open,
    Keys {
        admissions: Admissions,
        seal: Seal,
        passes: Passes,
    },
}

/// What a door with keys is made of.
pub(super) struct Keyed<'a> {
    pub key: &'a CurveKey,
    pub admissions: Admissions,
    pub seal: Seal,
    pub passes: Passes,
}

/// One whole message.
pub(super) struct Incoming {
    /// The routing id first; no more than [`FRAMES_MAX`].
    pub frames: Vec<Vec<u8>>,
    /// There were more frames than are kept.
    pub too_many: bool,
    pub sender: Sender,
}

/// What the door knows of whoever sent a message.
pub(super) enum Sender {
    Known(Caller),
    /// The connection proved to have this key, and the register does not admit it now.
    NotAdmitted(PublicKey),
    /// Nobody answered for this connection: see [`Seal`].
    Unvouched,
}

/// Milliseconds that answers already sent may take to leave the process at a stop.
const LINGER_MS: i32 = 1_000;
/// What a connection's handshake left for each of its messages.
const USER_ID: &str = "User-Id";
/// The number of its descriptor in this process.
const DESCRIPTOR: &str = "__fd";

impl Door {
    /// A door that listens nowhere yet.
    ///
    /// - `keys`: none for the single user's.
    pub fn new(context: &Context, keys: Option<Keyed<'_>>) -> Result<Door, GatewayError> {
        let start = |error: zmq::Error| GatewayError::Start { reason: error.to_string() };
        let socket = Outlet::new(context.socket(zmq::ROUTER).map_err(start)?);
        // An answer for a peer that is gone, or that does not read, is an error that is counted; it
        // must neither vanish silently nor block everybody else.
        socket.set_router_mandatory(true).map_err(start)?;
        // A peer that sends larger frames than this is disconnected before its bytes fill the
        // memory; between the two bounds it gets a sentence.
        socket.set_maxmsgsize(2 * FRAME_BYTES_MAX as i64).map_err(start)?;
        socket.set_linger(LINGER_MS).map_err(start)?;
        socket.set_rcvhwm(UNREAD_MAX).map_err(start)?;
        socket.bound_sending().map_err(start)?;
        let bolt = match keys {
            None => Bolt::Open,
            Some(Keyed { key, admissions, seal, passes }) => {
                lock::put_on(&socket, key, DOMAIN).map_err(start)?;
                Bolt::Keys { admissions, seal, passes }
            }
        };
        Ok(Door { socket, bolt })
    }

    /// Listens on an inproc name of its context.
    pub fn bind_inner(&self, name: &str) -> Result<(), GatewayError> {
        let start = |error: zmq::Error| GatewayError::Start { reason: error.to_string() };
        self.socket.bind(name).map_err(start)
    }

    /// - returns: the endpoints as they are bound, with the ports that were taken.
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
            // The frames of one message arrive together: this does not wait.
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
        let Bolt::Keys { admissions, seal, passes } = &self.bolt else {
            return Sender::Known(Caller::Local);
        };
        match vouched(seal, passes, frame) {
            None => Sender::Unvouched,
            // Asked for each message: a key that is taken back ends with its next one.
            Some(key) => match admissions.admit(&key) {
                Some(admitted) => Sender::Known(Caller::Keyed(admitted)),
                None => Sender::NotAdmitted(key),
            },
        }
    }

    /// Whether answers addressed to `routing_id` reach nobody but who has it now. One that ZeroMQ
    /// gave is given once; one that a client chose can be taken by another.
    pub fn is_own_address(&self, routing_id: &[u8]) -> bool {
        match self.bolt {
            Bolt::Open => true,
            Bolt::Keys { .. } => routing_id.len() == GIVEN_ID_BYTES && routing_id[0] == 0,
        }
    }
}

/// Whose connection a frame came through, if its handshake was answered here; notes which
/// descriptor it has.
pub(super) fn vouched(seal: &Seal, passes: &Passes, frame: &mut zmq::Message) -> Option<PublicKey> {
    let (number, key) = seal.read(frame.gets(USER_ID)?)?;
    if passes.is_new(number)
        && let Some(descriptor) = frame.gets(DESCRIPTOR).and_then(|text| text.parse().ok())
    {
        passes.seen(number, descriptor);
    }
    Some(key)
}

/// Bytes of a routing id that ZeroMQ gives: a zero and a number.
const GIVEN_ID_BYTES: usize = 5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actors::wall_clock;
    use crate::client::Identity;

    fn receive(door: &Door) -> Incoming {
        assert_eq!(door.socket.poll(zmq::POLLIN, 10_000).unwrap(), 1, "a message within 10 s");
        door.receive().unwrap()
    }

    /// ZeroMQ lets everybody in when nobody answers handshakes: this is that moment.
    #[test]
    fn a_message_whose_handshake_nobody_answered_is_vouched_for_by_nobody() {
        let (context, key) = (Context::new(), CurveKey::new().unwrap());
        let admissions = Admissions::new(wall_clock());
        let (seal, passes) = (Seal::fresh(), Passes::new());
        let keyed = Keyed { key: &key, admissions, seal, passes };
        let door = Door::new(&context, Some(keyed)).unwrap();
        let endpoint = Endpoint::parse("tcp://127.0.0.1:0").unwrap();
        let bound = door.bind(&[endpoint]).unwrap();
        let stranger = Context::new().socket(zmq::DEALER).unwrap();
        let identity = Identity { key: CurveKey::new().unwrap(), server: *key.public() };
        identity.put_on(&stranger).unwrap();
        stranger.connect(&bound[0]).unwrap();
        stranger.send("let me in", 0).unwrap();
        let incoming = receive(&door);
        assert!(matches!(incoming.sender, Sender::Unvouched));
        assert_eq!(incoming.frames[1], b"let me in");
    }

    #[test]
    fn an_open_door_knows_one_person_and_keeps_few_frames() {
        let context = Context::new();
        let door = Door::new(&context, None).unwrap();
        door.bind_inner("inproc://door").unwrap();
        let local = context.socket(zmq::DEALER).unwrap();
        local.connect("inproc://door").unwrap();
        local.send_multipart(vec!["x"; 100], 0).unwrap();
        let incoming = receive(&door);
        assert!(matches!(incoming.sender, Sender::Known(Caller::Local)));
        assert_eq!((incoming.frames.len(), incoming.too_many), (FRAMES_MAX, true));
    }
}
