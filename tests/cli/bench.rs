//! Benchmarks: tables, JSON, plots, and the populations that are kept.

use std::path::Path;

use serde_json::Value;

use crate::common::*;

/// The executors, as the help lists them.
fn executors(place: &Place) -> Vec<String> {
    let help = place.ok(&["bench", "--help"]);
    let rest = help.split("--executors").nth(1).expect("a flag");
    let rest = rest.split("Possible values:").nth(1).expect("a list").split("--rounds").next().expect("more");
    let name = |line: &str| line.trim().strip_prefix("- ")?.split_once(':').map(|(name, _)| name.to_string());
    rest.lines().filter_map(name).collect()
}

/// A benchmark that takes next to no time.
fn tiny_bench<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["bench", "--data", "data"];
    for pair in [
        ["--preset", "paper"],
        ["--population", "60"],
        ["--generations", "0,1,2"],
        ["--sample", "5"],
        ["--rounds", "1"],
    ] {
        if !arguments.contains(&pair[0]) {
            all.extend(pair);
        }
    }
    all.extend(arguments);
    all
}

/// The files of the store, by name.
fn store(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("readable").path());
    let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
    let mut files: Vec<_> =
        entries.map(|path| (name(&path), std::fs::read(&path).expect("readable"))).collect();
    files.sort();
    files
}

#[test]
fn tables_have_a_row_for_each_executor() {
    let place = Place::new();
    let (text, aside) = place.ok_with_progress(&tiny_bench(&[]));
    assert!(plain(&text), "{text:?}");
    assert!(!text.contains("measuring") && aside.contains("measuring generation 1"), "{aside}");
    let executors = executors(&place);
    assert!(executors.len() >= 4, "{executors:?}");
    for executor in executors {
        let rows = text.lines().filter(|line| line.split_whitespace().next() == Some(&executor)).count();
        // Three generations and the cases; and what compiles, break-even in each generation. Of the widths of
        // vectors the machine need not have all, and the widest goes by its short name.
        let width = executor.starts_with("batch-");
        assert!([4, 7].contains(&rows) || width && rows == 0, "{executor}: {rows} rows in {text}");
        assert!(executor != "cranelift" || rows == 7, "{text}");
    }
    for part in ["Generation 0: ", "Generation 2: ", "Break-even", "24 cases", "GPop/s"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    let quiet = place.ok(&tiny_bench(&["--quiet"]));
    assert!(!quiet.contains("measuring") && quiet.contains("Generation 2: "), "{quiet}");
}

#[test]
fn json_has_the_documented_fields() {
    let place = Place::new();
    let arguments =
        ["--quiet", "--json", "--out", "report.json", "--cases", "7,all", "--executors", "cranelift,tree"];
    let printed = place.ok(&tiny_bench(&arguments));
    assert_eq!(printed, place.read("report.json"));
    let report: Value = serde_json::from_str(&printed).expect("JSON");
    assert_eq!((&report["version"], &report["rounds"]), (&Value::from(2), &Value::from(1)));
    assert_eq!(report["data"]["cases"], 24);
    assert_eq!(report["settings"]["population"], 60);
    assert!(report["machine"]["threads"].as_u64() > Some(0));
    let generations = report["generations"].as_array().expect("a list");
    assert_eq!(
        generations.iter().map(|g| g["generation"].as_u64()).collect::<Vec<_>>(),
        [Some(0), Some(1), Some(2)]
    );
    for generation in generations {
        let executors = generation["executors"].as_array().expect("a list");
        let names: Vec<_> = executors.iter().map(|e| e["executor"].as_str()).collect();
        assert_eq!(names, [Some("cranelift"), Some("tree")]);
        for executor in executors {
            for field in ["lower_s", "compile_s", "execute_s", "together_s"] {
                let spread = |part: &str| executor[field][part].as_f64().expect("a number");
                assert!(spread("q1") <= spread("median") && spread("median") <= spread("q3"), "{executor}");
            }
            for field in ["gpops", "gpops_execute", "times_walker"] {
                assert!(executor[field].as_f64() > Some(0.0), "{field} of {executor}");
            }
            let totals = &executor["round_totals_s"];
            assert!(
                totals["min"].as_f64() > Some(0.0) && totals["min"] == totals["max"],
                "one round: {totals}"
            );
        }
        assert_eq!(executors[1]["times_walker"], 1.0);
        // Of five individuals a slow executor runs the first and the fifth.
        assert_eq!((&executors[0]["individuals"], &executors[1]["individuals"]), (&5.into(), &2.into()));
        let even = &generation["break_even"][0];
        assert_eq!(
            (even["executor"].as_str(), even["interpreter"].as_str()),
            (Some("cranelift"), Some("tree"))
        );
        assert!(even["cases"].as_object().is_some_and(|cases| cases.contains_key("median")), "{even}");
        for share in ["always_interpret", "always_compile", "compile_here"] {
            assert!((0.0..=1.0).contains(&even[share].as_f64().expect("a share")), "{even}");
        }
        let measured = generation["measured"].as_array().expect("a list");
        assert_eq!(measured.len(), 5);
        assert!(measured.iter().all(|m| m["nodes"].as_u64() > Some(0) && m["operations"].is_u64()));
        assert!(measured[0]["together_s"][1].is_f64() && measured[1]["together_s"][1].is_null());
    }
    let points = report["scaling"]["points"].as_array().expect("a list");
    assert_eq!(points.iter().map(|p| p["cases"].as_u64()).collect::<Vec<_>>(), [Some(7), Some(24)]);
    assert!(points.iter().all(|p| p["executors"][1]["together_s"]["median"].as_f64() > Some(0.0)));
}

/// The names of the elements of an XML text, each of which is closed where it should be.
fn elements(text: &str) -> Vec<String> {
    let (mut open, mut all) = (Vec::<String>::new(), Vec::new());
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        let end = rest[start..].find('>').map(|end| start + end).expect("every tag ends");
        let tag = &rest[start + 1..end];
        assert!(!rest[..start].contains('>') && tag.matches('"').count().is_multiple_of(2), "{tag}");
        let name: String =
            tag.trim_start_matches('/').chars().take_while(char::is_ascii_alphanumeric).collect();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else {
            all.push(name.clone());
            if !tag.ends_with('/') {
                open.push(name);
            }
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty() && rest.trim().is_empty(), "{open:?} {rest:?}");
    all
}

#[test]
fn plots_are_pictures() {
    let place = Place::new();
    place.ok(&tiny_bench(&[
        "--quiet",
        "--plot",
        "a.svg",
        "--plot",
        "b.PNG",
        "--executors",
        "reference,tree",
    ]));
    let svg = place.read("a.svg");
    let elements = elements(&svg);
    assert_eq!(elements[..4], ["svg", "title", "desc", "rect"], "named, described, on a ground");
    assert!(
        svg.contains("fill=\"#FFFFFF\"") && svg.contains(">\nreference\n<") && svg.contains(">\ntree\n<")
    );
    assert!(elements.iter().filter(|e| *e == "circle").count() >= 2 * 6, "dots and points");
    assert!(elements.iter().filter(|e| *e == "polyline").count() >= 2, "lines");
    let bytes = std::fs::read(place.path("b.PNG")).expect("written");
    let picture =
        image::load_from_memory_with_format(&bytes, image::ImageFormat::Png).expect("a PNG").into_rgb8();
    assert_eq!(picture.dimensions(), (2160, 960));
    let pixels = |colour| picture.pixels().filter(|p| p.0 == colour).count();
    let colours = [[255, 255, 255], [0, 0, 0], [0, 114, 178], [213, 94, 0]].map(pixels);
    assert!(colours[0] > 1_000_000 && colours[1..].iter().all(|&n| n > 100), "{colours:?}");
}

#[test]
fn everyone_measures_the_same() {
    let place = Place::new();
    let run = |arguments: &[&str]| {
        place.ok(&tiny_bench(&[arguments, &["--quiet", "--executors", "reference", "--cases", "1"]].concat()))
    };
    run(&["--store", "a"]);
    let first = store(&place.path("a"));
    assert_eq!(first.len(), 3);
    // Evolved again, they are the same; and so they are without the generation between.
    run(&["--store", "b"]);
    run(&["--store", "c", "--generations", "2,0"]);
    assert_eq!(first, store(&place.path("b")));
    assert_eq!(store(&place.path("c")), [first[0].clone(), first[2].clone()]);
    // What is there is taken, and not touched: it can be read only.
    let file = place.path("a").join(&first[1].0);
    let modified = || std::fs::metadata(&file).and_then(|m| m.modified()).expect("a file");
    let before = modified();
    std::fs::remove_file(place.path("a").join(&first[2].0)).expect("there");
    run(&["--store", "a"]);
    assert_eq!((store(&place.path("a")), modified()), (first.clone(), before));
    // Another seed is another population.
    run(&["--store", "a", "--seed", "2"]);
    let both = store(&place.path("a"));
    assert_eq!(both.len(), 6);
    let individuals = |n: usize| both[n].1.splitn(2, |&b| b == b'\n').nth(1).map(<[u8]>::to_vec);
    assert_ne!(individuals(0), individuals(3));
}

#[test]
fn a_broken_store_is_named() {
    let place = Place::new();
    let arguments = tiny_bench(&["--quiet", "--executors", "reference", "--cases", "1", "--store", "kept"]);
    place.ok(&arguments);
    let files = store(&place.path("kept"));
    let name = format!("kept/{}", files[1].0);
    let text = String::from_utf8(files[1].1.clone()).expect("text");
    let mut noise = files[1].1.clone();
    noise[500] = 0xff;
    for broken in [
        &text.as_bytes()[..text.len() / 2],
        b"",
        &noise,
        text.replacen("\"seed\":1", "\"seed\":7", 1).as_bytes(),
    ] {
        place.write(&name, broken);
        let complaint = place.fails(1, &arguments);
        assert!(complaint.contains(&name) && complaint.contains("remove the file"), "{complaint}");
    }
    std::fs::remove_file(place.path(&name)).expect("there");
    place.ok(&arguments);
    assert_eq!(store(&place.path("kept")), files);
}

#[test]
fn wrong_flags_are_refused_before_anything_is_done() {
    let place = Place::new();
    for (arguments, said) in [
        (&["--executors", "fast"][..], "'fast'"),
        (&["--executors", "tree,,"], "--executors"),
        (&["--generations", "1,x"], "'x'"),
        (&["--generations", "-1"], "-1"),
        (&["--sample", "0"], "--sample"),
        (&["--rounds", "0"], "--rounds"),
        (&["--population", "1"], "population"),
        (&["--cases", "25"], "there are only 24 fitness cases"),
        (&["--cases", "0"], "`all`"),
        (&["--plot", "a.pdf"], ".svg or .png"),
        (&["--preset", "best"], "'best'"),
    ] {
        let complaint = place.fails(2, &[&["bench", "--data", "data"], arguments].concat());
        assert!(complaint.contains(said), "{arguments:?}: {complaint}");
    }
    let complaint = place.fails(2, &["bench", "--match", "a*"]);
    assert!(complaint.contains("--data"), "{complaint}");
    let complaint = place.fails(1, &["bench", "--data", "nowhere"]);
    assert!(complaint.contains("nowhere"), "{complaint}");
}
