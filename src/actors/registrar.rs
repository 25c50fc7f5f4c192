use std::sync::{Arc, Mutex, PoisonError};

use actix::{Actor, Addr, Handler, Message, SyncArbiter, SyncContext};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::awake::Awake;
use super::{Book, Failure, OrderError};
use crate::events::{Event, PersonErased};
use crate::ids::{StreamId, TenantId};
use crate::limits::REGISTRAR_QUEUE_MAX;
use crate::store::AppendError;
use crate::tenancy::{Admissions, Order};

/// Where orders about tenants are handed in while a service runs. One thread carries them out, one
/// after the other: it alone writes the tenants' own streams.
#[derive(Clone)]
pub struct Registrar {
    address: Addr<Clerk>,
    places: Arc<Semaphore>,
    admissions: Admissions,
}

/// What came of an order.
pub type Obeyed = Result<Vec<Event>, OrderError>;

struct Clerk {
    desk: Arc<Mutex<Desk>>,
    failure: Failure,
}

struct Desk {
    book: Book,
    // Last, so that it ends after the store was closed: fields are dropped in this order.
    _open: Awake,
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
    pub(super) fn start(book: Book, open: Awake, failure: Failure) -> Registrar {
        let admissions = book.admissions().clone();
        let desk = Arc::new(Mutex::new(Desk { book, _open: open }));
        let address =
            SyncArbiter::start(1, move || Clerk { desk: desk.clone(), failure: failure.clone() });
        Registrar { address, places: Arc::new(Semaphore::new(REGISTRAR_QUEUE_MAX)), admissions }
    }

    /// Hands in an order; `answer` is called once, from another thread, when it is durable.
    pub fn order(
        &self,
        tenant: TenantId,
        order: Order,
        answer: impl FnOnce(Obeyed) + Send + 'static,
    ) {
        let answer = Answer(Some(Box::new(answer)));
        let Ok(place) = self.places.clone().try_acquire_owned() else {
            return answer.send(Err(OrderError::Busy));
        };
        let answer = Box::new(move |obeyed| answer.send(obeyed));
        // A queue that is closed drops the order, and a dropped answer says so.
        self.address.do_send(Obey { tenant, order, answer, _place: place });
    }

    /// Erases a person for whom nobody speaks any more; `answer` as in [`Registrar::order`].
    pub(super) fn erase(&self, stream: StreamId, answer: impl FnOnce(Erased) + Send + 'static) {
        let answer = Answer(Some(Box::new(answer)));
        let Ok(place) = self.places.clone().try_acquire_owned() else {
            return answer.send(Err(OrderError::Busy));
        };
        let answer = Box::new(move |erased| answer.send(erased));
        self.address.do_send(Erase { stream, answer, _place: place });
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

impl Actor for Clerk {
    type Context = SyncContext<Self>;
}

impl Handler<Obey> for Clerk {
    type Result = ();

    fn handle(&mut self, obey: Obey, _: &mut SyncContext<Self>) {
        let Obey { tenant, order, answer, _place } = obey;
        let mut desk = self.desk.lock().unwrap_or_else(PoisonError::into_inner);
        let obeyed = desk.book.obey(&tenant, &order);
        drop(desk);
        self.look_at(obeyed.as_ref().err());
        answer(obeyed);
    }
}

impl Handler<Erase> for Clerk {
    type Result = ();

    fn handle(&mut self, erase: Erase, _: &mut SyncContext<Self>) {
        let Erase { stream, answer, _place } = erase;
        let mut desk = self.desk.lock().unwrap_or_else(PoisonError::into_inner);
        let erased = desk.book.erase(&stream);
        drop(desk);
        self.look_at(erased.as_ref().err());
        answer(erased);
    }
}

impl Clerk {
    /// A log that is poisoned ends the service.
    fn look_at(&self, error: Option<&OrderError>) {
        if let Some(OrderError::Append { error, .. }) = error
            && matches!(error, AppendError::Poisoned { .. } | AppendError::Gone)
        {
            self.failure.report(error.to_string());
        }
    }
}
