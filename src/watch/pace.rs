//! How fast generations come, of all runs together.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// When the last generations were complete.
#[derive(Debug, Clone, Default)]
pub(super) struct Pace {
    times: VecDeque<Instant>,
}

impl Pace {
    /// How many intervals an estimate looks back on.
    const WINDOW: usize = 12;

    /// A generation is complete.
    pub(super) fn tick(&mut self, now: Instant) {
        self.times.push_back(now);
        if self.times.len() > Pace::WINDOW + 1 {
            self.times.pop_front();
        }
    }

    /// How long so many generations take. The initial one is unlike the others, so it takes two to tell.
    pub(super) fn left(&self, generations: u64, now: Instant) -> Option<Duration> {
        let (first, last) = (self.times.front()?, self.times.back()?);
        let intervals = self.times.len() - 1;
        if intervals == 0 {
            return None;
        }
        let mean = last.duration_since(*first).as_secs_f64() / intervals as f64;
        let left = mean * generations as f64 - now.saturating_duration_since(*last).as_secs_f64();
        Duration::try_from_secs_f64(left.max(0.0)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_at_the_pace_of_recent_generations() {
        let start = Instant::now();
        let at = |seconds: u64| start + Duration::from_secs(seconds);
        let mut pace = Pace::default();
        assert_eq!(pace.left(3, start), None);
        pace.tick(at(100));
        assert_eq!(pace.left(3, at(100)), None);
        for i in 1..=Pace::WINDOW as u64 {
            pace.tick(at(100 + 50 * i));
        }
        assert_eq!(pace.left(3, at(700)), Some(Duration::from_secs(150)));
        let end = 700 + 2 * Pace::WINDOW as u64;
        (701..=end).filter(|i| i % 2 == 0).for_each(|i| pace.tick(at(i)));
        assert_eq!(pace.left(3, at(end)), Some(Duration::from_secs(6)), "the slow ones are long ago");
        assert_eq!(pace.left(3, at(end + 1)), Some(Duration::from_secs(5)));
        assert_eq!(pace.left(3, at(end + 60)), Some(Duration::ZERO));
    }
}
