//! A run that is killed, at any moment and again and again, comes to the same end.

use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::common::*;

/// Far longer than a generation takes.
const LIMIT: Duration = Duration::from_secs(300);
const KILLS: u32 = 12;

#[test]
fn killed_at_random_moments_it_comes_to_the_same_end() {
    let seed = Dice::seed();
    let mut dice = Dice(seed);
    println!("seed {seed}");
    let place = Place::new();
    let more = ["--population", "60", "--quiet", "--executor", "tree"];
    let parts = place.path("parts");
    for kill in 1..=KILLS {
        let resume = ["evolve", "--resume", "parts", "--quiet", "--executor", "tree"];
        let fresh = !parts.exists();
        let arguments =
            if fresh { tiny(&[&more[..], ENDLESS, &["--out", "parts"]].concat()) } else { resume.to_vec() };
        let mut command = place.command(&arguments);
        let mut run = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("started");
        // While it starts, or so many generations on; and then somewhere in the midst of one.
        let (further, start) = (logged(&parts) + dice.below(4) as usize, Instant::now());
        while logged(&parts) < further && run.try_wait().expect("it can be asked").is_none() {
            assert!(start.elapsed() < LIMIT, "seed {seed}, kill {kill}: no generation");
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(Duration::from_micros(dice.below(30_000)));
        run.kill().expect("it can be killed");
        let output = run.wait_with_output().expect("it ends");
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(complaint.is_empty(), "seed {seed}, kill {kill}: {complaint}");
        assert_eq!(output.status.code(), None, "seed {seed}, kill {kill}: it ended by itself");
    }
    let generations = logged(&parts) + 2;
    println!("killed {KILLS} times, {generations} generations");
    end_after(&parts, generations);
    place.ok(&["evolve", "--resume", "parts", "--quiet", "--executor", "tree"]);
    let left = place.everything().into_iter().map(|(path, _)| path);
    let hidden =
        |path: &std::path::PathBuf| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
    assert_eq!(left.filter(hidden).collect::<Vec<_>>(), [""; 0].map(std::path::PathBuf::from), "seed {seed}");
    place.ok(&tiny(&[&more[..], &["--generations", &generations.to_string(), "--out", "whole"]].concat()));
    assert_eq!(recorded(&place.path("whole")), recorded(&parts), "seed {seed}");
}
