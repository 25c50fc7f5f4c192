//! What the actors share, and what they do on other threads: waking, training, keeping minds.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use actix::Addr;

use super::awake::Awake;
use super::meters::Meters;
use super::seat::NewSession;
use super::trainer::{Run, Slot, Train, Trainer};
use super::{CommitNotifications, Failure, Registrar};
use crate::client::{ErrorCode, Response};
use crate::fairness::Trainings;
use crate::ids::{Digest, RequestId, StreamId, TenantId, Timestamp, UserId};
use crate::learning::{self, Lesson, Mind, Recipe};
use crate::limits::TRAIN_QUEUE_MAX;
use crate::replay::{self, Minds};
use crate::sabotage;
use crate::session::Session;
use crate::store::{EventLog, KeyError, Store};
use crate::world::Domain;

/// What exists before the actix system starts.
pub(super) struct Common<D: Domain> {
    pub domain: Arc<D>,
    pub store: Store,
    pub new: Arc<NewSession>,
    pub minds: Arc<Minds>,
    pub meters: Arc<Meters>,
    pub notifications: CommitNotifications,
    pub failure: Failure,
    // Last, because fields are dropped in this order: it must end after the store was closed.
    pub _open: Awake,
}

/// What the actors share. It exists as long as one of them uses the store.
pub(super) struct Shared<D: Domain> {
    registrar: Registrar,
    trainer: OnceLock<Addr<Trainer<D>>>,
    trainings: Mutex<Trainings<Train<D>>>,
    common: Common<D>,
}

impl<D: Domain> Shared<D> {
    /// Starts the trainers. Call it on the thread of the actix system.
    pub fn start(
        common: Common<D>,
        registrar: Registrar,
        trainers: usize,
        trainer: impl FnOnce(Arc<Shared<D>>, usize) -> Addr<Trainer<D>>,
    ) -> Arc<Shared<D>> {
        let shared = Arc::new(Shared {
            registrar,
            trainer: OnceLock::new(),
            trainings: Mutex::new(Trainings::new(trainers)),
            common,
        });
        let address = trainer(shared.clone(), trainers.max(1));
        assert!(shared.trainer.set(address).is_ok(), "it was just made and is set once");
        shared
    }

    pub fn log(&self) -> &dyn EventLog {
        &*self.common.store.log
    }

    /// Writes the tenants' own streams.
    pub fn registrar(&self) -> &Registrar {
        &self.registrar
    }

    /// Takes notes of new records for the feed.
    pub fn notifications(&self) -> &CommitNotifications {
        &self.common.notifications
    }

    /// What the session of a new person starts with.
    pub fn new_session(&self) -> &Arc<NewSession> {
        &self.common.new
    }

    pub fn failure(&self) -> &Failure {
        &self.common.failure
    }

    pub fn stream_of(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, KeyError> {
        self.common.store.keys.stream_id(tenant, user)
    }

    /// The wall clock; a session makes it monotone with `next_at`.
    pub fn now(&self) -> Timestamp {
        self.registrar.admissions().clock().read()
    }

    /// Queues a training.
    ///
    /// - returns: true if there was space for it.
    pub fn queue_training(self: &Arc<Self>, train: Train<D>) -> bool {
        let stream = train.stream.clone();
        let quota = self.common.meters.quotas(&stream.tenant).trainings_waiting;
        let most = quota.map_or(TRAIN_QUEUE_MAX, |quota| TRAIN_QUEUE_MAX.min(quota as usize));
        let queued = self.trainings().push(&stream, train, most);
        // It may replace a training of a former actor of the same person. That actor is gone.
        let taken = queued.is_ok();
        if !taken {
            self.common.meters.note_training_refused(&stream.tenant);
        }
        self.hand_out_trainings();
        taken
    }

    /// Notes that a training is over, and starts the next.
    pub fn trained(self: &Arc<Self>, stream: &StreamId) {
        self.trainings().finish(stream);
        self.hand_out_trainings();
    }

    /// Gives a training to each free trainer. The queue of the trainers' actor has no limit and
    /// knows no tenants, so it never gets more than there are trainers.
    fn hand_out_trainings(self: &Arc<Self>) {
        let trainer = self.trainer.get().expect("set before the first actor starts");
        if !trainer.connected() {
            // The system stops. When these people wake again, their trainings are still due.
            let waiting = self.trainings().clear();
            return drop(waiting);
        }
        loop {
            let next = self.trainings().start();
            let Some((stream, train)) = next else { return };
            let slot = Slot { shared: self.clone(), stream };
            trainer.do_send(Run { train, slot });
        }
    }

    // A panic while the lock is held leaves nothing half changed, and none of its methods calls
    // back.
    fn trainings(&self) -> MutexGuard<'_, Trainings<Train<D>>> {
        self.trainings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn mind(&self, tenant: &TenantId, digest: Digest) -> Option<Arc<Mind>> {
        self.common.minds.get(tenant, digest)
    }

    pub fn remember(&self, tenant: &TenantId, mind: Arc<Mind>) {
        self.common.minds.put(tenant, mind);
    }
}

/// Rebuilds a session from the log. The session of a new person is not open; only a command writes
/// records. Blocks.
///
/// - errors: the answer to all requests for this person.
pub(super) fn wake<D: Domain>(
    shared: &Shared<D>,
    stream: &StreamId,
) -> Result<Session<D>, Box<Response>> {
    // Put back into the memory of minds, because everybody begins with it.
    shared.remember(&stream.tenant, shared.common.new.base.clone());
    let Common { domain, store, minds, .. } = &shared.common;
    replay::rebuild(domain, store, stream, minds).map_err(|error| {
        let message = format!("this session cannot be woken: {error}");
        Box::new(Response::error(ErrorCode::Unavailable, message))
    })
}

/// Trains a mind and keeps its bytes, before a record names it. Runs on a thread of the trainers.
///
/// - errors: why there is no mind, as a sentence.
pub(super) fn train<D: Domain>(
    shared: &Shared<D>,
    stream: &StreamId,
    recipe: &Recipe,
    lessons: &[Lesson<D::Scene, D::Task>],
) -> Result<Arc<Mind>, String> {
    sabotage::point("training");
    let mind = learning::train(&*shared.common.domain, recipe, lessons)
        .map_err(|error| error.to_string())?;
    if let Err(error) = replay::keep_mind(&shared.common.store, stream, &mind) {
        // They are a cache: without them, the next waking trains again.
        tracing::warn!(%stream, %error, "the mind's bytes were not kept");
    }
    Ok(Arc::new(mind))
}

/// Keeps a snapshot, so that the next waking applies fewer records. It is a cache: a failure only
/// costs time.
pub(super) fn keep_snapshot<D: Domain>(
    shared: &Shared<D>,
    stream: &StreamId,
    session: &Session<D>,
) {
    if let Err(reason) = replay::keep_snapshot(&shared.common.store, stream, session) {
        tracing::warn!(%stream, %reason, "no snapshot was kept");
    }
}

/// Deletes the kept bytes of all minds of a person but the present one.
pub(super) fn forget_old_minds<D: Domain>(
    shared: &Shared<D>,
    stream: &StreamId,
    session: &Session<D>,
) {
    let current: Vec<Digest> = session.mind().iter().map(|mind| mind.digest()).collect();
    if let Err(reason) = shared.common.store.models.keep_only(stream, &current) {
        tracing::warn!(%stream, %reason, "old minds were not dropped");
    }
}

/// A request id for records that the service itself writes.
pub(super) fn fresh_request() -> RequestId {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).expect("the operating system gives random bytes");
    RequestId(bytes)
}
