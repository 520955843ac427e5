//! `vsonar report`: the page of a run and of several.

use std::collections::BTreeSet;

use html5ever::tendril::TendrilSink as _;
use html5ever::{ParseOpts, parse_document};
use markup5ever_rcdom::{Handle, NodeData, RcDom};
use serde_json::Value;
use vsonar::dataset::Dataset;

use crate::common::*;

/// An element of a page: its name and its attributes.
#[derive(Debug)]
struct Element {
    name: String,
    attributes: Vec<(String, String)>,
}

impl Element {
    fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(there, _)| there == name).map(|(_, value)| value.as_str())
    }
}

fn walk(node: &Handle, found: &mut Vec<Element>) {
    if let NodeData::Element { name, attrs, .. } = &node.data {
        let attributes =
            attrs.borrow().iter().map(|a| (a.name.local.to_string(), a.value.to_string())).collect();
        found.push(Element { name: name.local.to_string(), attributes });
    }
    node.children.borrow().iter().for_each(|child| walk(child, found));
}

/// The elements of a page, which is held to be sound: no parse error, nothing from elsewhere, names for what is seen.
fn elements(page: &str) -> Vec<Element> {
    let dom = parse_document(RcDom::default(), ParseOpts::default()).one(page);
    assert_eq!(*dom.errors.borrow(), Vec::<std::borrow::Cow<'static, str>>::new());
    let mut all = Vec::new();
    walk(&dom.document, &mut all);
    let count = |name: &str| all.iter().filter(|e| e.name == name).count();
    assert_eq!((count("h1"), count("main"), count("title") > 0), (1, 1, true));
    assert_eq!(count("script") + count("link") + count("iframe") + count("object"), 0);
    let mut ids = BTreeSet::new();
    for id in all.iter().filter_map(|e| e.get("id")) {
        assert!(ids.insert(id), "{id} is there twice");
    }
    for element in &all {
        for name in ["src", "href", "srcset", "data", "action", "xlink:href"] {
            if let Some(value) = element.get(name) {
                let inside = value.strip_prefix('#').is_some_and(|id| ids.contains(id));
                assert!(
                    inside
                        || value.starts_with("data:image/png;base64,")
                        || value.starts_with("data:image/svg+xml;base64,"),
                    "{name}={value}"
                );
            }
        }
        if element.name == "img" {
            assert!(element.get("alt").is_some_and(|alt| !alt.is_empty()), "{element:?}");
        }
        if element.get("role") == Some("img") {
            let labels = element.get("aria-labelledby").expect("a name");
            assert!(labels.split(' ').all(|id| ids.contains(id)), "{labels}");
        }
        if element.name == "svg" {
            assert!(element.get("role") == Some("img") || element.get("aria-hidden") == Some("true"));
        }
    }
    let without = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    assert!(!without.contains("http://") && !without.contains("https://") && !page.contains("@import"));
    all
}

/// A run in `run`, trained on drive a and tested on drive b.
fn evolved(place: &Place, seed: &str, out: &str, more: &[&str]) {
    let flags = ["--train-match", "drive_a*", "--holdout-match", "drive_b*", "--quiet", "--json"];
    place.ok(&tiny(&[&flags[..], &["--seed", seed, "--out", out], more].concat()));
}

fn json(place: &Place, arguments: &[&str]) -> Value {
    let text = place.ok(&[&["report"], arguments, &["--json"]].concat());
    serde_json::from_str(&text).expect("one JSON value")
}

#[test]
fn the_page_of_a_run_is_sound_and_says_what_eval_says() {
    let place = Place::new();
    evolved(&place, "1", "run", &[]);
    let text = place.ok(&["report", "run"]);
    assert!(text.starts_with("run/report.html: ") && text.trim_end().ends_with(" KiB"), "{text}");
    let page = place.read("run/report.html");
    let all = elements(&page);
    let sections: Vec<&str> =
        all.iter().filter(|e| e.name == "section").filter_map(|e| e.get("id")).collect();
    let expected = [
        "result",
        "pictures",
        "program",
        "rivals",
        "errors",
        "transience",
        "curves",
        "hall",
        "diversity",
        "time",
        "settings",
        "commands",
    ];
    assert_eq!(sections, expected, "the detector, then how it came about");
    assert!(page.contains("<h1>run</h1>"), "the name of the folder");
    let first = page.split("id=\"pictures\"").next().expect("a beginning");
    assert!(first.contains("data:image/png") && first.contains("answer: a"), "what it sees, what it does");
    assert!(all.iter().filter(|e| e.get("role") == Some("img")).count() >= 12);
    let pictures =
        |kind: &str| all.iter().filter(|e| e.get("src").is_some_and(|src| src.starts_with(kind))).count();
    assert_eq!(pictures("data:image/png"), 1 + 3, "a typical image, and all of the held-out drive");
    assert_eq!(pictures("data:image/svg+xml"), 1, "the trees");
    assert!(page.contains("images of 64 x 48 pixels") && page.contains("bit for bit"), "the listing");
    assert!(page.len() < 5 << 20);
    // A flag is one word, however narrow the page is.
    assert!(page.contains("<span>vsonar</span> <span>report</span> <span>run</span></code>"), "{page}");
    assert!(page.contains("<span>--seed</span>") && !page.contains("vsonar evolve --settings"));
    assert!(all.iter().filter(|e| e.get("class") == Some("scroll")).all(|table| {
        table.get("tabindex") == Some("0") && table.get("aria-label").is_some_and(|label| !label.is_empty())
    }));

    let report = json(&place, &["run"]);
    let run = &report["runs"][0];
    let eval = |part: &str| -> Value {
        let text = place.ok(&["eval", "run", "--part", part, "--json"]);
        serde_json::from_str(&text).expect("JSON")
    };
    for (i, part) in ["train", "holdout"].into_iter().enumerate() {
        let (score, eval) = (&run["scores"][i], eval(part));
        assert_eq!((&score["correct"], &score["cases"]), (&eval["correct"], &eval["cases"]));
        // What the page has large is the same number.
        let percent = format!("<b>{:.1} %</b>", 100.0 * eval["fitness"].as_f64().expect("a share"));
        assert!(page.contains(&percent), "{percent}");
    }
    let held_out = eval("holdout");
    assert_eq!(run["answers"]["transience"], held_out["transience"]);
    for (group, column) in run["answers"]["columns"].as_array().expect("a list").iter().zip([8, 20, 33, 51]) {
        let same = held_out["columns"].as_array().expect("a list").iter().find(|c| c["x"] == column);
        assert_eq!(group["tally"]["correct"], same.expect("there")["correct"], "{group}");
    }
    let rivals = run["rivals"]["rows"].as_array().expect("a list");
    let names: Vec<&str> = rivals.iter().filter_map(|row| row["name"].as_str()).collect();
    assert_eq!(names, ["evolved", "constant", "gradient", "polly", "lorigo", "ulrich"]);
    assert_eq!(rivals[0]["test"], held_out["fitness"]);
    let hall = run["hall_of_fame"].as_array().expect("a list");
    let winners: Vec<&Value> = hall.iter().filter(|m| m["winner"] == true).collect();
    assert_eq!(winners.len(), 1);
    assert_eq!(winners[0]["holdout"], held_out["fitness"]);
}

#[test]
fn the_commands_of_the_page_repeat_the_run() {
    let place = Place::new();
    evolved(&place, "3", "run", &[]);
    let report = json(&place, &["run", "--no-rivals"]);
    let commands = report["runs"][0]["commands"].as_array().expect("a list").clone();
    let text = |i: usize| commands[i]["command"].as_str().expect("text").to_string();
    let words: Vec<String> = text(0).split(' ').skip(1).map(str::to_string).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    place.ok(&[&words[..], &["--quiet", "--json"]].concat());
    assert_eq!(recorded(&place.path("run")), recorded(&place.path("run-again")));
    for kind in ["vsonar eval ", "vsonar show ", "vsonar export "] {
        assert!((0..commands.len()).any(|i| text(i).starts_with(kind)), "{kind}: {commands:?}");
    }
}

#[test]
fn the_explanation_can_be_left_out() {
    let place = Place::new();
    evolved(&place, "3", "run", &[]);
    let of = |more: &[&str]| {
        let report = json(&place, &[&["run", "--no-rivals"], more].concat());
        let run = &report["runs"][0];
        (run["program"]["explanation"].clone(), run["scores"].clone(), report["command"].clone())
    };
    let (there, scores, _) = of(&[]);
    assert!(there["listing"].as_str().expect("a listing").contains("answer: a"), "{there}");
    let (left_out, same_scores, command) = of(&["--no-explain"]);
    assert!(left_out.is_null(), "{left_out}");
    assert_eq!(scores, same_scores);
    assert_eq!(command, "vsonar report run --no-rivals --no-explain");
    // Neither a heading without a listing nor a complaint is on the page.
    place.ok(&["report", "run", "--no-rivals", "--no-explain", "--out", "without.html"]);
    place.ok(&["report", "run", "--no-rivals", "--out", "with.html"]);
    let listing = "images of 64 x 48 pixels";
    assert!(place.read("with.html").contains(listing) && !place.read("without.html").contains(listing));
    assert!(!place.read("without.html").contains("is not explained"));
}

#[test]
fn names_are_text_and_never_markup() {
    let place = Place::new();
    let data = Dataset::load(place.path("data")).expect("sound");
    let mut images = data.images().to_vec();
    for (i, image) in images.iter_mut().enumerate() {
        image.name = format!("<b id='x'>&{i}.png");
    }
    let set = Dataset::new("data", images, data.cases().to_vec()).expect("sound");
    set.save(place.path("<i>&amp;")).expect("writable");
    let mut evolve = tiny(&["--out", "a'<u>", "--quiet", "--json"]);
    evolve[2] = "<i>&amp;";
    place.ok(&evolve);
    place.ok(&["report", "a'<u>", "--title", "</title><script>x</script>", "--out", "page.html"]);
    let page = place.read("page.html");
    let all = elements(&page);
    assert!(
        all.iter().all(|e| !["b", "i", "u", "script"].contains(&e.name.as_str()) || e.get("id").is_none())
    );
    assert_eq!(all.iter().filter(|e| ["i", "u"].contains(&e.name.as_str())).count(), 0);
    assert!(
        page.contains("&lt;b id='x'&gt;&amp;amp;0.png") || page.contains("&lt;b id='x'&gt;&amp;0.png"),
        "escaped"
    );
}

#[test]
fn without_the_data_there_is_what_the_folder_tells() {
    let place = Place::new();
    evolved(&place, "1", "run", &[]);
    std::fs::rename(place.path("data"), place.path("moved")).expect("possible");
    let output = place.command(&["report", "run"]).output().expect("started");
    let note = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && note.contains("`--data DIR` says where the images are now"), "{note}");
    let page = place.read("run/report.html");
    let all = elements(&page);
    assert_eq!(all.iter().filter(|e| e.name == "img").count(), 0);
    assert!(page.contains("the data cannot be had") && page.contains("/data has 1 fault"), "{page}");
    assert!(all.iter().any(|e| e.get("id") == Some("g-fitness-t")), "the curves are there");
    // Told where they are now, it has all.
    let found = json(&place, &["run", "--data", "moved", "--no-rivals"]);
    assert_eq!(found["runs"][0]["scores"].as_array().map(Vec::len), Some(2));
    // Other images are not taken for them.
    dataset(6, 1).save(place.path("other")).expect("writable");
    let complaint = place.fails(1, &["report", "run", "--data", "other"]);
    assert!(complaint.contains("other training data"), "{complaint}");
}

#[test]
fn what_is_held_out_waits_for_the_end_of_the_run() {
    let place = Place::new();
    evolved(&place, "1", "run", &[]);
    let log = place.read("run/log.jsonl");
    let cut: Vec<&str> = log.lines().take(1).collect();
    // As while the next line is being written.
    place.write("run/log.jsonl", format!("{}\n{{\"generation\":1,\"best", cut[0]));
    let report = json(&place, &["run", "--no-rivals"]);
    let run = &report["runs"][0];
    assert_eq!(run["scores"].as_array().map(Vec::len), Some(1), "training alone");
    assert_eq!(run["answers"]["part"], "training");
    assert!(run["hall_of_fame"].as_array().expect("a list").iter().all(|m| m["holdout"].is_null()));
}

#[test]
fn damaged_folders_are_one_clear_error() {
    let place = Place::new();
    evolved(&place, "1", "run", &[]);
    let whole = place.read("run/log.jsonl");
    let mut lines: Vec<&str> = whole.lines().collect();
    lines[1] = "{\"generation\":1}";
    place.write("run/log.jsonl", lines.join("\n") + "\n");
    let complaint = place.fails(1, &["report", "run"]);
    assert!(complaint.contains("run/log.jsonl:2: ") && complaint.contains("--resume run"), "{complaint}");
    let again = [&whole[..], whole.lines().next().expect("a line"), "\n"].concat();
    place.write("run/log.jsonl", again);
    assert!(place.fails(1, &["report", "run"]).contains("generation 0 where"), "out of order");
    place.write("run/log.jsonl", &whole);
    let hall = place.read("run/hall_of_fame.jsonl");
    place.write("run/hall_of_fame.jsonl", format!("{hall}?\n"));
    let line = format!("run/hall_of_fame.jsonl:{}: ", hall.lines().count() + 1);
    assert!(place.fails(1, &["report", "run"]).contains(&line));
    place.write("run/hall_of_fame.jsonl", &hall);
    place.write("run/best.gp", "(individual");
    assert!(place.fails(1, &["report", "run"]).contains("run/best.gp:"));
    let complaint = place.fails(1, &["report", "data"]);
    assert!(complaint.contains("not a run folder"), "{complaint}");
    place.fails(2, &["report"]);
}

#[test]
fn several_runs_are_compared_by_their_settings() {
    let place = Place::new();
    for seed in ["1", "2", "10"] {
        evolved(&place, seed, &format!("all/seed-{seed}"), &[]);
    }
    evolved(&place, "1", "deep", &["--set", "breeding.max_depth=12"]);
    let report = json(&place, &["all", "--out", "all.html"]);
    let page = place.read("all.html");
    elements(&page);
    let seeds: Vec<u64> =
        report["runs"].as_array().expect("a list").iter().filter_map(|run| run["seed"].as_u64()).collect();
    assert_eq!(seeds, [1, 2, 10]);
    let settings = report["comparison"]["settings"].as_array().expect("a list").clone();
    assert_eq!(settings.len(), 1);
    let mut held_out: Vec<f64> = (report["runs"].as_array().expect("a list").iter())
        .map(|run| run["scores"][1]["fitness"].as_f64().expect("a share"))
        .collect();
    held_out.sort_by(f64::total_cmp);
    let quartiles = settings[0]["parts"].as_array().expect("a list").last().expect("held out")[1].clone();
    assert_eq!(quartiles["median"].as_f64(), Some(held_out[1]));
    assert!(report["comparison"]["pairs"].as_array().expect("a list").is_empty());

    assert!(
        page.contains("data:image/png;base64,") && page.contains("r2-columns"),
        "errors and pictures of each"
    );
    evolved(&place, "1", "all/seed-1-again", &[]);
    let again = json(&place, &["all"]);
    assert_eq!(again["comparison"]["settings"][0]["runs"].as_array().map(Vec::len), Some(3));
    assert_eq!(again["comparison"]["again"].as_array().map(Vec::len), Some(1));
    assert_eq!(again["comparison"]["settings"][0]["parts"], report["comparison"]["settings"][0]["parts"]);

    let report = json(&place, &["all", "deep", "--out", "both.html"]);
    elements(&place.read("both.html"));
    let comparison = &report["comparison"];
    assert_eq!(comparison["settings"].as_array().map(Vec::len), Some(2));
    assert_eq!(comparison["settings"][1]["name"], "breeding.max_depth = 12");
    assert_eq!(comparison["part"], "holdout");
    let pair = &comparison["pairs"][0];
    assert!(pair["p"].as_f64().is_some_and(|p| (0.0..=1.0).contains(&p)), "{pair}");

    // Where more than one thing differs, settings go by their runs; and all runs are seen on the same images.
    evolved(&place, "1", "wide", &["--set", "breeding.max_depth=13", "--set", "breeding.mutation_depth=3"]);
    let report = json(&place, &["all", "deep", "wide", "--out", "three.html"]);
    let page = place.read("three.html");
    elements(&page);
    let settings = report["comparison"]["settings"].as_array().expect("a list");
    let names: Vec<&str> = settings.iter().filter_map(|setting| setting["name"].as_str()).collect();
    assert_eq!(names, ["seed-1 to seed-10", "deep", "wide"]);
    let seen: BTreeSet<String> = (report["runs"].as_array().expect("a list").iter())
        .map(|run| run["answers"]["views"][0]["name"].to_string())
        .collect();
    assert_eq!(seen.len(), 1, "{seen:?}");
    assert!(
        page.contains("id=\"views\"") && page.contains("<span>wide, held out, drive_b_"),
        "a picture of each"
    );
}

/// A log whose numbers are the oddest that it can hold gives a page all the same, and one that is no number an error.
#[test]
fn every_finite_number_in_a_log_is_plotted() {
    let place = Place::new();
    evolved(&place, "1", "run", &[]);
    evolved(&place, "2", "other", &[]);
    let whole = place.read("run/log.jsonl");
    let with = |changes: &[(&str, &str)]| {
        let mut lines: Vec<String> = whole.lines().map(str::to_string).collect();
        let mut record: Value = serde_json::from_str(&lines[1]).expect("JSON");
        for (i, (pointer, _)) in changes.iter().enumerate() {
            *record.pointer_mut(pointer).expect(pointer) = Value::from(format!("change {i}"));
        }
        lines[1] = record.to_string();
        for (i, (_, number)) in changes.iter().enumerate() {
            lines[1] = lines[1].replace(&format!("\"change {i}\""), number);
        }
        place.write("run/log.jsonl", lines.join("\n") + "\n");
    };
    let most = "1.7976931348623157e308";
    for changes in [
        &[("/mean_depth", most)][..],
        &[("/timing/evaluate", most), ("/timing/breed", most), ("/timing/wall", most)],
        &[("/timing/lower", most), ("/timing/execute", most), ("/timing/busy", "-1e300")],
        &[("/mean_nodes", "5e-324"), ("/mean_depth", "-0.0"), ("/timing/wall", "2.2250738585072014e-308")],
        &[
            ("/best_fitness", most),
            ("/mean_fitness", "-1.7976931348623157e308"),
            ("/median_fitness", "5e-324"),
        ],
        &[("/mean_nodes", "-1.7976931348623157e308"), ("/constant_share", most), ("/timing/save", "-0.0")],
    ] {
        with(changes);
        let start = std::time::Instant::now();
        for runs in [&["run"][..], &["run", "other"]] {
            place.ok(&[&["report"], runs, &["--no-rivals", "--no-explain", "--out", "page.html"]].concat());
            let page = place.read("page.html");
            elements(&page);
            assert!(!page.contains("NaN") && !page.contains(">inf") && page.len() < 2 << 20, "{changes:?}");
        }
        assert!(start.elapsed().as_secs() < 120, "{changes:?}");
    }
    for number in ["1e999", "-1e999", "NaN", "Infinity", "\"7\""] {
        with(&[("/mean_depth", number)]);
        let complaint = place.fails(1, &["report", "run", "--no-rivals"]);
        assert!(complaint.contains("run/log.jsonl:2: "), "{number}: {complaint}");
    }
}
