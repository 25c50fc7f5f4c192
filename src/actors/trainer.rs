use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use actix::{Actor, Handler, Message, Recipient, SyncContext};

use super::defect::panic_words;
use super::presence::Attention;
use super::shared::{self, Shared};
use crate::ids::{Digest, StreamId};
use crate::learning::{Lesson, Mind, Recipe};
use crate::world::Domain;

/// Trains minds, several at the same time, on its own threads (`SyncArbiter`).
pub(super) struct Trainer<D: Domain> {
    pub shared: Arc<Shared<D>>,
}

/// A training that is due.
pub(super) struct Train<D: Domain> {
    pub stream: StreamId,
    pub recipe: Arc<Recipe>,
    pub lessons: Vec<Lesson<D::Scene, D::Task>>,
    /// Gets the result.
    pub tell: Recipient<Trained>,
    /// Keeps the person awake until the training is over.
    pub attention: Attention,
}

/// A training that a trainer begins now.
#[derive(Message)]
#[rtype(result = "()")]
pub(super) struct Run<D: Domain> {
    pub train: Train<D>,
    pub slot: Slot<D>,
}

/// A trainer in use. When this is dropped, also after a panic, the next training gets the trainer.
pub(super) struct Slot<D: Domain> {
    pub shared: Arc<Shared<D>>,
    pub stream: StreamId,
}

impl<D: Domain> Drop for Slot<D> {
    fn drop(&mut self) {
        self.shared.trained(&self.stream);
    }
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

impl<D: Domain> Handler<Run<D>> for Trainer<D> {
    type Result = ();

    fn handle(&mut self, run: Run<D>, _: &mut SyncContext<Self>) {
        let Run { train: Train { stream, recipe, lessons, tell, attention }, slot } = run;
        let start = Instant::now();
        // A panic that left this handler would end this thread of the trainers. After some panics
        // there would be no trainer left.
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            shared::train(&self.shared, &stream, &recipe, &lessons)
        }))
        .unwrap_or_else(|panic| Err(format!("training panicked: {}", panic_words(&*panic))));
        tracing::info!(
            %stream,
            lessons = lessons.len(),
            ms = start.elapsed().as_millis() as u64,
            failed = outcome.is_err(),
            "trained"
        );
        drop(slot);
        // It ignores the limit of the mailbox on purpose: this message must not be lost, and there
        // is at most one for each person.
        tell.do_send(Trained { recipe: recipe.digest(), outcome, attention });
    }
}
