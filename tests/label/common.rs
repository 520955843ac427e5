//! What these tests share: folders of images, and the command as it serves them.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;
use vsonar::world::Corridor;

/// A folder of so many small rendered images, `frame_1.png` and on, without labels.
pub(crate) fn images(count: usize) -> TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let corridor = Corridor { width: 160, height: 120, ..Corridor::default() };
    let set = corridor.render(1, count).expect("a small corridor");
    for (i, image) in set.images().iter().enumerate() {
        image.pixels.save(dir.path().join(format!("frame_{}.png", i + 1))).expect("writable");
    }
    dir
}

/// The command, serving a folder; killed when dropped.
pub(crate) struct Label {
    pub(crate) process: Child,
    pub(crate) ready: Value,
}

impl Label {
    pub(crate) fn start(dir: &Path, more: &[&str]) -> Label {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vsonar"));
        command.arg("label").arg(dir).arg("--json").args(more);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = command.spawn().expect("the command can be started");
        let mut line = String::new();
        let out = process.stdout.as_mut().expect("piped");
        BufReader::new(out).read_line(&mut line).expect("readable");
        let ready = serde_json::from_str(&line).unwrap_or_else(|error| {
            let mut complaint = String::new();
            let _ = process.stderr.take().expect("piped").read_to_string(&mut complaint);
            panic!("{line:?}: {error}: {complaint}")
        });
        Label { process, ready }
    }

    pub(crate) fn address(&self) -> &str {
        self.ready["address"].as_str().expect("an address")
    }

    /// Host with port, and the path with the token.
    pub(crate) fn parts(&self) -> (String, String) {
        let rest = self.address().strip_prefix("http://").expect("http");
        let (host, path) = rest.split_once('/').expect("a path");
        (host.to_string(), format!("/{path}"))
    }

    /// Sends what may be no proper request, and gives the answer: status, head and body.
    pub(crate) fn raw(&self, request: &[u8]) -> (u16, String, Vec<u8>) {
        let (host, _) = self.parts();
        let mut stream = TcpStream::connect(host).expect("it listens");
        // A server that refuses may close before all is sent.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap_or(answer.len());
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        let status = head.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or_default();
        (status, head, answer.get(end + 4..).unwrap_or_default().to_vec())
    }

    /// A proper request of the page's.
    pub(crate) fn ask(&self, method: &str, what: &str, body: &str) -> (u16, Vec<u8>) {
        let (host, path) = self.parts();
        let request = format!(
            "{method} {path}{what} HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        );
        let (status, head, body) = self.raw(request.as_bytes());
        assert!(!head.to_ascii_lowercase().contains("transfer-encoding"), "{head}");
        (status, body)
    }

    pub(crate) fn json(&self, method: &str, what: &str, body: &str) -> Value {
        let (status, body) = self.ask(method, what, body);
        assert_eq!(status, 200, "{what}: {}", String::from_utf8_lossy(&body));
        serde_json::from_slice(&body).expect("JSON")
    }

    /// What the page sends to have these marks made.
    pub(crate) fn marks(&self, marks: Value) -> String {
        let identity = &self.json("GET", "session", "")["identity"];
        serde_json::json!({ "identity": identity, "marks": marks }).to_string()
    }

    /// Sets a mark as the page does.
    pub(crate) fn mark(&self, image: &str, x: u32, from: Value, to: Value) -> Value {
        let marks = serde_json::json!([{ "image": image, "x": x, "from": from, "to": to }]);
        self.json("POST", "marks", &self.marks(marks))
    }
}

impl Drop for Label {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The labels in a folder, by image and column.
pub(crate) fn labels(dir: &Path) -> BTreeMap<(String, u32), u32> {
    let Ok(text) = std::fs::read_to_string(dir.join("labels.csv")) else { return BTreeMap::new() };
    let mut found = BTreeMap::new();
    for row in text.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        let key = (fields[0].to_string(), fields[1].parse().expect("a column"));
        assert_eq!(found.insert(key, fields[2].parse().expect("a row")), None, "{text}");
    }
    found
}

/// Waits until something holds.
pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = std::time::Instant::now();
    while !holds() {
        assert!(start.elapsed().as_secs() < 60, "{what} did not happen");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
}

/// An absolute path below a folder.
pub(crate) fn below(dir: &TempDir, name: &str) -> PathBuf {
    dir.path().join(name)
}
