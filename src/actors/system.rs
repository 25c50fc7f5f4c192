use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, mpsc};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use actix::dev::SendError;
use actix::{Actor, Addr, Arbiter, ArbiterHandle, SyncArbiter, System};

use super::archive::{Archive, ArchiveReader, Question};
use super::awake::AwakeCount;
use super::defect::panic_words;
use super::directory::actor::{
    Address, DirectoryActor, ErasePerson, Greeting, People, SleepAll, Waking,
};
use super::meters::{Meters, Usage};
use super::seat::NewSession;
use super::shared::{Common, Shared};
use super::trainer::Trainer;
use super::user::UserActor;
use super::{
    AnswerTo, CommitNotifications, Erased, Failure, OrderError, Registrar, Submit, TenantRegistry,
};
use crate::client::{ArchiveAsk, Ask, Hello, Response};
use crate::ids::{StreamId, TenantId, UserId};
use crate::learning::{self, Mind, Recipe};
use crate::replay::{Minds, Work};
use crate::store::{CacheCounter, CacheCounts, KeyError, Store};
use crate::tenancy::Clock;
use crate::world::Domain;

/// All actors, on an actix system with its own thread.
pub struct ActorSystem {
    directory: Addr<DirectoryActor>,
    registrar: Registrar,
    meters: Arc<Meters>,
    notifications: CommitNotifications,
    reader: Option<ArchiveReader>,
    archive: Archive,
    system: System,
    thread: Option<JoinHandle<()>>,
    failure: Failure,
    awake: Arc<AwakeCount>,
    /// The parts of the service that use the store.
    store_users: Arc<AwakeCount>,
    minds: Arc<Minds>,
    kept_minds: CacheCounter,
    snapshots: CacheCounter,
}

/// What waking people has cost since the start, and what the caches saved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wakings {
    /// Records applied and minds trained.
    pub work: Work,
    /// Kept minds.
    pub minds: CacheCounts,
    /// Kept snapshots.
    pub snapshots: CacheCounts,
}

/// What the actors are started with.
pub struct ActorSettings<D: Domain> {
    /// The world.
    pub domain: Arc<D>,
    /// Keeps the records.
    pub store: Store,
    /// The recipe of new people, as TOML.
    pub recipe_text: String,
    /// Trainings at the same time.
    pub trainers: usize,
    /// Threads that people's actors share.
    pub arbiters: usize,
    /// People awake at the same time.
    pub awake_max: usize,
    /// Where the actors report that the service must stop.
    pub failure: Failure,
    /// Gives the times of records and ends the overlaps of retired keys.
    pub clock: Clock,
}

/// Why the actors did not start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActorsError {
    /// The recipe is not valid.
    #[error("the recipe for new people cannot be read: {reason}")]
    Recipe { reason: String },
    /// Training without lessons failed.
    #[error("the base mind cannot be trained: {reason}")]
    BaseMind { reason: String },
    /// The records of a tenant cannot be read.
    #[error("the tenants' own records cannot be read: {0}")]
    Tenants(#[from] OrderError),
    /// A thread did not start.
    #[error("the actors did not start: {reason}")]
    System { reason: String },
}

/// Takes requests from frontends. Does not depend on the domain.
#[derive(Clone)]
pub struct Front {
    directory: Addr<DirectoryActor>,
    meters: Arc<Meters>,
    archive: Archive,
}

/// A request that was not accepted. It must be answered in another way.
pub enum NotTaken {
    /// Too many requests wait.
    Full(AnswerTo),
    /// The actors have stopped.
    Closed(AnswerTo),
}

impl Front {
    /// As [`ActorSystem::erase`]. If the actors have stopped, `answer` is dropped.
    pub fn erase(
        &self,
        tenant: TenantId,
        user: UserId,
        answer: impl FnOnce(Erased) + Send + 'static,
    ) {
        self.directory.do_send(ErasePerson { tenant, user, answer: Box::new(answer) });
    }

    /// Counts a request until it is answered. Call it before [`Front::submit`], [`Front::greet`] or
    /// [`Front::ask_archive`].
    ///
    /// - errors: the answer, if the tenant is over a quota or the service has too much work.
    pub fn let_in(
        &self,
        tenant: &TenantId,
        ask: &Ask,
        answer: &mut AnswerTo,
    ) -> Result<(), Box<Response>> {
        answer.let_in(self.meters.admit(tenant, ask)?);
        Ok(())
    }

    /// Notes that something was dropped, because the tenant's clients do not read.
    pub fn note_unread(&self, tenant: &TenantId) {
        self.meters.note_unread(tenant);
    }

    /// Gives a request to a person's actor. Wakes the person.
    pub fn submit(&self, submit: Submit) -> Result<(), NotTaken> {
        self.directory.try_send(submit).map_err(|error| match error {
            SendError::Full(submit) => NotTaken::Full(submit.answer),
            SendError::Closed(submit) => NotTaken::Closed(submit.answer),
        })
    }

    /// Asks which service this is.
    pub fn greet(&self, answer: AnswerTo) -> Result<(), NotTaken> {
        self.directory.try_send(Greeting { answer }).map_err(|error| match error {
            SendError::Full(greeting) => NotTaken::Full(greeting.answer),
            SendError::Closed(greeting) => NotTaken::Closed(greeting.answer),
        })
    }

    /// Asks about a tenant's records.
    pub fn ask_archive(
        &self,
        tenant: TenantId,
        ask: ArchiveAsk,
        answer: AnswerTo,
    ) -> Result<(), NotTaken> {
        self.archive.ask(Question { tenant, ask, answer }).map_err(NotTaken::Full)
    }
}

/// How long a stop waits for actors to fall asleep, and then for trainings to end.
const FALL_ASLEEP: Duration = Duration::from_secs(30);
/// The same if the service has failed. It must end soon, and nothing that it still did would be
/// kept.
const FALL_DOWN: Duration = Duration::from_millis(200);

impl ActorSystem {
    /// Trains the base mind, so that no request waits for it, and starts the actors. Blocks.
    ///
    /// - errors: see [`ActorsError`].
    pub fn start<D: Domain>(settings: ActorSettings<D>) -> Result<ActorSystem, ActorsError> {
        let ActorSettings {
            domain,
            store,
            recipe_text,
            trainers,
            arbiters,
            awake_max,
            failure,
            clock,
        } = settings;
        let recipe = Recipe::parse(&recipe_text)
            .map_err(|error| ActorsError::Recipe { reason: error.to_string() })?;
        let hello = Hello {
            service: env!("CARGO_PKG_NAME").to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            domain: domain.id().to_owned(),
            recipe: recipe.name().to_owned(),
        };
        let (awake, store_users) =
            (Arc::new(AwakeCount::default()), Arc::new(AwakeCount::default()));
        let minds = Arc::<Minds>::default();
        let (kept_minds, snapshots) = (store.models.counter(), store.snapshots.counter());
        let tenant_registry = TenantRegistry::open_by(store.clone(), clock)?;
        let meters = Arc::new(Meters::new(tenant_registry.admissions().clone(), store.log.clone()));
        let notifications = tenant_registry.notifications().clone();
        let reader = ArchiveReader::new(store.log.clone());
        let base = base_mind(&*domain, &recipe)?;
        let common = Common {
            domain,
            store,
            new: Arc::new(NewSession { recipe, recipe_text, base }),
            minds: minds.clone(),
            meters: meters.clone(),
            notifications: notifications.clone(),
            failure: failure.clone(),
            _open: store_users.enter(),
        };
        let archive = Archive::start(reader.clone(), store_users.enter())
            .map_err(|error| ActorsError::System { reason: error.to_string() })?;

        let (started, ready) = mpsc::channel();
        let (count, alarm) = (awake.clone(), failure.alarm("the actors' thread ended"));
        let (failed, registry_open) = (failure.clone(), store_users.enter());
        let measured = meters.clone();
        let thread = thread::Builder::new()
            .name("actors".to_owned())
            .spawn(move || {
                let _alarm = alarm;
                let system = System::new();
                let (directory, registrar) = system.block_on(async move {
                    let registrar = Registrar::start(tenant_registry, registry_open, failed);
                    let trainer = |shared: Arc<Shared<D>>, trainers| {
                        SyncArbiter::start(trainers, move || Trainer { shared: shared.clone() })
                    };
                    let shared = Shared::start(common, registrar.clone(), trainers, trainer);
                    let arbiters: Vec<Arbiter> =
                        (0..arbiters.max(1)).map(|_| Arbiter::new()).collect();
                    let homes = arbiters.iter().map(Arbiter::handle).collect();
                    let people = Box::new(Homes { shared, homes });
                    let for_directory = registrar.clone();
                    let directory = DirectoryActor::new(
                        people,
                        awake_max,
                        hello,
                        count,
                        measured,
                        for_directory,
                    );
                    let directory = directory.start();
                    (directory, registrar)
                });
                let _ = started.send((directory, registrar, System::current()));
                if let Err(error) = system.run() {
                    tracing::error!(%error, "the actors' system ended with an error");
                }
            })
            .map_err(|error| ActorsError::System { reason: error.to_string() })?;
        let (directory, registrar, system) = ready
            .recv()
            .map_err(|_| ActorsError::System { reason: "their thread ended at once".to_owned() })?;
        let thread = Some(thread);
        Ok(ActorSystem {
            directory,
            registrar,
            meters,
            notifications,
            reader: Some(reader),
            archive,
            system,
            thread,
            failure,
            awake,
            store_users,
            minds,
            kept_minds,
            snapshots,
        })
    }

    /// Takes requests.
    pub fn front(&self) -> Front {
        Front {
            directory: self.directory.clone(),
            meters: self.meters.clone(),
            archive: self.archive.clone(),
        }
    }

    /// Tells one listener which records are new.
    pub fn notifications(&self) -> &CommitNotifications {
        &self.notifications
    }

    /// Reads durable records; none after a stop. Drop it before you stop the actors.
    pub fn reader(&self) -> Option<ArchiveReader> {
        self.reader.clone()
    }

    /// What each tenant uses, and how often it was refused.
    pub fn usage(&self) -> BTreeMap<TenantId, Usage> {
        self.meters.usage()
    }

    /// Takes orders about tenants.
    pub fn registrar(&self) -> &Registrar {
        &self.registrar
    }

    /// Erases a person: destroys their key, so that their records can no longer be decrypted, and
    /// records it. The person is asleep meanwhile. Afterwards the name belongs to a new person.
    ///
    /// - `answer`: called once, from another thread.
    pub fn erase(
        &self,
        tenant: TenantId,
        user: UserId,
        answer: impl FnOnce(Erased) + Send + 'static,
    ) {
        let answer = Box::new(answer);
        self.directory.do_send(ErasePerson { tenant, user, answer });
    }

    /// People awake now.
    pub fn awake(&self) -> usize {
        self.awake.now()
    }

    /// What waking people has cost.
    pub fn wakings(&self) -> Wakings {
        let (minds, snapshots) = (self.kept_minds.now(), self.snapshots.now());
        Wakings { work: self.minds.work(), minds, snapshots }
    }

    /// Sends everybody to sleep, which keeps their snapshots, and closes the store.
    pub fn stop(&mut self) {
        let Some(thread) = self.thread.take() else { return };
        self.failure.stop_expected();
        let patience = if self.failure.reason().is_some() { FALL_DOWN } else { FALL_ASLEEP };
        self.archive.close();
        self.reader = None;
        self.directory.do_send(SleepAll);
        if !self.awake.wait_for_none(patience) {
            tracing::warn!(awake = self.awake.now(), "stopping although not everybody sleeps");
        }
        self.system.stop();
        // A panic in there was reported by its alarm.
        let _ = thread.join();
        // A training that still runs uses the store, and the store must be free for the next
        // process.
        if !self.store_users.wait_for_none(patience) {
            tracing::warn!("the store is still held by a training");
        }
        let Wakings { work, minds, snapshots } = self.wakings();
        tracing::info!(
            woken = work.rebuilds,
            events_folded = work.events_folded,
            trained_again = work.trainings,
            not_reproduced = work.not_reproduced,
            stale_minds = minds.stale,
            damaged_minds = minds.damaged,
            stale_snapshots = snapshots.stale,
            damaged_snapshots = snapshots.damaged,
            "what waking people has cost"
        );
    }
}

impl Drop for ActorSystem {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Trains the mind of new people.
fn base_mind<D: Domain>(domain: &D, recipe: &Recipe) -> Result<Arc<Mind>, ActorsError> {
    let train = || learning::train(domain, recipe, &[]).map_err(|error| error.to_string());
    let trained = catch_unwind(AssertUnwindSafe(train)).map_err(|panic| panic_words(&*panic));
    let mind = trained.flatten().map_err(|reason| ActorsError::BaseMind { reason })?;
    Ok(Arc::new(mind))
}

/// Starts people's actors, spread over arbiters.
struct Homes<D: Domain> {
    shared: Arc<Shared<D>>,
    homes: Vec<ArbiterHandle>,
}

impl<D: Domain> People for Homes<D> {
    fn stream_of(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, KeyError> {
        self.shared.stream_of(tenant, user)
    }

    fn wake(&self, waking: Waking) -> Address {
        // The key of a stream is a keyed hash, so its bytes are evenly distributed.
        let place = usize::from(waking.stream.key.0[0]) % self.homes.len();
        let shared = self.shared.clone();
        let start = move |_: &mut _| UserActor::new(shared, waking);
        let user = UserActor::start_in_arbiter(&self.homes[place], start);
        Address { submit: user.clone().recipient(), sleep: user.recipient() }
    }
}
