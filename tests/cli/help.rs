//! The help: a newcomer finds his way, and what it says of defaults is true.

use vsonar::dataset::TOLERANCE;
use vsonar::evolve::Settings;
use vsonar::world::FRAMES;

use crate::common::*;

const COMMANDS: &[&[&str]] = &[
    &[],
    &["evolve"],
    &["sweep"],
    &["eval"],
    &["show"],
    &["explain"],
    &["report"],
    &["run"],
    &["drive"],
    &["ir"],
    &["export"],
    &["bench"],
    &["calibrate"],
    &["label"],
    &["data"],
    &["data", "check"],
    &["data", "import"],
    &["data", "import", "masks"],
    &["data", "import", "labelme"],
    &["data", "import", "coco"],
    &["data", "video"],
    &["data", "synth"],
    &["synth"],
    &["completions"],
];

/// The help of a command, as words with single spaces between them.
fn help(command: &[&str]) -> String {
    let text = Place::new().ok(&[command, &["--help"]].concat());
    assert!(plain(&text), "{text:?}");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What the help says of a flag, up to its default.
fn of_flag(help: &str, flag: &str) -> String {
    let start = help.find(&format!(" {flag} <")).unwrap_or_else(|| panic!("no {flag} in {help}"));
    let rest = &help[start + 1..];
    let default = rest.find("[default: ").unwrap_or_else(|| panic!("no default of {flag} in {help}"));
    let end = rest[default..].find(']').map_or(rest.len(), |end| default + end + 1);
    rest[..end].to_string()
}

/// On a terminal of 80 columns paragraphs fill it: no line breaks within them but where it is full.
#[test]
fn paragraphs_of_the_help_flow() {
    for command in COMMANDS {
        let text = {
            let place = Place::new();
            let mut help = place.command(&[*command, &["--help"]].concat());
            let output = help.env("COLUMNS", "80").output().expect("it runs");
            String::from_utf8(output.stdout).expect("UTF-8")
        };
        let after = text.split_once("\nExample").map_or("", |(_, after)| after);
        let lines: Vec<&str> = after.lines().collect();
        // A line of JSON cannot be broken.
        let fits = |line: &&str| line.chars().count() <= 80 || !line.trim().contains(' ');
        assert!(lines.iter().all(fits), "{command:?}: {after}");
        for pair in lines.windows(2) {
            let [line, next] = [pair[0], pair[1]];
            let in_paragraph = |line: &str| !line.is_empty() && !line.starts_with(' ');
            let word = next.split(' ').next().unwrap_or("");
            let full = line.chars().count() + 1 + word.chars().count() > 80;
            assert!(
                !in_paragraph(line) || !in_paragraph(next) || full,
                "{command:?}: {line:?}, then {next:?}"
            );
        }
    }
}

#[test]
fn every_command_has_help_with_examples() {
    for command in COMMANDS {
        let text = help(command);
        assert!(text.contains("Example") && text.contains("Usage: vsonar"), "{command:?}: {text}");
        let short = Place::new().ok(&[*command, &["-h"]].concat());
        assert!(short.lines().all(|line| line.chars().count() <= 120), "{short}");
    }
    let all = help(&[]);
    for command in [
        "evolve",
        "sweep",
        "eval",
        "show",
        "explain",
        "report",
        "run",
        "drive",
        "ir",
        "export",
        "bench",
        "calibrate",
        "label",
        "data",
        "synth",
        "completions",
    ] {
        assert!(all.contains(&format!(" {command} ")), "{all}");
    }
}

#[test]
fn no_command_shows_the_help() {
    let output = Place::new().command(&[]).output().expect("started");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("Usage: vsonar"));
}

#[test]
fn stated_defaults_of_settings_are_the_real_ones() {
    let text = help(&["evolve"]);
    let place = Place::new();
    place.ok(&[
        "evolve",
        "--data",
        "data",
        "--out",
        "run",
        "--population",
        "2",
        "--generations",
        "1",
        "--quiet",
    ]);
    let recorded = Settings::from_toml(&place.read("run/settings.toml"), "settings.toml").expect("sound");
    let defaults = Settings { population: 4000, generations: 51, ..recorded };
    assert_eq!(defaults, Settings::default_preset(), "the default preset is `default`");
    assert!(of_flag(&text, "--preset").contains("[default: default]"));
    for (flag, value) in [
        ("--seed", defaults.seed.to_string()),
        ("--population", "4,000; without".to_string()),
        ("--generations", "51; without".to_string()),
        ("--trees", defaults.trees.to_string()),
        ("--tolerance", defaults.tolerance.to_string()),
        ("--executor", "auto".to_string()),
    ] {
        let said = of_flag(&text, flag);
        assert!(said.contains(&format!("[default: {value}")), "{said}");
    }
}

#[test]
fn the_smaller_defaults_without_data_are_the_real_ones() {
    let text = help(&["evolve"]);
    let stated = |flag: &str| {
        let said = of_flag(&text, flag);
        let number = said.split("without --data ").nth(1).and_then(|rest| rest.split(']').next());
        number.unwrap_or_else(|| panic!("{said}")).replace(',', "")
    };
    let place = Place::new();
    // One of the two is given, so that the run is short; the other is recorded as it is by default.
    place.ok(&[
        "evolve",
        "--population",
        "2",
        "--generations",
        "1",
        "--set",
        "filter.enabled=false",
        "--out",
        "a",
    ]);
    let run = |flag: &str, value: &str, out: &str| {
        let mut command =
            place.command(&["evolve", flag, value, "--set", "filter.enabled=false", "--out", out]);
        let mut run = command.stdout(std::process::Stdio::null()).spawn().expect("started");
        let settings = place.path(out).join("settings.toml");
        while !settings.exists() {
            assert!(run.try_wait().expect("it can be asked").is_none(), "it ended early");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        run.kill().expect("it can be killed");
        run.wait().expect("it ends");
        place.read(&format!("{out}/settings.toml"))
    };
    let settings = run("--generations", "1", "b");
    assert!(settings.contains(&format!("population = {}\n", stated("--population"))), "{settings}");
    let settings = run("--population", "2", "c");
    assert!(settings.contains(&format!("generations = {}\n", stated("--generations"))), "{settings}");
}

#[test]
fn other_stated_defaults_are_the_real_ones() {
    assert!(of_flag(&help(&["eval"]), "--tolerance").contains(&format!("[default: {TOLERANCE}]")));
    assert!(of_flag(&help(&["eval"]), "--executor").contains("[default: auto]"));
    let (evolve, sweep) = (help(&["evolve"]), help(&["sweep"]));
    for (text, flag, value) in [
        (&evolve, "--runs", "1"),
        (&evolve, "--jobs", "1"),
        (&sweep, "--out", "sweeps/NAME of the file"),
        (&sweep, "--jobs", "one for each thread"),
        (&sweep, "--threads", "one for each core"),
        (&sweep, "--executor", "auto"),
        (&sweep, "--strip-cache", "256"),
    ] {
        assert!(of_flag(text, flag).contains(&format!("[default: {value}]")), "{flag}");
    }
    assert!(of_flag(&help(&["data", "synth"]), "--frames").contains(&format!("[default: {FRAMES}]")));
    for command in ["evolve", "sweep", "eval", "show", "explain", "bench"] {
        // The number itself is tested where it is computed.
        let said = of_flag(&help(&[command]), "--memory");
        let default = "[default: three quarters of the machine's memory, 8 where that is unknown]";
        assert!(said.contains(default), "{said}");
    }
    // The numbers are tested where they are used.
    assert!(of_flag(&help(&["bench"]), "--cases").contains("[default: 32,64,128,256,all as far"));
    assert!(of_flag(&help(&["calibrate"]), "--size").contains("[default: 320x240]"));
    // That they are is tested with the command.
    let run = help(&["run"]);
    for (flag, value) in [
        ("--input", "-"),
        ("--format", "auto"),
        ("--columns", "12"),
        ("--output", "rows"),
        ("--median", "1"),
        ("--every", "1s"),
    ] {
        assert!(of_flag(&run, flag).contains(&format!("[default: {value}]")), "{flag}: {run}");
    }
    let label = help(&["label"]);
    assert!(of_flag(&label, "--port").contains("[default: 0]"), "{label}");
    assert!(
        of_flag(&label, "--columns").contains(
            "[default: those last asked for in this folder, else those that its table has, else 6]"
        ),
        "{label}"
    );
    let drive = help(&["drive"]);
    assert!(
        of_flag(&drive, "--world").contains("[default: nsh for a run that was made in it, else fmrb]"),
        "{drive}"
    );
    for (flag, value) in [("--runs", "5"), ("--columns", "12"), ("--minutes", "45")] {
        assert!(of_flag(&drive, flag).contains(&format!("[default: {value}]")), "{flag}: {drive}");
    }
    let ir = help(&["ir"]);
    assert!(of_flag(&ir, "--stage").contains("[default: optimised]"));
    assert!(of_flag(&ir, "--size").contains("[default: that of the images it was evolved on, else 320x240]"));
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    let listing = place.ok(&["ir", "up.gp"]);
    assert!(listing.contains("image 320x240"), "{listing}");
    assert_eq!(listing, place.ok(&["ir", "up.gp", "--stage", "optimised", "--size", "320x240"]));
}

#[test]
fn the_corridor_is_not_what_evolve_takes_without_data() {
    let place = Place::new();
    let help = place.ok(&["data", "--help"]);
    let line = help.lines().find(|line| line.contains("data synth corridor")).expect("an example");
    assert!(line.ends_with("write a synthetic corridor, with labels"), "{line}");
    assert!(place.ok(&["evolve", "--help"]).contains("else the world fmrb"));
}
