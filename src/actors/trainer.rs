use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use actix::{Actor, Handler, Message, Recipient, SyncContext};
use tokio::sync::OwnedSemaphorePermit;

use super::life::{self, Life};
use super::submit::Attention;
use crate::ids::{Digest, StreamId};
use crate::learning::{Lesson, Mind, Recipe};
use crate::world::Domain;

/// Trains minds, several at once, on threads of its own beside the actors (`SyncArbiter`).
pub(super) struct Trainer<D: Domain> {
    pub life: Arc<Life<D>>,
}

/// A training that is due.
#[derive(Message)]
#[rtype(result = "()")]
pub(super) struct Train<D: Domain> {
    pub stream: StreamId,
    pub recipe: Arc<Recipe>,
    pub lessons: Vec<Lesson<D::Scene, D::Task>>,
    /// Whom to tell.
    pub tell: Recipient<Trained>,
    /// A place in the queue, bounded by `limits::TRAIN_QUEUE_MAX`: the queue of a `SyncArbiter` is
    /// not bounded by itself.
    pub place: OwnedSemaphorePermit,
    /// Nobody whose training runs is put to sleep.
    pub attention: Attention,
}

/// How a training ended.
#[derive(Message)]
#[rtype(result = "()")]
pub(super) struct Trained {
    pub recipe: Digest,
    pub outcome: Result<Arc<Mind>, String>,
    pub attention: Attention,
}

impl<D: Domain> Actor for Trainer<D> {
    type Context = SyncContext<Self>;
}

impl<D: Domain> Handler<Train<D>> for Trainer<D> {
    type Result = ();

    fn handle(&mut self, train: Train<D>, _: &mut SyncContext<Self>) {
        let Train { stream, recipe, lessons, tell, place, attention } = train;
        let start = Instant::now();
        // A panic that left this handler would end the worker for good, and with it, one by one,
        // every training of everybody.
        let outcome =
            catch_unwind(AssertUnwindSafe(|| life::train(&self.life, &stream, &recipe, &lessons)))
                .unwrap_or_else(|panic| {
                    Err(format!("training panicked: {}", life::panic_words(&*panic)))
                });
        tracing::info!(
            %stream,
            lessons = lessons.len(),
            ms = start.elapsed().as_millis() as u64,
            failed = outcome.is_err(),
            "trained"
        );
        drop(place);
        // Past the mailbox bound on purpose: this message must not be lost, and there is at most
        // one for each person.
        tell.do_send(Trained { recipe: recipe.digest(), outcome, attention });
    }
}
