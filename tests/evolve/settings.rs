//! Settings: presets, files, and what they refuse.

use vsonar::evolve::{Draft, Preset, SelectionKind, Settings};

fn error(text: &str) -> String {
    Settings::from_toml(text, "my.toml").expect_err("refused").to_string()
}

#[test]
fn presets() {
    let (paper, default) = (Settings::paper(), Settings::default_preset());
    assert_eq!((paper.population, paper.generations, paper.selection.tournament), (4000, 51, 7));
    assert_eq!(paper.selection.kind, SelectionKind::Tournament);
    assert!(!paper.filter.enabled && paper.creation.plain_column_probability == 0.0);
    assert_eq!(default.selection.kind, SelectionKind::Sharing);
    assert!(default.filter.enabled && default.creation.plain_column_probability == 0.7);
    for preset in [Preset::Paper, Preset::Default] {
        let settings = Settings::preset(preset);
        settings.validate().expect("sound");
        assert_eq!(Settings::from_toml(&settings.to_toml(), "x").expect("sound"), settings);
    }
}

#[test]
fn a_file_gives_some_fields_over_a_preset() {
    let text =
        "preset = \"paper\"\npopulation = 100\n[filter]\nenabled = true\n[nodes]\nraw = 0\n\"3x8\" = 2\n";
    let settings = Settings::from_toml(text, "x").expect("sound");
    let mut expected = Settings::paper();
    expected.population = 100;
    expected.filter.enabled = true;
    expected.nodes.edit("-raw 3x8=2").expect("node types");
    assert_eq!(settings, expected);
    assert_eq!(Settings::from_toml("", "x").expect("sound"), Settings::default_preset());
    let more = settings.with_toml("[selection]\nkind = \"sharing\"", "y").expect("sound");
    assert_eq!((more.population, more.selection.kind), (100, SelectionKind::Sharing));
}

#[test]
fn unknown_fields_and_wrong_types() {
    let e = error("seed = 1\n\n  popluation = 5\n");
    assert!(e.starts_with("my.toml:3:3: ") && e.contains("popluation") && e.contains("population"), "{e}");
    let e = error("[breeding]\nmutation = 0.1\n");
    assert!(e.starts_with("my.toml:2:1: ") && e.contains("mutation"), "{e}");
    let e = error("seed = 1\ngenerations = \"many\"\n");
    assert!(e.starts_with("my.toml:2:15: ") && e.contains("u32"), "{e}");
    let e = error("[selection]\nkind = \"roulette\"\n");
    assert!(e.starts_with("my.toml:2:8: ") && e.contains("tournament") && e.contains("sharing"), "{e}");
    let e = error("seed = = 2");
    assert!(e.starts_with("my.toml:1:"), "{e}");
    let e = error("preset = \"papre\"");
    assert!(e.contains("papre") && e.contains("paper"), "{e}");
}

#[test]
fn impossible_values() {
    for (text, place, field) in [
        ("population = 1", "1:14", "population"),
        ("generations = 0", "1:15", "generations"),
        ("trees = 3", "1:9", "trees"),
        ("tolerance = nan", "1:13", "tolerance"),
        ("tolerance = -1", "1:13", "tolerance"),
        ("[breeding]\ncrossover_probability = 1.5", "2:25", "breeding.crossover_probability"),
        ("[breeding]\ninternal_probability = nan", "2:24", "breeding.internal_probability"),
        ("[creation]\nmin_depth = 10", "2:13", "creation.min_depth"),
        ("[creation]\nconstant_max = 0.001", "2:16", "creation.constant_max"),
        ("[selection]\ntournament = 0", "2:14", "selection.tournament"),
        ("[filter]\nmax_draws = 0", "2:13", "filter.max_draws"),
        ("[augmentation]\nvariants = 0", "2:12", "augmentation.variants"),
        ("[augmentation]\nmirror = 1.5", "2:10", "augmentation.mirror"),
        ("[augmentation]\ngain = -0.1", "2:8", "augmentation.gain"),
        ("[augmentation]\nblur = nan", "2:8", "augmentation.blur"),
        ("[augmentation]\nshift_y = 10001", "2:11", "augmentation.shift_y"),
        ("[nodes]\nsqrt = 1", "2:8", "nodes.sqrt"),
        ("[nodes]\nraw = 1001", "2:7", "nodes.raw"),
    ] {
        let e = error(text);
        assert!(e.starts_with(&format!("my.toml:{place}: ")) && e.contains(field), "{text}: {e}");
    }
    let mut settings = Settings::paper();
    settings.seed = u64::MAX;
    assert!(settings.validate().expect_err("too large").to_string().contains("9223372036854775807"));
}

#[test]
fn plain_columns_need_their_node() {
    let e = error("[nodes]\n\n\"x-obstacle\" = 0\n");
    assert!(
        e.starts_with("my.toml:3:16: ") && e.contains("`creation.plain_column_probability` is 0.7"),
        "{e}"
    );
    assert!(e.contains("`x-obstacle`") && e.contains("--set creation.plain_column_probability=0"), "{e}");
    let text = "[creation]\nplain_column_probability = 0.0\n[nodes]\n\"x-obstacle\" = 0\n";
    Settings::from_toml(text, "my.toml").expect("no plain columns");
    Settings::from_toml("preset = \"paper\"\n[nodes]\n\"x-obstacle\" = 0\n", "x").expect("none there");
}

#[test]
fn a_draft_is_checked_at_the_end() {
    let mut draft = Draft::new(Settings::default_preset());
    draft.lay_over("[creation]\nmin_depth = 10\n", "deep.toml").expect("a number");
    // By itself, the file is at odds with the preset, and a fault of it is told where it stands.
    let e = draft.clone().finish().expect_err("too deep").to_string();
    assert!(e.starts_with("deep.toml:2:13: ") && e.contains("creation.min_depth"), "{e}");
    // Names and types are checked at once, and what is refused leaves no trace.
    for text in ["[creation]\nmax_depth = \"x\"\n", "depth = 3\n", "[nodes]\nsqrt = 1\n"] {
        assert!(draft.lay_over(text, "x").expect_err("refused").to_string().starts_with("x:"), "{text}");
    }
    let mut shallow = draft.clone();
    shallow.change("creation.max_depth", |s| s.creation.max_depth = 9);
    let e = shallow.finish().expect_err("too deep").to_string();
    assert!(e.starts_with("the setting `creation.min_depth` is 10"), "{e}");
    draft.change("creation.max_depth", |s| s.creation.max_depth = 12);
    let mut expected = Settings::default_preset();
    (expected.creation.min_depth, expected.creation.max_depth) = (10, 12);
    assert_eq!(draft.clone().finish().expect("sound"), expected);
    // A preset replaces everything.
    draft.lay_over("preset = \"paper\"", "y").expect("a preset");
    assert_eq!(draft.finish().expect("sound"), Settings::paper());
}

#[test]
fn every_field_changes_the_fingerprint_but_generations() {
    let base = Settings::default_preset();
    let longer = base.clone().extended(100).expect("more");
    assert_eq!(base.fingerprint(), longer.fingerprint());
    let text = base.to_toml();
    let mut table = String::new();
    let mut changed = 0;
    for line in text.lines().filter(|l| !l.starts_with('#') && !l.is_empty()) {
        if line.starts_with('[') {
            table = format!("{line}\n");
            continue;
        }
        let (field, value) = line.split_once(" = ").expect("field = value");
        let other = match value {
            "true" => "false".to_string(),
            "false" => "true".to_string(),
            "\"sharing\"" => "\"tournament\"".to_string(),
            number if table == "[nodes]\n" => format!("{number}7"),
            "0.0" => "0.5".to_string(),
            "0" => "1".to_string(),
            number if number.contains('.') => {
                format!("{:?}", number.parse::<f64>().expect("a number") * 0.75)
            }
            "1" => "2".to_string(),
            number => (number.parse::<u64>().expect("a number") - 1).to_string(),
        };
        let settings =
            base.clone().with_toml(&format!("{table}{field} = {other}"), "x").expect("a possible value");
        assert_eq!(settings.fingerprint() == base.fingerprint(), field == "generations", "{field}");
        changed += 1;
    }
    assert!(changed > 90, "{changed} fields");
}
