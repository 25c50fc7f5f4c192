//! Notices a commit that does not come to its end.
//!
//! When a write of `sled` 0.34.7 fails that it had left to one of its own threads (a full buffer that
//! still had writers), that thread sets an error and wakes nobody. A flush that waits for the write
//! then never returns. Nothing else may wait for it.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Shared;
use crate::store::log::{AppendError, Promise};

/// The promises of the group that is being made durable. The one that takes them out answers them.
#[derive(Default)]
pub(super) struct InHand(Mutex<Option<Group>>);

struct Group {
    since: Instant,
    promises: Vec<Promise>,
}

/// Takes promises out when it is dropped: after a panic everybody hears
/// [`AppendError::Gone`].
pub(super) struct Hold<'a>(&'a InHand);

impl InHand {
    pub fn hold(&self, promises: Vec<Promise>) -> Hold<'_> {
        *self.lock() = Some(Group { since: Instant::now(), promises });
        Hold(self)
    }

    /// The promises, if they have been held for longer than `patience`.
    fn overdue(&self, patience: Duration) -> Option<Vec<Promise>> {
        let mut group = self.lock();
        let overdue = group.as_ref().is_some_and(|group| group.since.elapsed() > patience);
        overdue.then(|| group.take()).flatten().map(|group| group.promises)
    }

    // One field, taken or put: a panic while it was locked left nothing half done.
    fn lock(&self) -> MutexGuard<'_, Option<Group>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Hold<'_> {
    /// The promises, unless the watch lost patience and has answered them.
    pub fn release(self) -> Option<Vec<Promise>> {
        self.0.lock().take().map(|group| group.promises)
    }
}

impl Drop for Hold<'_> {
    fn drop(&mut self) {
        drop(self.0.lock().take());
    }
}

/// The thread that looks at the clock. Ends when dropped.
pub(super) struct Watch {
    stop: Option<SyncSender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Poisons the log when a group has not become durable within `patience`.
    pub fn start(shared: Arc<Shared>, patience: Duration) -> std::io::Result<Watch> {
        let (stop, stopped) = sync_channel(0);
        let watch = move || {
            while stopped.recv_timeout(patience / 4) == Err(RecvTimeoutError::Timeout) {
                let Some(promises) = shared.in_hand.overdue(patience) else { continue };
                let reason = format!("the disk did not store a record within {patience:?}");
                shared.hangs.store(true, Ordering::SeqCst);
                shared.poison(reason.clone());
                for promise in promises {
                    let _ = promise.send(Err(AppendError::Poisoned { reason: reason.clone() }));
                }
            }
        };
        let thread = std::thread::Builder::new().name("commit watch".to_owned()).spawn(watch)?;
        Ok(Watch { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // It only reads the clock.
            let _ = thread.join();
        }
    }
}
