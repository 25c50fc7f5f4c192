use std::cell::Cell;
use std::time::{Duration, Instant};

use apprentice_core::ids::{PublicKey, RequestId, Seq, StreamKey, TenantId, UserId};
use apprentice_core::limits::{
    CLIENT_RETRY_S_MAX, FRAME_BYTES_MAX, HEADS_IN_REPLY_MAX, RECORDS_IN_REPLY_MAX, WAIT_S_MAX,
};
use apprentice_core::world::{Stage, View};

use crate::probe::{Probe, probe};
use crate::protocol::{
    ArchiveAsk, Ask, Command, DoorAsk, ErasedView, ErrorCode, FeedView, HeadView, Heads, Hello,
    KnownExemplar, OnClash, Order, Ordered, PersonAsk, Phase, PlainRecords, Query, Quota,
    QuotaExceeded, RejectionCode, Reply, Response, SealedRecords, Status, TenantAsk, TenantVerb,
    TenantView, Waited,
};
use crate::wire::{self, Request};
use crate::{Context, CurveKey, Endpoint, EndpointError, z85};

/// One person's end of the wire: asks, waits, and asks again with the same request id, which is
/// always safe.
pub struct Client {
    socket: zmq::Socket,
    user: UserId,
    endpoint: String,
    identity: Option<Identity>,
    patience: Duration,
    state: Cell<Line>,
}

/// Who a client is where keys are asked for, and whom it takes for the service.
#[derive(Debug, Clone)]
pub struct Identity {
    pub key: CurveKey,
    /// The service's public key; whoever has another one is not talked to.
    pub server: PublicKey,
}

/// What is known of a client's connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    /// Nothing was heard on it yet.
    Fresh,
    /// An answer came through it.
    Heard,
    /// It was not let in, after which ZeroMQ does not try again by itself.
    Closed,
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ClientError {
    /// Normal: the service declined, and recorded nothing.
    #[error("{message}")]
    Rejected { code: RejectionCode, message: String },
    #[error("{message}")]
    Failed { code: ErrorCode, message: String },
    /// Whether the request was carried out is not known; asking again with the same id will tell.
    #[error("no answer from {endpoint} within {seconds} s; is the service running?")]
    NoAnswer { endpoint: String, seconds: u64 },
    #[error(
        "the service at {endpoint} does not let in your key {key}; ask whoever runs it \
         (`apprentice tenant admit` lets a key in)"
    )]
    NotAdmitted { endpoint: String, key: String },
    #[error(
        "whoever listens at {endpoint} is not the service with the key {server}; ask whoever runs \
         it for the right one (`apprentice keys show` prints it)"
    )]
    WrongServer { endpoint: String, server: String },
    #[error(
        "the service at {endpoint} lets in only those with a key; name yours with --key FILE and \
         the service's with --server-key KEY"
    )]
    KeyWanted { endpoint: String },
    #[error("the service at {endpoint} asks for no key; leave --key and --server-key out")]
    NoKeyWanted { endpoint: String },
    #[error("the service at {endpoint} stayed busy for {seconds} s: {message}")]
    Busy { endpoint: String, seconds: u64, message: String },
    /// The tenant takes more than it may, and waiting did not help or would not.
    #[error("{message}")]
    OverQuota { quota: Quota, used: u64, limit: u64, message: String },
    #[error("the request has {found} bytes; at most {FRAME_BYTES_MAX} can be sent")]
    TooLarge { found: usize },
    #[error("the service at {endpoint} answered something else than was asked: {reason}")]
    Puzzling { endpoint: String, reason: String },
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    #[error("cannot reach {endpoint}: {reason}")]
    Socket { endpoint: String, reason: String },
}

/// How long the first attempt waits for its answer; each later one waits twice as long.
const ATTEMPT: Duration = Duration::from_secs(2);
/// The longest that one attempt waits.
const ATTEMPT_MAX: Duration = Duration::from_secs(10);
/// How long it is tried to find out why an answer is overdue.
const PROBE: Duration = Duration::from_secs(1);

impl Identity {
    /// Gives a socket this identity, before it connects.
    pub fn put_on(&self, socket: &zmq::Socket) -> zmq::Result<()> {
        socket.set_curve_serverkey(&self.server.0)?;
        socket.set_curve_publickey(&self.key.public().0)?;
        socket.set_curve_secretkey(self.key.secret())
    }
}

impl Client {
    /// A client of a service in another process of this machine, at a door without keys.
    pub fn connect(endpoint: &str, user: UserId) -> Result<Client, ClientError> {
        let endpoint = match Endpoint::parse(endpoint)? {
            Endpoint::Network { .. } => {
                return Err(EndpointError::KeyWanted { endpoint: endpoint.to_owned() }.into());
            }
            endpoint => endpoint.to_string(),
        };
        Client::open(&Context::new(), &endpoint, user, None)
    }

    /// A client of a service at a door with keys, here or elsewhere.
    pub fn connect_as(
        endpoint: &str,
        user: UserId,
        identity: Identity,
    ) -> Result<Client, ClientError> {
        let endpoint = Endpoint::parse(endpoint)?.to_string();
        Client::open(&Context::new(), &endpoint, user, Some(identity))
    }

    /// A client that shares `context` with the service.
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
        let (endpoint, state) = (endpoint.to_owned(), Cell::new(Line::Fresh));
        Ok(Client { socket, user, endpoint, identity, patience, state })
    }

    /// How long a request is retried before it is given up; [`CLIENT_RETRY_S_MAX`] at most, since
    /// request ids are not remembered for ever.
    pub fn with_patience(mut self, patience: Duration) -> Client {
        self.patience = patience.min(Duration::from_secs(CLIENT_RETRY_S_MAX));
        self
    }

    pub fn user(&self) -> &UserId {
        &self.user
    }

    pub fn endpoint(&self) -> &str {
        &self.endpoint
    }

    /// Who answers there.
    pub fn hello(&self) -> Result<Hello, ClientError> {
        match self.ask(DoorAsk::Hello)? {
            Response::Hello(hello) => Ok(hello),
            other => Err(self.puzzled(&other)),
        }
    }

    pub fn start(&self, stage: Stage) -> Result<Reply, ClientError> {
        self.command(Command::StartEpisode { stage })
    }

    pub fn say(&self, utterance: &str) -> Result<Reply, ClientError> {
        self.command(Command::Say { utterance: utterance.to_owned() })
    }

    pub fn done(&self) -> Result<Reply, ClientError> {
        self.command(Command::Done)
    }

    /// `actions` are numbers of the episode's actions, a contiguous run; empty for "nothing did".
    pub fn teach(
        &self,
        explains: Seq,
        actions: Vec<u32>,
        on_clash: OnClash,
    ) -> Result<Reply, ClientError> {
        self.command(Command::Teach { explains, actions, on_clash })
    }

    pub fn finish_teaching(&self) -> Result<Reply, ClientError> {
        self.command(Command::FinishTeaching)
    }

    pub fn forget(&self, lesson: Seq) -> Result<Reply, ClientError> {
        self.command(Command::Forget { lesson })
    }

    pub fn close(&self, reason: &str) -> Result<Reply, ClientError> {
        self.command(Command::Close { reason: reason.to_owned() })
    }

    pub fn status(&self) -> Result<Status, ClientError> {
        match self.ask(Query::Status)? {
            Response::Status(status) => Ok(status),
            other => Err(self.puzzled(&other)),
        }
    }

    pub fn look(&self) -> Result<View, ClientError> {
        match self.ask(Query::Look)? {
            Response::Look(view) => Ok(view),
            other => Err(self.puzzled(&other)),
        }
    }

    pub fn known(&self) -> Result<Vec<KnownExemplar>, ClientError> {
        match self.ask(Query::Known)? {
            Response::Known(known) => Ok(known),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Where new records of this client's tenant are published.
    pub fn feed(&self) -> Result<FeedView, ClientError> {
        match self.ask(DoorAsk::Feed)? {
            Response::Feed(feed) => Ok(feed),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Where all streams of this client's tenant end, in the order of their keys.
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

    /// Records of a stream as they are kept, from `from` on; as many as fit an answer.
    pub fn records(&self, stream: StreamKey, from: Seq) -> Result<SealedRecords, ClientError> {
        let limit = RECORDS_IN_REPLY_MAX as u32;
        match self.ask(Ask::Archive(ArchiveAsk::Sealed { stream, from, limit }))? {
            Response::Records(records) => Ok(records),
            other => Err(self.puzzled(&other)),
        }
    }

    /// As [`Client::records`], in the clear.
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

    /// Gives an operator's order.
    ///
    /// - `tenant`: whom it is about; none: the tenant of this client's own key.
    pub fn order(&self, tenant: Option<TenantId>, order: Order) -> Result<Ordered, ClientError> {
        match self.ask(Ask::Order(TenantAsk { tenant, verb: TenantVerb::Give(order) }))? {
            Response::Ordered(ordered) => Ok(ordered),
            other => Err(self.puzzled(&other)),
        }
    }

    /// The tenants that this operator may see, or one of them.
    pub fn tenants(&self, tenant: Option<TenantId>) -> Result<Vec<TenantView>, ClientError> {
        match self.ask(Ask::Order(TenantAsk { tenant, verb: TenantVerb::List }))? {
            Response::Tenants(tenants) => Ok(tenants),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Erases a person, for good. Under a fresh request id: after an answer was lost, look whether
    /// the name is in use again before asking anew, or its new bearer would be erased.
    pub fn erase(&self, tenant: Option<TenantId>, user: UserId) -> Result<ErasedView, ClientError> {
        match self.ask(Ask::Order(TenantAsk { tenant, verb: TenantVerb::Erase { user } }))? {
            Response::Erased(erased) => Ok(erased),
            other => Err(self.puzzled(&other)),
        }
    }

    /// Waits until the training that runs is over, if one does.
    ///
    /// - errors: [`ClientError::NoAnswer`] when it is not over within `limit`.
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

    /// Sends a command under a request id of the caller's: to ask again after a restart of either
    /// end what came of it. A new command must have a new id.
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
        if self.state.get() == Line::Closed {
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
                // Between a Busy and the next attempt: listening, since an earlier attempt's
                // answer may still come.
                _ => end.min(now + pause),
            };
            match self.answer_to(id, until)? {
                Some(Response::Busy(answer)) => {
                    pause = Duration::from_millis(u64::from(answer.retry_after_ms.clamp(1, 5_000)));
                    busy = Some(answer.message);
                    send = false;
                }
                Some(Response::QuotaExceeded(over)) => match over.retry_after_ms {
                    // Later than anybody waits: said at once.
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

    /// An answer is overdue: whether that will not change by waiting.
    fn find_out(&self) -> Result<(), ClientError> {
        if self.endpoint.starts_with("inproc:") {
            return Ok(());
        }
        let endpoint = self.endpoint.clone();
        let error = match (probe(&endpoint, self.identity.as_ref(), PROBE), &self.identity) {
            (Probe::Silence, _) | (Probe::BrokenOff | Probe::NotAdmitted, None) => return Ok(()),
            (Probe::LetIn, _) => {
                // Let in now, and perhaps not when this client came.
                return match self.state.get() {
                    Line::Heard => Ok(()),
                    Line::Fresh | Line::Closed => self.reconnect(),
                };
            }
            (Probe::NotAdmitted, Some(identity)) => {
                ClientError::NotAdmitted { endpoint, key: z85::show(identity.key.public()) }
            }
            // A service that asks for no key may break off as a wrong one does, but it lets in a client
            // that brings none.
            (Probe::BrokenOff, Some(_)) if probe(&endpoint, None, PROBE) == Probe::LetIn => {
                ClientError::NoKeyWanted { endpoint }
            }
            (Probe::BrokenOff, Some(identity)) => {
                ClientError::WrongServer { endpoint, server: z85::show(&identity.server) }
            }
            (Probe::OtherDoor, None) => ClientError::KeyWanted { endpoint },
            (Probe::OtherDoor, Some(_)) => ClientError::NoKeyWanted { endpoint },
        };
        self.state.set(Line::Closed);
        Err(error)
    }

    fn reconnect(&self) -> Result<(), ClientError> {
        // Without a connection there is none to give up.
        let _ = self.socket.disconnect(&self.endpoint);
        self.socket.connect(&self.endpoint).map_err(|error| self.socket_error(error))?;
        self.state.set(Line::Fresh);
        Ok(())
    }

    fn send(&self, bytes: &[u8]) -> Result<(), ClientError> {
        match self.socket.send(bytes, zmq::DONTWAIT) {
            // A full pipe: the peer has been away for long. The next attempt sends again.
            Ok(()) | Err(zmq::Error::EAGAIN | zmq::Error::EINTR) => Ok(()),
            Err(error) => Err(self.socket_error(error)),
        }
    }

    /// The answer to `id`, or none until `until`. Answers to earlier requests are dropped.
    fn answer_to(&self, id: RequestId, until: Instant) -> Result<Option<Response>, ClientError> {
        loop {
            let left = until.saturating_duration_since(Instant::now());
            // Rounded up, or the last millisecond would be spent spinning.
            let left_ms = left.as_micros().div_ceil(1_000) as i64;
            match self.socket.poll(zmq::POLLIN, left_ms) {
                Ok(0) if Instant::now() >= until => return Ok(None),
                Ok(0) | Err(zmq::Error::EINTR) => continue,
                Ok(_) => {}
                Err(error) => return Err(self.socket_error(error)),
            }
            let frames = match self.socket.recv_multipart(zmq::DONTWAIT) {
                Ok(frames) => {
                    self.state.set(Line::Heard);
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

/// A request id that nobody else has.
pub fn fresh_id() -> RequestId {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).expect("the operating system gives random bytes");
    RequestId(bytes)
}
