//! Data sets from folders: what is accepted, and that every fault is reported with its place.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, Luma};
use tempfile::TempDir;
use vsonar::dataset::{Case, Constants, Dataset, FaultKind, NamedImage, Place, SaveError, SplitError, check};

/// A folder under construction.
struct Folder(TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn table(self, text: impl AsRef<[u8]>) -> Folder {
        fs::write(self.path().join("labels.csv"), text).unwrap();
        self
    }

    fn image(self, name: &str, width: u32, height: u32) -> Folder {
        let shade = name.bytes().fold(0u8, |a, b| a.wrapping_mul(31).wrapping_add(b));
        let pixels =
            GrayImage::from_fn(width, height, |x, y| Luma([shade.wrapping_add((x * 7 + y * 3) as u8)]));
        let path = self.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        pixels.save(path).unwrap();
        self
    }

    /// The report's faults as (line, code), after checking that `load` agrees.
    fn faults(&self) -> Vec<(Option<u64>, &'static str)> {
        let report = check(self.path());
        match Dataset::load(self.path()) {
            Ok(set) => {
                assert!(report.is_sound());
                assert_eq!((set.images().len(), set.cases().len()), (report.images(), report.rows()));
            }
            Err(error) => {
                assert_eq!(error.faults(), report.faults());
                let text = error.to_string();
                let nothing = ["no-folder", "no-table"].contains(&report.faults()[0].kind.code());
                assert_eq!(text.contains("vsonar data check "), !nothing, "{text}");
                assert!(text.contains(&report.faults()[0].to_string()), "{text}");
            }
        }
        let text = report.to_string();
        for fault in report.faults() {
            assert!(text.contains(&fault.to_string()), "{text}");
        }
        let line = |at| if let Place::Line(line) = at { Some(line) } else { None };
        report.faults().iter().map(|f| (line(f.at), f.kind.code())).collect()
    }
}

fn sound() -> Folder {
    Folder::new().image("images/a.png", 32, 24).image("images/b.png", 32, 24)
}

#[test]
fn loads_images_from_the_subfolder_and_beside_the_table() {
    let table = "image,x,y\nb.png,4,0\na.png,5,23\nb.png,0,7\n";
    let inside = sound().table(table);
    let beside = Folder::new().image("a.png", 32, 24).image("b.png", 32, 24).table(table);
    for folder in [&inside, &beside] {
        assert_eq!(folder.faults(), []);
        let set = Dataset::load(folder.path()).unwrap();
        assert_eq!((set.width(), set.height()), (32, 24));
        let names: Vec<&str> = set.images().iter().map(|i| i.name.as_str()).collect();
        assert_eq!(names, ["b.png", "a.png"], "in the order of the table");
        let case = |image, x, y| Case { image, x, y };
        assert_eq!(set.cases(), [case(0, 4, 0), case(1, 5, 23), case(0, 0, 7)]);
        assert_eq!(set.labels(), [0, 23, 7]);
        assert_eq!(set.columns(), [0, 4, 5]);
        assert_eq!(set.name(), folder.path().file_name().unwrap().to_str().unwrap());
    }
    // the subfolder comes first
    let both = sound().image("b.png", 99, 99).table("image,x,y\nb.png,4,0\n");
    assert_eq!(both.faults(), []);
    assert_eq!(Dataset::load(both.path()).unwrap().width(), 32);
    let deeper = Folder::new().image("images/run 1/a.png", 16, 16).table("image,x,y\nrun 1/a.png,15,15\n");
    assert_eq!(deeper.faults(), []);
}

#[test]
fn the_table_may_be_written_in_many_ways() {
    for table in [
        "y,image,weather,x\n1,a.png,rain,2\n3,b.png,,4\n",
        "\u{feff}image,x,y\na.png,2,1\nb.png,4,3\n",
        "image,x,y\r\na.png,2,1\r\nb.png,4,3",
        " image , x , y \n\"a.png\", 2 ,1\n\nb.png,+4,003\n",
    ] {
        let folder = sound().table(table);
        assert_eq!(folder.faults(), [], "{table:?}");
        let set = Dataset::load(folder.path()).unwrap();
        assert_eq!(set.cases(), [Case { image: 0, x: 2, y: 1 }, Case { image: 1, x: 4, y: 3 }], "{table:?}");
    }
}

#[test]
fn each_fault_alone() {
    type Found = (Option<u64>, &'static str);
    let cases: &[(&str, &[Found])] = &[
        ("image,x,y\n", &[(None, "empty")]),
        ("", &[(None, "empty")]),
        ("image,x\na.png,1\n", &[(Some(1), "header")]),
        ("image,x,y,x\na.png,1,2,1\n", &[(Some(1), "header")]),
        ("a.png,1,2\n", &[(Some(1), "header")]),
        ("image,x,y\na.png,1,2\nc.png,1,2\nc.png,2,2\n", &[(Some(3), "missing-image")]),
        ("image,x,y\na.png,1,2\nb.png,1\n", &[(Some(3), "row")]),
        ("image,x,y\na.png,1,2\nb.png,1,2,3\n", &[(Some(3), "row")]),
        ("image,x,y\na.png,1,2\n\n\nb.png,1\n", &[(Some(5), "row")]),
        ("image,x,y\r\na.png,1,2\r\n\r\nb.png,1\r\n", &[(Some(4), "row")]),
        ("image,x,y\ra.png,1,2\rb.png,1\r", &[(Some(3), "row")]),
        ("\u{feff}\n\nimage,x,y\n\na.png,1,2\n\nb.png,1", &[(Some(7), "row")]),
        ("image,x,y\n\"a\nb.png\",1,2\nb.png,1", &[(Some(2), "missing-image"), (Some(4), "row")]),
        ("image,x,y\na.png,32,2\n", &[(Some(2), "outside")]),
        ("image,x,y\na.png,-1,2\n", &[(Some(2), "outside")]),
        ("image,x,y\na.png,1,24\n", &[(Some(2), "outside")]),
        ("image,x,y\na.png,1,99999999999999999999\n", &[(Some(2), "outside")]),
        ("image,x,y\na.png,1.5,2\n", &[(Some(2), "number")]),
        ("image,x,y\na.png,1,\n", &[(Some(2), "number")]),
        ("image,x,y\na.png,nan,up\n", &[(Some(2), "number"), (Some(2), "number")]),
        ("image,x,y\na.png,1,2\nb.png,1,2\na.png,1,3\n", &[(Some(4), "duplicate")]),
        ("image,x,y\n../images/a.png,1,2\n", &[(Some(2), "name")]),
        ("image,x,y\n/etc/passwd,1,2\n", &[(Some(2), "name")]),
        ("image,x,y\n,1,2\n", &[(Some(2), "name")]),
        ("image,x,y\nimages,1,2\n", &[(Some(2), "missing-image")]),
    ];
    for (table, expected) in cases {
        assert_eq!(sound().table(table).faults(), *expected, "{table:?}");
    }
    let bytes = sound().table(b"image,x,y\na.png,1,2\n\xff\xfe.png,1,2\n");
    assert_eq!(bytes.faults(), [(Some(3), "row")]);
    assert_eq!(sound().faults(), [(None, "no-table")]);
    let report = check(sound().path().join("nowhere"));
    assert_eq!(report.faults()[0].kind.code(), "no-folder");
    let file = sound().table("image,x,y\n");
    assert_eq!(check(file.path().join("labels.csv")).faults()[0].kind.code(), "no-folder");
}

#[test]
fn faults_of_images() {
    let table = "image,x,y\na.png,1,2\nb.png,1,2\nc.png,1,2\nc.png,2,2\n";
    let differing = sound().image("images/c.png", 32, 25).table(table);
    assert_eq!(differing.faults(), [(Some(4), "size")]);
    let small = sound().image("images/c.png", 15, 24).table(table);
    assert_eq!(small.faults(), [(Some(4), "small")]);
    let all_small = Folder::new().image("a.png", 8, 8).table("image,x,y\na.png,1,2\n");
    assert_eq!(all_small.faults(), [(Some(2), "small")]);
    // the size most images have counts, not that of the first
    let first =
        Folder::new().image("a.png", 40, 24).image("b.png", 32, 24).image("c.png", 32, 24).table(table);
    assert_eq!(first.faults(), [(Some(2), "size")]);

    let truncated = sound().image("images/c.png", 32, 24).table(table);
    let path = truncated.path().join("images/c.png");
    let bytes = fs::read(&path).unwrap();
    for keep in [0, 7, 20, bytes.len() / 2, bytes.len() - 14] {
        fs::write(&path, &bytes[..keep]).unwrap();
        assert_eq!(truncated.faults(), [(Some(4), "image")], "{keep} bytes kept");
    }
    fs::write(&path, "no image at all").unwrap();
    assert_eq!(truncated.faults(), [(Some(4), "image")]);
}

#[test]
fn all_faults_together_are_all_reported() {
    let folder = sound()
        .image("images/wide.png", 64, 24)
        .image("images/tiny.png", 8, 8)
        .image("images/cut.png", 32, 24)
        .image("spare.png", 32, 24)
        .table(
            "image,x,y,note\n\
             a.png,1,2,\n\
             b.png,1,2,fine\n\
             gone.png,1,2,\n\
             wide.png,1,2,\n\
             tiny.png,1,2,\n\
             cut.png,1,2,\n\
             a.png,99,-5,\n\
             a.png,one,2,\n\
             a.png,1,7,\n\
             b.png,2\n\
             ../b.png,1,2,\n\
             gone.png,99,2,\n",
        );
    let cut = folder.path().join("images/cut.png");
    let bytes = fs::read(&cut).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let expected = [
        (Some(4), "missing-image"),
        (Some(5), "size"),
        (Some(6), "small"),
        (Some(7), "image"),
        (Some(8), "outside"),
        (Some(8), "outside"),
        (Some(9), "number"),
        (Some(10), "duplicate"),
        (Some(11), "row"),
        (Some(12), "name"),
        (Some(13), "outside"),
    ];
    assert_eq!(folder.faults(), expected);
    let report = check(folder.path());
    assert_eq!((report.rows(), report.sound_cases()), (12, 2));
    assert_eq!(report.unlabelled(), ["spare.png"]);
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["faults"].as_array().unwrap().len(), 11);
    assert_eq!(json["faults"][1]["line"], 5);
    assert_eq!(json["faults"][1]["kind"], "size");
    let error = Dataset::load(folder.path()).unwrap_err().to_string();
    assert!(error.contains("has 11 faults") && error.contains("and 8 more"), "{error}");
}

#[test]
fn images_without_labels_are_a_note() {
    let folder = sound().image("other.png", 20, 20).table("image,x,y\na.png,1,2\n");
    assert_eq!(folder.faults(), []);
    let report = check(folder.path());
    assert_eq!(report.unlabelled(), ["b.png", "other.png"]);
    assert!(report.to_string().contains("2 image(s) without labels: b.png, other.png"));
}

/// Images named so, each with a case at every given (x, y).
fn set(names: &[&str], cases: &[(u32, u32)]) -> Dataset {
    let pixels = |i: usize| GrayImage::from_pixel(64, 240, Luma([i as u8]));
    let images = names
        .iter()
        .enumerate()
        .map(|(i, n)| NamedImage { name: n.to_string(), pixels: pixels(i) })
        .collect();
    let cases = (0..names.len()).flat_map(|image| cases.iter().map(move |&(x, y)| Case { image, x, y }));
    Dataset::new("made", images, cases.collect()).unwrap()
}

#[test]
fn parts_in_memory_are_held_to_the_same_rules() {
    let image = |name: &str, w, h| NamedImage { name: name.into(), pixels: GrayImage::new(w, h) };
    let case = |image, x, y| Case { image, x, y };
    let images =
        vec![image("a.png", 20, 20), image("../b", 20, 20), image("a.png", 20, 21), image("c.png", 5, 20)];
    let cases = vec![case(0, 1, 1), case(0, 1, 2), case(0, 20, 20), case(9, 1, 1), case(2, 1, 1)];
    let error = Dataset::new("parts", images, cases).unwrap_err();
    let found: Vec<(Place, &str)> = error.faults().iter().map(|f| (f.at, f.kind.code())).collect();
    let expected = [
        (Place::Image(1), "name"),
        (Place::Image(2), "name-twice"),
        (Place::Image(2), "size"),
        (Place::Image(3), "small"),
        (Place::Case(1), "duplicate"),
        (Place::Case(2), "outside"),
        (Place::Case(2), "outside"),
        (Place::Case(3), "no-image"),
    ];
    assert_eq!(found, expected);
    let error = Dataset::new("none", vec![image("a.png", 20, 20)], vec![]).unwrap_err();
    assert_eq!(error.faults()[0].kind, FaultKind::Empty);
    // images come into the order of the cases, and those without a case are left out
    let images = vec![image("a.png", 20, 20), image("b.png", 20, 20), image("c.png", 20, 20)];
    let set = Dataset::new("order", images, vec![case(2, 1, 1), case(0, 1, 1), case(2, 2, 2)]).unwrap();
    assert_eq!(set.images().iter().map(|i| i.name.as_str()).collect::<Vec<_>>(), ["c.png", "a.png"]);
    assert_eq!(set.cases(), [case(0, 1, 1), case(1, 1, 1), case(0, 2, 2)]);
}

#[test]
fn splits_by_name() {
    let whole = set(&["run_A_1.png", "run_B_1.png", "run_A_2.png", "run_C_1.png"], &[(1, 2), (3, 4)]);
    let names = |s: &Dataset| s.images().iter().map(|i| i.name.clone()).collect::<Vec<_>>();
    let (train, holdout) = whole.split("run_[AB]*", "run_C*").unwrap();
    assert_eq!(names(&train), ["run_A_1.png", "run_B_1.png", "run_A_2.png"]);
    assert_eq!(names(&holdout), ["run_C_1.png"]);
    assert_eq!((train.cases().len(), holdout.cases().len()), (6, 2));
    for case in train.cases() {
        let here = &train.images()[case.image];
        let there = whole.images().iter().find(|i| i.name == here.name).unwrap();
        assert_eq!(here.pixels, there.pixels, "a case keeps its image");
    }
    assert_eq!(holdout.cases()[0], Case { image: 0, x: 1, y: 2 });
    assert_eq!(names(&whole.select("*_{B,C}_?.png").unwrap()), ["run_B_1.png", "run_C_1.png"]);

    let error = whole.split("run_[AB", "run_C*").unwrap_err();
    assert!(matches!(error, SplitError::Pattern { .. }) && error.to_string().contains("run_[AB"), "{error}");
    let error = whole.split("run_A*", "walk_*").unwrap_err();
    assert!(matches!(error, SplitError::Nothing { .. }), "{error}");
    let text = error.to_string();
    assert!(
        text.contains("walk_*") && text.contains("run_A_1.png") && text.contains("run_C_1.png"),
        "{text}"
    );
    let error = whole.split("*", "run_A*").unwrap_err();
    assert!(matches!(error, SplitError::Overlap { count: 2, .. }), "{error}");
    // a pattern is held against the whole name
    assert!(whole.select("run_A").is_err() && whole.select("RUN_A*").is_err());
}

#[test]
fn constants_learned_on_one_set_score_on_another() {
    let a = set(&["1.png", "2.png"], &[(1, 10), (2, 100), (3, 105)]);
    let constants = Constants::learn(&a, 10.0);
    assert_eq!(constants.overall().correct, 4);
    assert_eq!(
        constants.columns().iter().map(|c| (c.0, c.1.correct)).collect::<Vec<_>>(),
        [(1, 2), (2, 2), (3, 2)]
    );
    assert_eq!(constants.score(&a).per_column, 6);
    assert_eq!(constants.answer(1), 10.0);
    assert_eq!(constants.answer(50), constants.overall().answer, "an unseen column takes the overall answer");
    let b = set(&["3.png"], &[(1, 21), (2, 95), (50, 101)]);
    let score = constants.score(&b);
    assert_eq!((score.overall, score.per_column, score.cases), (2, 2, 3));
}

#[test]
fn fingerprint_tells_any_change() {
    let base = set(&["a.png", "b.png"], &[(1, 2), (3, 4)]);
    let mut prints = vec![base.fingerprint()];
    let parts = || (base.images().to_vec(), base.cases().to_vec());
    let mut change = |f: &dyn Fn(&mut Vec<NamedImage>, &mut Vec<Case>)| {
        let (mut images, mut cases) = parts();
        f(&mut images, &mut cases);
        prints.push(Dataset::new("made", images, cases).unwrap().fingerprint());
    };
    change(&|images, _| images[1].pixels.put_pixel(63, 239, Luma([77])));
    change(&|images, _| images[0].name = "c.png".into());
    change(&|images, _| (images[0].name, images[1].name) = ("b.png".into(), "a.png".into()));
    change(&|_, cases| cases[3].y = 5);
    change(&|_, cases| cases[3].x = 5);
    change(&|_, cases| cases.swap(2, 3));
    change(&|_, cases| cases.truncate(3));
    change(&|images, _| images.iter_mut().for_each(|i| i.pixels = GrayImage::new(64, 240)));
    change(&|images, _| images.iter_mut().for_each(|i| i.pixels = GrayImage::new(240, 64)));
    let count = prints.len();
    prints.sort_unstable();
    prints.dedup();
    assert_eq!(prints.len(), count);
    let (images, cases) = parts();
    assert_eq!(Dataset::new("other name", images, cases).unwrap().fingerprint(), base.fingerprint());
}

#[test]
fn saving_and_loading_gives_the_same_set() {
    let place = tempfile::tempdir().unwrap();
    let names = ["a.png", "sub/b, \"quoted\".png", "ü.png"];
    let whole = set(&names, &[(0, 0), (63, 239)]);
    let dir = place.path().join("out");
    whole.save(&dir).unwrap();
    let loaded = Dataset::load(&dir).unwrap();
    assert_eq!(loaded.images(), whole.images());
    assert_eq!(loaded.cases(), whole.cases());
    assert_eq!(loaded.fingerprint(), whole.fingerprint());
    assert_eq!(loaded.name(), "out");

    // nothing is overwritten, and nothing is left behind
    fs::write(dir.join("mine.txt"), "keep").unwrap();
    assert!(matches!(whole.save(&dir), Err(SaveError::Exists(_))));
    assert_eq!(fs::read(dir.join("mine.txt")).unwrap(), b"keep");
    fs::create_dir(place.path().join("empty")).unwrap();
    assert!(matches!(whole.save(place.path().join("empty")), Err(SaveError::Exists(_))));
    let error = whole.save(place.path().join("no/parent")).unwrap_err();
    assert!(matches!(error, SaveError::Io { .. }), "{error}");
    let mut left: Vec<_> = fs::read_dir(place.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["empty", "out"]);

    // names of other formats become PNG names, all different
    let mixed = set(&["a.jpg", "a.jpg.png", "a"], &[(0, 0)]);
    let dir = place.path().join("mixed");
    mixed.save(&dir).unwrap();
    let loaded = Dataset::load(&dir).unwrap();
    assert_eq!(loaded.images().len(), 3);
    for (a, b) in loaded.images().iter().zip(mixed.images()) {
        assert!(a.name.ends_with(".png") && a.pixels == b.pixels);
    }
}

#[test]
fn lanes_are_the_cases_in_order() {
    let whole = set(&["a.png", "b.png"], &[(1, 2), (3, 4)]);
    let cases = whole.case_set();
    assert_eq!((cases.width(), cases.height(), cases.len()), (64, 240, 4));
    for (lane, case) in cases.lanes().iter().zip(whole.cases()) {
        assert_eq!((lane.image as usize, lane.column), (case.image, case.x));
    }
}

/// The real images are not part of the project; where they are, they must read as known.
#[test]
fn real_images_where_present() {
    let root = match std::env::var_os("VSONAR_DATA") {
        Some(root) => PathBuf::from(root),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
    };
    for (name, images, cases, overall, per_column) in
        [("corridor", 85, 505, 29.9, 50.7), ("street", 100, 600, 54.8, 57.2)]
    {
        let dir = root.join(name);
        if !dir.is_dir() {
            continue;
        }
        let report = check(&dir);
        assert!(report.is_sound(), "{report}");
        let set = Dataset::load(&dir).unwrap();
        assert_eq!((set.images().len(), set.cases().len()), (images, cases));
        let score = report.constants_score().unwrap();
        let percent = |share: f64| (share * 1000.0).round() / 10.0;
        assert_eq!(
            (percent(score.overall_share()), percent(score.per_column_share())),
            (overall, per_column)
        );
    }
}
