//! Builds a service from its parts: store, actors, gateway. The program `apprentice` starts it.
//! Your own program can start it inside its process (`examples/embed.rs`).

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
use crate::frontends::{Counts, Endpoints, FeedSettings, Gateway, GatewayError, KeyedEndpoints};
use crate::ids::{PublicKey, TenantId, UserId};
use crate::learning::Recipe;
use crate::limits::{AWAKE_USERS_MAX, FEED_WAITING_MAX};
use crate::store::{self, FaultPlan};
use crate::tenancy::Clock;
use crate::world::Domain;

/// What a service is made of.
#[derive(Debug, Clone)]
pub struct Config<D: Domain> {
    /// The world.
    pub domain: Arc<D>,
    /// Where the records are kept.
    pub data: Data,
    /// The recipe of new people, as TOML. Known people keep theirs.
    pub recipe_text: String,
    /// Endpoints without keys: `tcp://127.0.0.1:PORT` (0 takes a free port), `tcp://[::1]:PORT`,
    /// `ipc://PATH`. Everybody who connects there is tenant `local` and its operator. The endpoint
    /// inside the process always exists.
    pub listen: Vec<String>,
    /// Endpoints that accept only admitted keys, at any address.
    pub listen_curve: Vec<String>,
    /// Where new records are published: the first endpoint of the feed; the others get the next
    /// ports. Followers request missed records at an endpoint of `listen_curve`, so there must be
    /// one.
    pub feed: Option<String>,
    /// Messages of the feed that may wait for one subscriber. It misses further ones.
    pub feed_waiting_max: i32,
    /// The file of the service's own CURVE key; it is made if there is none. None:
    /// `keys/server.curve` in the data directory.
    pub server_key: Option<PathBuf>,
    /// Trainings at the same time.
    pub trainers: usize,
    /// People awake at the same time.
    pub awake_max: usize,
    /// Faults on purpose, for drills; none in a normal service.
    pub faults: Option<FaultPlan>,
    /// The wall clock of the machine, unless a test sets another.
    pub clock: Clock,
}

/// Where a service keeps what it records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Data {
    /// In this data directory, which is made if there is none.
    Directory(PathBuf),
    /// In memory: nothing is kept when the service stops. For tests and trials.
    Memory,
}

/// Why a service did not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// An endpoint cannot be used.
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    /// A feed needs an endpoint with keys.
    #[error(
        "a feed needs an endpoint with keys, where followers catch up; add one with \
         `--curve tcp://ADDRESS:PORT`"
    )]
    FeedAlone,
    /// The service's own key cannot be read or made.
    #[error(transparent)]
    ServerKey(#[from] CurveKeyError),
    /// The data directory cannot be opened.
    #[error(transparent)]
    Store(#[from] store::OpenError),
    /// The faults on purpose cannot be prepared.
    #[error("the fault drill cannot be started: {0}")]
    Drill(std::io::Error),
    /// The actors did not start.
    #[error(transparent)]
    Actors(#[from] ActorsError),
    /// The gateway did not start.
    #[error(transparent)]
    Gateway(#[from] GatewayError),
}

/// A running service. Stops when dropped.
pub struct Service {
    // Stopped and dropped in this order: no request may come in while people go to sleep.
    gateway: Gateway,
    actors: ActorSystem,
    context: Context,
    failure: Failure,
    server_key: Option<PublicKey>,
}

/// The file in a data directory with the service's own CURVE key. Its ending is not `.key`, because
/// those files are keys of tenants.
pub fn server_key_file(directory: &Path) -> PathBuf {
    directory.join("keys/server.curve")
}

/// The endpoint inside the process. Each service has its own context, so the name may be the same.
const INNER: &str = "inproc://apprentice";

impl<D: Domain> Config<D> {
    /// The recipe `default`, no endpoint outside the process, and one trainer for each processor.
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
    /// Opens the store, trains the base mind and then listens, so that no request meets a service
    /// that is not ready. Blocks.
    ///
    /// - errors: what stood in the way. Nothing runs then.
    pub fn start<D: Domain>(config: Config<D>) -> Result<Service, StartError> {
        let open = config.listen.iter().map(|text| Endpoint::parse_open(text));
        let open: Vec<Endpoint> = open.collect::<Result<_, _>>()?;
        let keyed = config.listen_curve.iter().map(|text| Endpoint::parse(text));
        let keyed: Vec<Endpoint> = keyed.collect::<Result<_, _>>()?;
        let feed = config.feed.as_deref().map(Endpoint::parse).transpose()?;
        if feed.is_some() && keyed.is_empty() {
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
        // After the directory was locked, so that two processes do not both make the key.
        let key = match (keyed.is_empty(), &config.server_key, &config.data) {
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
            FeedSettings { endpoint, waiting_max, notifications, reader }
        });
        let keyed = key.as_ref().map(|key| KeyedEndpoints { endpoints: &keyed, key, feed });
        let endpoints = Endpoints { inner: INNER, open: &open, keyed };
        let (front, registrar) = (actors.front(), actors.registrar().clone());
        let gateway = Gateway::open(&context, endpoints, front, registrar, failure.clone())?;
        let server_key = key.map(|key| *key.public());
        Ok(Service { gateway, actors, context, failure, server_key })
    }

    /// A client inside this process, as tenant `local`.
    ///
    /// - errors: those of ZeroMQ.
    pub fn connect(&self, user: UserId) -> Result<Client, ClientError> {
        Client::within(&self.context, INNER, user)
    }

    /// The first endpoint without keys that other processes can reach, with its port.
    pub fn endpoint(&self) -> Option<&str> {
        self.endpoints().first().map(String::as_str)
    }

    /// The endpoints without keys.
    pub fn endpoints(&self) -> &[String] {
        self.gateway.open_endpoints()
    }

    /// The endpoints with keys.
    pub fn curve_endpoints(&self) -> &[String] {
        self.gateway.keyed_endpoints()
    }

    /// The endpoints of the feed now, each with its tenant and whether its records are decrypted.
    pub fn feed_endpoints(&self) -> Vec<(TenantId, bool, String)> {
        self.gateway.feed_endpoints()
    }

    /// Takes orders about tenants from inside the process.
    pub fn registrar(&self) -> &Registrar {
        self.actors.registrar()
    }

    /// The service's own public key; none without an endpoint with keys.
    pub fn server_key(&self) -> Option<&PublicKey> {
        self.server_key.as_ref()
    }

    /// Erases a person while the service runs: destroys their key, their minds and their snapshots,
    /// and records it, signed, in the tenant's stream. Blocks.
    ///
    /// - errors: no person has this name, or what stood in the way.
    pub fn erase(&self, tenant: TenantId, user: UserId) -> Erased {
        let (sender, receiver) = mpsc::channel();
        self.actors.erase(tenant, user, move |erased| {
            // This fails if the service was dropped meanwhile; then no caller waits.
            let _ = sender.send(erased);
        });
        receiver.recv().unwrap_or(Err(OrderError::Gone))
    }

    /// What came through the endpoints since the start.
    pub fn counts(&self) -> Counts {
        self.gateway.counters().now()
    }

    /// What each tenant uses, and how often it was refused.
    pub fn usage(&self) -> BTreeMap<TenantId, Usage> {
        self.actors.usage()
    }

    /// People awake now.
    pub fn awake(&self) -> usize {
        self.actors.awake()
    }

    /// What waking people has cost since the start, and how often a kept mind or snapshot was stale
    /// or damaged.
    pub fn wakings(&self) -> Wakings {
        self.actors.wakings()
    }

    /// Why the service has failed; none if it has not. A failed service answers no request. End its
    /// process with an exit code other than 0.
    pub fn failed(&self) -> Option<String> {
        self.failure.reason()
    }

    /// A function that ends [`Service::wait`]. Call it from another thread or a signal handler.
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

    /// Refuses new requests, answers those that were accepted, sends everybody to sleep and closes
    /// the store. Afterwards the data directory can be opened again. Blocks.
    ///
    /// - errors: the reason, if the service had failed before.
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
