//! Faults on purpose, for a lab that wants to see its own deployment under trouble.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use super::faulty::{FaultPlan, FaultyLog};
use crate::events::{Batch, Head, Record};
use crate::ids::{Seq, StreamId, TenantId};
use crate::store::directory::store::Store;
use crate::store::log::{EventLog, Pending, ReadError, SealedRecords};

impl FaultPlan {
    /// Reads a plan (TOML), as `deploy/drills/` has them.
    ///
    /// - errors: a sentence that names the file and what is wrong in it.
    pub fn read(path: &Path) -> Result<FaultPlan, String> {
        let fail = |reason: String| format!("the fault plan {}: {reason}", path.display());
        let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
        let plan: FaultPlan = toml::from_str(&text).map_err(|error| fail(error.to_string()))?;
        match plan.shares() {
            shares if shares > 1_000 => {
                Err(fail(format!("its shares add up to {shares}, more than 1,000 of 1,000")))
            }
            _ if plan.release_every_ms == 0 => {
                Err(fail("release_every_ms is 0; at least 1 is needed".to_owned()))
            }
            _ => Ok(plan),
        }
    }
}

impl Store {
    /// The same store with faults by `plan`, and a thread that lets go in time what they hold back.
    ///
    /// - errors: the thread cannot be started.
    pub fn under(self, plan: FaultPlan) -> std::io::Result<Store> {
        tracing::warn!(?plan, "FAULT DRILL: writes fail on purpose; this is not a normal service");
        let every = Duration::from_millis(plan.release_every_ms);
        let faulty = Arc::new(FaultyLog::new(self.log.clone(), plan));
        let drill = Drill::start(faulty, every)?;
        Ok(self.with_log(Arc::new(drill)))
    }
}

/// A [`FaultyLog`] that releases what it holds back at regular intervals: a slow disk, not a dead
/// one.
struct Drill {
    faulty: Arc<FaultyLog>,
    /// Dropped to end the thread at once.
    stop: Option<SyncSender<()>>,
    releasing: Option<JoinHandle<()>>,
}

impl Drill {
    fn start(faulty: Arc<FaultyLog>, every: Duration) -> std::io::Result<Drill> {
        let (stop, stopped) = sync_channel(0);
        let slow = faulty.clone();
        let releasing =
            std::thread::Builder::new().name("fault drill".to_owned()).spawn(move || {
                while stopped.recv_timeout(every) == Err(RecvTimeoutError::Timeout) {
                    slow.release();
                }
                slow.release();
            })?;
        Ok(Drill { faulty, stop: Some(stop), releasing: Some(releasing) })
    }
}

impl Drop for Drill {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(releasing) = self.releasing.take() {
            // It only waits for the log; a panic there was reported by the log.
            let _ = releasing.join();
        }
    }
}

impl EventLog for Drill {
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending {
        self.faulty.append(stream, after, batch)
    }

    fn read<'a>(
        &'a self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError> {
        self.faulty.read(stream, from)
    }

    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError> {
        self.faulty.sealed(stream, from)
    }

    fn head(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.faulty.head(stream)
    }

    fn tenants(&self) -> Result<Vec<TenantId>, ReadError> {
        self.faulty.tenants()
    }

    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.faulty.walk(stream)
    }

    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError> {
        self.faulty.sealed_bytes(tenant)
    }

    fn streams(&self, tenant: &TenantId) -> Result<Vec<StreamId>, ReadError> {
        self.faulty.streams(tenant)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::directory::store::open_memory;
    use crate::store::faults::faulty::Fault;
    use crate::store::testing::conformance::{batch, read_all, stream};

    fn plan(text: &str) -> Result<FaultPlan, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        FaultPlan::read(file.path())
    }

    #[test]
    fn a_plan_is_a_file_and_a_bad_one_a_sentence() {
        let read = plan("seed = 4\nscript = [\"refused\"]\nheld_answers = 20\n").unwrap();
        assert_eq!((read.seed, read.held_answers, read.refused), (4, 20, 0));
        assert_eq!(read.script, [Fault::Refused]);
        let sentence = plan("seed = 4\nrefused = 900\ncrashes_after = 101\n").unwrap_err();
        assert!(sentence.contains("1001"), "{sentence}");
        for bad in ["refuse = 3\n", "refused = \"many\"\n", "release_every_ms = 0\n"] {
            assert!(plan(bad).unwrap_err().starts_with("the fault plan /"));
        }
        assert!(FaultPlan::read(Path::new("no/such/plan")).unwrap_err().contains("no/such/plan"));
    }

    #[test]
    fn what_a_drill_holds_back_is_answered_in_time_and_at_the_end() {
        for release_every_ms in [1, 1_000_000] {
            let script = vec![Fault::HeldAnswer, Fault::HeldAppend];
            let plan = FaultPlan { script, release_every_ms, ..FaultPlan::default() };
            let store = open_memory();
            let (ada, grace) =
                (stream(&store.keys, "local", "ada"), stream(&store.keys, "local", "grace"));
            let drilled = store.clone().under(plan).unwrap();
            let answer = drilled.log.append(&ada, Head::EMPTY, batch(["a"]));
            let append = drilled.log.append(&grace, Head::EMPTY, batch(["b"]));
            if release_every_ms > 1 {
                drop(drilled);
            }
            answer.wait().unwrap();
            append.wait().unwrap();
            assert_eq!(read_all(&*store.log, &grace).len(), 1);
        }
    }
}
