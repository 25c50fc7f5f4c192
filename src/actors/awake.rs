use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Counts what is in use: the actors of people, also those that are going to sleep; or the parts of
/// the service that use the store.
#[derive(Debug, Default)]
pub(super) struct AwakeCount {
    count: Mutex<usize>,
    fewer: Condvar,
}

/// One that is counted, until it is dropped.
#[derive(Debug)]
pub(super) struct Awake(Arc<AwakeCount>);

impl AwakeCount {
    /// Counts one more.
    pub fn enter(self: &Arc<Self>) -> Awake {
        *self.count.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        Awake(self.clone())
    }

    /// The count at this moment.
    pub fn now(&self) -> usize {
        *self.count.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Blocks until the count is 0, or `limit` has passed.
    ///
    /// - returns: true if the count is 0.
    pub fn wait_for_none(&self, limit: Duration) -> bool {
        let count = self.count.lock().unwrap_or_else(PoisonError::into_inner);
        let result = self.fewer.wait_timeout_while(count, limit, |count| *count > 0);
        *result.unwrap_or_else(PoisonError::into_inner).0 == 0
    }
}

impl Drop for Awake {
    fn drop(&mut self) {
        let mut count = self.0.count.lock().unwrap_or_else(PoisonError::into_inner);
        *count = count.saturating_sub(1);
        self.0.fewer.notify_all();
    }
}
