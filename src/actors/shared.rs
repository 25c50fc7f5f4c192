//! What actors share, and what they do outside the mailbox: waking, training, remembering.

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

/// What exists before there is an actix system.
pub(super) struct Common<D: Domain> {
    pub domain: Arc<D>,
    pub store: Store,
    pub new: Arc<NewSession>,
    pub minds: Arc<Minds>,
    pub meters: Arc<Meters>,
    pub notifications: CommitNotifications,
    pub failure: Failure,
    // Last, so that it ends after the store was closed: fields are dropped in this order.
    pub _open: Awake,
}

/// What the actors share. Lives as long as anyone uses the store.
pub(super) struct Shared<D: Domain> {
    registrar: Registrar,
    trainer: OnceLock<Addr<Trainer<D>>>,
    trainings: Mutex<Trainings<Train<D>>>,
    common: Common<D>,
}

impl<D: Domain> Shared<D> {
    /// Must run on the actix system's thread, where `trainer` starts its threads.
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

    /// Who writes the tenants' own streams.
    pub fn registrar(&self) -> &Registrar {
        &self.registrar
    }

    /// Who is told of what became durable.
    pub fn notifications(&self) -> &CommitNotifications {
        &self.common.notifications
    }

    /// What new people start with.
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
    /// - returns: whether there was a place for it.
    pub fn queue_training(self: &Arc<Self>, train: Train<D>) -> bool {
        let stream = train.stream.clone();
        let quota = self.common.meters.quotas(&stream.tenant).trainings_waiting;
        let most = quota.map_or(TRAIN_QUEUE_MAX, |quota| TRAIN_QUEUE_MAX.min(quota as usize));
        let queued = self.trainings().push(&stream, train, most);
        // What it took the place of was asked for by a former actor of the same person, who is
        // gone.
        let taken = queued.is_ok();
        if !taken {
            self.common.meters.note_training_refused(&stream.tenant);
        }
        self.hand_out_trainings();
        taken
    }

    /// A training is over.
    pub fn trained(self: &Arc<Self>, stream: &StreamId) {
        self.trainings().finish(stream);
        self.hand_out_trainings();
    }

    /// Gives free trainers what is due. The trainers' own queue is not bounded and knows no
    /// tenants: it never holds more than there are trainers.
    fn hand_out_trainings(self: &Arc<Self>) {
        let trainer = self.trainer.get().expect("set before the first actor starts");
        if !trainer.connected() {
            // The system stops. Whoever waits finds out at the next waking that it is still due.
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

    // Its methods leave it whole whenever they return, and none of them calls back.
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

/// Rebuilds a session from the log. That of somebody new is not open, and nothing is written for
/// them: only a command does that. Blocks.
///
/// - errors: what to answer to whoever asks for this person.
pub(super) fn wake<D: Domain>(
    shared: &Shared<D>,
    stream: &StreamId,
) -> Result<Session<D>, Box<Response>> {
    // Never pushed out of the memory of minds for long: everybody begins with it.
    shared.remember(&stream.tenant, shared.common.new.base.clone());
    let Common { domain, store, minds, .. } = &shared.common;
    replay::rebuild(domain, store, stream, minds).map_err(|error| {
        let message = format!("this session cannot be woken: {error}");
        Box::new(Response::error(ErrorCode::Unavailable, message))
    })
}

/// Trains a mind and keeps its bytes, before any record names them. Runs on a trainer's thread.
///
/// - errors: the reason, in the trainer's words.
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
        // The bytes of a mind are a cache: without them the next waking trains again.
        tracing::warn!(%stream, %error, "the mind's bytes were not kept");
    }
    Ok(Arc::new(mind))
}

/// Keeps a snapshot, so that the next waking folds less. A cache: failing costs time only.
pub(super) fn keep_snapshot<D: Domain>(
    shared: &Shared<D>,
    stream: &StreamId,
    session: &Session<D>,
) {
    if let Err(reason) = replay::keep_snapshot(&shared.common.store, stream, session) {
        tracing::warn!(%stream, %reason, "no snapshot was kept");
    }
}

/// Forgets the bytes of minds that nobody will ask for again.
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

/// A request id for what the service itself asks for.
pub(super) fn fresh_request() -> RequestId {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).expect("the operating system gives random bytes");
    RequestId(bytes)
}
