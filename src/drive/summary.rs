//! Runs of one sensor, in a few numbers.

use super::accuracy::Accuracy;
use super::run::{End, Run};

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
    /// Collisions with what had been in view.
    pub in_view: usize,
    /// Those that reached the limit on time: their distances and times are lower bounds.
    pub unended: usize,
    /// Those that got stuck.
    pub stuck: usize,
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
    /// Of these runs, unless there are none.
    pub fn of(runs: &[Run]) -> Option<Summary> {
        let each = |value: fn(&Run) -> f64| Spread::of(&runs.iter().map(value).collect::<Vec<f64>>());
        let (metres, seconds) = (each(|run| run.metres)?, each(|run| run.seconds)?);
        let ended = |end: End| runs.iter().filter(|run| run.end == end).count();
        Some(Summary {
            runs: runs.len(),
            collisions: ended(End::Collision),
            in_view: runs.iter().filter(|run| run.hit.is_some_and(|hit| hit.in_view)).count(),
            unended: ended(End::Limit),
            stuck: ended(End::Stuck),
            metres,
            seconds,
            speed: if seconds.mean > 0.0 { metres.mean / seconds.mean } else { 0.0 },
            accuracy: runs.iter().filter_map(|run| run.accuracy).reduce(Accuracy::and),
        })
    }
}
