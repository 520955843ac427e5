//! What the tests of the command share: a place with data, starting the command, comparing run folders.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use image::{GrayImage, Luma};
use tempfile::TempDir;
use vsonar::dataset::{Case, Dataset, NamedImage};

pub(crate) const WIDTH: u32 = 64;
pub(crate) const HEIGHT: u32 = 48;

/// A textured floor below a wall whose foot is at a row that varies with image and column.
pub(crate) fn dataset(images: u32, salt: u32) -> Dataset {
    let mut named = Vec::new();
    let mut cases = Vec::new();
    for i in 0..images {
        let foot = |x: u32| 6 + (7 * i + salt + x / (4 + i)) % 36;
        let pixels = GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
            let grain = (x * 31 + y * 17 + i * 7 + (x * y) % 13) % 23;
            Luma([if y > foot(x) { 90 + grain as u8 } else { 200 - (y / 4) as u8 }])
        });
        let drive = if i % 2 == 0 { "a" } else { "b" };
        named.push(NamedImage { name: format!("drive_{drive}_{i}.png"), pixels });
        cases.extend([8, 20, 33, 51].map(|x| Case { image: i as usize, x, y: foot(x) }));
    }
    Dataset::new("data", named, cases).expect("a sound set")
}

/// A temporary folder in which the command is started, with a data set in its subfolder `data`.
pub(crate) struct Place {
    dir: TempDir,
}

impl Place {
    pub(crate) fn new() -> Place {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let place = Place { dir };
        dataset(6, 0).save(place.path("data")).expect("writable");
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("writable");
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The folder in which what is to be this name in the place is being made, once it is there; waits for it.
    pub(crate) fn part_of(&self, name: &str) -> PathBuf {
        let start = std::time::Instant::now();
        let is_part = |entry: &std::fs::DirEntry| {
            let found = entry.file_name().to_string_lossy().into_owned();
            found.starts_with(&format!(".{name}.")) && found.ends_with(".part")
        };
        loop {
            let mut entries = std::fs::read_dir(self.dir.path()).expect("readable").flatten();
            if let Some(part) = entries.find(is_part) {
                return part.path();
            }
            assert!(start.elapsed().as_secs() < 300, "{name} is not begun");
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }

    /// Everything in the place, by relative path, with the content of files.
    pub(crate) fn everything(&self) -> Vec<(PathBuf, Option<Vec<u8>>)> {
        let mut found = Vec::new();
        let mut folders = vec![self.dir.path().to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).expect("readable") {
                let path = entry.expect("readable").path();
                let content =
                    if path.is_dir() { None } else { Some(std::fs::read(&path).expect("readable")) };
                if path.is_dir() {
                    folders.push(path.clone());
                }
                found.push((path.strip_prefix(self.dir.path()).expect("below").to_path_buf(), content));
            }
        }
        found.sort();
        found
    }

    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vsonar"));
        command.current_dir(self.dir.path()).args(arguments).stdin(Stdio::null());
        command
    }

    fn output(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the command can be started")
    }

    /// What a command prints that does what it is asked, without a word of complaint.
    pub(crate) fn ok(&self, arguments: &[&str]) -> String {
        self.ok_with_progress(arguments).0
    }

    /// The same, and the lines about its progress, which go to standard error.
    pub(crate) fn ok_with_progress(&self, arguments: &[&str]) -> (String, String) {
        let output = self.output(arguments);
        let aside = String::from_utf8(output.stderr).expect("UTF-8");
        assert!(
            output.status.success() && complaints(&aside).is_empty(),
            "{arguments:?}: {:?}: {aside}",
            output.status
        );
        let quiet = arguments.iter().any(|flag| ["--quiet", "-q"].contains(flag));
        assert!(aside.is_empty() || !quiet, "{arguments:?}: {aside}");
        (String::from_utf8(output.stdout).expect("UTF-8"), aside)
    }

    /// The complaint of a command that fails with this exit code and leaves no trace in the place.
    pub(crate) fn fails(&self, code: i32, arguments: &[&str]) -> String {
        let before = self.everything();
        let output = self.output(arguments);
        let complaint = one_error(&output, code);
        assert!(before == self.everything(), "{arguments:?} left something behind: {complaint}");
        complaint
    }
}

/// The lines on standard error that are not about the progress of a run, a benchmark, several runs or a drive.
pub(crate) fn complaints(aside: &str) -> Vec<&str> {
    let several = |line: &str| {
        let (done, rest) = line.trim_start().split_once('/')?;
        let (all, _) = rest.split_once(": ")?;
        Some(done.parse::<u32>().is_ok() && all.parse::<u32>().is_ok())
    };
    let drive = |line: &str| {
        let (_, rest) = line.split_once(", run ")?;
        Some(rest.split_once(": ")?.0.parse::<u32>().is_ok())
    };
    let beginnings = ["generation ", "measuring ", "Evolving on "];
    let progress = |line: &&str| {
        beginnings.iter().any(|beginning| line.starts_with(beginning))
            || several(line) == Some(true)
            || drive(line) == Some(true)
    };
    aside.lines().filter(|line| !progress(line)).collect()
}

/// The complaint, held to be one clear error with the right exit code.
pub(crate) fn one_error(output: &Output, code: i32) -> String {
    let complaint = String::from_utf8(output.stderr.clone()).expect("UTF-8");
    assert_eq!(output.status.code(), Some(code), "{complaint}");
    assert!(complaint.starts_with("error: "), "{complaint}");
    assert_eq!(complaint.matches("error:").count(), 1, "{complaint}");
    assert!(!complaint.contains("panicked"), "{complaint}");
    assert!(plain(&complaint), "{complaint:?}");
    complaint
}

/// Whether a text has no control characters but the ends of its lines.
pub(crate) fn plain(text: &str) -> bool {
    text.chars().all(|c| c == '\n' || !vsonar::support::printable::is_hidden(c))
}

/// Settings of a run so small that the walker takes no time, without altered copies of the few images.
pub(crate) const TINY: &[&str] = &[
    "--tolerance",
    "3",
    "--population",
    "40",
    "--generations",
    "4",
    "--set",
    "creation.min_depth=2",
    "--set",
    "creation.max_depth=4",
    "--set",
    "filter.max_draws=30",
    "--set",
    "augmentation.mirror=0",
    "--set",
    "augmentation.gain=0",
    "--set",
    "augmentation.brightness=0",
];

/// What makes a tiny run collapse: selection that is too hard for so small a population.
pub(crate) const HOPELESS: &[&str] = &[
    "--generations",
    "26",
    "--set",
    "filter.enabled=false",
    "--set",
    "selection.kind=tournament",
    "--set",
    "creation.plain_column_probability=0",
];

/// `evolve` on the place's data, tiny unless the other arguments say otherwise.
pub(crate) fn tiny<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["evolve", "--data", "data"];
    // A flag may be given only once.
    let given = |flag: &str| flag != "--set" && arguments.contains(&flag);
    for pair in TINY.chunks(2).filter(|pair| !given(pair[0])) {
        all.extend(pair);
    }
    all.extend(arguments);
    all
}

/// What a run folder says, but for the timing.
#[derive(Debug, PartialEq)]
pub(crate) struct Recorded {
    pub(crate) log: Vec<serde_json::Value>,
    pub(crate) best: String,
    pub(crate) hall: String,
}

pub(crate) fn recorded(run: &Path) -> Recorded {
    let read = |name: &str| std::fs::read_to_string(run.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let without_timing = |line: &str| {
        let mut value: serde_json::Value = serde_json::from_str(line).expect("a line is JSON");
        assert!(value.as_object_mut().expect("an object").remove("timing").is_some());
        value
    };
    Recorded {
        log: read("log.jsonl").lines().map(without_timing).collect(),
        best: read("best.gp"),
        hall: read("hall_of_fame.jsonl"),
    }
}

/// More generations than any test sees the end of: such a run is still at it whenever somebody comes to stop it.
pub(crate) const ENDLESS: &[&str] = &["--generations", "1000000"];

/// How many generations are recorded so far.
pub(crate) fn logged(run: &Path) -> usize {
    std::fs::read_to_string(run.join("log.jsonl")).map_or(0, |text| text.matches('\n').count())
}

/// Lets a run that was [`ENDLESS`] end after so many generations. The command only ever adds some.
pub(crate) fn end_after(run: &Path, generations: usize) {
    let file = run.join("settings.toml");
    let settings = std::fs::read_to_string(&file).expect("there");
    let ends = settings.replace("generations = 1000000\n", &format!("generations = {generations}\n"));
    assert_ne!(ends, settings);
    std::fs::write(&file, ends).expect("writable");
}

/// Random numbers for tests; the seed is to be printed on failure.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    /// A seed that differs from one run of the tests to the next.
    pub(crate) fn seed() -> u64 {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970");
        now.as_nanos() as u64
    }

    pub(crate) fn below(&mut self, n: u64) -> u64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ z >> 31) % n
    }
}

/// Whether ffmpeg is there. Where it is not that is said, and is a failure where VSONAR_REQUIRE_TOOLS is set.
pub(crate) fn has_ffmpeg() -> bool {
    let found = Command::new("ffmpeg").arg("-version").output().is_ok_and(|output| output.status.success());
    if !found {
        let required = std::env::var_os("VSONAR_REQUIRE_TOOLS").is_some();
        assert!(!required, "`ffmpeg -version` does not run, but VSONAR_REQUIRE_TOOLS is set");
        eprintln!("skipped: `ffmpeg -version` does not run");
    }
    found
}
