//! `vsonar evolve --watch` in Chromium: the page keeps up with the run, and whoever reads it is not disturbed.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;
use vsonar::world::Corridor;

use crate::browser::{Browser, Screen, is_there};
use crate::common::wait_until;

/// The command, evolving for as long as anybody looks; killed when dropped.
struct Watched {
    process: Child,
    address: String,
    place: TempDir,
}

impl Watched {
    fn start(more: &[&str]) -> Watched {
        let place = tempfile::tempdir().expect("a temporary folder");
        let corridor = Corridor { width: 160, height: 120, ..Corridor::default() };
        corridor.render(1, 6).expect("a small corridor").save(place.path().join("data")).expect("writable");
        let mut command = Command::new(env!("CARGO_BIN_EXE_vsonar"));
        command
            .current_dir(place.path())
            .args(["evolve", "--data", "data", "--out", "run", "--watch", "--quiet"]);
        command.args(["--threads", "1", "--generations", "100000", "--tolerance", "10"]).args(more);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().expect("the command can be started");
        let mut line = String::new();
        let mut said = BufReader::new(process.stderr.take().expect("piped"));
        said.read_line(&mut line).expect("UTF-8");
        // What it says later is not held up.
        std::thread::spawn(move || std::io::copy(&mut said, &mut std::io::sink()));
        let address = line.strip_prefix("watch: ").unwrap_or_else(|| panic!("no address: {line}"));
        Watched { process, address: address.trim().to_string(), place }
    }

    /// Generations recorded.
    fn generations(&self) -> usize {
        let log = self.place.path().join(Path::new("run/log.jsonl"));
        std::fs::read_to_string(log).map_or(0, |text| text.lines().count())
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Small, so that a generation takes a moment.
const SMALL: &[&str] = &["--population", "200"];

fn revision(browser: &Browser) -> u64 {
    let text = browser.get("document.getElementById('report').dataset.revision");
    text.as_str().and_then(|text| text.parse().ok()).expect("a number")
}

fn later(browser: &Browser, revision: u64) {
    browser.wait(&format!("Number(document.getElementById('report').dataset.revision) > {revision}"));
}

/// The figure of the fitness.
const FIGURE: &str = "document.getElementById('g-fitness-t').closest('figure')";

#[test]
fn it_keeps_up_and_leaves_the_reader_alone() {
    if !is_there() {
        return;
    }
    let watched = Watched::start(SMALL);
    let browser = Browser::start(Screen::Desktop);
    browser.open(&watched.address);
    browser.wait("document.getElementById('g-fitness-t')");
    // A single generation is a dot.
    browser.wait(&format!("{FIGURE}.querySelector('svg polyline.l-s0')"));
    // Somebody opens the numbers of a plot, goes there, marks a word and has the keyboard at a line to open.
    browser.get(&format!(
        "(() => {{ window.kept = {FIGURE}.querySelector('details'); kept.open = true; window.svg = {FIGURE}.querySelector(':scope > svg'); \
         document.querySelector('#hall summary').focus(); {FIGURE}.scrollIntoView(); \
         getSelection().selectAllChildren({FIGURE}.querySelector('figcaption')); }})()"
    ));
    let place = |browser: &Browser| browser.get(&format!("{FIGURE}.getBoundingClientRect().top")).as_f64();
    let row = |browser: &Browser| browser.get("kept.querySelector('tbody tr:last-child th').textContent");
    let line = |browser: &Browser| {
        browser.get(&format!("{FIGURE}.querySelector('svg polyline.l-s0').getAttribute('points')"))
    };
    let before = (row(&browser), line(&browser), browser.text("line"), place(&browser).expect("a number"));
    for _ in 0..2 {
        later(&browser, revision(&browser));
    }
    assert_ne!(row(&browser), before.0);
    assert_ne!(line(&browser), before.1);
    assert_ne!(browser.text("line"), before.2);
    assert!((place(&browser).expect("a number") - before.3).abs() < 2.0, "it has moved");
    for same in
        ["kept.isConnected && kept.open", "svg.isConnected", "document.activeElement.nodeName === 'SUMMARY'"]
    {
        assert_eq!(browser.get(same), true, "{same}");
    }
    assert_eq!(browser.get("String(getSelection())"), "Fitness");
    assert!(browser.get("document.title").as_str().is_some_and(|title| title.ends_with(" %: run")));

    // Parts of it come and go, as a legend does when there is one curve; what is behind them stays.
    browser.get(
        "(() => { const ask = window.fetch; window.bare = true; window.fetch = async (...what) => { \
         const news = await (await ask(...what)).json(); \
         if (bare && news.report) news.report = news.report.replaceAll(/<ul class=\"legend\">.*?<\\/ul>/gs, ''); \
         return new Response(JSON.stringify(news)); }; })()",
    );
    let legends = |browser: &Browser| browser.get("document.querySelectorAll('#hall ul.legend').length");
    assert_ne!(legends(&browser), 0);
    for bare in [true, false] {
        browser.get(&format!("window.bare = {bare}"));
        let are = if bare { "=== 0" } else { "> 0" };
        browser.wait(&format!("document.querySelectorAll('#hall ul.legend').length {are}"));
        for same in [
            "kept.isConnected && kept.open",
            "svg.isConnected",
            "document.activeElement.nodeName === 'SUMMARY'",
        ] {
            assert_eq!(browser.get(same), true, "{same}, {bare}");
        }
    }

    // Nobody looks: nothing is asked for, and when somebody does, all is there at once.
    let hide = |hidden: bool| {
        browser.get(&format!(
            "(() => {{ Object.defineProperty(document, 'hidden', {{ value: {hidden}, configurable: true }}); \
             document.dispatchEvent(new Event('visibilitychange')); }})()"
        ))
    };
    browser.get(
        "(() => { const ask = window.fetch; \
         window.fetch = (what, how) => { \
         if (String(what).includes('quiet=true')) window.quiet = true; return ask(what, how); }; })()",
    );
    hide(true);
    // It asks for what is next once it has shown what came before.
    browser.wait("window.quiet === true");
    let (hidden, generations) = (revision(&browser), watched.generations());
    wait_until("two generations", || watched.generations() > generations + 1);
    std::thread::sleep(Duration::from_millis(2500));
    assert_eq!(revision(&browser), hidden);
    hide(false);
    later(&browser, hidden);

    // In all this nothing was forbidden or missing; and that would be told.
    assert_eq!(browser.complaints(), Vec::<String>::new());
    browser.get("document.body.insertAdjacentHTML('beforeend', '<p style=\"color: red\">inline</p>')");
    let complaints = browser.complaints();
    assert!(complaints.iter().any(|text| text.contains("Content Security Policy")), "{complaints:?}");
}

/// Ctrl-C is told with the last state, as the end of the run is; a command that is killed cannot tell it.
#[cfg(unix)]
#[test]
fn it_says_when_the_run_has_ended() {
    if !is_there() {
        return;
    }
    let browser = Browser::start(Screen::Desktop);
    let watched = Watched::start(SMALL);
    browser.open(&watched.address);
    browser.wait("document.getElementById('g-fitness-t')");
    // SAFETY: sends a signal to a child that has not been waited for, so its number is its own.
    assert_eq!(unsafe { libc::kill(watched.process.id() as libc::pid_t, libc::SIGINT) }, 0);
    browser.wait("document.getElementById('live').dataset.state === 'ended'");
    assert!(browser.text("note").contains("vsonar evolve --resume run"), "{}", browser.text("note"));
    let last = browser.get("document.querySelector('dl.facts').innerText");
    let generations = watched.generations();
    assert!(
        last.as_str().is_some_and(|text| text.contains(&format!("{generations} of 100,000 generations"))),
        "{last}"
    );

    let watched = Watched::start(SMALL);
    browser.open(&watched.address);
    browser.wait("document.getElementById('g-fitness-t')");
    drop(watched);
    browser.wait("document.getElementById('live').dataset.state === 'lost'");
    assert!(browser.text("note").contains("has ended or was stopped"));
    assert!(!browser.text("line").contains("left"), "nobody knows how long: {}", browser.text("line"));
    assert_eq!(browser.get("Boolean(document.getElementById('g-fitness-t'))"), true, "what there was stays");
}

#[test]
fn it_fits_a_phone() {
    if !is_there() {
        return;
    }
    let watched = Watched::start(SMALL);
    let browser = Browser::start(Screen::Phone);
    browser.open(&watched.address);
    browser.wait("document.getElementById('g-fitness-t')");
    assert_eq!(browser.get("innerWidth"), 390);
    assert_eq!(browser.get("document.documentElement.scrollWidth <= innerWidth"), true);
    // The line stays in sight.
    browser.get("window.scrollTo(0, 2000)");
    let top: Value = browser.get("document.getElementById('line').getBoundingClientRect().top");
    assert!(top.as_f64().is_some_and(|top| (0.0..100.0).contains(&top)), "{top}");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
