//! Random numbers and noise from integer hashes, so that a seed gives the same world on every machine.
//!
//! ```
//! use vsonar::world::noise::{Stream, smooth};
//! let mut a = Stream::new(7, 0);
//! assert_eq!(a.unit(), Stream::new(7, 0).unit());
//! assert!((0.0..1.0).contains(&smooth(1, 0.3, -8.25)));
//! ```

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): every bit of the input reaches every bit of the result.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A hash of a seed and two whole coordinates.
pub fn hash(seed: u64, x: i64, y: i64) -> u64 {
    let h = mix(seed.wrapping_add(GOLDEN) ^ x.cast_unsigned().wrapping_mul(0xd6e8_feb8_6659_fd93));
    mix(h ^ y.cast_unsigned().wrapping_mul(0xa076_1d64_78bd_642f))
}

/// The upper 53 bits as a number in 0 (included) to 1 (excluded).
pub fn unit(hash: u64) -> f64 {
    (hash >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// White noise in 0 to 1: one value for each pair of whole coordinates.
pub fn white(seed: u64, x: i64, y: i64) -> f64 {
    unit(hash(seed, x, y))
}

/// Value noise in 0 to 1: white noise at whole coordinates, joined by cubic smoothsteps.
pub fn smooth(seed: u64, x: f64, y: f64) -> f64 {
    let (x0, y0) = (x.floor(), y.floor());
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (u, v) = (ease(x - x0), ease(y - y0));
    let (x0, y0) = (x0 as i64, y0 as i64);
    let row = |y: i64| {
        let (a, b) = (white(seed, x0, y), white(seed, x0 + 1, y));
        a + (b - a) * u
    };
    let (a, b) = (row(y0), row(y0 + 1));
    a + (b - a) * v
}

/// Noise of mean 0 and standard deviation 1 that looks normal: the sum of the four 16-bit parts of a hash.
pub fn normal(hash: u64) -> f64 {
    let sum = (hash & 0xffff) + (hash >> 16 & 0xffff) + (hash >> 32 & 0xffff) + (hash >> 48);
    // a 16-bit part has the variance (65536^2 - 1) / 12, their sum four times as much
    (sum as f64 - 131_070.0) * (1.0 / 37_837.227)
}

/// A stream of random numbers (SplitMix64), one for each purpose so that changing one leaves the others alone.
#[derive(Debug, Clone)]
pub struct Stream(u64);

impl Stream {
    /// The stream of a seed for one purpose.
    pub fn new(seed: u64, purpose: u64) -> Stream {
        Stream(mix(mix(seed.wrapping_add(GOLDEN)) ^ purpose.wrapping_mul(GOLDEN)))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mix(self.0)
    }

    /// Uniform in 0 (included) to 1 (excluded).
    pub fn unit(&mut self) -> f64 {
        unit(self.bits())
    }

    /// Uniform in `low` to `high`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform among the whole numbers `low..=high`.
    pub fn whole(&mut self, low: u32, high: u32) -> u32 {
        low + (self.unit() * f64::from(high - low + 1)) as u32
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_right() {
        let mut stream = Stream::new(3, 1);
        let n = 100_000;
        let (mut mean, mut square, mut flat) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            let v = normal(stream.bits());
            mean += v / f64::from(n);
            square += v * v / f64::from(n);
            flat += stream.unit() / f64::from(n);
        }
        assert!(mean.abs() < 0.02 && (square - 1.0).abs() < 0.02 && (flat - 0.5).abs() < 0.01);
    }

    #[test]
    fn smooth_noise_passes_through_the_lattice_and_is_continuous() {
        assert_eq!(smooth(5, 3.0, -2.0), white(5, 3, -2));
        for i in 0..1000 {
            let x = f64::from(i) * 0.01 - 5.0;
            assert!((smooth(5, x, 0.7) - smooth(5, x + 0.001, 0.7)).abs() < 0.01);
        }
    }

    #[test]
    fn whole_numbers_cover_their_range() {
        let mut stream = Stream::new(1, 2);
        let mut seen = [false; 4];
        (0..200).for_each(|_| seen[stream.whole(0, 3) as usize] = true);
        assert_eq!(seen, [true; 4]);
    }
}
