//! Reading the past: a session from its records. Waking a sleeping user, recovery after a crash
//! and reading history are all [`rebuild`].

mod minds;
mod rebuild;

pub use minds::Minds;
pub use rebuild::{RebuildError, keep_snapshot, mind_of, rebuild, rebuild_at};
