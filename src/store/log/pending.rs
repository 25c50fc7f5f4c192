use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::sync::oneshot;

use super::error::AppendError;
use super::receipt::Durable;

/// The end of a promise that keeps it.
pub(in crate::store) type Promise = oneshot::Sender<Result<Durable, AppendError>>;

/// The promise of an append: a future of [`Durable`] or [`AppendError`].
#[derive(Debug)]
pub struct Pending(oneshot::Receiver<Result<Durable, AppendError>>);

impl Pending {
    /// For backends of this room only: the promise and the end that keeps it.
    pub(in crate::store) fn promise() -> (Promise, Pending) {
        let (sender, receiver) = oneshot::channel();
        (sender, Pending(receiver))
    }

    /// A promise that is kept already.
    pub(in crate::store) fn kept(result: Result<Durable, AppendError>) -> Pending {
        let (sender, pending) = Pending::promise();
        sender.send(result).expect("the other end is held right here");
        pending
    }

    /// Blocks until the promise is kept; for tools and tests, never inside an actor.
    pub fn wait(self) -> Result<Durable, AppendError> {
        self.0.blocking_recv().unwrap_or(Err(AppendError::Gone))
    }
}

impl Future for Pending {
    type Output = Result<Durable, AppendError>;
    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let received = Pin::new(&mut self.0).poll(context);
        received.map(|result| result.unwrap_or(Err(AppendError::Gone)))
    }
}
