//! Random numbers that are the same on every machine: ChaCha8 streams, and draws defined here to the bit.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A stream of random numbers.
///
/// ```
/// use vsonar::tree::Random;
///
/// let mut random = Random::stream(1, 0, 7);
/// let die = 1 + random.below(6);
/// assert!((1..=6).contains(&die));
/// assert_eq!(Random::stream(1, 0, 7).below(6), die - 1);
/// ```
#[derive(Debug, Clone)]
pub struct Random(ChaCha8Rng);

impl Random {
    /// The stream of a run's seed for one slot (or pair of slots) of a generation.
    ///
    /// The key is the first four outputs of SplitMix64 (Steele, Lea and Flood 2014) started at the seed, each
    /// little-endian; the stream number is `generation · 2³² + slot`. Streams do not overlap.
    pub fn stream(seed: u64, generation: u32, slot: u32) -> Random {
        let mut state = seed;
        let mut key = [0u8; 32];
        for word in key.chunks_exact_mut(8) {
            word.copy_from_slice(&split_mix(&mut state).to_le_bytes());
        }
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(u64::from(generation) << 32 | u64::from(slot));
        Random(rng)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// A whole number from 0 to `n` - 1, each equally likely: the upper half of the 128-bit product of 64 random
    /// bits and `n`, drawn again in the rare case that would favour some (Lemire 2019).
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn below(&mut self, n: u64) -> u64 {
        assert!(n > 0, "there is no number below 0");
        loop {
            let product = u128::from(self.bits()) * u128::from(n);
            // 2⁶⁴ mod n low parts are one too many for some results.
            if product as u64 >= n.wrapping_neg() % n {
                return (product >> 64) as u64;
            }
        }
    }

    /// [`Random::below`] for positions in memory.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn index(&mut self, n: usize) -> usize {
        self.below(n as u64) as usize
    }

    /// A number in [0, 1), one of 2⁵³ equally spaced: the upper 53 of 64 random bits.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }
}

fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_mix_is_the_published_generator() {
        // The first outputs from seed 1234567, as listed with several implementations.
        let mut state = 1_234_567;
        assert_eq!(split_mix(&mut state), 6_457_827_717_110_365_317);
        assert_eq!(split_mix(&mut state), 3_203_168_211_198_807_973);
    }

    #[test]
    fn streams_differ_and_repeat() {
        let first = |seed, generation, slot| Random::stream(seed, generation, slot).bits();
        assert_eq!(first(5, 3, 9), first(5, 3, 9));
        let all = [first(5, 3, 9), first(6, 3, 9), first(5, 4, 9), first(5, 3, 10), first(5, 9, 3)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|b| a != b), "{all:?}");
        }
    }

    #[test]
    fn draws_are_even() {
        let mut random = Random::stream(1, 0, 0);
        let mut counts = [0u32; 7];
        for _ in 0..70_000 {
            counts[random.index(7)] += 1;
        }
        // Ten standard deviations around 10,000.
        assert!(counts.iter().all(|c| (9_070..10_930).contains(c)), "{counts:?}");
        let mean = (0..100_000).map(|_| random.unit()).sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert!((0..1000).all(|_| (0.0..1.0).contains(&random.unit())));
        assert!((0..1000).all(|_| random.chance(1.0) && !random.chance(0.0)));
    }
}
