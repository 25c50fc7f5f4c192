use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Deserialize;

use crate::events::{Batch, Head, Record};
use crate::ids::{Seq, StreamId, TenantId};
use crate::store::log::{AppendError, EventLog, Pending, Promise, ReadError, SealedRecords};
use crate::store::sealing::entropy::{Entropy, SeededEntropy};

/// What goes wrong with one append.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    None,
    /// Refused as busy; nothing is appended.
    Refused,
    /// Appended, but the answer is lost: the caller hears [`AppendError::Gone`].
    Unacknowledged,
    /// Appended, and answered when [`FaultyLog::release`] is called.
    HeldAnswer,
    /// Appended and answered when [`FaultyLog::release`] is called.
    HeldAppend,
    /// The process dies before the append; everything after it fails until a restart.
    CrashBefore,
    /// The process dies after the append and before its answer.
    CrashAfter,
}

/// Which appends go wrong. Shares are out of 1,000 and drawn from the seed; `script` comes first.
#[derive(Debug, Clone, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FaultPlan {
    pub seed: u64,
    /// The faults of the first appends, one each.
    pub script: Vec<Fault>,
    pub refused: u32,
    pub unacknowledged: u32,
    pub held_answers: u32,
    pub held_appends: u32,
    pub crashes_before: u32,
    pub crashes_after: u32,
    /// Milliseconds after which a drill lets go what is held back.
    pub release_every_ms: u64,
}

impl Default for FaultPlan {
    /// No faults.
    fn default() -> FaultPlan {
        FaultPlan {
            seed: 0,
            script: Vec::new(),
            refused: 0,
            unacknowledged: 0,
            held_answers: 0,
            held_appends: 0,
            crashes_before: 0,
            crashes_after: 0,
            release_every_ms: 100,
        }
    }
}

impl FaultPlan {
    /// Appends of 1,000 that go wrong.
    pub(in crate::store) fn shares(&self) -> u64 {
        self.table().iter().map(|(share, _)| u64::from(*share)).sum()
    }

    fn table(&self) -> [(u32, Fault); 6] {
        [
            (self.refused, Fault::Refused),
            (self.unacknowledged, Fault::Unacknowledged),
            (self.held_answers, Fault::HeldAnswer),
            (self.held_appends, Fault::HeldAppend),
            (self.crashes_before, Fault::CrashBefore),
            (self.crashes_after, Fault::CrashAfter),
        ]
    }
}

/// A log on which appends go wrong by a plan. For simulations, and for fault drills of a lab.
pub struct FaultyLog {
    inner: Arc<dyn EventLog>,
    plan: FaultPlan,
    dice: SeededEntropy,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    appends: usize,
    crashed: bool,
    held: Vec<Held>,
}

struct Held {
    promise: Promise,
    what: What,
}

enum What {
    Answer(Pending),
    Append(StreamId, Head, Batch),
}

impl FaultyLog {
    pub fn new(inner: Arc<dyn EventLog>, plan: FaultPlan) -> FaultyLog {
        let dice = SeededEntropy::new(plan.seed);
        FaultyLog { inner, plan, dice, state: Mutex::default() }
    }

    /// How many answers and appends are held back.
    pub fn held(&self) -> usize {
        self.state().held.len()
    }

    /// Lets everything go that was held back, oldest first. Blocks until it is durable.
    pub fn release(&self) {
        let held = std::mem::take(&mut self.state().held);
        for Held { promise, what } in held {
            let answer = match what {
                What::Answer(pending) => pending.wait(),
                What::Append(stream, after, batch) => {
                    self.inner.append(&stream, after, batch).wait()
                }
            };
            // The caller may be gone: this append survived the crash that dropped it.
            let _ = promise.send(answer);
        }
    }

    /// Whether the planned crash has come. From then on every call fails, as for a process that
    /// is no more.
    pub fn crashed(&self) -> bool {
        self.state().crashed
    }

    /// Starts again after a crash: what was durable is there, what was held back is not, and
    /// whoever waited hears nothing but [`AppendError::Gone`].
    pub fn restart(&self) {
        let mut state = self.state();
        state.crashed = false;
        state.held.clear();
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn draw(&self, append: usize) -> Fault {
        if let Some(&fault) = self.plan.script.get(append) {
            return fault;
        }
        let mut bytes = [0; 8];
        self.dice.fill(&mut bytes);
        let mut roll = u64::from_be_bytes(bytes) % 1_000;
        for (share, fault) in self.plan.table() {
            if roll < u64::from(share) {
                return fault;
            }
            roll -= u64::from(share);
        }
        Fault::None
    }

    fn alive(&self) -> Result<(), ReadError> {
        match self.crashed() {
            true => Err(ReadError::Store { reason: "the planned crash has come".to_owned() }),
            false => Ok(()),
        }
    }
}

impl EventLog for FaultyLog {
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending {
        let mut state = self.state();
        if state.crashed {
            return Pending::kept(Err(AppendError::Gone));
        }
        let fault = self.draw(state.appends);
        state.appends += 1;
        let gone = || Pending::kept(Err(AppendError::Gone));
        let hold = |state: &mut State, what| {
            let (promise, pending) = Pending::promise();
            state.held.push(Held { promise, what });
            pending
        };
        match fault {
            Fault::None => self.inner.append(stream, after, batch),
            Fault::Refused => Pending::kept(Err(AppendError::Busy { waiting: state.held.len() })),
            Fault::Unacknowledged => {
                drop(self.inner.append(stream, after, batch));
                gone()
            }
            Fault::HeldAnswer => {
                let answer = self.inner.append(stream, after, batch);
                hold(&mut state, What::Answer(answer))
            }
            Fault::HeldAppend => hold(&mut state, What::Append(stream.clone(), after, batch)),
            Fault::CrashBefore => {
                state.crashed = true;
                gone()
            }
            Fault::CrashAfter => {
                state.crashed = true;
                drop(self.inner.append(stream, after, batch));
                gone()
            }
        }
    }

    fn read<'a>(
        &'a self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError> {
        self.alive()?;
        self.inner.read(stream, from)
    }

    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError> {
        self.alive()?;
        self.inner.sealed(stream, from)
    }

    fn head(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.alive()?;
        self.inner.head(stream)
    }

    fn streams(&self, tenant: &TenantId) -> Result<Vec<StreamId>, ReadError> {
        self.alive()?;
        self.inner.streams(tenant)
    }

    fn tenants(&self) -> Result<Vec<TenantId>, ReadError> {
        self.alive()?;
        self.inner.tenants()
    }

    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.alive()?;
        self.inner.walk(stream)
    }

    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError> {
        self.alive()?;
        self.inner.sealed_bytes(tenant)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::memory::MemoryLog;
    use crate::store::sealing::entropy::OsEntropy;
    use crate::store::sealing::keys::Keys;
    use crate::store::testing::conformance::{batch, read_all, stream};

    fn faulty(plan: FaultPlan) -> (FaultyLog, StreamId) {
        let keys = Arc::new(Keys::in_memory(Arc::new(OsEntropy)));
        let ada = stream(&keys, "one", "ada");
        (FaultyLog::new(Arc::new(MemoryLog::new(keys)), plan), ada)
    }

    fn scripted(script: &[Fault]) -> (FaultyLog, StreamId) {
        faulty(FaultPlan { script: script.to_vec(), ..FaultPlan::default() })
    }

    #[test]
    fn a_refused_append_leaves_nothing_and_an_unacknowledged_one_does() {
        let (log, ada) = scripted(&[Fault::Refused, Fault::Unacknowledged]);
        let refused = log.append(&ada, Head::EMPTY, batch(["a"])).wait();
        assert!(matches!(refused, Err(AppendError::Busy { .. })));
        assert_eq!(read_all(&log, &ada).len(), 0);
        let lost = log.append(&ada, Head::EMPTY, batch(["b"])).wait();
        assert_eq!(lost, Err(AppendError::Gone));
        assert_eq!(read_all(&log, &ada).len(), 1);
    }

    #[test]
    fn what_is_held_comes_when_it_is_released() {
        let (log, ada) = scripted(&[Fault::HeldAnswer, Fault::HeldAppend]);
        let answer = log.append(&ada, Head::EMPTY, batch(["a"]));
        let head = log.head(&ada).unwrap();
        assert_eq!(head.seq, 1);
        let append = log.append(&ada, head, batch(["b"]));
        assert_eq!((log.head(&ada).unwrap(), log.held()), (head, 2));
        log.release();
        assert_eq!(answer.wait().unwrap().head(), head);
        assert_eq!(append.wait().unwrap().head(), log.head(&ada).unwrap());
        assert_eq!(log.head(&ada).unwrap().seq, 2);
    }

    #[test]
    fn after_a_crash_everything_fails_until_the_restart() {
        for (fault, survives) in [(Fault::CrashBefore, 0), (Fault::CrashAfter, 1)] {
            let (log, ada) = scripted(&[Fault::HeldAnswer, fault]);
            let grace = StreamId { key: crate::ids::StreamKey([1; 16]), ..ada.clone() };
            let held = log.append(&grace, Head::EMPTY, batch(["held"]));
            assert_eq!(log.append(&ada, Head::EMPTY, batch(["a"])).wait(), Err(AppendError::Gone));
            assert!(
                log.crashed() && log.head(&ada).is_err() && log.read(&ada, Seq::FIRST).is_err()
            );
            assert_eq!(log.append(&ada, Head::EMPTY, batch(["b"])).wait(), Err(AppendError::Gone));
            log.restart();
            assert_eq!(held.wait(), Err(AppendError::Gone));
            assert_eq!(read_all(&log, &ada).len(), survives);
            assert_eq!(read_all(&log, &grace).len(), 1);
        }
    }

    #[test]
    fn a_seed_gives_the_same_faults() {
        let plan =
            FaultPlan { seed: 11, refused: 300, unacknowledged: 200, ..FaultPlan::default() };
        let run = |plan: &FaultPlan| {
            let (log, _) = faulty(plan.clone());
            (0..200).map(|append| log.draw(append)).collect::<Vec<_>>()
        };
        let faults = run(&plan);
        assert_eq!(faults, run(&plan));
        assert_ne!(faults, run(&FaultPlan { seed: 12, ..plan }));
        let count = |fault| faults.iter().filter(|&&found| found == fault).count();
        assert!((30..=90).contains(&count(Fault::Refused)), "{}", count(Fault::Refused));
        assert!((15..=70).contains(&count(Fault::Unacknowledged)));
        assert_eq!(count(Fault::CrashAfter) + count(Fault::HeldAnswer), 0);
    }
}
