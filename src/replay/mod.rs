//! Reading the past: a session from its records. Waking a sleeping user, recovery after a crash
//! and reading history are all [`rebuild`].

mod minds;
mod origins;
mod rebuild;

pub use minds::{Minds, Work};
pub use origins::{keep_mind, mind_origin, state_origin};
pub use rebuild::{RebuildError, keep_snapshot, mind_of, rebuild, rebuild_at};
