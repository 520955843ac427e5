//! Prints the rows that an exported detector finds in frames from standard input, a line for each frame.
//!
//! ```sh
//! vsonar export best.gp --name detector --out detector
//! DETECTOR_DIR=$PWD/detector cargo run --release --manifest-path rust/Cargo.toml < frame.pgm
//! ```
//!
//! The frames are PGM or raw gray pixels, of the detector's size. The argument is the number of columns, spread evenly
//! over the image; 12 if none is given.

mod detector;
mod frames;

use std::io::{self, BufReader, Write};
use std::process::ExitCode;

use detector::Detector;
use frames::Frames;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let detector = Detector::new()?;
    let n = match std::env::args().nth(1) {
        None => 12,
        Some(text) => match text.parse() {
            Ok(n) if (1..=detector.width()).contains(&n) => n,
            _ => {
                return Err(format!(
                    "the number of columns has to be 1 to {}, not '{text}'",
                    detector.width()
                ))
            }
        },
    };
    // The image is cut into n strips of one width; the column in the middle of each is looked at.
    let columns: Vec<i32> = (0..n).map(|i| ((2 * i + 1) * detector.width() / (2 * n)) as i32).collect();

    let mut frames = Frames::new(BufReader::new(io::stdin().lock()), detector.width(), detector.height());
    let mut output = io::stdout().lock();
    let mut seen = 0;
    while let Some(frame) = frames.next().map_err(|e| format!("frame {seen}: {e}"))? {
        let rows: Vec<String> = detector.detect(&frame, &columns)?.iter().map(f32::to_string).collect();
        // Whoever listens wants this frame now, not when a buffer is full.
        let written = writeln!(output, "{}", rows.join(" ")).and_then(|()| output.flush());
        written.map_err(|e| format!("cannot write to standard output: {e}"))?;
        seen += 1;
    }
    if seen == 0 {
        return Err("there is no frame on standard input".into());
    }
    Ok(())
}
