//! Reading the past: a session from its records. Waking a sleeping user, recovery after a crash
//! and reading history are all [`rebuild`]; [`audit`] holds the whole log against what this binary
//! computes.

mod audit;
mod auditor;
mod difference;
mod erasures;
mod evidence;
mod minds;
mod origins;
mod rebuild;
mod repropose;

pub use audit::{AuditReport, Counts, Scrutiny, StreamReport, audit, streams_of};
pub use difference::{Difference, body};
pub use evidence::{
    CheckpointsError, ORIGIN, ProveError, SegmentError, Through, Wanted, check_segment,
    due_segments, keep_checkpoint, leaf_of, leaves_of, newest_checkpoint, prove, sign_statement,
    signer_of,
};
pub use minds::{Minds, Work};
pub use origins::{keep_mind, mind_origin, state_origin};
pub use rebuild::{RebuildError, keep_snapshot, mind_of, read_back, rebuild, rebuild_at};
