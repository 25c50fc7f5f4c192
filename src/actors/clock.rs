use std::time::{SystemTime, UNIX_EPOCH};

use crate::ids::Timestamp;
use crate::tenancy::Clock;

/// The machine's wall clock. It may be set back or ahead at any moment, and be set right again.
pub fn wall_clock() -> Clock {
    Clock::new(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Timestamp(u64::try_from(since.as_micros()).unwrap_or(u64::MAX))
    })
}
