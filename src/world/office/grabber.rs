//! The frame grabber: automatic exposure, what lens and sensor do to the picture, and the digitizer.

use image::GrayImage;

use super::sight::Sight;
use super::{Moment, Office, Place};
use crate::world::noise::{Stream, hash, normal};

/// Pixels between those that the exposure meter looks at.
const METER: usize = 16;
/// Deviates in the table of noise: a power of two, well above the width of a line.
const NOISE: usize = 1 << 14;

/// The robot's camera and frame grabber. It remembers its exposure, so that one sequence has one grabber.
///
/// The two fields of an interlaced frame differ in brightness only: both are taken from one place, so that the labels
/// are those of the picture.
#[derive(Debug, Clone)]
pub struct Grabber {
    seed: u64,
    frame: u64,
    /// The exposure's factor, as it was adapted last.
    gain: Option<f64>,
    /// Seconds since the office's beginning at the last frame.
    last: Option<f64>,
    noise: Vec<f32>,
}

/// What a picture depends on besides the office: it can be taken later, or on another thread.
#[derive(Debug, Clone)]
pub(super) struct Exposure {
    seconds: f64,
    place: Place,
    gain: f64,
    /// Seed of the frame's noise.
    seed: u64,
}

impl Grabber {
    pub(super) fn new(seed: u64) -> Grabber {
        let stream = &mut Stream::new(seed, 51);
        let noise = (0..NOISE).map(|_| normal(stream.bits()) as f32).collect();
        Grabber { seed, frame: 0, gain: None, last: None, noise }
    }

    /// The picture that the robot takes from a place. Times ascend from one to the next.
    pub fn take(&mut self, moment: &Moment<'_>, place: &Place) -> GrayImage {
        let exposure = self.expose(moment, place);
        self.develop(moment, &exposure)
    }

    /// Lets the camera look from a place without taking a picture: its exposure follows what it sees.
    pub fn look(&mut self, moment: &Moment<'_>, place: &Place) {
        self.expose(moment, place);
    }

    /// The exposure of this frame, which the frames before it decide; and that of the next.
    pub(super) fn expose(&mut self, moment: &Moment<'_>, place: &Place) -> Exposure {
        let setup = &moment.office.setup;
        let meter = f64::from(Sight::new(moment, place).meter(METER));
        // the gain at which the mean gray value is what it should be
        let wanted = setup.target / (255.0 * meter.max(1e-6));
        let wanted = (wanted * wanted / setup.exposure.max(1e-9)).clamp(1.0 / setup.range, setup.range);
        let gain = self.gain.unwrap_or(wanted);
        let passed = self.last.map_or(0.0, |seconds| (moment.seconds - seconds).max(0.0));
        let share = if setup.delay > 0.0 { 1.0 - libm::exp(-passed / setup.delay) } else { 1.0 };
        // in proportion, as an iris works
        self.gain = Some(gain * libm::pow(wanted / gain, share));
        self.last = Some(moment.seconds);
        self.frame += 1;
        let seed = hash(self.seed, self.frame as i64, -1);
        Exposure { seconds: moment.seconds, place: *place, gain, seed }
    }

    /// The picture of an exposure.
    pub(super) fn develop(&self, moment: &Moment<'_>, exposure: &Exposure) -> GrayImage {
        debug_assert_eq!(moment.seconds, exposure.seconds);
        let office: &Office = moment.office;
        let light = Sight::new(moment, &exposure.place).picture();
        let (width, height) = office.size();
        let light = soften(&light, width as usize, height as usize, office.setup.softness as f32);
        let values = self.digitize(office, exposure, &light);
        GrayImage::from_raw(width, height, values).unwrap_or_else(|| GrayImage::new(width, height))
    }

    /// From light to gray values: vignetting, tone curve, noise, interlace lines, moire, and the digitizer's floor.
    fn digitize(&self, office: &Office, exposure: &Exposure, light: &[f32]) -> Vec<u8> {
        let setup = &office.setup;
        let width = setup.width as usize;
        let factor = (setup.exposure * exposure.gain * 255.0 * 255.0) as f32;
        let (sigma, strength) = (setup.noise as f32, setup.interlace as f32);
        // moire: sin(a x + b y + c) taken apart into what depends on the column and what on the row
        let phase = (exposure.seed >> 40) as f64 * (std::f64::consts::TAU / f64::from(1 << 24));
        let waves: Vec<(f32, f32)> = (0..width)
            .map(|x| {
                let (sin, cos) = libm::sincos(0.83 * x as f64);
                (sin as f32, cos as f32)
            })
            .collect();
        let mut values = vec![0; light.len()];
        let rows = values.chunks_exact_mut(width).zip(light.chunks_exact(width));
        for (y, ((out, light), vignette)) in rows.zip(office.rig.vignette.chunks_exact(width)).enumerate() {
            let random = hash(exposure.seed, y as i64, 0);
            let (sin, cos) = libm::sincos(0.31 * y as f64 + phase);
            let (sin, cos) = (strength * sin as f32, strength * cos as f32);
            let line = if y.is_multiple_of(2) { strength } else { -strength };
            let line = line + 0.3 * sigma * normal(random.rotate_left(7)) as f32;
            let mut at = random as usize & (NOISE - 1);
            for (((out, light), vignette), wave) in out.iter_mut().zip(light).zip(vignette).zip(&waves) {
                let value = (light * vignette * factor).sqrt();
                let value = value + sigma * self.noise[at] + line + wave.0 * cos + wave.1 * sin + 0.5;
                at = (at + 1) & (NOISE - 1);
                let value = value as u8;
                *out = if setup.digitizer && value < 32 { 16 } else { value };
            }
        }
        values
    }
}

/// A slightly unsharp lens: each pixel gives this share away to its neighbours, as a 3 x 3 binomial.
fn soften(light: &[f32], width: usize, height: usize, share: f32) -> Vec<f32> {
    let side = share / 4.0;
    let centre = 1.0 - 2.0 * side;
    let mut across = light.to_vec();
    for (row, out) in light.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        for ((three, out), _) in row.windows(3).zip(&mut out[1..]).zip(2..width) {
            *out = centre * three[1] + side * (three[0] + three[2]);
        }
        out[0] = (centre + side) * row[0] + side * row[1];
        out[width - 1] = (centre + side) * row[width - 1] + side * row[width - 2];
    }
    let mut out = across.clone();
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        let row = |y: usize| &across[y * width..(y + 1) * width];
        let (above, here, below) = (row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1)));
        for (((out, a), h), b) in out.iter_mut().zip(above).zip(here).zip(below) {
            *out = centre * h + side * (a + b);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn softening_keeps_even_light_and_spreads_a_point() {
        let even = soften(&[2.0; 20], 5, 4, 0.6);
        assert!(even.iter().all(|v| (v - 2.0).abs() < 1e-6));
        let mut point = vec![0.0; 25];
        point[12] = 1.0;
        let out = soften(&point, 5, 5, 0.6);
        assert!((out.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(out[7] > 0.0 && out[6] > 0.0 && out[2] == 0.0);
    }
}
