use std::time::{SystemTime, UNIX_EPOCH};

use crate::ids::Timestamp;
use crate::tenancy::Clock;

/// The wall clock of the machine. An administrator may set it back or ahead at any moment.
pub fn wall_clock() -> Clock {
    Clock::new(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Timestamp(u64::try_from(since.as_micros()).unwrap_or(u64::MAX))
    })
}
