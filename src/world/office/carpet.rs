//! The carpet's fine texture: a tile that repeats, averaged over ever larger squares so that what is finer than a
//! pixel fades away instead of flickering.

use crate::world::noise::{Stream, smooth, white};

/// Texels of the tile each way, and their size in metres.
const SIDE: usize = 256;
const TEXEL: f32 = 0.004;

/// The tile and its averages.
#[derive(Debug, Clone)]
pub(super) struct Carpet {
    /// Halved each way from one to the next; the last is one texel.
    levels: Vec<Vec<f32>>,
}

impl Carpet {
    /// A texture of mean 1 that varies by about `grain`.
    pub(super) fn new(seed: u64, grain: f64) -> Carpet {
        let seed = Stream::new(seed, 41).bits();
        // lattices that divide the tile, so that it repeats without a seam
        let layer = |salt: u64, cells: usize, i: usize, j: usize| {
            let at = |k: usize| k as f64 * cells as f64 / SIDE as f64;
            let (x, y) = (at(i), at(j));
            let wrapped = |x: f64, y: f64| smooth(seed.wrapping_add(salt), x, y) - 0.5;
            // near the far edge the lattice of the near edge is blended in
            let blend = |v: f64| (v - (cells as f64 - 1.0)).max(0.0);
            let (bx, by, n) = (blend(x), blend(y), cells as f64);
            let row = |y: f64| (1.0 - bx) * wrapped(x, y) + bx * wrapped(x - n, y);
            (1.0 - by) * row(y) + by * row(y - n)
        };
        let texel = |k: usize| {
            let (i, j) = (k % SIDE, k / SIDE);
            let fine = white(seed, i as i64, j as i64) - 0.5;
            let pattern = 1.5 * fine + 1.0 * layer(1, 72, i, j) + 0.9 * layer(2, 26, i, j);
            (1.0 + grain * pattern) as f32
        };
        let mut levels = vec![(0..SIDE * SIDE).map(texel).collect::<Vec<f32>>()];
        let mean = levels[0].iter().sum::<f32>() / (SIDE * SIDE) as f32;
        levels[0].iter_mut().for_each(|v| *v = (*v / mean).max(0.05));
        let mut side = SIDE;
        while side > 1 {
            let (above, half) = (&levels[levels.len() - 1], side / 2);
            let average = |k: usize| {
                let (i, j) = (2 * (k % half), 2 * (k / half));
                let pair = |j: usize| above[j * side + i] + above[j * side + i + 1];
                0.25 * (pair(j) + pair(j + 1))
            };
            levels.push((0..half * half).map(average).collect());
            side = half;
        }
        Carpet { levels }
    }

    /// The level at which a pixel of this size, in metres, is about a texel: a fraction stands between two.
    pub(super) fn level(pixel: f64) -> f64 {
        libm::log2((pixel / f64::from(TEXEL)).max(1.0))
    }

    /// Its factor at a place, in metres from any point: it repeats on all sides.
    #[inline]
    pub(super) fn at(&self, x: f32, y: f32, level: u8) -> f32 {
        let level = usize::from(level).min(self.levels.len() - 1);
        let (tile, bits) = (&self.levels[level], SIDE.trailing_zeros() as usize - level);
        let mask = (1usize << bits) - 1;
        let scale = (1 << bits) as f32 / (SIDE as f32 * TEXEL);
        // beyond a million texels one is as good as another; what is no number becomes one
        let near = |u: f32| if u > -1e6 { u.min(1e6) } else { -1e6 };
        let floor = |u: f32| u as i32 - i32::from(u < (u as i32) as f32);
        let (u, v) = (near(x * scale), near(y * scale));
        let (i, j) = (floor(u), floor(v));
        let (u, v) = (u - i as f32, v - j as f32);
        let (i, j) = (i as usize, j as usize);
        // Left of the first texel they count down from the largest number.
        let (i1, j1) = (i.wrapping_add(1) & mask, j.wrapping_add(1) & mask);
        let (i0, j0) = (i & mask, j & mask);
        let row = |j: usize| {
            let (a, b) = (tile[(j << bits) + i0], tile[(j << bits) + i1]);
            a + (b - a) * u
        };
        let (a, b) = (row(j0), row(j1));
        a + (b - a) * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_repeats_and_fades() {
        let carpet = Carpet::new(3, 0.3);
        let period = SIDE as f32 * TEXEL;
        for k in 0..50 {
            let (x, y) = (k as f32 * 0.37, 12.0 - k as f32 * 0.21);
            assert!((carpet.at(x, y, 0) - carpet.at(x + period, y - period, 0)).abs() < 0.1);
        }
        let spread = |level| {
            let values: Vec<f32> = (0..500).map(|k| carpet.at(k as f32 * 0.0137, 0.4, level)).collect();
            values.iter().map(|v| (v - 1.0) * (v - 1.0)).sum::<f32>()
        };
        assert!(spread(0) > 4.0 * spread(3) && spread(8) < 1e-6, "{} {}", spread(0), spread(3));
        // on the other side of 0 too, and without a step there
        for k in 0..50 {
            let (x, y) = (-0.031 * k as f32, 0.3 - 0.017 * k as f32);
            assert!((carpet.at(x, y, 0) - carpet.at(x + 4.0 * period, y + 4.0 * period, 0)).abs() < 0.02);
            assert!((carpet.at(-1e-6, y, 0) - carpet.at(1e-6, y, 0)).abs() < 0.01);
        }
        for far in [-1e30, 1e30, f32::INFINITY, f32::NAN] {
            assert!((0.0..5.0).contains(&carpet.at(far, -far, 1)), "{far}");
        }
        assert!(Carpet::level(0.001) == 0.0 && (Carpet::level(0.008) - 1.0).abs() < 1e-6);
    }
}
