use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// How many actors of people there are, the ones just falling asleep included.
#[derive(Debug, Default)]
pub(super) struct AwakeCount {
    count: Mutex<usize>,
    fewer: Condvar,
}

/// One actor. Ends when dropped.
#[derive(Debug)]
pub(super) struct Awake(Arc<AwakeCount>);

impl AwakeCount {
    pub fn enter(self: &Arc<Self>) -> Awake {
        *self.count.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        Awake(self.clone())
    }

    pub fn now(&self) -> usize {
        *self.count.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Blocks until nobody is awake, or `limit` has passed.
    ///
    /// - returns: whether everybody sleeps.
    pub fn wait_for_silence(&self, limit: Duration) -> bool {
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
