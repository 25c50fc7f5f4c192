use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Where the parts of the service report that it must stop: the log is poisoned, or a thread that
/// all depend on has ended. Only the first reason is kept.
#[derive(Debug, Clone, Default)]
pub struct Failure(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    reason: Option<String>,
    stopped: bool,
}

impl Failure {
    /// Reports that the service must stop, and why. Nothing after [`Failure::stop_expected`].
    pub fn report(&self, reason: impl Into<String>) {
        let mut state = self.lock();
        if state.reason.is_none() && !state.stopped {
            let reason = reason.into();
            tracing::error!(%reason, "the service cannot go on");
            state.reason = Some(reason);
            self.0.changed.notify_all();
        }
    }

    /// Why the service must stop; none if it need not.
    pub fn reason(&self) -> Option<String> {
        self.lock().reason.clone()
    }

    /// Notes that a stop was requested. Threads that end from now on are no failure.
    pub fn stop_expected(&self) {
        self.lock().stopped = true;
        self.0.changed.notify_all();
    }

    /// True if a stop was requested.
    pub fn is_stop_expected(&self) -> bool {
        self.lock().stopped
    }

    /// Blocks until the service has failed, a stop was requested, or `limit` has passed.
    ///
    /// - returns: true for a failure or a stop.
    pub fn wait(&self, limit: Duration) -> bool {
        let over = |state: &mut State| state.reason.is_none() && !state.stopped;
        let (state, _) = self
            .0
            .changed
            .wait_timeout_while(self.lock(), limit, over)
            .unwrap_or_else(PoisonError::into_inner);
        state.reason.is_some() || state.stopped
    }

    // A panic while the lock is held leaves nothing half changed: the state is two plain fields.
    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Reports a failure when it is dropped, unless a stop was requested. A thread that all depend on
/// owns one, so that its end is noticed, also after a panic.
#[derive(Debug)]
pub struct Alarm {
    failure: Failure,
    reason: &'static str,
}

impl Failure {
    /// An alarm with this reason.
    pub fn alarm(&self, reason: &'static str) -> Alarm {
        Alarm { failure: self.clone(), reason }
    }
}

impl Drop for Alarm {
    fn drop(&mut self) {
        self.failure.report(self.reason);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_reason_stays() {
        let failure = Failure::default();
        assert_eq!(failure.reason(), None);
        drop(failure.alarm("the gateway's thread ended"));
        failure.report("and then something else");
        assert_eq!(failure.reason().as_deref(), Some("the gateway's thread ended"));
        assert!(failure.wait(Duration::from_secs(60)));
    }

    #[test]
    fn a_stop_that_was_requested_is_no_failure() {
        let failure = Failure::default();
        assert!(!failure.wait(Duration::ZERO));
        failure.stop_expected();
        drop(failure.alarm("the gateway's thread ended"));
        assert_eq!(failure.reason(), None);
    }
}
