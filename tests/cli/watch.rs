//! `vsonar evolve --watch`: the page of a run while it goes on, as a browser asks for it.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::*;
use crate::interruption::interrupt;

/// Longer than anything here takes.
const LIMIT: Duration = Duration::from_secs(120);

/// Long enough to be watched for a while.
const LONG: &[&str] =
    &["--generations", "20000", "--population", "300", "--threads", "1", "--executor", "tree"];

/// A command that is watched; killed when dropped.
struct Watched {
    process: Option<Child>,
    /// Host with port, and the path with the token.
    place: (String, String),
}

/// An answer: status, head, body.
struct Answer(u16, String, String);

impl Watched {
    /// Starts `evolve --watch --quiet`, and reads the address.
    fn start(place: &Place, arguments: &[&str]) -> Watched {
        Watched::start_by(place, arguments, |_| ())
    }

    /// The same of a command that is prepared first.
    fn start_by(place: &Place, arguments: &[&str], prepare: impl FnOnce(&mut Command)) -> Watched {
        let mut command = place.command(&[arguments, &["--watch", "--quiet"]].concat());
        prepare(&mut command);
        let mut process = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
        let mut said = BufReader::new(process.stderr.take().expect("piped"));
        let mut line = String::new();
        said.read_line(&mut line).expect("UTF-8");
        let address = line.strip_prefix("watch: http://").and_then(|rest| rest.trim_end().split_once('/'));
        let (host, path) = address.unwrap_or_else(|| panic!("no address: {line}"));
        let place = (host.to_string(), format!("/{path}"));
        // Whatever else it says is not held up.
        std::thread::spawn(move || std::io::copy(&mut said, &mut std::io::sink()));
        Watched { process: Some(process), place }
    }

    fn request(&self, host: &str, path: &str) -> std::io::Result<Answer> {
        let mut stream = TcpStream::connect(&self.place.0)?;
        stream.set_read_timeout(Some(LIMIT))?;
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")?;
        let mut text = String::new();
        stream.read_to_string(&mut text)?;
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((text.as_str(), ""));
        let status = head.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or_default();
        Ok(Answer(status, head.to_ascii_lowercase(), body.to_string()))
    }

    fn get(&self, what: &str) -> std::io::Result<Answer> {
        self.request(&self.place.0, &format!("{}{what}", self.place.1))
    }

    fn news(&self, since: u64) -> Value {
        let Answer(status, _, body) = self.get(&format!("news?since={since}")).expect("it answers");
        assert_eq!(status, 200, "{body}");
        serde_json::from_str(&body).expect("JSON")
    }

    /// Asks for what is new, as a page does, until this holds.
    fn follow(&self, what: &str, mut holds: impl FnMut(&Value) -> bool) -> Value {
        let (start, mut since) = (Instant::now(), 0);
        loop {
            let news = self.news(since);
            since = news["revision"].as_u64().expect("a number");
            if holds(&news) {
                return news;
            }
            assert!(news["end"].is_null() && start.elapsed() < LIMIT, "{what} did not happen: {news}");
        }
    }

    fn process(&self) -> &Child {
        self.process.as_ref().expect("not waited for")
    }

    fn wait(mut self) -> Output {
        self.process.take().expect("not waited for").wait_with_output().expect("it ends")
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        if let Some(mut process) = self.process.take() {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

/// The generations that news tells of: those there are, and those there will be.
fn generations(news: &Value) -> (u64, u64) {
    let line = news["line"].as_str().expect("text");
    let words: Vec<&str> = line.split(' ').collect();
    let at = words.iter().position(|word| word.starts_with("generations")).expect(line);
    let number = |i: usize| words[i].parse().expect(line);
    (number(at - 3), number(at - 1))
}

fn report(news: &Value) -> &str {
    news["report"].as_str().expect("a report")
}

#[test]
fn the_page_grows_with_the_run() {
    let place = Place::new();
    let watched = Watched::start(&place, &tiny(&[LONG, &["--out", "run"]].concat()));
    let first = watched.follow("a generation", |news| !news["report"].is_null() && generations(news).0 > 0);
    assert_eq!((generations(&first).1, first["title"].as_str()), (20000, Some("run")));
    for part in ["<h1>run</h1>", "id=\"curves\"", "id=\"hall\"", "id=\"program\"", "<polyline", "(individual"]
    {
        assert!(report(&first).contains(part), "no {part} in {}", report(&first));
    }
    // What is held out waits, as in every report, and nothing was evaluated for the page.
    assert!(!report(&first).contains("id=\"errors\"") && !report(&first).contains("<img"));
    // As in "17 of 20,000 generations".
    let drawn = |news: &Value| {
        let (before, _) = report(news).split_once(" of 20,000 generations").expect("how many");
        before
            .rsplit(' ')
            .next()
            .and_then(|number| number.replace(',', "").parse::<u64>().ok())
            .expect("a number")
    };
    let later = watched.follow("more", |news| !news["report"].is_null() && drawn(news) > drawn(&first));
    assert!(generations(&later).0 > generations(&first).0);
    assert!(later["line"].as_str().expect("text").ends_with(" left"), "{later}");
    let share = later["share"].as_f64().expect("a share");
    assert!(share > 0.0 && share < 1.0);
    // Nothing new: an answer all the same, after a moment, without the report.
    let news = watched.news(u64::MAX);
    assert!(news["report"].is_null() && news["end"].is_null());

    // The page as it is opened: without script it loads itself again; nothing inline, so that the policy stays strict.
    let Answer(status, head, page) = watched.get("").expect("it answers");
    assert_eq!(status, 200);
    for directive in ["default-src 'none'", "script-src 'self'", "style-src 'self'", "img-src 'self'"] {
        assert!(head.contains(&format!("{directive};")), "{head}");
    }
    assert!(
        page.contains("<noscript><meta http-equiv=\"refresh\"") && page.contains(" of 20000 generations")
    );
    assert!(!page.contains("<style") && !page.contains(" style=") && !page.contains("data:"));
    assert_eq!(page.matches("<script").count(), 1);
    for file in ["style.css", "watch.css", "watch.js", "icon.svg"] {
        assert!(page.contains(&format!("\"{file}\"")), "{file}");
        assert_eq!(watched.get(file).expect("it answers").0, 200, "{file}");
    }
    // Who does not know the address, or comes from elsewhere, sees nothing.
    let (host, path) = (&watched.place.0, &watched.place.1);
    for (host, path) in
        [(host.as_str(), "/"), (host, "/news?since=0"), ("attacker.example", path), (host, "/x/")]
    {
        assert_eq!(watched.request(host, path).expect("it answers").0, 403, "{host} {path}");
    }
    assert_eq!(watched.get("news").expect("it answers").0, 400);

    // Ctrl-C: who is looking is told how to go on; the command ends as without a page.
    let revision = later["revision"].as_u64().expect("a number");
    let end = std::thread::scope(|scope| {
        let quiet =
            scope.spawn(|| watched.get(&format!("news?since={revision}&quiet=true")).expect("an answer"));
        std::thread::sleep(Duration::from_millis(200));
        interrupt(watched.process());
        quiet.join().expect("answered")
    });
    let end: Value = serde_json::from_str(&end.2).expect("JSON");
    let words = end["end"].as_str().expect("it has ended");
    assert!(words.contains("interrupted with ") && words.contains("vsonar evolve --resume run"), "{words}");
    assert!(report(&end).contains("id=\"curves\""));
    assert_eq!(watched.wait().status.code(), Some(130));
}

#[test]
fn being_watched_changes_nothing() {
    let place = Place::new();
    let flags = [
        "--generations",
        "12",
        "--population",
        "1500",
        "--threads",
        "2",
        "--seed",
        "5",
        "--executor",
        "tree",
    ];
    place.ok(&tiny(&[&flags[..], &["--quiet", "--out", "alone"]].concat()));
    let watched = Watched::start(&place, &tiny(&[&flags[..], &["--json", "--out", "watched"]].concat()));
    let end = watched.follow("the end", |news| !news["end"].is_null());
    // The last that is told is the whole of it, and the address is gone with the command.
    assert_eq!(generations(&end), (12, 12));
    assert!(report(&end).contains("12 of 12 generations"), "{}", report(&end));
    assert_eq!(end["share"], 1.0);
    let words = end["end"].as_str().expect("text");
    assert_eq!(words, "The run has ended; `vsonar report watched` makes the whole page.");
    let page = report(&end).to_string();
    let (host, output) = (watched.place.0.clone(), watched.wait());
    assert!(output.status.success() && TcpStream::connect(host).is_err());
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
    assert_eq!(summary["complete"], true);
    // What the winner reaches is told once it is known.
    let train = summary["train"]["fitness"].as_f64().expect("a share");
    assert!(
        page.contains(&format!("<span>training</span><b>{:.1} %</b>", 100.0 * train)),
        "{train} in {page}"
    );
    assert_eq!(recorded(&place.path("alone")), recorded(&place.path("watched")));
    assert_eq!(place.read("alone/settings.toml"), place.read("watched/settings.toml"));
}

#[test]
fn a_run_that_goes_on_is_shown_from_its_beginning() {
    let place = Place::new();
    place.ok(&tiny(&["--population", "1500", "--quiet", "--out", "run"]));
    let more = ["evolve", "--resume", "run", "--generations", "14", "--executor", "tree", "--threads", "1"];
    let watched = Watched::start(&place, &more);
    let end = watched.follow("the end", |news| !news["end"].is_null());
    assert_eq!(generations(&end), (14, 14));
    assert!(report(&end).contains("The best goes from") && report(&end).contains("in generation 13"));
    assert!(watched.wait().status.success());
}

#[test]
fn several_runs_are_compared() {
    let place = Place::new();
    let flags =
        ["--runs", "3", "--jobs", "2", "--threads", "2", "--executor", "tree", "--population", "1000"];
    let parts = ["--train-match", "drive_a*", "--holdout-match", "drive_b*"];
    let several = |out| tiny(&[&flags[..], &parts, &["--generations", "6", "--out", out]].concat());
    let watched = Watched::start(&place, &several("all"));
    let end = watched.follow("the end", |news| !news["end"].is_null());
    assert_eq!(end["line"], "3 of 3 runs complete, 18 of 18 generations");
    assert_eq!(end["title"], "3 runs");
    for part in ["<h1>3 runs</h1>", "id=\"c-best-t\"", "all/seed-1", "all/seed-3", "id=\"c-spread-t\""] {
        assert!(report(&end).contains(part), "no {part} in {}", report(&end));
    }
    assert!(end["end"].as_str().expect("text").contains("`vsonar report all`"));
    assert_eq!(report(&end).matches("<span>held out</span>").count(), 3, "of each run");
    assert!(watched.wait().status.success());
    place.ok(&[several("alone"), vec!["--quiet"]].concat());
    for run in ["seed-1", "seed-2", "seed-3"] {
        assert_eq!(recorded(&place.path("all").join(run)), recorded(&place.path("alone").join(run)));
    }
}

#[test]
fn a_port_that_is_taken_is_told_before_anything_is_done() {
    let place = Place::new();
    let taken = TcpListener::bind("127.0.0.1:0").expect("any port");
    let port = taken.local_addr().expect("bound").port().to_string();
    for more in [&[][..], &["--runs", "2"]] {
        let complaint = place.fails(1, &tiny(&[&["--watch", "--port", &port], more].concat()));
        assert!(complaint.contains(&format!("--port: {port} of 127.0.0.1")), "{complaint}");
    }
    for flag in [&["--port", "8000"][..], &["--open"]] {
        assert!(place.fails(2, &tiny(flag)).contains("--watch"));
    }
}

/// Whoever opens connections and says nothing takes descriptors, which a run needs for its files.
#[test]
fn idle_connections_keep_nobody_out_and_end_no_run() {
    let place = Place::new();
    let arguments = tiny(&[
        "--population",
        "200",
        "--generations",
        "30",
        "--threads",
        "1",
        "--executor",
        "tree",
        "--out",
        "run",
    ]);
    // Few descriptors, so that there are soon none left if nobody sees to it.
    let watched = Watched::start_by(&place, &arguments, |command| {
        use std::os::unix::process::CommandExt;
        let set = || {
            let limit = libc::rlimit { rlim_cur: 64, rlim_max: 64 };
            // SAFETY: a plain system call with valid arguments.
            match unsafe { libc::setrlimit(libc::RLIMIT_NOFILE, &limit) } {
                0 => Ok(()),
                _ => Err(std::io::Error::last_os_error()),
            }
        };
        // SAFETY: the closure only makes a system call; it neither allocates nor locks.
        unsafe { command.pre_exec(set) };
    });
    let mut idle = Vec::new();
    let mut known = 0;
    let end = loop {
        for _ in 0..20 {
            idle.extend(TcpStream::connect(&watched.place.0));
        }
        idle.drain(..idle.len().saturating_sub(400));
        let start = Instant::now();
        let news = watched.news(known);
        assert!(start.elapsed() < LIMIT);
        known = news["revision"].as_u64().expect("a number");
        if !news["end"].is_null() {
            break news;
        }
    };
    assert_eq!(generations(&end), (30, 30));
    let output = watched.wait();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(logged(&place.path("run")), 30);
}
