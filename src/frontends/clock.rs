use std::time::{SystemTime, UNIX_EPOCH};

use crate::ids::Timestamp;

/// The moment that keys are held against.
pub(super) fn now() -> Timestamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Timestamp(u64::try_from(since.as_micros()).unwrap_or(u64::MAX))
}
