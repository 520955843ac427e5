//! `vsonar sweep` on files that are wrong, and on results that do not belong to them.

use crate::common::*;
use crate::sweep::{DATA, SMALL};

const ONE: &str = "[[setting]]\nname = \"default\"\n";

#[test]
fn faults_of_the_file_are_named_with_place_and_remedy() {
    let sound = [SMALL, DATA, ONE].concat();
    let place = Place::new();
    let after = |text: &str| format!("{sound}{text}");
    // 100 to the power of 10 points, which no machine can count.
    let values = (2..102).map(|i| i.to_string()).collect::<Vec<_>>().join(", ");
    let large: String = (0..10).map(|i| format!("axis_{i} = [{values}]\n")).collect();
    for (text, line, said) in [
        ("seeds = [".to_string(), 1, "sweep --help"),
        (format!("sedes = 1\n{sound}"), 1, "unknown field `sedes`"),
        (format!("seeds = \"3-1\"\n{sound}"), 1, "1-5,9"),
        (format!("seeds = []\n{sound}"), 1, "1-5,9"),
        (format!("\nbaseline = \"none\"\n{sound}"), 2, "`none`"),
        (format!("preset = \"papers\"\n{sound}"), 1, "paper"),
        ([SMALL, ONE].concat(), 1, "[[data]]"),
        (after(DATA), 17, "two data sets"),
        (after("[[data]]\nname = \"x\"\n"), 16, "[data.folder]"),
        (
            sound.replace("train_match = \"drive_a*\"\n", ""),
            8,
            "`made up`: `holdout_match` needs `train_match`",
        ),
        (sound.replace("train_match", "holdout_part = \"25%\"\ntrain_match"), 8, "only one can be given"),
        (
            sound.replace("train_match", "validation_part = \"250%\"\ntrain_match"),
            8,
            "`validation_part`: `250%`",
        ),
        (after("[[data]]\nname = \"x\"\nfolder.train = \"a\"\nfolder.trian = \"b\"\n"), 19, "trian"),
        (after("[[data]]\nname = \" x\"\nsynthetic = {}\n"), 17, "name"),
        (after(ONE), 16, "two settings `default`"),
        (after("[[setting]]\npopulation = 5\n"), 16, "no name"),
        (after("[[setting]]\nname = \"x\"\npopulatoin = 5\n"), 18, "unknown field `populatoin`"),
        (after("[[setting]]\nname = \"x\"\npopulation = 1\n"), 18, "`population`"),
        (after("[[setting]]\nname = \"x\"\nselection.kind = \"best\"\n"), 18, "lexicase"),
        (after("[[setting]]\nname = \"x\"\nseed = 5\n"), 18, "seeds = "),
        (after("[[setting]]\nname = \"x\"\nedit_nodes = \"raw\"\n"), 18, "`-name`"),
        (after("[[setting]]\nname = \"x\"\nnodes.rawr = 0\n"), 18, "rawr"),
        (after("[grid]\n\"selection.size\" = [1]\n"), 17, "unknown field"),
        (after("[grid]\n\"selection.tournament\" = 3\n"), 17, "list"),
        (after("[grid]\n\"selection.tournament\" = [3, 0]\n"), 17, "`selection.tournament`"),
        (after("[grid]\nseed = [3, 0]\n"), 17, "seed"),
        (after("[[setting]]\nname = \"x\"\n"), 16, "`default` and `x` are the same settings"),
        (after("[[setting]]\nname = \"x\"\nselection.kind = \"lexicase\"\n"), 16, "`default` and `x`"),
        (
            after("[grid]\n\"filter.max_draws\" = [3, 4]\n\"filter.enabled\" = [true, true]\n"),
            14,
            "`default, filter.max_draws=3, filter.enabled=true`",
        ),
        (after("[grid]\nfilter.max_draws = [3]\n\"filter.max_draws\" = [4]\n"), 18, "one list"),
        (after(&("[grid]\n".to_string() + &large)), 17, "10,000"),
        (
            format!("baseline = \"default\"\n{sound}[grid]\n\"selection.tournament\" = [3, 4]\n"),
            1,
            "`default, selection.tournament=3`; `default, selection.tournament=4`",
        ),
        (sound.replace("[settings]", "[settings]\npreset = \"paper\""), 2, "above"),
        (sound.replace("tolerance = 10", "tolerance = \"3\""), 2, "string"),
    ] {
        place.write("spec.toml", &text);
        let error = place.fails(1, &["sweep", "spec.toml", "--dry-run"]);
        assert!(error.contains(&format!("spec.toml:{line}:")), "{line}: {error}\n{text}");
        assert!(error.contains(said), "{said}: {error}\n{text}");
    }
}

#[test]
fn wrong_usage_is_named() {
    let place = Place::new();
    place.write("spec.toml", [SMALL, DATA, ONE].concat());
    for (flags, said) in [
        (&["--seeds", "x"][..], "--seeds"),
        (&["--only", "other"], "`default`"),
        (&["--data", "data"], "NAME=DIR"),
        (&["--data", "other=data"], "made up"),
        (&["--jobs", "0"], "--jobs"),
    ] {
        let error = place.fails(2, &[&["sweep", "spec.toml"], flags].concat());
        assert!(error.contains(said), "{said}: {error}");
    }
    let error = place.fails(1, &["sweep", "none.toml"]);
    assert!(error.contains("none.toml") && error.contains("check the path"), "{error}");
    place.write("built-in.toml", "[[data]]\nname = \"x\"\nsynthetic = {}\n");
    let error = place.fails(2, &["sweep", "built-in.toml", "--data", "x=data"]);
    assert!(error.contains("built in"), "{error}");
}

#[test]
fn results_are_never_mixed() {
    let place = Place::new();
    place.write("spec.toml", ["seeds = 1\n", SMALL, DATA, ONE].concat());
    place.ok(&["sweep", "spec.toml", "--quiet"]);
    // Other settings of the same name; the number of generations is one too.
    for (from, to, told) in [
        ("population = 40", "population = 41", "`population` was 40, now 41"),
        ("generations = 3", "generations = 4", "`generations` was 3, now 4"),
    ] {
        place.write("spec.toml", ["seeds = 1\n", &SMALL.replace(from, to), DATA, ONE].concat());
        let error = place.fails(1, &["sweep", "spec.toml"]);
        for part in ["results.csv", "`default`", "seed 1", "--out", told] {
            assert!(error.contains(part), "{part}: {error}");
        }
    }
    // Other data of the same name.
    place.write("spec.toml", ["seeds = 1\n", SMALL, DATA, ONE].concat());
    let table = place.read("data/labels.csv");
    let (head, last) = table.trim_end().rsplit_once('\n').expect("there are labels");
    assert!(!last.is_empty());
    place.write("data/labels.csv", format!("{head}\n"));
    // The last label is of the held-out drive, at which nobody has looked yet.
    place.ok(&["sweep", "spec.toml", "--test", "--quiet"]);
    place.write("data/labels.csv", &table);
    let error = place.fails(1, &["sweep", "spec.toml"]);
    assert!(error.contains("results.csv") && error.contains("`made up`"), "{error}");
    place.write("data/labels.csv", format!("{}\n", head.replacen("drive_a_0.png,8,", "drive_a_0.png,9,", 1)));
    let error = place.fails(1, &["sweep", "spec.toml"]);
    assert!(error.contains("images or labels"), "{error}");
}

#[test]
fn files_of_others_are_left_alone() {
    let place = Place::new();
    let text = ["seeds = 1\n", SMALL, DATA, ONE].concat();
    place.write("spec.toml", &text);
    place.write("other.toml", text.replace("seeds = 1", "seeds = 2"));
    for spec in ["other.toml", "spec.toml"] {
        let error = place.fails(1, &["sweep", spec, "--out", "."]);
        assert!(error.contains("spec.toml: is there") && error.contains("--out"), "{error}");
    }
    std::fs::create_dir(place.path("mine")).expect("writable");
    for table in ["image,x,y\na.png,1,2", "image,x"] {
        place.write("mine/results.csv", table);
        let error = place.fails(1, &["sweep", "spec.toml", "--out", "mine"]);
        assert!(error.contains("results.csv:1:") && error.contains("--out"), "{error}");
    }
    // A sweep that was killed before its first row had left its lock.
    std::fs::create_dir_all(place.path("sweeps/spec")).expect("writable");
    place.write("sweeps/spec/lock", "");
    place.write("sweeps/spec/spec.toml", "of the killed one");
    place.ok(&["sweep", "spec.toml", "--quiet"]);
    assert_eq!(place.read("sweeps/spec/spec.toml"), text);
}

#[test]
fn faults_met_later_are_named_too() {
    let place = Place::new();
    let text = ["seeds = 1\n", SMALL, DATA, ONE].concat();
    place.write("spec.toml", &text);
    place.ok(&["sweep", "spec.toml", "--quiet"]);
    let results = place.read("sweeps/spec/results.csv");
    let program = results.find("(individual").expect("a program");
    place.write(
        "sweeps/spec/results.csv",
        format!("{}(individuum{}", &results[..program], &results[program + 11..]),
    );
    let output = place.command(&["sweep", "spec.toml", "--test"]).output().expect("started");
    let error = one_error(&output, 1);
    for part in ["results.csv", "`made up`", "`default`", "seed 1", "take the line out"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    place.write("other.toml", text.replace("drive_b*", "nothing*"));
    let error = place.fails(1, &["sweep", "other.toml"]);
    assert!(error.contains("other.toml:10:8: data set `made up`: "), "{error}");
}
