use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::Receiver;

use super::Shared;
use super::quiet::guarded;
use super::read::{chunk_key, chunks};
use crate::events::Head;
use crate::fairness::FairQueue;
use crate::ids::{StreamId, TenantId};
use crate::limits::{COMMIT_GROUP_BYTES_MAX, COMMIT_GROUP_MAX};
use crate::sabotage;
use crate::store::checks;
use crate::store::log::heads::HeadsFile;
use crate::store::log::{AppendError, Durable, Promise};
use crate::store::sealing::seal::Draft;

type Answer = Result<Durable, AppendError>;

/// Makes sled's file reach the disk.
pub(super) type Syncer = Box<dyn FnMut() -> io::Result<()> + Send>;

/// One batch that waits for the committer.
pub(super) struct Job {
    pub stream: StreamId,
    pub after: Head,
    pub draft: Draft,
    pub promise: Promise,
}

impl Job {
    pub(super) fn answer(self, answer: Answer) {
        // The caller may have gone; the log goes on.
        let _ = self.promise.send(answer);
    }
}

/// The only writer: it owns the expected-head check, the heads file and the meaning of *durable*.
pub(super) struct Committer {
    shared: Arc<Shared>,
    heads_file: HeadsFile,
    sync: Syncer,
}

fn enqueue(queue: &mut FairQueue<Job>, job: Job) {
    let tenant = job.stream.tenant.clone();
    queue.push(&tenant, job);
}

/// What one group will have done once it is durable.
#[derive(Default)]
struct Group {
    bytes: BTreeMap<TenantId, u64>,
    writes: BTreeMap<TenantId, ::sled::Batch>,
    heads: BTreeMap<StreamId, Head>,
    kept: Vec<(Promise, Durable)>,
}

impl Committer {
    pub(super) fn new(shared: Arc<Shared>, heads_file: HeadsFile, sync: Syncer) -> Committer {
        Committer { shared, heads_file, sync }
    }

    /// Commits until the log is dropped.
    pub(super) fn run(mut self, jobs: &Receiver<Job>) {
        // Tenants take turns: one that has thousands of batches waiting fills no group alone.
        let mut queue = FairQueue::default();
        loop {
            if queue.is_empty() {
                let Ok(first) = jobs.recv() else { return };
                enqueue(&mut queue, first);
            }
            jobs.try_iter().for_each(|job| enqueue(&mut queue, job));
            let (mut group, mut bytes) = (Vec::new(), 0);
            while group.len() < COMMIT_GROUP_MAX && bytes < COMMIT_GROUP_BYTES_MAX {
                let Some(job) = queue.pop() else { break };
                bytes += job.draft.bytes();
                self.shared.waiting.remove(&job.stream.tenant, job.draft.bytes());
                group.push(job);
            }
            self.commit(group);
        }
    }

    fn commit(&mut self, jobs: Vec<Job>) {
        if let Some(reason) = self.shared.poisoned.get() {
            let poisoned = AppendError::Poisoned { reason: reason.clone() };
            jobs.into_iter().for_each(|job| job.answer(Err(poisoned.clone())));
            return;
        }
        let Group { bytes, writes, heads, kept } = self.gather(jobs);
        let (promises, receipts): (Vec<Promise>, Vec<Durable>) = kept.into_iter().unzip();
        let shared = self.shared.clone();
        let hold = shared.in_hand.hold(promises);
        sabotage::point("committer");
        let durable = self.make_durable(writes, &heads);
        // Too late: the log is poisoned, and everybody was told so.
        let Some(promises) = hold.release() else { return };
        match durable {
            Ok(()) => {
                self.publish(heads);
                for (tenant, bytes) in bytes {
                    shared.sizes.add(&tenant, bytes);
                }
                for (promise, receipt) in promises.into_iter().zip(receipts) {
                    let _ = promise.send(Ok(receipt));
                }
            }
            Err(reason) => {
                let poisoned = AppendError::Poisoned { reason: reason.clone() };
                self.shared.poison(reason);
                for promise in promises {
                    let _ = promise.send(Err(poisoned.clone()));
                }
            }
        }
    }

    /// Checks heads, seals and collects; answers at once what cannot be appended.
    fn gather(&self, jobs: Vec<Job>) -> Group {
        let new: Vec<StreamId> = jobs
            .iter()
            .filter(|job| job.after == Head::EMPTY)
            .map(|job| job.stream.clone())
            .collect();
        // Many new people share the syncs of their key files. What goes wrong here goes wrong
        // again below, and is answered there to the one whom it concerns.
        let _ = self.shared.keys.make_user_keys(&new);
        let mut group = Group::default();
        for job in jobs {
            let Job { stream, after, draft, promise } = job;
            let found =
                group.heads.get(&stream).copied().unwrap_or_else(|| self.shared.head(&stream));
            let key = checks::head(&stream, after, found)
                .and_then(|()| checks::key_to_append(&self.shared.keys, &stream, found));
            let key = match key {
                Ok(key) => key,
                Err(error) => {
                    let _ = promise.send(Err(error));
                    continue;
                }
            };
            let sealed = draft.seal(&key, self.shared.keys.entropy(), stream.key, after);
            if !sealed.frames.is_empty() {
                let bytes = group.bytes.entry(stream.tenant.clone()).or_default();
                *bytes += sealed.bytes() + checks::key_bytes(found);
                let writes = group.writes.entry(stream.tenant.clone()).or_default();
                for (record, frame) in sealed.records.iter().zip(&sealed.frames) {
                    for (chunk, value) in chunks(frame) {
                        writes.insert(&chunk_key(stream.key, record.seq.get(), chunk), value);
                    }
                }
                group.heads.insert(stream, sealed.head);
            }
            group.kept.push((promise, Durable::mint(sealed.records, sealed.head)));
        }
        group
    }

    /// Batch, flush, sync, heads frame, sync: in this order, and the first error ends it.
    fn make_durable(
        &mut self,
        writes: BTreeMap<TenantId, ::sled::Batch>,
        heads: &BTreeMap<StreamId, Head>,
    ) -> Result<(), String> {
        if writes.is_empty() {
            return Ok(());
        }
        let shared = &self.shared;
        guarded(|| {
            for (tenant, batch) in writes {
                let tree = shared.tree(&tenant).map_err(|error| error.to_string())?;
                tree.apply_batch(batch).map_err(|error| error.to_string())?;
            }
            shared.db.flush().map_err(|error| error.to_string()).map(|_| ())
        })??;
        (self.sync)().map_err(|error| format!("fdatasync of the log: {error}"))?;
        self.heads_file.append(heads).map_err(|error| format!("the heads file: {error}"))
    }

    fn publish(&mut self, changed: BTreeMap<StreamId, Head>) {
        let mut heads = self.shared.heads.write().expect("no holder of the heads panics");
        for (stream, head) in changed {
            heads.entry(stream.tenant).or_default().insert(stream.key, head);
        }
        drop(heads);
        // A rewrite that fails half-way leaves us with a file that may have lost its name.
        let heads = self.shared.heads.read().expect("no holder of the heads panics");
        if let Err(error) = self.heads_file.compact_if_long(&heads) {
            self.shared.poison(format!("the heads file cannot be rewritten: {error}"));
        }
    }
}
