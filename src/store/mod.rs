//! Where bytes outlive processes: the ports for durable things, and their adapters.
//!
//! Lowest first: `disk`, `log` (the port), `sealing`, `checks`, the two logs `memory` and `sled`, with
//! `caches` below the second, `directory`, `exchange`, `faults`, `testing`. Imports point downwards on
//! this list only; `tests/tidy.rs` checks that they make no circle.

mod caches;
mod checks;
mod directory;
mod disk;
mod exchange;
mod faults;
mod log;
mod memory;
mod sealing;
mod sled;
#[cfg(feature = "testing")]
pub mod testing;

pub use self::caches::models::ModelStore;
pub use self::caches::origin::{CacheCounter, CacheCounts, Found, Origin};
pub use self::caches::snapshots::SnapshotStore;
pub use self::directory::check::{CHECK_COMMAND, check_copy, check_with};
pub use self::directory::checkpoints::{CheckpointFeed, FeedError};
pub use self::directory::copy::{PrivateCopy, copy_private};
pub use self::directory::error::OpenError;
pub use self::directory::layout::LAYOUT;
pub use self::directory::open::open;
pub use self::directory::store::{HISTORY_FILE, Store, open_memory};
pub use self::exchange::export::{ExportError, Exported, export, key_file_of};
pub use self::exchange::import::{ImportError, Imported, import};
pub use self::exchange::rescue::{Loss, RescueError, StreamFound};
pub use self::exchange::salvage::{SalvageError, Salvaged, Share, salvage};
pub use self::faults::faulty::{Fault, FaultPlan, FaultyLog};
pub use self::log::{
    AppendError, Durable, EventLog, Pending, ReadError, SealedRecord, SealedRecords,
};
pub use self::memory::MemoryLog;
pub use self::sealing::entropy::{Entropy, OsEntropy, SeededEntropy};
pub use self::sealing::keys::{KeyError, Keys};
pub use self::sealing::seal::{DataKey, Draft, Sealed, Walk};
pub use self::sled::{Damage, SledLog};
#[cfg(feature = "testing")]
pub use self::testing::{conformance, decoders};
