use std::sync::atomic::{AtomicU64, Ordering};

/// Counts what came through the endpoints since the start.
#[derive(Debug, Default)]
pub struct Counters {
    pub(super) received: AtomicU64,
    pub(super) answered: AtomicU64,
    pub(super) dropped: AtomicU64,
    pub(super) unvouched: AtomicU64,
    pub(super) refused: AtomicU64,
    pub(super) denied: AtomicU64,
    pub(super) busy: AtomicU64,
    pub(super) over_quota: AtomicU64,
    pub(super) undelivered: AtomicU64,
    pub(super) handshakes: AtomicU64,
    pub(super) handshakes_denied: AtomicU64,
    pub(super) unread: AtomicU64,
    pub(super) feed_unread: AtomicU64,
    pub(super) handshakes_crowded: AtomicU64,
}

/// [`Counters`] at one moment, in messages or in handshakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Messages received.
    pub received: u64,
    /// Answers sent.
    pub answered: u64,
    /// Messages that cannot be answered: not one frame, or no request id.
    pub dropped: u64,
    /// Messages dropped at an endpoint with keys, because the authenticator did not answer the
    /// handshake of their connection.
    pub unvouched: u64,
    /// Messages answered with an error, because they were not a request.
    pub refused: u64,
    /// Messages answered with an error, because their sender may not ask this, or is not admitted.
    pub denied: u64,
    /// Requests refused by the gateway because it had too much work.
    pub busy: u64,
    /// Requests refused by the gateway because their tenant is over a quota.
    pub over_quota: u64,
    /// Answers whose client was gone, or had too many messages to read.
    pub undelivered: u64,
    /// Connections whose key was accepted.
    pub handshakes: u64,
    /// Connections whose key was not accepted.
    pub handshakes_denied: u64,
    /// Answers dropped because too many bytes waited for their connection or their tenant.
    pub unread: u64,
    /// Messages of the feed dropped because too many bytes of their tenant waited.
    pub feed_unread: u64,
    /// Connections refused because there were too many.
    pub handshakes_crowded: u64,
}

impl Counters {
    /// The counts at this moment.
    pub fn now(&self) -> Counts {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Counts {
            received: read(&self.received),
            answered: read(&self.answered),
            dropped: read(&self.dropped),
            unvouched: read(&self.unvouched),
            refused: read(&self.refused),
            denied: read(&self.denied),
            busy: read(&self.busy),
            over_quota: read(&self.over_quota),
            undelivered: read(&self.undelivered),
            handshakes: read(&self.handshakes),
            handshakes_denied: read(&self.handshakes_denied),
            unread: read(&self.unread),
            feed_unread: read(&self.feed_unread),
            handshakes_crowded: read(&self.handshakes_crowded),
        }
    }
}

pub(super) fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}
