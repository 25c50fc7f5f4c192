use serde::{Deserialize, Serialize};

use crate::ids::{Digest, RequestId, Seq, Timestamp};

use super::Event;

/// One command's worth of events: appended together or not at all.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    pub request: RequestId,
    pub at: Timestamp,
    pub events: Vec<Event>,
}

/// Where a stream ends: the number and the digest of its last record. Sequence 0 and
/// [`Digest::ZERO`] for a stream that does not exist yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Head {
    pub seq: u64,
    pub digest: Digest,
}

impl Head {
    pub const EMPTY: Head = Head { seq: 0, digest: Digest::ZERO };

    pub fn next(&self) -> Seq {
        Seq::new(self.seq + 1).expect("a head's successor is at least 1")
    }
}

/// An event as it was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub seq: Seq,
    pub at: Timestamp,
    pub request: RequestId,
    pub prev: Digest,
    /// BLAKE3 over header and sealed body: what the next record names as `prev`.
    pub digest: Digest,
    pub event: Event,
}

/// Tells, of the records of one stream in their order, which times were held
/// ([`Timestamp::next`]): then the wall clock had been set back, or the stream has a time from a
/// clock that ran ahead.
#[derive(Debug, Clone, Default)]
pub struct Times {
    last: Option<(Timestamp, RequestId)>,
    held: bool,
}

impl Times {
    /// Whether the time of the next record was held. The records of a batch share their time, and
    /// with it the answer.
    pub fn is_held(&mut self, record: &Record) -> bool {
        let this = (record.at, record.request);
        if self.last != Some(this) {
            self.held = self.last.is_some_and(|(before, _)| record.at.is_held(before));
            self.last = Some(this);
        }
        self.held
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_that_the_clock_did_not_read_is_known_by_its_distance() {
        let record = |at: u64, batch: u8| Record {
            seq: Seq::FIRST,
            at: Timestamp(at),
            request: RequestId([batch; 16]),
            prev: Digest::ZERO,
            digest: Digest::ZERO,
            event: crate::events::TenantOpened {}.into(),
        };
        let mut times = Times::default();
        let mut last = Timestamp::default();
        // The clock is set back behind 90, and passes it again.
        for (batch, wall, held) in [(1, 50, false), (2, 90, false), (3, 60, true), (4, 99, false)] {
            last = last.next(Timestamp(wall));
            for _ in 0..2 {
                assert_eq!(times.is_held(&record(last.0, batch)), held, "batch {batch}");
            }
        }
        // As the times of tenants' own streams were held before the release of 0.2.
        assert!(times.is_held(&record(last.0, 5)));
        assert_eq!(Timestamp(u64::MAX).next(Timestamp(5)), Timestamp(u64::MAX));
    }
}
