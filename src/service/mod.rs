//! The one place that wires a service together: store → actors → gateway. The binary starts it,
//! and so does any program that wants the service inside itself (`examples/embed.rs`).

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crate::actors::{ActorsError, Failure, House, HouseSettings, Usage, Wakings};
use crate::frontends::{
    Client, ClientError, Context, Counts, Endpoint, EndpointError, Gateway, GatewayError,
};
use crate::ids::{TenantId, UserId};
use crate::learning::Recipe;
use crate::limits::AWAKE_USERS_MAX;
use crate::store::{self, FaultPlan};
use crate::world::Domain;

/// What a service is made of.
#[derive(Debug, Clone)]
pub struct Config<D: Domain> {
    pub domain: Arc<D>,
    pub data: Data,
    /// The recipe (TOML) that new people start with. People who are known keep theirs.
    pub recipe_text: String,
    /// Endpoints beside the one inside the process: `tcp://127.0.0.1:PORT` (0 takes a free port),
    /// `tcp://[::1]:PORT`, `ipc://PATH`.
    pub listen: Vec<String>,
    /// Trainings at once.
    pub trainers: usize,
    /// People awake at once.
    pub awake_max: usize,
    /// Faults on purpose, for drills; none in a normal service.
    pub faults: Option<FaultPlan>,
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
    house: House,
    context: Context,
    failure: Failure,
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
            trainers: cores(),
            awake_max: AWAKE_USERS_MAX,
            faults: None,
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
        let outer = config.listen.iter().map(|text| Endpoint::parse(text));
        let outer: Vec<Endpoint> = outer.collect::<Result<_, _>>()?;
        let failure = Failure::default();
        let store = match &config.data {
            Data::Directory(path) => store::open(path)?,
            Data::Memory => store::open_memory(),
        };
        let store = match config.faults {
            Some(plan) => store.under(plan).map_err(StartError::Drill)?,
            None => store,
        };
        let house = House::start(HouseSettings {
            domain: config.domain,
            store,
            recipe_text: config.recipe_text,
            trainers: config.trainers,
            arbiters: cores(),
            awake_max: config.awake_max,
            failure: failure.clone(),
        })?;
        let context = Context::new();
        let (tenant, front) = (TenantId::local(), house.front());
        let gateway = Gateway::open(&context, INNER, &outer, tenant, front, failure.clone())?;
        Ok(Service { gateway, house, context, failure })
    }

    /// A client inside this process.
    pub fn connect(&self, user: UserId) -> Result<Client, ClientError> {
        Client::within(&self.context, INNER, user)
    }

    /// The first endpoint that other processes can reach, with the port that was taken.
    pub fn endpoint(&self) -> Option<&str> {
        self.endpoints().first().map(String::as_str)
    }

    pub fn endpoints(&self) -> &[String] {
        self.gateway.endpoints()
    }

    /// What came through the doors.
    pub fn counts(&self) -> Counts {
        self.gateway.counters().now()
    }

    /// What each tenant takes, and how often it was turned away.
    pub fn usage(&self) -> BTreeMap<TenantId, Usage> {
        self.house.usage()
    }

    /// People awake now.
    pub fn awake(&self) -> usize {
        self.house.awake()
    }

    /// What waking people has cost, and how often a kept mind or snapshot was stale or damaged.
    pub fn wakings(&self) -> Wakings {
        self.house.wakings()
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
        self.house.stop();
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.close();
    }
}
