use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use actix::{Actor, Addr, Handler, Message, SyncArbiter, SyncContext};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::{OrderError, TenantRegistry};
use crate::actors::Failure;
use crate::actors::awake::Awake;
use crate::events::{Event, PersonErased};
use crate::ids::{StreamId, TenantId};
use crate::limits::REGISTRAR_QUEUE_MAX;
use crate::replay::Through;
use crate::tenancy::{Admissions, Order};

/// Where orders about tenants are handed in while a service runs. One thread carries them out, one
/// after the other: it alone writes the tenants' own streams.
#[derive(Clone)]
pub struct Registrar {
    address: Addr<RegistrarWorker>,
    places: Arc<Semaphore>,
    admissions: Admissions,
}

/// What came of an order.
pub type Obeyed = Result<Vec<Event>, OrderError>;

/// A signed checkpoint.
pub type Signed = Result<String, OrderError>;

/// Seconds between two checkpoints of one tenant that nobody asked for.
const CHECKPOINT_EVERY_S: u64 = 60;

struct RegistrarWorker(Arc<Mutex<Registrations>>);

struct Registrations {
    tenant_registry: TenantRegistry,
    /// When each tenant's tree was signed last, and whether it has grown since.
    signed: BTreeMap<TenantId, (Instant, bool)>,
    // Last, so that it ends after the store was closed: fields are dropped in this order.
    _open: Awake,
}

/// A person's episode ended, or they woke: segments may be due.
#[derive(Message)]
#[rtype(result = "()")]
struct Close {
    stream: StreamId,
    _place: OwnedSemaphorePermit,
}

#[derive(Message)]
#[rtype(result = "()")]
struct SignTree {
    tenant: TenantId,
    through: Through,
    answer: Way<String>,
    _place: OwnedSemaphorePermit,
}

#[derive(Message)]
#[rtype(result = "()")]
struct Obey {
    tenant: TenantId,
    order: Order,
    answer: Way<Vec<Event>>,
    /// The queue of a `SyncArbiter` is not bounded by itself.
    _place: OwnedSemaphorePermit,
}

/// What came of an erasure.
pub type Erased = Result<PersonErased, OrderError>;

#[derive(Message)]
#[rtype(result = "()")]
struct Erase {
    stream: StreamId,
    answer: Way<PersonErased>,
    _place: OwnedSemaphorePermit,
}

impl Registrar {
    /// Must run on the actix system's thread.
    pub(in crate::actors) fn start(
        mut tenant_registry: TenantRegistry,
        open: Awake,
        failure: Failure,
    ) -> Registrar {
        tenant_registry.report_to(failure);
        let admissions = tenant_registry.admissions().clone();
        let registrations = Arc::new(Mutex::new(Registrations {
            tenant_registry,
            signed: BTreeMap::new(),
            _open: open,
        }));
        let address = SyncArbiter::start(1, move || RegistrarWorker(registrations.clone()));
        Registrar { address, places: Arc::new(Semaphore::new(REGISTRAR_QUEUE_MAX)), admissions }
    }

    /// Hands in an order; `answer` is called once, from another thread, when it is durable.
    pub fn order(
        &self,
        tenant: TenantId,
        order: Order,
        answer: impl FnOnce(Obeyed) + Send + 'static,
    ) {
        self.hand_in(answer, |answer, _place| Obey { tenant, order, answer, _place });
    }

    /// Closes what is due of a person's stream, some time soon. What is forgotten, because the queue
    /// is full or the service ends, is closed when they wake again.
    pub fn close(&self, stream: &StreamId) {
        if let Ok(place) = self.places.clone().try_acquire_owned() {
            self.address.do_send(Close { stream: stream.clone(), _place: place });
        }
    }

    /// Signs a tenant's tree, after closing what is due of each of its people's streams; `answer` as
    /// in [`Registrar::order`], when the checkpoint is kept.
    pub fn checkpoint(
        &self,
        tenant: TenantId,
        through: Through,
        answer: impl FnOnce(Signed) + Send + 'static,
    ) {
        self.hand_in(answer, |answer, _place| SignTree { tenant, through, answer, _place });
    }

    /// Erases a person for whom nobody speaks any more; `answer` as in [`Registrar::order`].
    pub(in crate::actors) fn erase(
        &self,
        stream: StreamId,
        answer: impl FnOnce(Erased) + Send + 'static,
    ) {
        self.hand_in(answer, |answer, _place| Erase { stream, answer, _place });
    }

    /// Queues work while there is room for it.
    ///
    /// - `work`: the message, from the way back and its place in the queue.
    fn hand_in<T: 'static, M>(
        &self,
        answer: impl FnOnce(Result<T, OrderError>) + Send + 'static,
        work: impl FnOnce(Way<T>, OwnedSemaphorePermit) -> M,
    ) where
        M: Message<Result = ()> + Send + 'static,
        RegistrarWorker: Handler<M>,
    {
        let answer = Answer(Some(Box::new(answer)));
        match self.places.clone().try_acquire_owned() {
            // A queue that is closed drops the work, and a dropped answer says so.
            Ok(place) => {
                self.address.do_send(work(Box::new(move |outcome| answer.send(outcome)), place));
            }
            Err(_) => answer.send(Err(OrderError::Busy)),
        }
    }

    pub fn admissions(&self) -> &Admissions {
        &self.admissions
    }
}

/// An answer that is never forgotten: dropped unused, it says that nobody carries orders out.
struct Answer<T>(Option<Way<T>>);

type Way<T> = Box<dyn FnOnce(Result<T, OrderError>) + Send>;

impl<T> Answer<T> {
    fn send(mut self, outcome: Result<T, OrderError>) {
        if let Some(answer) = self.0.take() {
            answer(outcome);
        }
    }
}

impl<T> Drop for Answer<T> {
    fn drop(&mut self) {
        if let Some(answer) = self.0.take() {
            answer(Err(OrderError::Gone));
        }
    }
}

impl Actor for RegistrarWorker {
    type Context = SyncContext<Self>;
}

impl Registrations {
    /// Closes, and signs now and then, so that a feed of checkpoints goes on by itself.
    fn close(&mut self, stream: &StreamId) -> Result<(), OrderError> {
        if self.tenant_registry.close(stream, Through::Episodes)? == 0 {
            return Ok(());
        }
        let tenant = &stream.tenant;
        let last = self.signed.get(tenant).map(|(at, _)| *at);
        if last.is_none_or(|at| at.elapsed().as_secs() >= CHECKPOINT_EVERY_S) {
            self.tenant_registry.checkpoint(tenant)?;
            self.signed.insert(tenant.clone(), (Instant::now(), false));
        } else if let Some((_, grown)) = self.signed.get_mut(tenant) {
            *grown = true;
        }
        Ok(())
    }
}

impl Drop for Registrations {
    /// The last checkpoint of a service covers all that it closed.
    fn drop(&mut self) {
        for (tenant, _) in self.signed.iter().filter(|(_, (_, grown))| *grown) {
            if let Err(error) = self.tenant_registry.checkpoint(tenant) {
                tracing::warn!(%tenant, %error, "no checkpoint was signed at the end");
            }
        }
    }
}

impl RegistrarWorker {
    fn registrations(&self) -> MutexGuard<'_, Registrations> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Handler<Close> for RegistrarWorker {
    type Result = ();

    fn handle(&mut self, close: Close, _: &mut SyncContext<Self>) {
        let closed = self.registrations().close(&close.stream);
        if let Err(error) = closed {
            tracing::warn!(stream = %close.stream, %error, "segments are left to be closed later");
        }
    }
}

impl Handler<SignTree> for RegistrarWorker {
    type Result = ();

    fn handle(&mut self, sign: SignTree, _: &mut SyncContext<Self>) {
        let SignTree { tenant, through, answer, _place } = sign;
        let mut registrations = self.registrations();
        let signed = registrations.tenant_registry.sign(&tenant, through);
        if signed.is_ok() {
            registrations.signed.insert(tenant, (Instant::now(), false));
        }
        drop(registrations);
        answer(signed);
    }
}

impl Handler<Obey> for RegistrarWorker {
    type Result = ();

    fn handle(&mut self, obey: Obey, _: &mut SyncContext<Self>) {
        let Obey { tenant, order, answer, _place } = obey;
        let obeyed = self.registrations().tenant_registry.obey(&tenant, &order);
        answer(obeyed);
    }
}

impl Handler<Erase> for RegistrarWorker {
    type Result = ();

    fn handle(&mut self, erase: Erase, _: &mut SyncContext<Self>) {
        let Erase { stream, answer, _place } = erase;
        let erased = self.registrations().tenant_registry.erase(&stream);
        answer(erased);
    }
}
