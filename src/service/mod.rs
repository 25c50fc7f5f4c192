//! The one place that wires a service together: store → actors → gateway. The binary starts it,
//! and so does any program that wants the service inside itself (`examples/embed.rs`).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

use crate::actors::{
    ActorSettings, ActorSystem, ActorsError, Erased, Failure, OrderError, Registrar, Usage,
    Wakings, wall_clock,
};
use crate::client::{
    Client, ClientError, Context, CurveKey, CurveKeyError, Endpoint, EndpointError,
};
use crate::frontends::{Counts, Doors, FeedDoor, Gateway, GatewayError, LockedDoor};
use crate::ids::{PublicKey, TenantId, UserId};
use crate::learning::Recipe;
use crate::limits::{AWAKE_USERS_MAX, FEED_WAITING_MAX};
use crate::store::{self, FaultPlan};
use crate::tenancy::Clock;
use crate::world::Domain;

/// What a service is made of.
#[derive(Debug, Clone)]
pub struct Config<D: Domain> {
    pub domain: Arc<D>,
    pub data: Data,
    /// The recipe (TOML) that new people start with. People who are known keep theirs.
    pub recipe_text: String,
    /// Endpoints beside the one inside the process: `tcp://127.0.0.1:PORT` (0 takes a free port),
    /// `tcp://[::1]:PORT`, `ipc://PATH`. Whoever reaches them is the single user of this machine:
    /// tenant `local`, and its operator.
    pub listen: Vec<String>,
    /// Endpoints where only those come in whose key was admitted; any address will do.
    pub listen_curve: Vec<String>,
    /// Where what becomes durable is published: the first endpoint, after which the others follow.
    /// Followers catch up at an endpoint of `listen_curve`, which must be there.
    pub feed: Option<String>,
    /// Messages of the feed that wait for one subscriber before it misses some.
    pub feed_waiting_max: i32,
    /// The file of the service's own CURVE key, made when missing; none: `keys/server.curve` in the
    /// data directory.
    pub server_key: Option<PathBuf>,
    /// Trainings at once.
    pub trainers: usize,
    /// People awake at once.
    pub awake_max: usize,
    /// Faults on purpose, for drills; none in a normal service.
    pub faults: Option<FaultPlan>,
    /// The machine's wall clock, unless a test sets another.
    pub clock: Clock,
}

/// Where a service keeps what it records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Data {
    Directory(PathBuf),
    /// Nowhere: everything ends with the service. For tests and trials.
    Memory,
}

/// Why a service did not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    #[error(
        "a feed needs an endpoint with keys, where followers catch up; add one with \
         `--curve tcp://ADDRESS:PORT`"
    )]
    FeedAlone,
    #[error(transparent)]
    ServerKey(#[from] CurveKeyError),
    #[error(transparent)]
    Store(#[from] store::OpenError),
    #[error("the fault drill cannot be started: {0}")]
    Drill(std::io::Error),
    #[error(transparent)]
    Actors(#[from] ActorsError),
    #[error(transparent)]
    Gateway(#[from] GatewayError),
}

/// A running service. Stops when dropped.
pub struct Service {
    // Dropped, and stopped, in this order: first nobody comes in, then everybody goes to sleep.
    gateway: Gateway,
    actors: ActorSystem,
    context: Context,
    failure: Failure,
    server_key: Option<PublicKey>,
}

/// Where a data directory keeps the service's own CURVE key. Not named `.key`: those are tenants'.
pub fn server_key_file(directory: &Path) -> PathBuf {
    directory.join("keys/server.curve")
}

/// The endpoint inside the process; each service has a context, so that names do not meet.
const INNER: &str = "inproc://apprentice";

impl<D: Domain> Config<D> {
    /// The `default` recipe, no endpoint, as many trainers and actor threads as fit this machine.
    pub fn new(domain: Arc<D>, data: Data) -> Config<D> {
        let recipe = Recipe::builtin("default").expect("the recipe `default` ships");
        Config {
            domain,
            data,
            recipe_text: recipe.to_owned(),
            listen: Vec::new(),
            listen_curve: Vec::new(),
            feed: None,
            feed_waiting_max: FEED_WAITING_MAX,
            server_key: None,
            trainers: cores(),
            awake_max: AWAKE_USERS_MAX,
            faults: None,
            clock: wall_clock(),
        }
    }
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, |cores| cores.get())
}

impl Service {
    /// Opens the store, trains the base mind, and opens the doors, in this order: nobody is
    /// answered by a service that is not ready.
    pub fn start<D: Domain>(config: Config<D>) -> Result<Service, StartError> {
        let open = config.listen.iter().map(|text| Endpoint::parse_open(text));
        let open: Vec<Endpoint> = open.collect::<Result<_, _>>()?;
        let locked = config.listen_curve.iter().map(|text| Endpoint::parse(text));
        let locked: Vec<Endpoint> = locked.collect::<Result<_, _>>()?;
        let feed = config.feed.as_deref().map(Endpoint::parse).transpose()?;
        if feed.is_some() && locked.is_empty() {
            return Err(StartError::FeedAlone);
        }
        let failure = Failure::default();
        let store = match &config.data {
            Data::Directory(path) => store::open(path)?,
            Data::Memory => store::open_memory(),
        };
        let store = match config.faults {
            Some(plan) => store.under(plan).map_err(StartError::Drill)?,
            None => store,
        };
        // After the directory was locked: two processes must not make its key at once.
        let key = match (locked.is_empty(), &config.server_key, &config.data) {
            (true, _, _) => None,
            (false, Some(file), _) => Some(CurveKey::read_or_make(file)?),
            (false, None, Data::Directory(directory)) => {
                Some(CurveKey::read_or_make(&server_key_file(directory))?)
            }
            (false, None, Data::Memory) => Some(CurveKey::new()?),
        };
        let actors = ActorSystem::start(ActorSettings {
            domain: config.domain,
            store,
            recipe_text: config.recipe_text,
            trainers: config.trainers,
            arbiters: cores(),
            awake_max: config.awake_max,
            failure: failure.clone(),
            clock: config.clock,
        })?;
        let context = Context::new();
        let waiting_max = config.feed_waiting_max;
        let feed = feed.as_ref().zip(actors.reader()).map(|(endpoint, reader)| {
            let notifications = actors.notifications().clone();
            FeedDoor { endpoint, waiting_max, notifications, reader }
        });
        let locked = key.as_ref().map(|key| LockedDoor { endpoints: &locked, key, feed });
        let doors = Doors { inner: INNER, open: &open, locked };
        let (front, registrar) = (actors.front(), actors.registrar().clone());
        let gateway = Gateway::open(&context, doors, front, registrar, failure.clone())?;
        let server_key = key.map(|key| *key.public());
        Ok(Service { gateway, actors, context, failure, server_key })
    }

    /// A client inside this process.
    pub fn connect(&self, user: UserId) -> Result<Client, ClientError> {
        Client::within(&self.context, INNER, user)
    }

    /// The first endpoint without keys that other processes can reach, with the port that was taken.
    pub fn endpoint(&self) -> Option<&str> {
        self.endpoints().first().map(String::as_str)
    }

    /// The endpoints without keys.
    pub fn endpoints(&self) -> &[String] {
        self.gateway.open_endpoints()
    }

    /// The endpoints with keys.
    pub fn curve_endpoints(&self) -> &[String] {
        self.gateway.locked_endpoints()
    }

    /// The endpoints of the feed now, with their tenants and whether records are in the clear there.
    pub fn feed_endpoints(&self) -> Vec<(TenantId, bool, String)> {
        self.gateway.feed_endpoints()
    }

    /// Where orders about tenants are handed in from inside the process.
    pub fn registrar(&self) -> &Registrar {
        self.actors.registrar()
    }

    /// The service's own public key, when it has a door with keys.
    pub fn server_key(&self) -> Option<&PublicKey> {
        self.server_key.as_ref()
    }

    /// Erases a person while the service runs: their key is destroyed, their minds and snapshots go,
    /// and the tenant's stream says so, signed. Blocks.
    ///
    /// - errors: nobody of that name, or what stood in the way.
    pub fn erase(&self, tenant: TenantId, user: UserId) -> Erased {
        let (sender, receiver) = mpsc::channel();
        self.actors.erase(tenant, user, move |erased| {
            // Nobody waits any more when the service was dropped meanwhile.
            let _ = sender.send(erased);
        });
        receiver.recv().unwrap_or(Err(OrderError::Gone))
    }

    /// What came through the doors.
    pub fn counts(&self) -> Counts {
        self.gateway.counters().now()
    }

    /// What each tenant takes, and how often it was turned away.
    pub fn usage(&self) -> BTreeMap<TenantId, Usage> {
        self.actors.usage()
    }

    /// People awake now.
    pub fn awake(&self) -> usize {
        self.actors.awake()
    }

    /// What waking people has cost, and how often a kept mind or snapshot was stale or damaged.
    pub fn wakings(&self) -> Wakings {
        self.actors.wakings()
    }

    /// Why the service cannot go on, if so: it then answers nobody, and whoever started it must
    /// end the process with a code that is not 0.
    pub fn failed(&self) -> Option<String> {
        self.failure.reason()
    }

    /// Asks for the end of [`Service::wait`], from another thread or a signal handler.
    pub fn stopper(&self) -> impl Fn() + Send + Sync + use<> {
        let failure = self.failure.clone();
        move || failure.stop_expected()
    }

    /// Blocks until the service failed or a [`Service::stopper`] was called.
    ///
    /// - returns: why it failed, if it did.
    pub fn wait(&self) -> Option<String> {
        const WATCH: Duration = Duration::from_secs(3600);
        while !self.failure.wait(WATCH) {}
        self.failed()
    }

    /// Takes no more requests, answers those in hand, sends everybody to sleep and closes the
    /// store. When this returns the data directory may be opened again.
    ///
    /// - errors: the reason, when the service had failed before.
    pub fn stop(mut self) -> Result<(), String> {
        let reason = self.failed();
        self.close();
        reason.map_or(Ok(()), Err)
    }

    fn close(&mut self) {
        self.failure.stop_expected();
        self.gateway.close();
        self.actors.stop();
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.close();
    }
}
