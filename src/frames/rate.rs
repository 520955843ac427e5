//! How many frames a second there are.

use std::fmt;
use std::str::FromStr;

/// Frames a second, as a fraction, for a camera's rate may be 30000/1001.
///
/// ```
/// use vsonar::frames::Rate;
/// let rate: Rate = "30000/1001".parse()?;
/// assert_eq!(rate.to_string(), "30000:1001");
/// assert_eq!(rate.seconds(30_000), 1001.0);
/// assert_eq!("12.5".parse::<Rate>()?.to_string(), "25:2");
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    frames: u32,
    seconds: u32,
}

impl Rate {
    /// So many frames in so many seconds, in lowest terms; none if either is 0.
    pub const fn new(frames: u32, seconds: u32) -> Option<Rate> {
        if frames == 0 || seconds == 0 {
            return None;
        }
        let (mut a, mut b) = (frames, seconds);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        Some(Rate { frames: frames / a, seconds: seconds / a })
    }

    /// The time of a frame in seconds, the first one's being 0.
    pub fn seconds(self, frame: u64) -> f64 {
        frame as f64 * f64::from(self.seconds) / f64::from(self.frames)
    }
}

impl fmt::Display for Rate {
    /// As Y4M has it: `30:1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.frames, self.seconds)
    }
}

impl FromStr for Rate {
    type Err = String;

    /// Reads `30`, `29.97` (to three decimals), `30000/1001` or `30000:1001`.
    fn from_str(text: &str) -> Result<Rate, String> {
        let rate = match text.split_once(['/', ':']) {
            Some((frames, seconds)) => {
                frames.parse().ok().zip(seconds.parse().ok()).and_then(|(f, s)| Rate::new(f, s))
            }
            None => {
                let thousandths = text.parse::<f64>().ok().map(|rate| (rate * 1000.0).round());
                let fits = thousandths.filter(|t| (1.0..=f64::from(u32::MAX)).contains(t));
                fits.and_then(|t| Rate::new(t as u32, 1000))
            }
        };
        rate.ok_or_else(|| "write frames a second, as in 30, 29.97 or 30000/1001".to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_rate_is_refused() {
        for wrong in ["", "0", "0/1", "1/0", "-3", "nan", "inf", "1e300", "3/", "/", "0.0001", "1:2:3"] {
            assert!(wrong.parse::<Rate>().is_err(), "{wrong}");
        }
        assert_eq!("29.97".parse(), Ok(Rate { frames: 2997, seconds: 100 }));
        assert_eq!("60:2".parse(), Ok(Rate { frames: 30, seconds: 1 }));
    }
}
