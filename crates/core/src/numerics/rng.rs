use crate::ids::Digest;

/// Random numbers from a seed: xoshiro256++ on 256 bits of state. The same seed gives the same
/// numbers in every version.
///
/// Own code rather than a package: a package may change its numbers in an upgrade, and every
/// trained mind would change with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rng {
    state: [u64; 4],
}

impl Rng {
    /// The generator whose state is the digest.
    pub fn from_digest(seed: Digest) -> Rng {
        let mut state = [0; 4];
        for (word, bytes) in state.iter_mut().zip(seed.0.chunks_exact(8)) {
            *word = u64::from_le_bytes(bytes.try_into().expect("chunks of eight bytes"));
        }
        if state == [0; 4] {
            // The one state from which the generator would only ever give zero.
            return Rng::from_u64(0);
        }
        Rng { state }
    }

    /// Spreads a small seed over the whole state with SplitMix64.
    pub fn from_u64(seed: u64) -> Rng {
        let mut counter = seed;
        let state = [(); 4].map(|()| {
            counter = counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut mixed = counter;
            mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            mixed ^ (mixed >> 31)
        });
        Rng { state }
    }

    /// Uniform over all 64-bit numbers.
    pub fn next_u64(&mut self) -> u64 {
        let [a, b, c, d] = self.state;
        let result = a.wrapping_add(d).rotate_left(23).wrapping_add(a);
        let (c, d) = (c ^ a, d ^ b);
        self.state = [a ^ d, b ^ c, c ^ (b << 17), d.rotate_left(45)];
        result
    }

    /// Uniform in `[0, 1)`, a multiple of 2⁻²⁴, so exact in `f32`.
    pub fn uniform(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in `[low, high)`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.uniform()
    }

    /// Normal with mean 0 and variance 1 (Box–Muller in `f64`, one of the pair).
    pub fn normal(&mut self) -> f32 {
        // 1 − u lies in (0, 1], so the logarithm is finite.
        let radius = 1.0 - (self.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0);
        let turn = (self.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0);
        let length = (-2.0 * libm::log(radius)).sqrt();
        (length * libm::cos(std::f64::consts::TAU * turn)) as f32
    }

    /// Uniform below `limit`.
    ///
    /// - panics: `limit` is zero; there is no number to give.
    pub fn below(&mut self, limit: usize) -> usize {
        assert!(limit > 0, "a number below 0 does not exist");
        let limit = limit as u64;
        // Rejects the few values that would make small remainders likelier.
        let fair = u64::MAX - u64::MAX % limit;
        loop {
            let value = self.next_u64();
            if value < fair {
                return (value % limit) as usize;
            }
        }
    }

    /// Brings the items into a random order (Fisher–Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for end in (1..items.len()).rev() {
            items.swap(end, self.below(end + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_never_changes() {
        // The first numbers of the published generator from this state.
        let mut rng = Rng { state: [1, 2, 3, 4] };
        let drawn: Vec<u64> = (0..4).map(|_| rng.next_u64()).collect();
        assert_eq!(drawn, [41943041, 58720359, 3588806011781223, 3591011842654386]);
        assert_eq!(Rng::from_u64(7).next_u64(), 1021219803524665661);
        let mut zero = Rng::from_digest(Digest::ZERO);
        assert_ne!(zero.next_u64(), zero.next_u64());
    }

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let mut rng = Rng::from_digest(Digest::of(b"normal"));
        let drawn: Vec<f64> = (0..20_000).map(|_| rng.normal() as f64).collect();
        let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
        let variance = drawn.iter().map(|x| x * x).sum::<f64>() / drawn.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }

    #[test]
    fn a_shuffle_keeps_every_item() {
        let mut items: Vec<usize> = (0..100).collect();
        Rng::from_u64(1).shuffle(&mut items);
        assert_ne!(items, (0..100).collect::<Vec<_>>());
        items.sort();
        assert_eq!(items, (0..100).collect::<Vec<_>>());
    }
}
