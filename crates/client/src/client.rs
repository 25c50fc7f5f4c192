use std::cell::Cell;
use std::time::{Duration, Instant};

use apprentice_core::ids::{PublicKey, RequestId, Seq, StreamKey, TenantId, UserId};
use apprentice_core::limits::{
    CLIENT_RETRY_S_MAX, FRAME_BYTES_MAX, HEADS_IN_REPLY_MAX, RECORDS_IN_REPLY_MAX, WAIT_S_MAX,
};
use apprentice_core::world::{Stage, View};

use crate::probe::{Probe, probe};
use crate::protocol::{
    ArchiveAsk, Ask, Command, ErasedView, ErrorCode, FeedView, HeadView, Heads, Hello,
    KnownExemplar, OnClash, Order, Ordered, PersonAsk, Phase, PlainRecords, Query, Quota,
    QuotaExceeded, RejectionCode, Reply, Response, SealedRecords, ServiceAsk, Status, TenantAsk,
    TenantVerb, TenantView, Waited,
};
use crate::wire::{self, Request};
use crate::{Context, CurveKey, Endpoint, EndpointError, z85};

/// Sends one person's requests to a service and waits for the answers. If an answer is late, it
/// sends the request again with the same request id. This is always safe: the service carries out a
/// request id once.
///
/// ```no_run
/// use apprentice_client::Client;
/// use apprentice_core::ids::UserId;
/// use apprentice_core::world::Stage;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // `apprentice serve --zmq tcp://127.0.0.1:7117` runs on this machine.
/// let client = Client::connect("tcp://127.0.0.1:7117", UserId::new("ada")?)?;
/// client.start(Stage::Task { task: "clean Mug CounterTop".to_owned(), seed: 7 })?;
/// let reply = client.say("go to the mug")?;
/// println!("{:?}", reply.told);
/// # Ok(())
/// # }
/// ```
pub struct Client {
    socket: zmq::Socket,
    user: UserId,
    endpoint: String,
    identity: Option<Identity>,
    patience: Duration,
    connection: Cell<Connection>,
}

/// What a client needs at an endpoint with keys.
#[derive(Debug, Clone)]
pub struct Identity {
    /// The client's own key.
    pub key: CurveKey,
    /// The public key of the service. The client talks to no other service.
    pub server: PublicKey,
}

/// What is known of a client's connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Connection {
    /// No answer came through it yet.
    Fresh,
    /// An answer came through it.
    Used,
    /// The service refused it. ZeroMQ does not connect again by itself.
    Refused,
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ClientError {
    /// Normal: the service declined, and recorded nothing.
    #[error("{message}")]
    Rejected {
        /// For programs.
        code: RejectionCode,
        /// For people: one sentence.
        message: String,
    },
    /// The service cannot answer this request.
    #[error("{message}")]
    Failed {
        /// For programs.
        code: ErrorCode,
        /// For people: one sentence.
        message: String,
    },
    /// It is not known whether the request was carried out. Ask again with the same request id
    /// ([`Client::command_again`]).
    #[error("no answer from {endpoint} within {seconds} s; is the service running?")]
    NoAnswer {
        /// Where the service was expected.
        endpoint: String,
        /// How long the client waited.
        seconds: u64,
    },
    /// The service does not admit the client's key.
    #[error(
        "the service at {endpoint} does not admit your key {key}; ask its operator \
         (`apprentice tenant admit` admits a key)"
    )]
    NotAdmitted {
        /// Where the service is.
        endpoint: String,
        /// The public half of the client's key.
        key: String,
    },
    /// The service has another key than the client expects.
    #[error(
        "the service at {endpoint} does not have the key {server}; ask its operator for the right key \
         (`apprentice keys show` prints it)"
    )]
    WrongServer {
        /// Where the client connected.
        endpoint: String,
        /// The public key that the client expects.
        server: String,
    },
    /// The endpoint has keys, and the client has none.
    #[error(
        "the service at {endpoint} needs a key; name your key with --key FILE and the service's key \
         with --server-key KEY"
    )]
    KeyWanted {
        /// Where the client connected.
        endpoint: String,
    },
    /// The endpoint has no keys, and the client has one.
    #[error("the service at {endpoint} asks for no key; leave --key and --server-key out")]
    NoKeyWanted {
        /// Where the client connected.
        endpoint: String,
    },
    /// The service had too much work the whole time.
    #[error("the service at {endpoint} stayed busy for {seconds} s: {message}")]
    Busy {
        /// Where the service is.
        endpoint: String,
        /// How long the client tried.
        seconds: u64,
        /// What the service said last.
        message: String,
    },
    /// The tenant is over a quota, and waiting did not help or would not help.
    #[error("{message}")]
    OverQuota {
        /// Which quota.
        quota: Quota,
        /// What the tenant uses, in the unit of the quota.
        used: u64,
        /// What it may use, in the unit of the quota.
        limit: u64,
        /// For people: one sentence.
        message: String,
    },
    /// The request was not sent.
    #[error("the request has {found} bytes; at most {FRAME_BYTES_MAX} can be sent")]
    TooLarge {
        /// Bytes of the request.
        found: usize,
    },
    /// The service answered with something else than was asked.
    #[error("the service at {endpoint} answered something else than was asked: {reason}")]
    Puzzling {
        /// Where the service is.
        endpoint: String,
        /// What it answered.
        reason: String,
    },
    /// The endpoint cannot be used.
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    /// ZeroMQ cannot connect, send or receive.
    #[error("cannot reach {endpoint}: {reason}")]
    Socket {
        /// Where the client connects.
        endpoint: String,
        /// What ZeroMQ says.
        reason: String,
    },
}

/// How long the first attempt waits for its answer; each later one waits twice as long.
const ATTEMPT: Duration = Duration::from_secs(2);
/// The longest that one attempt waits.
const ATTEMPT_MAX: Duration = Duration::from_secs(10);
/// How long the client tries to find out why an answer is late.
const PROBE: Duration = Duration::from_secs(1);

impl Identity {
    /// Sets this identity on a socket. Call it before the socket connects.
    ///
    /// - errors: those of ZeroMQ.
    pub fn put_on(&self, socket: &zmq::Socket) -> zmq::Result<()> {
        socket.set_curve_serverkey(&self.server.0)?;
        socket.set_curve_publickey(&self.key.public().0)?;
        socket.set_curve_secretkey(self.key.secret())
    }
}

impl Client {
    /// A client of a service on this machine, at an endpoint without keys. It connects in the
    /// background, so it does not matter which of the two starts first.
    ///
    /// - errors: the endpoint is not one of this machine.
    pub fn connect(endpoint: &str, user: UserId) -> Result<Client, ClientError> {
        let endpoint = match Endpoint::parse(endpoint)? {
            Endpoint::Network { .. } => {
                return Err(EndpointError::KeyWanted { endpoint: endpoint.to_owned() }.into());
            }
            endpoint => endpoint.to_string(),
        };
        Client::open(&Context::new(), &endpoint, user, None)
    }

    /// A client of a service on any machine, at an endpoint with keys. It connects in the
    /// background.
    ///
    /// - errors: it is not an endpoint.
    pub fn connect_as(
        endpoint: &str,
        user: UserId,
        identity: Identity,
    ) -> Result<Client, ClientError> {
        let endpoint = Endpoint::parse(endpoint)?.to_string();
        Client::open(&Context::new(), &endpoint, user, Some(identity))
    }

    /// A client in the process of the service.
    ///
    /// - `context`: that of the service.
    /// - `endpoint`: `inproc://NAME`.
    /// - errors: [`ClientError::Socket`].
    pub fn within(context: &Context, endpoint: &str, user: UserId) -> Result<Client, ClientError> {
        Client::open(context, endpoint, user, None)
    }

    fn open(
        context: &Context,
        endpoint: &str,
        user: UserId,
        identity: Option<Identity>,
    ) -> Result<Client, ClientError> {
        let open = || -> zmq::Result<zmq::Socket> {
            let socket = context.socket(zmq::DEALER)?;
            // A client that gives up must not keep its process from ending.
            socket.set_linger(0)?;
            socket.set_ipv6(endpoint.contains('['))?;
            if let Some(identity) = &identity {
                identity.put_on(&socket)?;
            }
            socket.connect(endpoint)?;
            Ok(socket)
        };
        let socket = open().map_err(|error| ClientError::Socket {
            endpoint: endpoint.to_owned(),
            reason: error.to_string(),
        })?;
        let patience = Duration::from_secs(CLIENT_RETRY_S_MAX);
        let (endpoint, connection) = (endpoint.to_owned(), Cell::new(Connection::Fresh));
        Ok(Client { socket, user, endpoint, identity, patience, connection })
    }

    /// Sets how long a request is sent again before the client gives up: at most
    /// [`CLIENT_RETRY_S_MAX`] seconds, because the service forgets request ids later.
    pub fn with_patience(mut self, patience: Duration) -> Client {
        self.patience = patience.min(Duration::from_secs(CLIENT_RETRY_S_MAX));
        self
    }

    /// The person in whose name requests are sent.
    pub fn user(&self) -> &UserId {
        &self.user
    }

    /// The endpoint of the service.
    pub fn endpoint(&self) -> &str {
        &self.endpoint
    }

    /// Asks which service this is.
    ///
    /// - errors: see [`ClientError`]; so for all requests below.
    pub fn hello(&self) -> Result<Hello, ClientError> {
        match self.ask(ServiceAsk::Hello)? {
            Response::Hello(hello) => Ok(hello),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Begins an episode.
    pub fn start(&self, stage: Stage) -> Result<Reply, ClientError> {
        self.command(Command::StartEpisode { stage })
    }

    /// Says something to the robot.
    pub fn say(&self, utterance: &str) -> Result<Reply, ClientError> {
        self.command(Command::Say { utterance: utterance.to_owned() })
    }

    /// Ends the episode before its goal is reached.
    pub fn done(&self) -> Result<Reply, ClientError> {
        self.command(Command::Done)
    }

    /// Says which actions an utterance meant.
    ///
    /// - `explains`: the record of the answer to the utterance ([`Teachable`](crate::Teachable)).
    /// - `actions`: numbers of actions of the episode, without a gap. Empty: no action explains it.
    pub fn teach(
        &self,
        explains: Seq,
        actions: Vec<u32>,
        on_clash: OnClash,
    ) -> Result<Reply, ClientError> {
        self.command(Command::Teach { explains, actions, on_clash })
    }

    /// Ends the teaching and begins a training. See [`Client::wait_until_learned`].
    pub fn finish_teaching(&self) -> Result<Reply, ClientError> {
        self.command(Command::FinishTeaching)
    }

    /// Forgets a lesson and begins a training.
    ///
    /// - `lesson`: the record of the lesson.
    pub fn forget(&self, lesson: Seq) -> Result<Reply, ClientError> {
        self.command(Command::Forget { lesson })
    }

    /// Says that what the robot did last is not what was meant.
    pub fn mark_wrong(&self) -> Result<Reply, ClientError> {
        self.command(Command::MarkWrong)
    }

    /// Withdraws the person. No command is accepted afterwards.
    ///
    /// - `reason`: may be empty.
    pub fn close(&self, reason: &str) -> Result<Reply, ClientError> {
        self.command(Command::Close { reason: reason.to_owned() })
    }

    /// Asks for the phase, the goal, the actions so far and what may be taught.
    pub fn status(&self) -> Result<Status, ClientError> {
        match self.ask(Query::Status)? {
            Response::Status(status) => Ok(status),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Asks what the robot sees and holds.
    pub fn look(&self) -> Result<View, ClientError> {
        match self.ask(Query::Look)? {
            Response::Look(view) => Ok(view),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Asks for the exemplars that answers come from.
    pub fn known(&self) -> Result<Vec<KnownExemplar>, ClientError> {
        match self.ask(Query::Known)? {
            Response::Known(known) => Ok(known),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Asks where new records of the client's tenant are published. Use a
    /// [`Follower`](crate::Follower) to read them.
    pub fn feed(&self) -> Result<FeedView, ClientError> {
        match self.ask(ServiceAsk::Feed)? {
            Response::Feed(feed) => Ok(feed),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Asks where all streams of the client's tenant end. They come in the order of their keys.
    pub fn heads(&self) -> Result<Vec<HeadView>, ClientError> {
        let (mut all, limit) = (Vec::<HeadView>::new(), HEADS_IN_REPLY_MAX as u32);
        loop {
            let after = all.last().map(|head| head.stream);
            match self.ask(Ask::Archive(ArchiveAsk::Heads { after, limit }))? {
                Response::Heads(Heads { heads, more }) => {
                    let ends = !more || heads.is_empty();
                    all.extend(heads);
                    if ends {
                        return Ok(all);
                    }
                }
                other => return Err(self.puzzled(&other)),
            }
        }
    }

    /// Asks for encrypted records of a stream, from the record `from` on. An answer has at most
    /// [`RECORDS_IN_REPLY_MAX`] of them; ask again from the next record while `more` is true.
    pub fn records(&self, stream: StreamKey, from: Seq) -> Result<SealedRecords, ClientError> {
        let limit = RECORDS_IN_REPLY_MAX as u32;
        match self.ask(Ask::Archive(ArchiveAsk::Sealed { stream, from, limit }))? {
            Response::Records(records) => Ok(records),
            other => Err(self.puzzled(&other)),
        }
    }

    /// As [`Client::records`], decrypted.
    pub fn plain_records(&self, stream: StreamKey, from: Seq) -> Result<PlainRecords, ClientError> {
        let limit = RECORDS_IN_REPLY_MAX as u32;
        match self.ask(Ask::Archive(ArchiveAsk::Plain { stream, from, limit }))? {
            Response::PlainRecords(records) => Ok(records),
            other => Err(self.puzzled(&other)),
        }
    }

    pub(crate) fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    /// Gives an order. Needs a key with the role operator.
    ///
    /// - `tenant`: the tenant that it is about; none: the tenant of the client's key.
    pub fn order(&self, tenant: Option<TenantId>, order: Order) -> Result<Ordered, ClientError> {
        match self.ask(Ask::Order(TenantAsk { tenant, verb: TenantVerb::Give(order) }))? {
            Response::Ordered(ordered) => Ok(ordered),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Asks for the tenants that this operator may see, or for one of them.
    pub fn tenants(&self, tenant: Option<TenantId>) -> Result<Vec<TenantView>, ClientError> {
        match self.ask(Ask::Order(TenantAsk { tenant, verb: TenantVerb::List }))? {
            Response::Tenants(tenants) => Ok(tenants),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Erases a person: destroys their key, so that their records can no longer be decrypted.
    ///
    /// If no answer comes, look whether the name is in use again before you call this a second
    /// time: a second call is a new request and would erase the new person with this name.
    ///
    /// - `tenant`: the person's tenant; none: the tenant of the client's key.
    pub fn erase(&self, tenant: Option<TenantId>, user: UserId) -> Result<ErasedView, ClientError> {
        match self.ask(Ask::Order(TenantAsk { tenant, verb: TenantVerb::Erase { user } }))? {
            Response::Erased(erased) => Ok(erased),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Waits until no training is queued or running.
    ///
    /// - errors: [`ClientError::NoAnswer`] if it takes longer than `limit`.
    pub fn wait_until_learned(&self, limit: Duration) -> Result<Waited, ClientError> {
        let end = Instant::now() + limit;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let seconds = (left.as_secs() as u32).clamp(1, WAIT_S_MAX);
            match self.ask(Ask::Person(PersonAsk::Wait { seconds }))? {
                Response::Waited(waited) if waited.status.phase != Phase::Learning => {
                    return Ok(waited);
                }
                Response::Waited(_) if Instant::now() >= end => {
                    return Err(ClientError::NoAnswer {
                        endpoint: self.endpoint.clone(),
                        seconds: limit.as_secs(),
                    });
                }
                Response::Waited(_) => {}
                other => return Err(self.puzzled(&other)),
            }
        }
    }

    /// Sends a command under a fresh request id.
    pub fn command(&self, command: Command) -> Result<Reply, ClientError> {
        self.command_again(fresh_id(), command)
    }

    /// Sends a command under a request id that you choose. If you keep the id, you can ask for the
    /// same reply after a restart of the client or the service. A new command needs a new id.
    pub fn command_again(&self, id: RequestId, command: Command) -> Result<Reply, ClientError> {
        match self.ask_again(id, command.into())? {
            Response::Reply(reply) => Ok(reply),
            other => Err(self.puzzled(&other)),
        }
    }

    fn ask(&self, ask: impl Into<Ask>) -> Result<Response, ClientError> {
        self.ask_again(fresh_id(), ask.into())
    }

    fn ask_again(&self, id: RequestId, ask: Ask) -> Result<Response, ClientError> {
        let waits = match &ask {
            Ask::Person(PersonAsk::Wait { seconds }) => Duration::from_secs(u64::from(*seconds)),
            _ => Duration::ZERO,
        };
        let bytes = wire::encode_request(&Request { id, user: self.user.clone(), ask });
        if bytes.len() > FRAME_BYTES_MAX {
            return Err(ClientError::TooLarge { found: bytes.len() });
        }
        if self.connection.get() == Connection::Refused {
            self.reconnect()?;
        }
        let end = Instant::now() + self.patience + waits;
        let (mut attempt, mut send, mut busy) = (ATTEMPT, true, None);
        let mut pause = Duration::ZERO;
        loop {
            let now = Instant::now();
            if now >= end {
                return Err(self.gave_up(busy));
            }
            let until = match send {
                true if pause.is_zero() => {
                    self.send(&bytes)?;
                    end.min(now + attempt + waits)
                }
                // After a Busy and before the next attempt, the answer to an earlier attempt may
                // still come.
                _ => end.min(now + pause),
            };
            match self.answer_to(id, until)? {
                Some(Response::Busy(answer)) => {
                    pause = Duration::from_millis(u64::from(answer.retry_after_ms.clamp(1, 5_000)));
                    busy = Some(answer.message);
                    send = false;
                }
                Some(Response::QuotaExceeded(over)) => match over.retry_after_ms {
                    // If that is later than the client would wait, it gives up at once.
                    Some(ms) if now + Duration::from_millis(u64::from(ms)) < end => {
                        pause = Duration::from_millis(u64::from(ms.max(1)));
                        busy = Some(over.message);
                        send = false;
                    }
                    _ => {
                        let QuotaExceeded { quota, used, limit, message, .. } = over;
                        return Err(ClientError::OverQuota { quota, used, limit, message });
                    }
                },
                Some(Response::Rejected(rejected)) => {
                    let (code, message) = (rejected.code, rejected.message);
                    return Err(ClientError::Rejected { code, message });
                }
                Some(Response::Error(failed)) => {
                    let (code, message) = (failed.code, failed.message);
                    return Err(ClientError::Failed { code, message });
                }
                Some(response) => return Ok(response),
                None if !pause.is_zero() => (pause, send) = (Duration::ZERO, true),
                None => {
                    attempt = ATTEMPT_MAX.min(attempt * 2);
                    self.find_out()?;
                }
            }
        }
    }

    /// An answer is late. Finds out whether waiting can help.
    ///
    /// - errors: it cannot, and why.
    fn find_out(&self) -> Result<(), ClientError> {
        if self.endpoint.starts_with("inproc:") {
            return Ok(());
        }
        let endpoint = self.endpoint.clone();
        let error = match (probe(&endpoint, self.identity.as_ref(), PROBE), &self.identity) {
            (Probe::Silence, _) | (Probe::BrokenOff | Probe::NotAdmitted, None) => return Ok(()),
            (Probe::Accepted, _) => {
                // Accepted now, but perhaps not when this client connected.
                return match self.connection.get() {
                    Connection::Used => Ok(()),
                    Connection::Fresh | Connection::Refused => self.reconnect(),
                };
            }
            (Probe::NotAdmitted, Some(identity)) => {
                ClientError::NotAdmitted { endpoint, key: z85::show(identity.key.public()) }
            }
            // A service without keys may end the handshake, as a service with another key does. But
            // it accepts a client without a key.
            (Probe::BrokenOff, Some(_)) if probe(&endpoint, None, PROBE) == Probe::Accepted => {
                ClientError::NoKeyWanted { endpoint }
            }
            (Probe::BrokenOff, Some(identity)) => {
                ClientError::WrongServer { endpoint, server: z85::show(&identity.server) }
            }
            (Probe::OtherMechanism, None) => ClientError::KeyWanted { endpoint },
            (Probe::OtherMechanism, Some(_)) => ClientError::NoKeyWanted { endpoint },
        };
        self.connection.set(Connection::Refused);
        Err(error)
    }

    fn reconnect(&self) -> Result<(), ClientError> {
        // This fails if there is no connection, which does not matter.
        let _ = self.socket.disconnect(&self.endpoint);
        self.socket.connect(&self.endpoint).map_err(|error| self.socket_error(error))?;
        self.connection.set(Connection::Fresh);
        Ok(())
    }

    fn send(&self, bytes: &[u8]) -> Result<(), ClientError> {
        match self.socket.send(bytes, zmq::DONTWAIT) {
            // The queue is full, because the service has been away for long. The next attempt sends
            // it again.
            Ok(()) | Err(zmq::Error::EAGAIN | zmq::Error::EINTR) => Ok(()),
            Err(error) => Err(self.socket_error(error)),
        }
    }

    /// Waits for the answer to `id`. Answers to other requests are dropped.
    ///
    /// - returns: none if there was none until `until`.
    fn answer_to(&self, id: RequestId, until: Instant) -> Result<Option<Response>, ClientError> {
        loop {
            let left = until.saturating_duration_since(Instant::now());
            // Rounded up, or the last millisecond would be a busy loop.
            let left_ms = left.as_micros().div_ceil(1_000) as i64;
            match self.socket.poll(zmq::POLLIN, left_ms) {
                Ok(0) if Instant::now() >= until => return Ok(None),
                Ok(0) | Err(zmq::Error::EINTR) => continue,
                Ok(_) => {}
                Err(error) => return Err(self.socket_error(error)),
            }
            let frames = match self.socket.recv_multipart(zmq::DONTWAIT) {
                Ok(frames) => {
                    self.connection.set(Connection::Used);
                    frames
                }
                Err(zmq::Error::EAGAIN | zmq::Error::EINTR) => continue,
                Err(error) => return Err(self.socket_error(error)),
            };
            let [bytes] = &frames[..] else {
                let reason = format!("a message of {} frames", frames.len());
                return Err(ClientError::Puzzling { endpoint: self.endpoint.clone(), reason });
            };
            match wire::decode_response(bytes) {
                Ok((found, response)) if found == id => return Ok(Some(response)),
                Ok(_) => {}
                Err(reason) => {
                    return Err(ClientError::Puzzling { endpoint: self.endpoint.clone(), reason });
                }
            }
        }
    }

    fn gave_up(&self, busy: Option<String>) -> ClientError {
        let (endpoint, seconds) = (self.endpoint.clone(), self.patience.as_secs());
        match busy {
            Some(message) => ClientError::Busy { endpoint, seconds, message },
            None => ClientError::NoAnswer { endpoint, seconds },
        }
    }

    fn socket_error(&self, error: zmq::Error) -> ClientError {
        ClientError::Socket { endpoint: self.endpoint.clone(), reason: error.to_string() }
    }

    fn puzzled(&self, response: &Response) -> ClientError {
        let reason = response.name().to_owned();
        ClientError::Puzzling { endpoint: self.endpoint.clone(), reason }
    }
}

/// A request id from random bytes of the operating system. No other request has it.
///
/// - panics: if the operating system gives no random bytes.
pub fn fresh_id() -> RequestId {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).expect("the operating system gives random bytes");
    RequestId(bytes)
}
