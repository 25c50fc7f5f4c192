//! The laws by name. The name is what an assertion, a test and a bug report use. `tests/tidy.rs`
//! checks that code that is shipped and a test name each of them.

use std::fmt;

/// What must always hold; see `ARCHITECTURE.md`, *Laws*.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Invariant {
    /// A reply exists only for durable events. Kept by type: `Session::settle` demands a receipt,
    /// and only `store/` can make one.
    DurableBeforeReply,
    /// One stream has one writer at a time: `append` carries the expected head.
    SingleWriter,
    /// A stream's sequence numbers are 1, 2, 3, … with no gap.
    DenseSeq,
    /// Each record carries the digest of its predecessor.
    Chained,
    /// Folding the log from the start equals folding from any snapshot.
    FoldAgrees,
    /// The scene after replaying a program has the digest the event recorded.
    SceneAgrees,
    /// Bytes under a digest hash to it; retraining a recipe gives that digest.
    ModelAgrees,
    /// A repeated request id returns the first reply and appends nothing.
    ExactlyOnce,
    /// Every request that was taken is answered once, unless its process dies.
    AnsweredOnce,
    /// No key, address or reply crosses tenants.
    TenantWall,
    /// A scheduled retrain is finished or failed, never forgotten.
    NoLostWork,
    /// Every queue, loop, program, utterance and batch has a limit with a name and a unit.
    Bounded,
    /// Every record ever released still decodes.
    OldLogsOpen,
}

impl fmt::Display for Invariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}
