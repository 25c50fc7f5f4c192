use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use crate::fairness::{FairQueue, Room};
use crate::ids::{Seq, StreamId, TenantId};
use crate::limits::NOTIFICATIONS_WAITING_MAX;
use crate::store::Durable;

/// A bounded queue of commit notifications (stream and sequence, no content) for the feed. A writer
/// takes a lock and does no I/O. If the queue is full, the notification is dropped and counted, and
/// the writer does not wait.
#[derive(Clone, Default)]
pub struct CommitNotifications(Arc<Inner>);

#[derive(Default)]
struct Inner {
    waiting: Mutex<NotificationQueue>,
    /// Wakes the listener. Notifications are dropped until this is set.
    wake: OnceLock<Box<dyn Fn() + Send + Sync>>,
}

/// What waits for the listener.
struct NotificationQueue {
    queue: FairQueue<CommitNotification>,
    room: Room,
    /// Records noted for each tenant, also those whose notification was dropped.
    numbers: BTreeMap<TenantId, u64>,
    left_out: u64,
}

/// The records `first` to `last` of a stream are durable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommitNotification {
    /// The stream.
    pub stream: StreamId,
    /// The first of the records.
    pub first: Seq,
    /// The last of the records.
    pub last: Seq,
    /// The number of `first` among all records that were noted for this tenant, from 1. A missing
    /// number means missed records.
    pub number: u64,
}

impl Default for NotificationQueue {
    fn default() -> NotificationQueue {
        let room = Room::new(NOTIFICATIONS_WAITING_MAX);
        NotificationQueue {
            queue: FairQueue::default(),
            room,
            numbers: BTreeMap::new(),
            left_out: 0,
        }
    }
}

impl CommitNotifications {
    /// Keeps notifications from now on, and calls `wake` for each. Only the first call counts.
    pub fn listen(&self, wake: impl Fn() + Send + Sync + 'static) {
        let _ = self.0.wake.set(Box::new(wake));
    }

    /// Notes new records. Call it after they are durable, in the order of the stream.
    pub(super) fn note(&self, stream: &StreamId, durable: &Durable) {
        let Some(wake) = self.0.wake.get() else { return };
        let records = durable.records();
        let (Some(first), Some(last)) = (records.first(), records.last()) else { return };
        let notification = |number| CommitNotification {
            stream: stream.clone(),
            first: first.seq,
            last: last.seq,
            number,
        };
        {
            let waiting = &mut *self.waiting();
            let number = waiting.numbers.entry(stream.tenant.clone()).or_default();
            let notification = notification(*number + 1);
            *number += records.len() as u64;
            if waiting.room.take(&stream.tenant, 1) {
                waiting.queue.push(&stream.tenant, notification);
            } else {
                waiting.left_out += records.len() as u64;
            }
        }
        wake();
    }

    /// The next notification; none if the queue is empty. Tenants take turns.
    pub fn next(&self) -> Option<CommitNotification> {
        let mut waiting = self.waiting();
        let notification = waiting.queue.pop()?;
        waiting.room.give_back(&notification.stream.tenant, 1);
        Some(notification)
    }

    /// How many records were noted for each tenant; none while the queue is not empty.
    pub fn all_taken(&self) -> Option<BTreeMap<TenantId, u64>> {
        let waiting = self.waiting();
        waiting.queue.is_empty().then(|| waiting.numbers.clone())
    }

    /// Records whose notification was dropped, because the queue was full.
    pub fn left_out(&self) -> u64 {
        self.waiting().left_out
    }

    fn waiting(&self) -> MutexGuard<'_, NotificationQueue> {
        self.0.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for CommitNotifications {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("CommitNotifications(..)")
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::events::{Batch, Event, Head, TenantEvent, TenantOpened};
    use crate::ids::{RequestId, Timestamp};
    use crate::store::{self, EventLog};

    fn durable(log: &dyn EventLog, stream: &StreamId, after: Head) -> Durable {
        let events = vec![Event::Tenant(TenantEvent::Opened(TenantOpened {}))];
        let batch = Batch { request: RequestId([1; 16]), at: Timestamp(1), events };
        log.append(stream, after, batch).wait().unwrap()
    }

    #[test]
    fn one_labs_flood_leaves_another_its_place_and_shows_as_missing_numbers() {
        let store = store::open_memory();
        let [a, b] = ["a", "b"].map(|name| TenantId::new(name).unwrap());
        for tenant in [&a, &b] {
            store.keys.make_tenant(tenant).unwrap();
        }
        let notifications = CommitNotifications::default();
        let [a, b] = [&a, &b].map(StreamId::of_tenant);
        let once = durable(&*store.log, &a, Head::EMPTY);
        notifications.note(&a, &once);
        assert_eq!(notifications.next(), None, "nobody listens");
        let woken = Arc::new(AtomicUsize::new(0));
        let counter = woken.clone();
        notifications.listen(move || {
            counter.fetch_add(1, Ordering::SeqCst);
        });
        let flood = 3 * NOTIFICATIONS_WAITING_MAX;
        (0..flood).for_each(|_| notifications.note(&a, &once));
        notifications.note(&b, &durable(&*store.log, &b, Head::EMPTY));
        assert_eq!(woken.load(Ordering::SeqCst), flood + 1);
        assert!(notifications.left_out() > 0 && notifications.all_taken().is_none());
        assert_eq!(notifications.next().map(|it| (it.stream, it.number)), Some((a.clone(), 1)));
        assert_eq!(notifications.next().map(|it| (it.stream, it.number)), Some((b.clone(), 1)));
        while notifications.next().is_some() {}
        notifications.note(&a, &once);
        let last = notifications.next().unwrap();
        assert_eq!(last.number, flood as u64 + 1, "what was left out has its numbers");
        assert_eq!(notifications.all_taken().unwrap()[&a.tenant], flood as u64 + 1);
    }
}
