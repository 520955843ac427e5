//! Settings: presets, files, and what they refuse.

use vsonar::evolve::{Draft, Preset, SelectionKind, Settings};
use vsonar::tree::NodeType;

fn error(text: &str) -> String {
    Settings::from_toml(text, "my.toml").expect_err("refused").to_string()
}

#[test]
fn presets() {
    let (paper, default) = (Settings::paper(), Settings::default_preset());
    assert_eq!((paper.population, paper.generations, paper.selection.tournament), (4000, 51, 7));
    assert_eq!(paper.selection.kind, SelectionKind::Tournament);
    assert!(!paper.filter.enabled && paper.creation.plain_column_probability == 0.0);
    assert_eq!(default.selection.kind, SelectionKind::Lexicase);
    assert!(default.filter.enabled && default.creation.plain_column_probability == 0.7);
    let weight = |name: &str| default.nodes.weight(NodeType::from_name(name).expect("a node type"));
    assert_eq!(
        ["sin", "atan2", "raw-sq", "square", "raw", "if-le", "set-a"].map(weight),
        [0, 0, 0, 1, 1, 4, 3]
    );
    assert_eq!(default.variation().copies(), 1);
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
        ("[breeding]\nsubtree_mutation_probability = -0.1", "2:32", "breeding.subtree_mutation_probability"),
        ("[breeding]\npoint_mutation_probability = 0.55", "2:30", "breeding.point_mutation_probability"),
        ("[breeding]\nconstant_mutation_probability = nan", "2:33", "breeding.constant_mutation_probability"),
        ("[breeding]\nhoist_mutation_probability = 2", "2:30", "breeding.hoist_mutation_probability"),
        ("[breeding]\nmutation_depth = 0", "2:18", "breeding.mutation_depth"),
        ("[breeding]\nconstant_step = 0.0", "2:17", "breeding.constant_step"),
        ("[breeding]\nconstant_step = inf", "2:17", "breeding.constant_step"),
        ("[selection]\ncase_share = 0.0", "2:14", "selection.case_share"),
        ("[selection]\ncase_share = 1.01", "2:14", "selection.case_share"),
        ("[selection]\nsize_tournament = 0.9", "2:19", "selection.size_tournament"),
        ("[selection]\nelitism = 4000", "2:11", "selection.elitism"),
        ("[islands]\ncount = 0", "2:9", "islands.count"),
        ("[islands]\ncount = 2001", "2:9", "islands.count"),
        ("[islands]\ninterval = 0", "2:12", "islands.interval"),
        ("[islands]\ncount = 100\nmigrants = 40", "3:12", "islands.migrants"),
        ("population = 40\n[islands]\ncount = 10", "3:9", "islands.migrants"),
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

/// Each mutation takes its share of what crossover leaves.
#[test]
fn operators_share_one_probability() {
    let e = error("[breeding]\nsubtree_mutation_probability = 0.08\nhoist_mutation_probability = 0.48\n");
    assert!(
        e.starts_with("my.toml:3:30: ") && e.contains("`breeding.hoist_mutation_probability` is 0.48"),
        "{e}"
    );
    assert!(e.contains("at most 0.460000") && e.contains("`breeding.crossover_probability`"), "{e}");
    // The roundings of tenths are no fault.
    let text = "[breeding]\ncrossover_probability = 0.6\nsubtree_mutation_probability = 0.1\n\
                point_mutation_probability = 0.1\nconstant_mutation_probability = 0.1\n\
                hoist_mutation_probability = 0.1\n";
    Settings::from_toml(text, "x").expect("all of 1");
}

/// Where there are no islands, what is set for them does not matter.
#[test]
fn small_populations_need_no_settings_of_islands() {
    for text in ["population = 2", "population = 5\n[selection]\nelitism = 4\n[islands]\nmigrants = 100"] {
        Settings::from_toml(text, "x").expect("sound");
    }
    let e = error("population = 3\n[selection]\nelitism = 3");
    assert!(e.contains("`selection.elitism` is 3") && e.contains("less than the population, 3"), "{e}");
}

#[test]
fn choices_are_named() {
    let e = error("[selection]\nkind = \"roulette\"\n");
    assert!(["tournament", "sharing", "lexicase"].iter().all(|kind| e.contains(kind)), "{e}");
    let e = error("[selection]\nparsimony = \"tarpeian\"\n");
    assert!(["none", "lexicographic", "double"].iter().all(|kind| e.contains(kind)), "{e}");
    let text = Settings::paper().to_toml();
    let choices =
        ["\"tournament\"", "\"sharing\"", "\"lexicase\"", "\"none\"", "\"lexicographic\"", "\"double\""];
    assert!(choices.iter().all(|kind| text.contains(kind)), "{text}");
}

/// The fingerprints that the revision before these fields recorded in checkpoints, of what was its default preset.
#[test]
fn what_came_later_and_is_off_leaves_fingerprints_alone() {
    let mut small = Settings::paper();
    (small.creation.plain_column_probability, small.filter.enabled) = (0.7, true);
    small.selection.kind = SelectionKind::Sharing;
    (small.population, small.generations) = (200, 4);
    assert_eq!(small.fingerprint(), 6_976_453_483_606_610_770);
    small.selection.elitism = 1;
    assert_ne!(small.fingerprint(), 6_976_453_483_606_610_770);
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
    draft.change("creation.max_depth", |s| s.creation.max_depth = 10);
    let mut expected = Settings::default_preset();
    (expected.creation.min_depth, expected.creation.max_depth) = (10, 10);
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
            "\"lexicase\"" => "\"tournament\"".to_string(),
            "\"lexicographic\"" => "\"double\"".to_string(),
            // The probability of mutation has the room that crossover leaves.
            "0.0" => "0.0625".to_string(),
            "0" => "1".to_string(),
            number if table == "[nodes]\n" => format!("{number}7"),
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
