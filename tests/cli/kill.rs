//! A run that is killed, at any moment and again and again, comes to the same end.

use std::process::Stdio;
use std::time::Duration;

use crate::common::*;

#[test]
fn killed_at_random_moments_it_comes_to_the_same_end() {
    let seed = Dice::seed();
    let mut dice = Dice(seed);
    println!("seed {seed}");
    let place = Place::new();
    let start = |out| {
        tiny(&["--generations", "8", "--population", "60", "--quiet", "--executor", "tree", "--out", out])
    };
    let begun = std::time::Instant::now();
    place.ok(&start("whole"));
    let whole = begun.elapsed().as_millis() as u64;
    let (mut kills, mut attempts) = (0, 0);
    loop {
        attempts += 1;
        assert!(attempts < 200, "seed {seed}: it does not come to an end");
        let fresh = !place.path("parts").exists();
        let resume = vec!["evolve", "--resume", "parts", "--quiet", "--executor", "tree"];
        let arguments = if fresh { start("parts") } else { resume };
        let mut command = place.command(&arguments);
        let mut run = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("started");
        // At first a fraction of a run, so that many a generation is hit; then ever more, so that it ends.
        let patience = 1 + whole / 3 + whole * attempts / 40;
        std::thread::sleep(Duration::from_millis(dice.below(patience)));
        run.kill().expect("it can be killed");
        let output = run.wait_with_output().expect("it ends");
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(complaint.is_empty(), "seed {seed}, attempt {attempts}: {complaint}");
        if output.status.success() {
            break;
        }
        kills += 1;
    }
    println!("{kills} kills");
    assert!(kills >= 3, "seed {seed}: only {kills} kills");
    assert_eq!(recorded(&place.path("whole")), recorded(&place.path("parts")), "seed {seed}");
}
