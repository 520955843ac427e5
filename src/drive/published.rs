//! What was measured on the robot: M. C. Martin, *Evolving Visual Sonar: Depth From Monocular Images*, 2006,
//! "Validation on the robot".

/// Runs of one program in one building until the first collision.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Published {
    /// What it was evolved on.
    pub trained_on: &'static str,
    /// Where it drove.
    pub building: &'static str,
    /// How many runs, where that is said.
    pub runs: Option<u32>,
    /// The mean distance to collision, in metres.
    pub metres: f64,
    /// The mean time to collision, in seconds.
    pub seconds: f64,
    /// The longest distance, in metres, where that is said.
    pub longest_metres: Option<f64>,
    /// The longest time, in seconds, where that is said.
    pub longest_seconds: Option<f64>,
}

/// All that is said of distances.
pub const PUBLISHED: [Published; 2] = [
    Published {
        trained_on: "FMRB",
        building: "FMRB",
        runs: Some(5),
        metres: 133.0,
        seconds: 1201.0,
        longest_metres: Some(260.0),
        longest_seconds: Some(2372.0),
    },
    Published {
        trained_on: "both",
        building: "FMRB",
        runs: None,
        metres: 72.0,
        seconds: 600.0,
        longest_metres: None,
        longest_seconds: None,
    },
];
