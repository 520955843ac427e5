//! Chromium without a window, driven through WebDriver.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fantoccini::actions::{
    Actions, InputSource, KeyAction, KeyActions, MouseActions, PointerAction, TouchActions,
};
use fantoccini::{Client, ClientBuilder};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::runtime::Runtime;

/// Whether driver and browser are there. Where they are not, that is told, and is a failure where
/// VSONAR_REQUIRE_TOOLS is set.
pub(crate) fn is_there() -> bool {
    ["chromium", "chromedriver"].iter().all(|tool| {
        let found = Command::new(tool).arg("--version").output().is_ok_and(|output| output.status.success());
        let required = std::env::var_os("VSONAR_REQUIRE_TOOLS").is_some();
        assert!(found || !required, "`{tool}` does not run, but VSONAR_REQUIRE_TOOLS is set");
        if !found {
            eprintln!("skipped: `{tool}` does not run");
        }
        found
    })
}

/// What kind of screen the browser pretends to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Screen {
    /// 1280 x 800.
    Desktop,
    /// The same in dark colours.
    Dark,
    /// 390 x 844, touched with fingers.
    Phone,
    /// 400 x 800, touched with fingers, as many screen pixels as the page's.
    #[allow(dead_code)] // the example has none
    Narrow,
    /// 740 x 360: a phone held sideways.
    #[allow(dead_code)] // the example has none
    Sideways,
}

/// A browser of its own, with an empty profile; ended when dropped.
pub(crate) struct Browser {
    driver: Child,
    /// Where the driver listens.
    port: u16,
    runtime: Runtime,
    client: Client,
    _profile: TempDir,
}

impl Browser {
    pub(crate) fn start(screen: Screen) -> Browser {
        let mut driver = Command::new("chromedriver")
            .arg("--port=0")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver starts");
        let lines = BufReader::new(driver.stdout.take().expect("piped")).lines();
        let port = lines.map_while(Result::ok).find_map(|line| {
            let (_, rest) = line.split_once("successfully on port ")?;
            rest.trim_end_matches('.').parse::<u16>().ok()
        });
        let port = port.expect("chromedriver tells its port");
        let profile = tempfile::tempdir().expect("a temporary folder");
        let mut flags: Vec<String> = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--window-size=1280,800",
        ]
        .map(String::from)
        .to_vec();
        flags.push(format!("--user-data-dir={}", profile.path().display()));
        if screen == Screen::Dark {
            flags.push("--blink-settings=preferredColorScheme=0".to_string());
        }
        let mut options = json!({ "args": flags });
        let phone = match screen {
            Screen::Phone => Some((390, 844, 2.0)),
            Screen::Narrow => Some((400, 800, 1.0)),
            Screen::Sideways => Some((740, 360, 2.0)),
            Screen::Desktop | Screen::Dark => None,
        };
        if let Some((width, height, ratio)) = phone {
            let metrics = json!({ "width": width, "height": height, "pixelRatio": ratio, "touch": true });
            options["mobileEmulation"] = json!({ "deviceMetrics": metrics });
        }
        let logs = json!({ "browser": "ALL" });
        let capabilities = json!({
            "goog:chromeOptions": options, "goog:loggingPrefs": logs, "unhandledPromptBehavior": "accept"
        });
        let capabilities = capabilities.as_object().expect("an object").clone();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let connect = async {
            ClientBuilder::new(HttpConnector::new())
                .capabilities(capabilities)
                .connect(&format!("http://127.0.0.1:{port}"))
                .await
        };
        let client = runtime.block_on(connect).expect("the browser starts");
        Browser { driver, port, runtime, client, _profile: profile }
    }

    /// Opens a page, and what it shows to whoever sees it for the first time is closed.
    pub(crate) fn open(&self, address: &str) {
        self.open_as_new(address);
        self.get("document.getElementById('help')?.close?.()");
    }

    /// Opens a page as somebody does who may not have seen it before.
    pub(crate) fn open_as_new(&self, address: &str) {
        self.runtime.block_on(self.client.goto(address)).expect("the page opens");
        self.wait("document.body.dataset.ready === 'true'");
    }

    /// Gives the window another size.
    pub(crate) fn resize(&self, width: u32, height: u32) {
        self.runtime.block_on(self.client.set_window_size(width, height)).expect("another size");
    }

    /// Opens another window of the same browser, and goes on in it.
    pub(crate) fn open_another(&self, address: &str) {
        let window = self.runtime.block_on(self.client.new_window(false)).expect("another window");
        self.runtime.block_on(self.client.switch_to_window(window.handle)).expect("it is there");
        self.open(address);
    }

    /// Goes on in the first, second ... window.
    pub(crate) fn window(&self, index: usize) {
        let windows = self.runtime.block_on(self.client.windows()).expect("windows");
        let window = windows[index].clone();
        self.runtime.block_on(self.client.switch_to_window(window)).expect("it is there");
    }

    /// Closes the window; the browser goes on.
    pub(crate) fn close_window(&self) {
        self.runtime.block_on(self.client.close_window()).expect("it closes");
    }

    pub(crate) fn reload(&self) {
        self.runtime.block_on(self.client.refresh()).expect("the page opens again");
        self.wait("document.body.dataset.ready === 'true'");
    }

    /// What an expression is in the page.
    pub(crate) fn get(&self, expression: &str) -> Value {
        let script = format!("return {expression};");
        self.runtime.block_on(self.client.execute(&script, vec![])).expect("the script runs")
    }

    /// Waits until an expression is true in the page.
    pub(crate) fn wait(&self, expression: &str) {
        let start = Instant::now();
        while self.get(&format!("Boolean({expression})")) != true {
            if start.elapsed() > Duration::from_secs(30) {
                let text = self.get("document.body.innerText");
                panic!("{expression} did not come true; the page says {text}");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits until every mark is on the disk.
    pub(crate) fn wait_saved(&self) {
        self.wait("document.getElementById('saved').dataset.state === 'saved'");
    }

    /// Text of the element with this id.
    pub(crate) fn text(&self, id: &str) -> String {
        let text = self.get(&format!("document.getElementById('{id}').textContent"));
        text.as_str().unwrap_or_default().to_string()
    }

    /// Waits until the image is shown, without which nothing is marked, and presses keys.
    pub(crate) fn keys(&self, keys: &[&str]) {
        self.wait("document.getElementById('picture').dataset.image === location.hash.slice(1)");
        self.keys_now(keys);
    }

    /// Presses keys one after the other, each with those that are held down meanwhile.
    pub(crate) fn keys_now(&self, keys: &[&str]) {
        let mut actions = KeyActions::new("keys".to_string());
        for key in keys {
            let codes: Vec<char> = key.split('+').map(code).collect();
            for &value in &codes {
                actions = actions.then(KeyAction::Down { value });
            }
            for &value in codes.iter().rev() {
                actions = actions.then(KeyAction::Up { value });
            }
        }
        self.runtime.block_on(self.client.perform_actions(actions)).expect("keys are pressed");
    }

    /// Presses at the first of these places of the window, moves over the others, lets go.
    pub(crate) fn drag(&self, places: &[(i64, i64)], finger: bool) {
        self.drag_partly(places, finger, true);
    }

    /// The same, but lets go only if that is wanted.
    pub(crate) fn drag_partly(&self, places: &[(i64, i64)], finger: bool, lift: bool) {
        let mut path = Vec::new();
        for (i, &(x, y)) in places.iter().enumerate() {
            let (x, y) = (x as f64, y as f64);
            path.push(PointerAction::MoveTo { duration: Some(Duration::from_millis(20)), x, y });
            if i == 0 {
                path.push(PointerAction::Down { button: 0 });
            }
        }
        if lift {
            path.push(PointerAction::Up { button: 0 });
        }
        let done = if finger {
            let actions =
                path.into_iter().fold(TouchActions::new("finger".to_string()), |all, one| all.then(one));
            self.runtime.block_on(self.client.perform_actions(Actions::from(actions)))
        } else {
            let actions =
                path.into_iter().fold(MouseActions::new("mouse".to_string()), |all, one| all.then(one));
            self.runtime.block_on(self.client.perform_actions(Actions::from(actions)))
        };
        done.expect("the pointer moves");
    }

    /// Lets the mouse go where it is.
    pub(crate) fn let_go(&self) {
        let up = MouseActions::new("mouse".to_string()).then(PointerAction::Up { button: 0 });
        self.runtime.block_on(self.client.perform_actions(Actions::from(up))).expect("the button comes up");
    }

    /// Presses the element with this id, with the mouse.
    pub(crate) fn press(&self, id: &str) {
        let middle = format!(
            "(() => {{ const box = document.getElementById('{id}').getBoundingClientRect(); \
             return [box.left + box.width / 2, box.top + box.height / 2, box.width, box.height]; }})()"
        );
        let place = self.get(&middle);
        let number = |i: usize| place[i].as_f64().unwrap_or_default() as i64;
        assert!(number(2) > 0 && number(3) > 0, "{id} is not seen");
        self.drag(&[(number(0), number(1))], false);
    }

    /// What the browser has complained of since it was asked last: errors of scripts, what policies forbid, what
    /// could not be loaded.
    #[allow(dead_code)] // the example asks for none
    pub(crate) fn complaints(&self) -> Vec<String> {
        let session = self.runtime.block_on(self.client.session_id()).expect("a session").expect("a session");
        let body = json!({ "type": "browser" }).to_string();
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("the driver listens");
        write!(
            stream,
            "POST /session/{session}/se/log HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            self.port,
            body.len()
        )
        .expect("the driver listens");
        // The driver may leave the connection open behind its answer.
        let mut stream = BufReader::new(stream);
        let mut length = 0;
        loop {
            let mut line = String::new();
            stream.read_line(&mut line).expect("UTF-8");
            if line.trim_end().is_empty() {
                break;
            }
            if let Some((_, value)) =
                line.split_once(':').filter(|(name, _)| name.eq_ignore_ascii_case("content-length"))
            {
                length = value.trim().parse().expect("a number");
            }
        }
        let mut answer = vec![0; length];
        stream.read_exact(&mut answer).expect("a body");
        let answer: Value = serde_json::from_slice(&answer).expect("JSON");
        let entries = answer["value"].as_array().unwrap_or_else(|| panic!("no log: {answer}"));
        let bad =
            entries.iter().filter(|entry| ["SEVERE", "WARNING"].iter().any(|level| entry["level"] == *level));
        bad.map(|entry| entry["message"].as_str().unwrap_or_default().to_string()).collect()
    }

    /// A picture of the window, as PNG.
    #[allow(dead_code)] // the example takes some
    pub(crate) fn screenshot(&self) -> Vec<u8> {
        self.runtime.block_on(self.client.screenshot()).expect("a picture")
    }
}

/// The code of a key that is written as itself or by its name.
fn code(key: &str) -> char {
    match key {
        "Shift" => '\u{e008}',
        "Ctrl" => '\u{e009}',
        "Enter" => '\u{e007}',
        "Escape" => '\u{e00c}',
        "Tab" => '\u{e004}',
        "Delete" => '\u{e017}',
        "PageUp" => '\u{e00e}',
        "PageDown" => '\u{e00f}',
        "Left" => '\u{e012}',
        "Up" => '\u{e013}',
        "Right" => '\u{e014}',
        "Down" => '\u{e015}',
        "Plus" => '+',
        one => one.chars().next().unwrap_or(' '),
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The driver ends the browser when the session is closed; both are ours.
        let _ = self.runtime.block_on(self.client.clone().close());
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}
