use std::sync::{Arc, Mutex, PoisonError};

use actix::{Actor, Addr, Handler, Message, SyncArbiter, SyncContext};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::awake::Awake;
use super::{Book, Failure, OrderError};
use crate::events::Event;
use crate::ids::TenantId;
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
    answer: Box<dyn FnOnce(Obeyed) + Send>,
    /// The queue of a `SyncArbiter` is not bounded by itself.
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
        let Ok(place) = self.places.clone().try_acquire_owned() else {
            return answer(Err(OrderError::Busy));
        };
        let answer = Answer(Some(Box::new(answer)));
        let answer = Box::new(move |obeyed| answer.send(obeyed));
        // A queue that is closed drops the order, and a dropped answer says so.
        self.address.do_send(Obey { tenant, order, answer, _place: place });
    }

    pub fn admissions(&self) -> &Admissions {
        &self.admissions
    }
}

/// An answer that is never forgotten: dropped unused, it says that nobody carries orders out.
struct Answer(Option<Box<dyn FnOnce(Obeyed) + Send>>);

impl Answer {
    fn send(mut self, obeyed: Obeyed) {
        if let Some(answer) = self.0.take() {
            answer(obeyed);
        }
    }
}

impl Drop for Answer {
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
        if let Err(OrderError::Append { error, .. }) = &obeyed
            && matches!(error, AppendError::Poisoned { .. } | AppendError::Gone)
        {
            self.failure.report(error.to_string());
        }
        answer(obeyed);
    }
}
