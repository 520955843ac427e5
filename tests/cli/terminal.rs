//! The terminal: what is shown from the first moment, that it fits, and that nothing from outside gives it orders.

use vsonar::dataset::{Case, Dataset, NamedImage};

use crate::common::*;

/// Names that a file system takes and a terminal must not: a line that fakes a message, colours, a title, an 8-bit
/// sequence, and an override of the direction of writing.
const EVIL: [&str; 4] = [
    "a\nnote: all is lost.png",
    "b\u{1b}[2J\u{1b}]0;title\u{7}.png",
    "c\u{9b}31m\u{7f}.png",
    "d\u{202e}gnp.\u{2066}e.png",
];

/// The names as they are shown.
const SHOWN: [&str; 4] = [
    r"a\nnote: all is lost.png",
    r"b\u{1b}[2J\u{1b}]0;title\u{7}.png",
    r"c\u{9b}31m\u{7f}.png",
    r"d\u{202e}gnp.\u{2066}e.png",
];

/// A place with a data set `evil` whose images have such names, and a program.
#[cfg(unix)]
fn evil() -> Place {
    let place = Place::new();
    let set = dataset(4, 0);
    let named = |(image, name): (&NamedImage, &str)| NamedImage { name: name.into(), ..image.clone() };
    let images = set.images().iter().zip(EVIL).map(named).collect();
    let cases: Vec<Case> = set.cases().to_vec();
    Dataset::new("evil", images, cases).expect("a sound set").save(place.path("evil")).expect("writable");
    place.write("p.gp", "(individual (iterate-up 2x2 x-obstacle (set-a y)))");
    place
}

#[cfg(unix)]
#[test]
fn names_give_no_orders_to_the_terminal() {
    let place = evil();
    let held = |text: &str, names: &[&str]| {
        assert!(plain(text), "{text:?}");
        for name in names {
            assert!(text.contains(name), "no {name} in {text}");
        }
        assert!(!text.lines().any(|line| line.starts_with("note: all")), "{text}");
    };
    held(&place.ok(&["eval", "p.gp", "--data", "evil", "--tolerance", "0"]), &SHOWN);
    for (i, shown) in SHOWN.iter().enumerate() {
        let trace = format!("--trace={}", i + 1);
        held(&place.ok(&["explain", "p.gp", "--data", "evil", &trace]), &[shown]);
    }
    let error = place.fails(1, &["explain", "p.gp", "--data", "evil", "--trace=\u{1b}x"]);
    held(&error, &[r"\u{1b}x", SHOWN[0]]);
    // JSON says the same names, and nothing of them is raw.
    let json = place.ok(&["eval", "p.gp", "--data", "evil", "--json"]);
    assert!(plain(&json), "{json:?}");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let names: Vec<&str> =
        json["images"].as_array().expect("a list").iter().filter_map(|i| i["image"].as_str()).collect();
    assert_eq!(names, EVIL);
    let output = place.command(&["run", "p.gp", "--input", "evil/images"]).output().expect("started");
    let lines = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(plain(&lines), "{lines:?}");
    let names: Vec<String> = lines
        .lines()
        .filter_map(|line| {
            serde_json::from_str::<serde_json::Value>(line).ok()?["image"].as_str().map(String::from)
        })
        .collect();
    assert_eq!(names, EVIL);
    // Images without labels, and those that are faulty.
    let table = place.read("evil/labels.csv");
    let labelled: String = table.lines().take(1).map(|line| format!("{line}\n")).collect();
    std::fs::write(place.path("evil/labels.csv"), labelled + "\"e\u{1b}[1m\nx.png\",8,1\n")
        .expect("writable");
    let output = place.command(&["data", "check", "evil"]).output().expect("started");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    held(&text, &SHOWN);
    held(&text, &[r"`e\u{1b}[1m\nx.png`"]);
    held(&place.fails(1, &["eval", "p.gp", "--data", "evil"]), &[r"`e\u{1b}[1m\nx.png`"]);
}

#[cfg(unix)]
#[test]
fn names_of_folders_and_runs_give_no_orders() {
    let place = evil();
    let folder = "f\u{1b}[31m\ng";
    std::fs::rename(place.path("evil"), place.path(folder)).expect("possible");
    let run = "r\u{9b}1m";
    let shown = [r"f\u{1b}[31m\ng", r"r\u{9b}1m"];
    let (text, aside) = place.ok_with_progress(
        &[&["evolve", "--data", folder, "--out", run, "--validation", "fold:1/2"], TINY].concat(),
    );
    assert!(plain(&text) && plain(&aside), "{text:?}{aside:?}");
    assert!(shown.iter().all(|name| text.contains(name)), "{text}");
    let text = place.ok(&["show", run, "--data", folder, "--out", "pictures\u{1b}"]);
    assert!(plain(&text) && text.contains(r"pictures\u{1b}: 4 pictures"), "{text:?}");
    let text = place.ok(&["report", run, "--no-rivals", "--no-explain"]);
    assert!(plain(&text) && text.contains(shown[1]), "{text:?}");
    let page = place.read(&format!("{run}/report.html"));
    assert!(plain(&page), "no hidden characters in a page");
    assert!(SHOWN.iter().any(|name| page.contains(name)) && page.contains(shown[1]), "{page}");
    for command in [&["eval", "no\u{1b}[1m\nsuch"][..], &["data", "check", "no\u{1b}[1m\nsuch"]] {
        let output = place.command(command).output().expect("started");
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8(said).expect("UTF-8");
        assert!(plain(&said) && said.contains(r"no\u{1b}[1m\nsuch"), "{said:?}");
    }
    // What clap complains of, too.
    let error = place.fails(2, &["eval", "--no\u{9b}\u{202e}such"]);
    assert!(error.contains(r"\u{9b}\u{202e}such"), "{error}");
}

#[test]
fn advice_is_not_the_command_that_failed() {
    let place = Place::new();
    let output = place.command(&["data", "check", "nowhere"]).output().expect("started");
    let text = String::from_utf8(output.stdout).expect("UTF-8") + &String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.code() == Some(1) && text.contains("there is no folder nowhere; check the path"),
        "{text}"
    );
    assert!(!text.contains("vsonar data check"), "{text}");
    for command in [
        &["evolve", "--data", "nowhere"][..],
        &["eval", "p.gp", "--data", "nowhere"],
        &["sweep", "s.toml"],
        &["label", "nowhere"],
    ] {
        place.write("p.gp", "(individual (iterate-up 2x2 x-obstacle (set-a y)))");
        place.write(
            "s.toml",
            "seeds = \"1\"\n[[data]]\nname = \"d\"\nfolder.train = \"nowhere\"\n[[setting]]\nname = \"s\"\n",
        );
        let error = place.fails(1, command);
        assert!(!error.contains("data check") && error.contains("nowhere"), "{command:?}: {error}");
    }
}

#[test]
fn figures_that_tell_little_are_called_so() {
    let place = Place::new();
    let text = place.ok(&tiny(&["--out", "one"]));
    assert!(text.contains("6 images to train on: too few for any figure to mean anything"), "{text}");
    let advice = "hold some of them out by `--holdout 20%`";
    assert!(text.contains(advice) && !text.contains("No images are held out"), "{text}");
    let text = place.ok(&tiny(&["--runs", "2", "--out", "two"]));
    assert_eq!(text.matches(advice).count(), 1, "{text}");
    dataset(30, 0).save(place.path("enough")).expect("writable");
    let enough = [&["evolve", "--data", "enough", "--out", "three"], TINY].concat();
    let text = place.ok(&enough);
    assert!(!text.contains("too few") && text.contains("--data enough --holdout 20%\n"), "{text}");
    // The advice holds: what it says can be run, and has nothing more to advise.
    let tested = [&["evolve", "--data", "enough", "--holdout", "20%", "--out", "four"], TINY].concat();
    let text = place.ok(&tested);
    assert!(text.contains("held out") && !text.contains("No images are held out"), "{text}");
    let json = place.ok(&tiny(&["--json", "--quiet", "--out", "five"]));
    assert!(serde_json::from_str::<serde_json::Value>(&json).is_ok(), "{json}");
}

/// On terminals that the test pretends to be.
#[cfg(unix)]
mod on_a_terminal {
    use crate::common::*;
    use crate::live::{seen, seen_with};

    /// The text without sequences that move the cursor or colour it.
    fn bare(text: &str) -> String {
        let mut out = String::new();
        let mut rest = text;
        while let Some((before, sequence)) = rest.split_once("\u{1b}[") {
            out += before;
            rest = sequence.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
            rest = rest.get(1..).unwrap_or("");
        }
        out + rest
    }

    #[test]
    fn something_is_seen_from_the_first_moment_and_fits_the_terminal() {
        let place = Place::new();
        let slow = ["--executor", "tree", "--threads", "1", "--population", "300", "--holdout", "25%"];
        for columns in [80, 120] {
            let out = format!("--out=run{columns}");
            let text = seen(&place, &tiny(&[&slow[..], &["--split-by", "image", &out]].concat()), columns);
            let bare = bare(&text).replace('\r', "\n");
            let first = bare.lines().find(|line| !line.trim().is_empty()).expect("something");
            assert!(first.contains("reading") || first.contains("images: data"), "{first:?}");
            let bar = bare.lines().find(|line| line.starts_with("generation ")).expect("a bar");
            assert!(bar.contains('─') || bar.contains('━'), "the bar is seen: {bar:?}");
            let summary = bare.rfind("best, █ mean").map_or("", |at| &bare[at..]);
            assert!(summary.contains("correct cases"), "{bare}");
            for line in summary.lines().filter(|line| !line.starts_with("  vsonar ")) {
                assert!(line.chars().count() <= columns.into(), "{columns}: {line:?}");
            }
            assert!(bare.contains("generations 0 to 3: ░ best, █ mean"), "{bare}");
        }
    }

    #[test]
    fn wide_tables_are_folded_and_colours_can_be_refused() {
        let place = Place::new();
        place.write("p.gp", "(individual (iterate-up 2x2 x-obstacle (set-a y)))");
        let bench = ["bench", "--data", "data", "--population", "20", "--generations", "0", "--rounds", "1"];
        let text = bare(&seen(&place, &[&bench[..], &["--sample", "3"]].concat(), 80)).replace('\r', "\n");
        assert!(text.contains("GPop/s") && text.contains("quartiles"), "{text}");
        let tables = text.rfind("one thread").map_or("", |at| &text[at..]);
        assert!(tables.lines().count() > 20, "{text}");
        for line in tables.lines() {
            assert!(line.chars().count() <= 80, "{line:?}");
        }
        let evolve = |out: &str| {
            tiny(&["--quiet", "--out"])
                .into_iter()
                .chain([out.to_string().leak() as &str])
                .collect::<Vec<_>>()
        };
        let coloured = seen(&place, &evolve("a"), 100);
        assert!(coloured.contains("\u{1b}[1mNext:\u{1b}[0m"), "{coloured:?}");
        assert!(!coloured.contains('░'), "no curve with --quiet: {coloured}");
        for refused in [("NO_COLOR", "1"), ("TERM", "dumb")] {
            let text = seen_with(&place, &evolve(refused.0), 100, &[refused]);
            assert!(!text.contains("\u{1b}[1m"), "{text:?}");
        }
        // Piped, there is neither colour nor a limit.
        let piped = place.ok(&["evolve", "--resume", "a"]);
        assert!(plain(&piped) && !piped.contains('░'), "{piped}");
    }

    #[test]
    fn an_explanation_fits() {
        let place = Place::new();
        let condition = "(if-le gradient 41.5 (if-le median-corner moravec-horizontal (set-a (+ x-obstacle \
                         (* moravec-vertical 0.123456))) 0) (set-a (+ median-corner (min gradient moravec-slash))))";
        place
            .write("p.gp", format!("(individual (iterate-up 2x2 x-obstacle (prog2 {condition} (set-b y))))"));
        let explain = ["explain", "p.gp", "--data", "data"];
        let wide = place.ok(&explain);
        assert!(wide.lines().any(|line| line.chars().count() > 80), "{wide}");
        let text = bare(&seen(&place, &explain, 80)).replace('\r', "\n");
        let listing = text.find("the tree: ").map_or("", |at| &text[at..]);
        assert!(listing.contains("Without each part"), "{text}");
        for line in listing.lines() {
            assert!(line.chars().count() <= 80, "{line:?}");
        }
        let words = |text: &str| {
            let mut words: Vec<String> = text.split_whitespace().map(str::to_string).collect();
            words.sort_unstable();
            words
        };
        assert_eq!(words(listing), words(wide.find("the tree: ").map_or("", |at| &wide[at..])));
    }

    #[test]
    fn a_terminal_without_unicode_gets_ascii() {
        let place = Place::new();
        let text = seen_with(&place, &tiny(&["--out", "a"]), 80, &[("LC_ALL", "C")]);
        assert!(text.contains("generations 0 to 3: : best, # mean"), "{text}");
        assert!(!text.contains(['░', '━', '⠁']), "{text}");
    }
}
