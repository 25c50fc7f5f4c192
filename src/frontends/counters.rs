use std::sync::atomic::{AtomicU64, Ordering};

/// What came through the doors since they were opened.
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

/// [`Counters`] at one moment, in messages; those of handshakes in handshakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub received: u64,
    pub answered: u64,
    /// Malformed beyond an answer: not one frame, or no request id.
    pub dropped: u64,
    /// Dropped at the door with keys, because nobody vouched for their connection.
    pub unvouched: u64,
    /// Answered with an error, because they were no request.
    pub refused: u64,
    /// Answered with an error, because whoever sent them may not ask that, or nothing any more.
    pub denied: u64,
    /// Turned away by the gateway itself because of too much work.
    pub busy: u64,
    /// Turned away by the gateway because their tenant takes more than it may.
    pub over_quota: u64,
    /// Answers whose peer was gone, or has a thousand messages to read.
    pub undelivered: u64,
    /// Connections let in by their key.
    pub handshakes: u64,
    /// Connections whose key was not let in.
    pub handshakes_denied: u64,
    /// Answers that were dropped, because too many bytes waited for their connection or its tenant.
    pub unread: u64,
    /// Messages of the feed that were left out, because too many bytes of their tenant's waited.
    pub feed_unread: u64,
    /// Connections that were not let in because there were too many.
    pub handshakes_crowded: u64,
}

impl Counters {
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
