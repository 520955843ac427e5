//! `vsonar evolve --runs`: several seeds.

use crate::common::*;

#[test]
fn each_run_is_that_of_its_seed() {
    let place = Place::new();
    let flags = ["--seed", "4", "--train-match", "drive_a*", "--holdout-match", "drive_b*"];
    let text = place.ok(&tiny(&[&flags[..], &["--runs", "3", "--jobs", "2", "--out", "all"]].concat()));
    for part in ["seeds 4 to 6", "median", "quartiles", "held out", "best.gp", "all/seed-"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    for seed in ["4", "5", "6"] {
        let one = [&flags[2..], &["--seed", seed, "--out", seed, "--quiet"]].concat();
        place.ok(&tiny(&one));
        assert_eq!(recorded(&place.path(seed)), recorded(&place.path(&format!("all/seed-{seed}"))));
        let settings = |run: &str| place.read(&format!("{run}/settings.toml"));
        assert_eq!(settings(seed), settings(&format!("all/seed-{seed}")));
    }
    // Without a name, each is in a folder as of a single run; altered copies are each run's own.
    let json = place.ok(&tiny(&["--runs", "2", "--set", "augmentation.mirror=0.5", "--json", "--quiet"]));
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let runs = json["runs"].as_array().expect("a list");
    assert_eq!((&runs[0]["run"], &runs[1]["run"]), (&"runs/data-seed-1".into(), &"runs/data-seed-2".into()));
    assert!(json["train"]["median"].is_number() && json["holdout"].is_null());
    place.ok(&tiny(&["--seed", "2", "--set", "augmentation.mirror=0.5", "--out", "2", "--quiet"]));
    // The name of the last folder differs, all else is one.
    assert_eq!(recorded(&place.path("2")), recorded(&place.path("runs/data-seed-2")));
}

#[test]
fn collapsed_runs_are_told() {
    let place = Place::new();
    let runs = [HOPELESS, &["--runs", "2", "--out", "all"]].concat();
    let text = place.ok(&tiny(&[&runs[..], &["--quiet"]].concat()));
    let json = place.ok(&tiny(&[&runs[..], &["--quiet", "--json"]].concat()));
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let told =
        json["runs"].as_array().expect("a list").iter().filter(|run| run["warning"].is_object()).count();
    assert!(
        told > 0 && text.contains(&format!("Warning: {told} of 2 runs ended collapsed (all/seed-")),
        "{text}"
    );
}

#[test]
fn the_same_command_goes_on() {
    let place = Place::new();
    let all = tiny(&["--runs", "3", "--out", "all", "--quiet"]);
    let first = place.ok(&all);
    let whole: Vec<Recorded> =
        (1..=3).map(|seed| recorded(&place.path(&format!("all/seed-{seed}")))).collect();
    std::fs::remove_dir_all(place.path("all/seed-2")).expect("there");
    std::fs::remove_file(place.path("all/seed-3/checkpoint")).expect("there");
    let again = place.ok(&all);
    let scores = |text: &str| -> Vec<String> {
        let column = |line: &str| line.split_whitespace().take(3).collect::<Vec<_>>().join(" ");
        text.lines().filter(|line| line.contains(" % ")).map(column).collect()
    };
    assert_eq!(scores(&first), scores(&again));
    for (seed, whole) in (1..=3).zip(&whole) {
        assert_eq!(&recorded(&place.path(&format!("all/seed-{seed}"))), whole);
    }
    // More generations are more of the same runs; other settings are other runs.
    place.ok(&tiny(&["--runs", "3", "--out", "all", "--quiet", "--generations", "6"]));
    assert_eq!(recorded(&place.path("all/seed-3")).log.len(), 6);
    let error = place.fails(1, &tiny(&["--runs", "3", "--out", "all", "--set", "selection.tournament=3"]));
    assert!(error.contains("all/seed-1") && error.contains("--settings"), "{error}");
}

#[test]
fn wrong_usage_is_named() {
    let place = Place::new();
    for (flags, said) in [
        (&["--runs", "0"][..], "--runs"),
        (&["--jobs", "2"], "--runs"),
        (&["--runs", "2", "--seed", "9223372036854775807"], "seed"),
    ] {
        let error = place.fails(2, &tiny(flags));
        assert!(error.contains(said), "{said}: {error}");
    }
    let error = place.fails(2, &["evolve", "--resume", "x", "--runs", "2"]);
    assert!(error.contains("--runs"), "{error}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_saves_all_and_says_how_to_go_on() {
    use std::process::Stdio;
    let place = Place::new();
    let several = ["--population", "400", "--runs", "3", "--jobs", "2"];
    for out in [&["--out", "parts"][..], &[]] {
        let endless = [&several, ENDLESS, out, &["--executor", "tree"]].concat();
        let mut command = place.command(&tiny(&endless));
        let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
        let folder = |seed| {
            let folders = if out.is_empty() { "runs/data-seed-" } else { "parts/seed-" };
            place.path(&format!("{folders}{seed}"))
        };
        crate::interruption::wait_until("a generation", || {
            assert!(run.try_wait().expect("it can be asked").is_none(), "it ended early");
            logged(&folder(1)) > 0
        });
        crate::interruption::interrupt(&run);
        let output = run.wait_with_output().expect("it ends");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(130), "{said}");
        let begun: Vec<u32> = (1..=3).filter(|&seed| folder(seed).exists()).collect();
        let most = begun.iter().map(|&seed| logged(&folder(seed))).max().expect("one at least");
        begun.iter().for_each(|&seed| end_after(&folder(seed), most + 2));
        let generations = (most + 2).to_string();
        let whole = [&several[..], &["--generations", &generations, "--quiet", "--out"]].concat();
        if out.is_empty() {
            assert!(said.contains("vsonar evolve --resume runs/data-seed-1"), "{said}");
            place.ok(&["evolve", "--resume", "runs/data-seed-1", "--quiet"]);
            place.ok(&tiny(&[&whole[..], &["whole-1"]].concat()));
            assert_eq!(recorded(&folder(1)), recorded(&place.path("whole-1/seed-1")));
        } else {
            assert!(said.contains("--out parts"), "{said}");
            place.ok(&tiny(&[&whole[..], &["parts"]].concat()));
            place.ok(&tiny(&[&whole[..], &["whole"]].concat()));
            for seed in 1..=3 {
                assert_eq!(recorded(&folder(seed)), recorded(&place.path(&format!("whole/seed-{seed}"))));
            }
        }
    }
}
