//! Runs of one sensor, in a few numbers.

use super::accuracy::Accuracy;
use super::run::{End, Hit, Run};

/// Mean and spread over runs.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// The standard deviation of the sample; 0 of a single run.
    pub deviation: f64,
    /// The greatest.
    pub longest: f64,
}

impl Spread {
    fn of(sample: &[f64]) -> Option<Spread> {
        let n = sample.len() as f64;
        let mean = sample.iter().sum::<f64>() / n;
        let squares: f64 = sample.iter().map(|value| (value - mean) * (value - mean)).sum();
        let deviation = if sample.len() > 1 { (squares / (n - 1.0)).sqrt() } else { 0.0 };
        let longest = sample.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (!sample.is_empty()).then_some(Spread { mean, deviation, longest })
    }
}

/// Runs of one sensor.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Summary {
    /// How many.
    pub runs: usize,
    /// Those that ended with a collision.
    pub collisions: usize,
    /// Collisions with somebody who walked into a robot that stood still or turned in place.
    pub walked_into: usize,
    /// Collisions with what had been in view.
    pub in_view: usize,
    /// Those that reached the limit on time: as distances and times to collision theirs are lower bounds.
    pub unended: usize,
    /// Those that got stuck: lower bounds too.
    pub stuck: usize,
    /// The way of all runs together, in metres.
    pub total_metres: f64,
    /// The same for each collision: the mean distance to collision, were collisions equally likely everywhere, which
    /// counts the runs without one for what they are. None without collisions.
    pub metres_per_collision: Option<f64>,
    /// Distances in metres, of all runs however they ended.
    pub metres: Spread,
    /// Times in seconds.
    pub seconds: Spread,
    /// The mean speed, in m/s.
    pub speed: f64,
    /// The answers of the detector on the way, if it is one.
    pub accuracy: Option<Accuracy>,
}

impl Summary {
    /// Whether some runs ended without a collision, so that distances and times to collision are lower bounds.
    pub const fn is_lower_bound(&self) -> bool {
        self.collisions < self.runs
    }
}

impl Summary {
    /// Of these runs, unless there are none.
    pub fn of(runs: &[Run]) -> Option<Summary> {
        let each = |value: fn(&Run) -> f64| Spread::of(&runs.iter().map(value).collect::<Vec<f64>>());
        let (metres, seconds) = (each(|run| run.metres)?, each(|run| run.seconds)?);
        let ended = |end: End| runs.iter().filter(|run| run.end == end).count();
        let hits =
            |which: fn(&Hit) -> bool| runs.iter().filter(|run| run.hit.as_ref().is_some_and(which)).count();
        let total_metres: f64 = runs.iter().map(|run| run.metres).sum();
        let collisions = ended(End::Collision);
        Some(Summary {
            runs: runs.len(),
            collisions,
            walked_into: hits(|hit| hit.walked_into),
            in_view: hits(|hit| hit.in_view),
            unended: ended(End::Limit),
            stuck: ended(End::Stuck),
            total_metres,
            metres_per_collision: (collisions > 0).then(|| total_metres / collisions as f64),
            metres,
            seconds,
            speed: if seconds.mean > 0.0 { metres.mean / seconds.mean } else { 0.0 },
            accuracy: runs.iter().filter_map(|run| run.accuracy).reduce(Accuracy::and),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::office::Thing;

    #[test]
    fn runs_without_a_collision_count_as_lower_bounds() {
        let run = |end, metres, walked_into| Run {
            number: 1,
            end,
            hit: (end == End::Collision).then_some(Hit {
                thing: Thing::Person,
                point: (0.0, 0.0),
                in_view: false,
                walked_into,
            }),
            metres,
            seconds: 10.0,
            turning: 0.0,
            squares: 1,
            accuracy: None,
            path: Vec::new(),
        };
        let hit = [run(End::Collision, 30.0, true), run(End::Collision, 10.0, false)];
        let sum = Summary::of(&hit).expect("runs");
        assert_eq!((sum.collisions, sum.walked_into, sum.metres_per_collision), (2, 1, Some(20.0)));
        assert!(!sum.is_lower_bound());
        for end in [End::Limit, End::Stuck] {
            let sum = Summary::of(&[&hit[..1], &[run(end, 50.0, false)]].concat()).expect("runs");
            assert_eq!((sum.total_metres, sum.metres_per_collision), (80.0, Some(80.0)));
            assert!(sum.is_lower_bound());
            let none = Summary::of(&[run(end, 50.0, false)]).expect("a run");
            assert_eq!((none.metres_per_collision, none.is_lower_bound()), (None, true));
        }
    }
}
