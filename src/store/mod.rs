//! Where bytes outlive processes: the ports for durable things, and their adapters.

mod cache;
mod checks;
pub mod conformance;
mod copy;
mod drill;
mod entropy;
mod faulty;
mod files;
mod heads;
mod keys;
mod layout;
mod log;
mod memory;
mod models;
mod open;
mod origin;
mod quiet;
mod sealing;
mod sled;
mod snapshots;

pub use self::copy::{PrivateCopy, copy_private};
pub use self::entropy::{Entropy, OsEntropy, SeededEntropy};
pub use self::faulty::{Fault, FaultPlan, FaultyLog};
pub use self::keys::{KeyError, Keys};
pub use self::layout::LAYOUT;
pub use self::log::{AppendError, EventLog, Pending, ReadError};
pub use self::memory::MemoryLog;
pub use self::models::ModelStore;
pub use self::open::{OpenError, Store, open, open_memory};
pub use self::origin::{CacheCounter, CacheCounts, Found, Origin};
pub use self::sealing::{DataKey, Draft, Sealed, Walk};
pub use self::sled::{Damage, SledLog};
pub use self::snapshots::SnapshotStore;
