//! How long frames took and how many there were, in fixed memory, however long the camera runs.

use std::time::{Duration, Instant};

use super::output::count;
use super::table::Table;

/// Durations counted in classes that are at most 1/64 of their value wide, from nanoseconds to centuries.
#[derive(Debug, Clone)]
struct Latencies {
    classes: Vec<u64>,
    count: u64,
    largest: Duration,
}

/// Binary digits of a duration that a class tells apart, the leading one not counted.
const DIGITS: u32 = 6;

impl Default for Latencies {
    fn default() -> Latencies {
        Latencies { classes: vec![0; class(u64::MAX) + 1], count: 0, largest: Duration::ZERO }
    }
}

/// The class of a number of nanoseconds.
fn class(nanoseconds: u64) -> usize {
    let exponent = (u64::BITS - nanoseconds.leading_zeros()).saturating_sub(DIGITS + 1);
    // Below 2^7 each number is a class of its own; from there on the leading digits count.
    ((exponent as usize) << DIGITS) + (nanoseconds >> exponent) as usize
}

/// The largest number of nanoseconds in a class.
fn upper_end(class: usize) -> u64 {
    let exponent = (class >> DIGITS).saturating_sub(1) as u32;
    let leading = (class as u64) - (u64::from(exponent) << DIGITS);
    (leading << exponent) | ((1u64 << exponent) - 1)
}

impl Latencies {
    fn add(&mut self, latency: Duration) {
        self.classes[class(u64::try_from(latency.as_nanos()).unwrap_or(u64::MAX))] += 1;
        self.count += 1;
        self.largest = self.largest.max(latency);
    }

    /// What this share of the durations does not exceed, rounded up to the end of a class.
    fn quantile(&self, share: f64) -> Duration {
        let rank = (share * self.count as f64).ceil().max(1.0) as u64;
        let mut below = 0;
        for (class, &count) in self.classes.iter().enumerate() {
            below += count;
            if below >= rank {
                return Duration::from_nanos(upper_end(class)).min(self.largest);
            }
        }
        self.largest
    }

    /// Median, 95th percentile and largest in milliseconds, for people.
    fn cells(&self) -> [String; 3] {
        [self.quantile(0.5), self.quantile(0.95), self.largest].map(|time| {
            let milliseconds = 1e3 * time.as_secs_f64();
            format!("{milliseconds:.*}", if milliseconds < 10.0 { 3 } else { 1 })
        })
    }
}

/// What has been done so far.
pub(crate) struct Tally {
    start: Instant,
    /// Frames answered.
    pub(crate) frames: u64,
    /// Frames that were read and not looked at.
    pub(crate) dropped: u64,
    /// Frames recorded, if any are to be.
    pub(crate) kept: Option<u64>,
    detection: Latencies,
    answered: Latencies,
    written: Latencies,
}

impl Tally {
    /// Nothing yet; the time counts from now on.
    pub(crate) fn start() -> Tally {
        Tally {
            start: Instant::now(),
            frames: 0,
            dropped: 0,
            kept: None,
            detection: Latencies::default(),
            answered: Latencies::default(),
            written: Latencies::default(),
        }
    }

    /// Counts a frame: how long the detector took, and how long after it had been read the answers were known and
    /// written.
    pub(crate) fn frame(&mut self, detection: Duration, answered: Duration, written: Duration) {
        self.frames += 1;
        self.detection.add(detection);
        self.answered.add(answered);
        self.written.add(written);
    }

    /// What people are told at the end, without the end of its last line.
    pub(crate) fn summary(&self) -> String {
        let seconds = self.start.elapsed().as_secs_f64();
        let mut text = format!(
            "{} in {seconds:.1} s, {:.1} frames/s",
            count(self.frames, "frame"),
            self.frames as f64 / seconds.max(1e-9)
        );
        if self.dropped > 0 {
            text += &format!("; {} dropped", count(self.dropped, "further one"));
        }
        if let Some(kept) = self.kept {
            text += &format!("; {kept} recorded");
        }
        if self.frames == 0 {
            return text;
        }
        let mut table = Table::new(1, &["milliseconds", "median", "95 %", "largest"]);
        for (what, latencies) in [
            ("detection", &self.detection),
            ("frame read to answers known", &self.answered),
            ("frame read to output written", &self.written),
        ] {
            table.row(std::iter::once(what.to_string()).chain(latencies.cells()));
        }
        format!("{text}\n{table}").trim_end().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_narrow_and_without_gaps() {
        let mut numbers: Vec<u64> = (0..100_000).collect();
        for shift in 0..64 {
            let power = 1u64 << shift;
            numbers.extend([power - 1, power, power + power / 3, power | power / 2]);
        }
        for n in numbers.into_iter().chain([u64::MAX]) {
            let end = upper_end(class(n));
            assert!(end >= n && end - n <= n / 64, "{n}: {end}");
            assert_eq!(class(end), class(n));
            assert!(end == u64::MAX || class(end + 1) == class(n) + 1, "{n}");
        }
    }

    #[test]
    fn quantiles_are_near_the_true_ones() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.quantile(0.5), Duration::ZERO);
        // 1 to 1,000 microseconds, in some order.
        (0..1000u64).for_each(|i| latencies.add(Duration::from_micros(i * 387 % 1000 + 1)));
        for (share, exact) in [(0.5, 500.0), (0.95, 950.0), (0.001, 1.0)] {
            let found = 1e6 * latencies.quantile(share).as_secs_f64();
            assert!((exact..exact * 1.016).contains(&found), "{share}: {found}");
        }
        assert_eq!(latencies.cells()[2], "1.000");
    }
}
