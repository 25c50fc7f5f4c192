/// A bucket of tokens: it holds `burst` of them, gains `per_second`, and each use takes some.
///
/// The caller gives the time, in microseconds since a moment of its choice. A time before the last
/// one counts as no time passed. Rate and size are given at each use, so a changed quota holds
/// immediately.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Bucket {
    /// Millionths of a token that are missing.
    missing: u64,
    at_us: u64,
}

/// A whole token, in millionths.
pub const TOKEN: u64 = 1_000_000;

impl Bucket {
    /// Takes `cost` millionths of a token.
    ///
    /// - errors: there are too few: the microseconds after which there are enough, [`u64::MAX`] for
    ///   never.
    pub fn take(&mut self, now_us: u64, per_second: u32, burst: u32, cost: u64) -> Result<(), u64> {
        // A token's millionths per microsecond are the tokens per second.
        let gained = now_us.saturating_sub(self.at_us).saturating_mul(u64::from(per_second));
        self.at_us = self.at_us.max(now_us);
        let size = u64::from(burst) * TOKEN;
        self.missing = self.missing.saturating_sub(gained).min(size);
        let after = self.missing.saturating_add(cost);
        if after <= size {
            self.missing = after;
            return Ok(());
        }
        match per_second == 0 || cost > size {
            true => Err(u64::MAX),
            false => Err((after - size).div_ceil(u64::from(per_second))),
        }
    }

    /// Tokens that would be there now, rounded down.
    pub fn left(&self, now_us: u64, per_second: u32, burst: u32) -> u64 {
        let gained = now_us.saturating_sub(self.at_us).saturating_mul(u64::from(per_second));
        let size = u64::from(burst) * TOKEN;
        (size - self.missing.saturating_sub(gained).min(size)) / TOKEN
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_burst_goes_through_and_then_one_after_another() {
        let mut bucket = Bucket::default();
        for _ in 0..5 {
            assert_eq!(bucket.take(0, 10, 5, TOKEN), Ok(()));
        }
        assert_eq!(bucket.take(0, 10, 5, TOKEN), Err(100_000));
        assert_eq!(bucket.take(99_999, 10, 5, TOKEN), Err(1));
        assert_eq!(bucket.take(100_000, 10, 5, TOKEN), Ok(()));
        assert_eq!(bucket.left(1_000_000, 10, 5), 5);
        assert_eq!(bucket.take(1_000_000, 10, 5, TOKEN / 10), Ok(()));
        assert_eq!(bucket.left(1_000_000, 10, 5), 4);
        assert_eq!(bucket.take(1_000_000, 10, 5, 6 * TOKEN), Err(u64::MAX), "more than it holds");
    }

    #[test]
    fn a_bucket_without_rate_or_size_never_fills_and_a_clock_that_goes_back_gives_nothing() {
        assert_eq!(Bucket::default().take(0, 10, 0, TOKEN), Err(u64::MAX));
        let mut bucket = Bucket::default();
        assert_eq!(bucket.take(0, 0, 1, TOKEN), Ok(()));
        assert_eq!(bucket.take(u64::MAX, 0, 1, TOKEN), Err(u64::MAX));
        let mut bucket = Bucket::default();
        assert_eq!(bucket.take(5_000_000, 1, 1, TOKEN), Ok(()));
        assert_eq!(bucket.take(0, 1, 1, TOKEN), Err(1_000_000));
        assert_eq!(bucket.take(5_500_000, 1, 1, TOKEN), Err(500_000));
    }

    proptest! {
        /// Whatever the times: no stretch lets more through than the burst and what came in during
        /// it, and waiting as long as was said is enough.
        #[test]
        fn no_stretch_of_time_lets_more_through(
            steps in prop::collection::vec(0u64..400_000, 1..300),
            rate in 1u32..50,
            burst in 1u32..20,
        ) {
            let (mut bucket, mut now, mut taken) = (Bucket::default(), 0, Vec::new());
            for step in steps {
                now += step;
                match bucket.take(now, rate, burst, TOKEN) {
                    Ok(()) => taken.push(now),
                    Err(wait) => {
                        let mut later = bucket;
                        prop_assert_eq!(later.take(now + wait, rate, burst, TOKEN), Ok(()));
                        let mut sooner = bucket;
                        prop_assert!(sooner.take(now + wait - 1, rate, burst, TOKEN).is_err());
                    }
                }
            }
            for (index, start) in taken.iter().enumerate() {
                for (count, end) in taken[index..].iter().enumerate() {
                    let most = u64::from(burst) * TOKEN + (end - start) * u64::from(rate);
                    prop_assert!((count as u64 + 1) * TOKEN <= most);
                }
            }
        }
    }
}
