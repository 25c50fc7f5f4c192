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

/// Everybody who is awake, on an actix system with a thread of its own.
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
    lives: Arc<AwakeCount>,
    minds: Arc<Minds>,
    kept_minds: CacheCounter,
    snapshots: CacheCounter,
}

/// What waking people has cost since the start, and what their caches gave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wakings {
    pub work: Work,
    pub minds: CacheCounts,
    pub snapshots: CacheCounts,
}

/// What the actors are started with.
pub struct ActorSettings<D: Domain> {
    pub domain: Arc<D>,
    pub store: Store,
    /// What new people start with.
    pub recipe_text: String,
    /// Trainings at once.
    pub trainers: usize,
    /// Threads that people's actors share.
    pub arbiters: usize,
    /// People awake at once.
    pub awake_max: usize,
    pub failure: Failure,
    /// What record times and the overlaps of retired keys go by.
    pub clock: Clock,
}

/// Why the actors did not start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActorsError {
    #[error("the recipe for new people cannot be read: {reason}")]
    Recipe { reason: String },
    #[error("the base mind cannot be trained: {reason}")]
    BaseMind { reason: String },
    #[error("the tenants' own records cannot be read: {0}")]
    Tenants(#[from] OrderError),
    #[error("the actors did not start: {reason}")]
    System { reason: String },
}

/// Where front ends hand in requests. Knows no domain.
#[derive(Clone)]
pub struct Front {
    directory: Addr<DirectoryActor>,
    meters: Arc<Meters>,
    archive: Archive,
}

/// A request that was not taken; its way back.
pub enum NotTaken {
    /// Too many are waiting.
    Full(AnswerTo),
    /// Nobody is there any more.
    Closed(AnswerTo),
}

impl Front {
    /// As [`ActorSystem::erase`]; when everybody is gone, `answer` is dropped.
    pub fn erase(
        &self,
        tenant: TenantId,
        user: UserId,
        answer: impl FnOnce(Erased) + Send + 'static,
    ) {
        self.directory.do_send(ErasePerson { tenant, user, answer: Box::new(answer) });
    }

    /// Counts a request until it is answered. Comes before it is handed in.
    ///
    /// - errors: what to answer, when its tenant has too much of something, or all together have.
    pub fn let_in(
        &self,
        tenant: &TenantId,
        ask: &Ask,
        answer: &mut AnswerTo,
    ) -> Result<(), Box<Response>> {
        answer.let_in(self.meters.admit(tenant, ask)?);
        Ok(())
    }

    /// Notes that something was not sent, because the tenant's connections do not read.
    pub fn note_unread(&self, tenant: &TenantId) {
        self.meters.note_unread(tenant);
    }

    /// Hands in what is asked of a person's actor.
    pub fn submit(&self, submit: Submit) -> Result<(), NotTaken> {
        self.directory.try_send(submit).map_err(|error| match error {
            SendError::Full(submit) => NotTaken::Full(submit.answer),
            SendError::Closed(submit) => NotTaken::Closed(submit.answer),
        })
    }

    /// Asks who is there.
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
/// The same when the service has failed: it must be seen to be gone, and nothing that it could
/// still do in order would be kept.
const FALL_DOWN: Duration = Duration::from_millis(200);

impl ActorSystem {
    /// Trains the base mind, so that nobody ever waits for it, and starts the actors.
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
        let (awake, lives) = (Arc::new(AwakeCount::default()), Arc::new(AwakeCount::default()));
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
            _open: lives.enter(),
        };
        let archive = Archive::start(reader.clone(), lives.enter())
            .map_err(|error| ActorsError::System { reason: error.to_string() })?;

        let (started, ready) = mpsc::channel();
        let (count, alarm) = (awake.clone(), failure.alarm("the actors' thread ended"));
        let (failed, registry_open) = (failure.clone(), lives.enter());
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
            lives,
            minds,
            kept_minds,
            snapshots,
        })
    }

    pub fn front(&self) -> Front {
        Front {
            directory: self.directory.clone(),
            meters: self.meters.clone(),
            archive: self.archive.clone(),
        }
    }

    /// What became durable, for one listener.
    pub fn notifications(&self) -> &CommitNotifications {
        &self.notifications
    }

    /// Reads what is durable; none after a stop. To be dropped before one.
    pub fn reader(&self) -> Option<ArchiveReader> {
        self.reader.clone()
    }

    /// What each tenant takes, and how often it was turned away.
    pub fn usage(&self) -> BTreeMap<TenantId, Usage> {
        self.meters.usage()
    }

    /// Where orders about tenants are handed in.
    pub fn registrar(&self) -> &Registrar {
        &self.registrar
    }

    /// Erases a person: destroys their key, so that nothing they said can be read any more, and
    /// records that it was done. `answer` is called once, from another thread. Nobody is awake in
    /// their name meanwhile; whoever uses the name afterwards is somebody new.
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
        if !self.awake.wait_for_silence(patience) {
            tracing::warn!(awake = self.awake.now(), "stopping although not everybody sleeps");
        }
        self.system.stop();
        // A panic in there was reported by its alarm.
        let _ = thread.join();
        // A training that still runs holds the store; whoever opens it next must not find it busy.
        if !self.lives.wait_for_silence(patience) {
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

/// Trains the mind that new people start with.
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
        // The key is a keyed hash: its bytes are spread evenly.
        let place = usize::from(waking.stream.key.0[0]) % self.homes.len();
        let shared = self.shared.clone();
        let start = move |_: &mut _| UserActor::new(shared, waking);
        let user = UserActor::start_in_arbiter(&self.homes[place], start);
        Address { submit: user.clone().recipient(), sleep: user.recipient() }
    }
}
