//! What actors share, and what they do outside the mailbox: waking, training, remembering.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use actix::Addr;

use super::awake::Awake;
use super::meters::Meters;
use super::trainer::{Run, Seat, Train, Trainer};
use super::{ErrorCode, Failure, Growths, Registrar, Response};
use crate::events::Record;
use crate::fairness::Trainings;
use crate::ids::{Digest, RequestId, Seq, StreamId, TenantId, Timestamp, UserId};
use crate::learning::{self, Lesson, Mind, Recipe};
use crate::limits::TRAIN_QUEUE_MAX;
use crate::replay::{self, Minds};
use crate::sabotage;
use crate::session::{Command, Proposed, Session, Turn};
use crate::store::{EventLog, KeyError, Store};
use crate::world::Domain;

/// What the actors are made from, before there is an actix system.
pub(super) struct Parts<D: Domain> {
    pub domain: Arc<D>,
    pub store: Store,
    pub recipe: Recipe,
    pub recipe_text: String,
    /// Trainings at once.
    pub trainers: usize,
    pub minds: Arc<Minds>,
    pub meters: Arc<Meters>,
    pub growths: Growths,
    pub failure: Failure,
    pub open: Awake,
}

impl<D: Domain> Parts<D> {
    /// Trains the mind that new people start with. It holds nobody's words, so everybody shares it.
    pub fn with_base_mind(self) -> Result<Seeded<D>, String> {
        let train = || learning::train(&*self.domain, &self.recipe, &[]);
        let base = catch_unwind(AssertUnwindSafe(train))
            .map_err(|panic| panic_words(&*panic))?
            .map_err(|error| error.to_string())?;
        Ok(Seeded { parts: self, base: Arc::new(base) })
    }
}

/// [`Parts`] and the base mind.
pub(super) struct Seeded<D: Domain> {
    parts: Parts<D>,
    base: Arc<Mind>,
}

/// What the actors share. Lives as long as anyone uses the store.
pub(super) struct Life<D: Domain> {
    domain: Arc<D>,
    store: Store,
    recipe: Recipe,
    recipe_text: String,
    base: Arc<Mind>,
    minds: Arc<Minds>,
    meters: Arc<Meters>,
    growths: Growths,
    trainer: OnceLock<Addr<Trainer<D>>>,
    registrar: Registrar,
    trainings: Mutex<Trainings<Train<D>>>,
    failure: Failure,
    // Last, so that it ends after the store was closed: fields are dropped in this order.
    _open: Awake,
}

impl<D: Domain> Life<D> {
    /// Must run on the actix system's thread, where `trainer` starts its threads.
    pub fn start(
        seeded: Seeded<D>,
        registrar: Registrar,
        trainer: impl FnOnce(Arc<Life<D>>, usize) -> Addr<Trainer<D>>,
    ) -> Arc<Life<D>> {
        let Seeded { parts, base } = seeded;
        let Parts {
            domain,
            store,
            recipe,
            recipe_text,
            trainers,
            minds,
            meters,
            growths,
            failure,
            open,
        } = parts;
        let life = Arc::new(Life {
            domain,
            store,
            recipe,
            recipe_text,
            base,
            minds,
            meters,
            growths,
            trainer: OnceLock::new(),
            registrar,
            trainings: Mutex::new(Trainings::new(trainers)),
            failure,
            _open: open,
        });
        let address = trainer(life.clone(), trainers.max(1));
        assert!(life.trainer.set(address).is_ok(), "it was just made and is set once");
        life
    }
}

impl<D: Domain> Life<D> {
    pub fn log(&self) -> &dyn EventLog {
        &*self.store.log
    }

    /// Who writes the tenants' own streams.
    pub fn registrar(&self) -> &Registrar {
        &self.registrar
    }

    /// Who is told of what became durable.
    pub fn growths(&self) -> &Growths {
        &self.growths
    }

    /// The recipe that new people start with.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    pub fn failure(&self) -> &Failure {
        &self.failure
    }

    pub fn stream_of(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, KeyError> {
        self.store.keys.stream_id(tenant, user)
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
        let quota = self.meters.quotas(&stream.tenant).trainings_waiting;
        let most = quota.map_or(TRAIN_QUEUE_MAX, |quota| TRAIN_QUEUE_MAX.min(quota as usize));
        let queued = self.trainings().push(&stream, train, most);
        // What it took the place of was asked for by a former actor of the same person, who is
        // gone.
        let taken = queued.is_ok();
        if !taken {
            self.meters.note_training_refused(&stream.tenant);
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
            let seat = Seat { life: self.clone(), stream };
            trainer.do_send(Run { train, seat });
        }
    }

    // Its methods leave it whole whenever they return, and none of them calls back.
    fn trainings(&self) -> MutexGuard<'_, Trainings<Train<D>>> {
        self.trainings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The mind that new people start with.
    pub fn base(&self) -> &Arc<Mind> {
        &self.base
    }

    pub fn mind(&self, tenant: &TenantId, digest: Digest) -> Option<Arc<Mind>> {
        self.minds.get(tenant, digest)
    }

    pub fn remember(&self, tenant: &TenantId, mind: Arc<Mind>) {
        self.minds.put(tenant, mind);
    }

    /// The records `first` to `last` of a stream, for answering a request again.
    ///
    /// - errors: a sentence, when they cannot be read.
    pub fn records(&self, stream: &StreamId, first: Seq, last: Seq) -> Result<Vec<Record>, String> {
        let wanted = (last.get() - first.get() + 1) as usize;
        let records = self.log().read(stream, first).map_err(|error| error.to_string())?;
        let records: Vec<Record> =
            records.take(wanted).collect::<Result<_, _>>().map_err(|error| error.to_string())?;
        match records.len() == wanted {
            true => Ok(records),
            false => Err(format!("records {first} to {last} of {stream} are missing")),
        }
    }
}

/// Rebuilds a session from the log. That of somebody new is not open, and nothing is written for
/// them: only a command does that. Blocks.
///
/// - errors: what to answer to whoever asks for this person.
pub(super) fn wake<D: Domain>(
    life: &Life<D>,
    stream: &StreamId,
) -> Result<Session<D>, Box<Response>> {
    // Never pushed out of the memory of minds for long: everybody begins with it.
    life.remember(&stream.tenant, life.base.clone());
    replay::rebuild(&life.domain, &life.store, stream, &life.minds).map_err(|error| {
        let message = format!("this session cannot be woken: {error}");
        Box::new(Response::error(ErrorCode::Unavailable, message))
    })
}

/// Whether somebody new may be called that. People who were recorded keep the name that they have.
///
/// - errors: what to answer instead.
pub(super) fn check_name(user: &UserId) -> Result<(), Box<Response>> {
    user.check_new().map_err(|error| {
        let message = format!("nobody new can be called that: {error}");
        Box::new(Response::error(ErrorCode::Refused, message))
    })
}

/// The turn that opens the session of somebody new.
///
/// - errors: what to answer instead.
pub(super) fn open<D: Domain>(
    life: &Life<D>,
    session: &Session<D>,
    user: &UserId,
) -> Result<Turn, Box<Response>> {
    let command = Command::Open {
        user: user.clone(),
        recipe_text: life.recipe_text.clone(),
        mind: life.base.digest(),
    };
    let proposed = session.propose(&command, fresh_request(), session.next_at(life.now()));
    let unavailable = |reason: String| Box::new(Response::error(ErrorCode::Unavailable, reason));
    match proposed {
        Ok(Proposed::Turn(turn)) => Ok(turn),
        Ok(Proposed::Repeat { .. }) => unreachable!("a fresh request id was not answered before"),
        Ok(Proposed::Defect(divergence)) => Err(unavailable(divergence.to_string())),
        Err(rejection) => Err(unavailable(rejection.to_string())),
    }
}

/// Trains a mind and keeps its bytes, before any record names them. Runs on a trainer's thread.
///
/// - errors: the reason, in the trainer's words.
pub(super) fn train<D: Domain>(
    life: &Life<D>,
    stream: &StreamId,
    recipe: &Recipe,
    lessons: &[Lesson<D::Scene, D::Task>],
) -> Result<Arc<Mind>, String> {
    sabotage::point("training");
    let mind =
        learning::train(&*life.domain, recipe, lessons).map_err(|error| error.to_string())?;
    if let Err(error) = replay::keep_mind(&life.store, stream, &mind) {
        // The bytes of a mind are a cache: without them the next waking trains again.
        tracing::warn!(%stream, %error, "the mind's bytes were not kept");
    }
    Ok(Arc::new(mind))
}

/// Keeps a snapshot, so that the next waking folds less. A cache: failing costs time only.
pub(super) fn keep_snapshot<D: Domain>(life: &Life<D>, stream: &StreamId, session: &Session<D>) {
    if let Err(reason) = replay::keep_snapshot(&life.store, stream, session) {
        tracing::warn!(%stream, %reason, "no snapshot was kept");
    }
}

/// Forgets the bytes of minds that nobody will ask for again.
pub(super) fn forget_old_minds<D: Domain>(life: &Life<D>, stream: &StreamId, session: &Session<D>) {
    let current: Vec<Digest> = session.mind().iter().map(|mind| mind.digest()).collect();
    if let Err(reason) = life.store.models.keep_only(stream, &current) {
        tracing::warn!(%stream, %reason, "old minds were not dropped");
    }
}

/// A request id for what the service itself asks for.
pub(super) fn fresh_request() -> RequestId {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).expect("the operating system gives random bytes");
    RequestId(bytes)
}

/// What a panic said.
pub(super) fn panic_words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without words".to_owned())
}
