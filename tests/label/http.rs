//! What the server lets in, and what it does not.

use serde_json::json;

use crate::common::*;

fn request(method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> Vec<u8> {
    let mut text = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
    for (name, value) in headers {
        text += &format!("{name}: {value}\r\n");
    }
    format!("{text}\r\n{body}").into_bytes()
}

#[test]
fn only_who_knows_the_address_gets_in() {
    let dir = images(2);
    let label = Label::start(dir.path(), &[]);
    let (host, path) = label.parts();
    let host = host.as_str();
    let status = |path: &str, headers: &[(&str, &str)]| label.raw(&request("GET", path, headers, "")).0;
    assert_eq!(status(&path, &[("Host", host)]), 200);
    let (other, upper) = (format!("/{}/", "0".repeat(32)), path.to_uppercase());
    for wrong in
        ["/", "/session", "//", "/x/session", other.as_str(), &path[..path.len() - 2], upper.as_str()]
    {
        // A token without a letter is the same in capitals.
        if wrong != path {
            assert_eq!(status(wrong, &[("Host", host)]), 403, "{wrong}");
        }
    }
    let port = host.split(':').nth(1).expect("a port");
    let (localhost, attacker) = (format!("localhost:{port}"), format!("attacker.example:{port}"));
    assert_eq!(status(&path, &[("Host", &localhost)]), 200);
    let (own, foreign) = (format!("http://{host}"), format!("http://{attacker}"));
    for headers in [
        vec![],
        vec![("Host", attacker.as_str())],
        vec![("Host", "127.0.0.1")],
        vec![("Host", host), ("Origin", "http://attacker.example")],
        vec![("Host", host), ("Origin", foreign.as_str())],
        vec![("Host", host), ("Origin", "null")],
        vec![("Host", host), ("Sec-Fetch-Site", "cross-site")],
        vec![("Host", host), ("Origin", own.as_str()), ("Sec-Fetch-Site", "same-site")],
    ] {
        let status = status(&path, &headers);
        assert!(status == 403 || headers.is_empty() && status == 400, "{headers:?}: {status}");
    }
    assert_eq!(status(&path, &[("Host", host), ("Origin", &own), ("Sec-Fetch-Site", "same-origin")]), 200);
}

#[test]
fn foreign_sites_and_large_or_wrong_bodies_change_nothing() {
    let dir = images(1);
    let label = Label::start(dir.path(), &["--columns", "20,"]);
    let (host, path) = label.parts();
    let good = label.marks(json!([{ "image": "frame_1.png", "x": 20, "from": null, "to": 7 }]));
    let post = |headers: &[(&str, &str)], body: &str| {
        let length = body.len().to_string();
        let own = [("Host", host.as_str()), ("Content-Length", length.as_str())];
        let all = [&own[..], headers].concat();
        label.raw(&request("POST", &format!("{path}marks"), &all, body)).0
    };
    let json_type = ("Content-Type", "application/json");
    assert_eq!(post(&[json_type, ("Origin", "http://attacker.example")], &good), 403);
    assert_eq!(post(&[json_type, ("Sec-Fetch-Site", "cross-site")], &good), 403);
    // What a form of another site may send without asking first.
    assert_eq!(post(&[("Content-Type", "text/plain")], &good), 415);
    assert_eq!(post(&[json_type], "{"), 400);
    let large = format!("{}{good}", " ".repeat(64 << 10));
    assert_eq!(post(&[json_type], &large), 413);
    let chunk = format!("{:x}\r\n{large}\r\n0\r\n\r\n", large.len());
    let chunked = [("Host", host.as_str()), json_type, ("Transfer-Encoding", "chunked")];
    assert_eq!(label.raw(&request("POST", &format!("{path}marks"), &chunked, &chunk)).0, 413);
    for wrong in [
        json!({ "image": "frame_1.png", "x": 21, "from": null, "to": 7 }),
        json!({ "image": "frame_1.png", "x": 20, "from": null, "to": 120 }),
        json!({ "image": "frame_1.png", "x": 20, "from": null, "to": -1 }),
        json!({ "image": "frame_1.png", "x": 20, "from": null, "to": "other" }),
        json!({ "image": "../frame_1.png", "x": 20, "from": null, "to": 7 }),
        json!({ "image": "/etc/passwd", "x": 20, "from": null, "to": 7 }),
    ] {
        let (status, body) = label.ask("POST", "marks", &label.marks(json!([wrong.clone()])));
        assert_eq!(status, 422, "{wrong}: {}", String::from_utf8_lossy(&body));
    }
    // For another folder, whose page has found this command under its address.
    let mut other: serde_json::Value = serde_json::from_str(&good).expect("JSON");
    other["identity"] = json!("0123456789abcdef");
    let (status, body) = label.ask("POST", "marks", &other.to_string());
    let text = String::from_utf8_lossy(&body);
    assert!(status == 409 && text.contains("another folder"), "{status} {text}");
    assert!(!below(&dir, "labels.csv").exists() && !below(&dir, "labels.skip.csv").exists());
    assert_eq!(post(&[json_type], &good), 200);
    assert_eq!(labels(dir.path())[&("frame_1.png".to_string(), 20)], 7);
}

#[test]
fn nothing_outside_the_folder_is_served() {
    let dir = images(1);
    let label = Label::start(dir.path(), &[]);
    assert_eq!(label.ask("GET", "image/0", "").0, 200);
    for wrong in [
        "image/1",
        "image/-1",
        "image/99999999999999999999",
        "image/frame_1.png",
        "image/../labels.csv",
        "image/%2e%2e/labels.csv",
        "image/..%2flabels.csv",
        "../../../../etc/passwd",
        "%2e%2e/%2e%2e/etc/passwd",
        "..%2f..%2fetc%2fpasswd",
        "image/%2fetc%2fpasswd",
        "labels.csv",
        "frame_1.png",
        "suggestions/0",
    ] {
        let (status, body) = label.ask("GET", wrong, "");
        assert!([400, 403, 404].contains(&status), "{wrong}: {status}");
        assert!(!body.windows(5).any(|five| five == b"root:"), "{wrong}");
    }
    for method in ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "BREW"] {
        assert_eq!(label.ask(method, "session", "").0, 405, "{method}");
    }
    assert_eq!(label.ask("GET", "marks", "").0, 405);
}

#[cfg(unix)]
#[test]
fn links_that_leave_the_folder_are_left_out() {
    use std::os::unix::fs::symlink;
    let (dir, secret) = (images(3), images(1));
    std::fs::rename(below(&secret, "frame_1.png"), below(&secret, "secret.png")).expect("movable");
    symlink(below(&secret, "secret.png"), below(&dir, "frame_9.png")).expect("a link");
    symlink(below(&dir, "frame_1.png"), below(&dir, "again.png")).expect("a link");
    let label = Label::start(dir.path(), &[]);
    assert_eq!(
        (label.ready["images"].as_u64(), label.ready["left_out"].as_array().map(Vec::len)),
        (Some(3), Some(1)),
        "a link to an image of the folder is that image"
    );
    let why = &label.ready["left_out"][0];
    assert!(
        why["name"] == "frame_9.png" && why["why"].as_str().expect("a reason").contains("leads out"),
        "{why}"
    );
    // One that becomes a link while it is served is not followed either.
    let shown = label.json("GET", "session", "")["images"].as_array().expect("a list").clone();
    let index = shown.iter().position(|name| name == "frame_2.png").expect("listed");
    std::fs::remove_file(below(&dir, "frame_2.png")).expect("removable");
    symlink(below(&secret, "secret.png"), below(&dir, "frame_2.png")).expect("a link");
    let (status, body) = label.ask("GET", &format!("image/{index}"), "");
    assert!(status == 500 && String::from_utf8_lossy(&body).contains("leads out"), "{status}");
    // Nor is anything written through one that stands where the command puts files.
    let victim = below(&secret, "victim");
    std::fs::write(&victim, "precious").expect("writable");
    let _ = std::fs::remove_file(below(&dir, ".labels.columns"));
    symlink(&victim, below(&dir, ".labels.columns")).expect("a link");
    let x = label.ready["columns"][0].as_u64().expect("a column") as u32;
    label.mark("frame_1.png", x, json!(null), json!(5));
    label.mark("frame_3.png", x, json!(null), json!("skip"));
    assert_eq!(std::fs::read_to_string(&victim).expect("there"), "precious");
    for target in ["victim", "new"] {
        std::fs::remove_file(below(&dir, ".labels.lock")).expect("there");
        symlink(below(&secret, target), below(&dir, ".labels.lock")).expect("a link");
        let body = label.marks(json!([{ "image": "frame_1.png", "x": x, "from": 5, "to": 6 }]));
        let (status, answer) = label.ask("POST", "marks", &body);
        let text = String::from_utf8_lossy(&answer);
        assert!(status == 500 && text.contains(".labels.lock: is a link"), "{status} {text}");
    }
    assert!(!below(&secret, "new").exists());
    assert_eq!(std::fs::read_to_string(&victim).expect("there"), "precious");
    std::fs::remove_file(below(&dir, ".labels.lock")).expect("there");
    std::fs::remove_file(below(&dir, "labels.csv")).expect("there");
    // Nor is a table written through a link.
    drop(label);
    symlink(below(&secret, "stolen.csv"), below(&dir, "labels.csv")).expect("a link");
    let output =
        std::process::Command::new(env!("CARGO_BIN_EXE_vsonar")).arg("label").arg(dir.path()).output();
    let output = output.expect("started");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("labels.csv: is a link"));
}

#[cfg(unix)]
#[test]
fn a_pipe_is_not_waited_for() {
    let dir = images(1);
    let made = std::process::Command::new("mkfifo").arg(below(&dir, "z.png")).status().expect("started");
    assert!(made.success());
    let label = Label::start(dir.path(), &[]);
    assert_eq!(label.ready["left_out"], json!([{ "name": "z.png", "why": "is not a plain file" }]));
}

#[test]
fn answers_keep_to_themselves() {
    let dir = images(1);
    let label = Label::start(dir.path(), &[]);
    let (host, path) = label.parts();
    for path in [path.clone(), format!("{path}session"), format!("{path}image/0"), "/".to_string()] {
        let (_, head, _) = label.raw(&request("GET", &path, &[("Host", &host)], ""));
        let head = head.to_ascii_lowercase();
        for header in [
            "content-security-policy: default-src 'none';",
            "x-content-type-options: nosniff",
            "referrer-policy: no-referrer",
            "cache-control: no-store",
            "x-frame-options: deny",
            "cross-origin-resource-policy: same-origin",
        ] {
            assert!(head.contains(header), "{path}: {header} is not in {head}");
        }
        assert!(!head.contains("access-control"), "{head}");
    }
    // The page itself names nothing that is elsewhere.
    for file in [
        "",
        "style.css",
        "label.js",
        "desk.js",
        "keys.js",
        "marks.js",
        "pace.js",
        "pointers.js",
        "screen.js",
        "view.js",
    ] {
        let (status, body) = label.ask("GET", file, "");
        let text = String::from_utf8(body).expect("UTF-8");
        assert!(status == 200 && !text.contains("//www.") && !text.contains("https:"), "{file}");
        assert!(!text.replace("http://www.w3.org/2000/svg", "").contains("http:"), "{file}");
    }
}

/// Whoever opens connections and says nothing, or only half of a request, keeps nobody out.
#[test]
fn idle_connections_keep_nobody_out() {
    use std::io::Write;
    let dir = images(1);
    let label = Label::start(dir.path(), &["--columns", "20,60"]);
    let (host, path) = label.parts();
    let mut idle = Vec::new();
    for number in 0..600 {
        let mut stream = std::net::TcpStream::connect(&host).expect("it listens");
        if number % 2 == 0 {
            // It may have had to make room already.
            let _ = write!(stream, "GET {path}session HTTP/1.1\r\nHost: ");
        }
        idle.push(stream);
    }
    let start = std::time::Instant::now();
    assert_eq!(label.ask("GET", "", "").0, 200);
    label.mark("frame_1.png", 20, json!(null), json!(5));
    assert!(start.elapsed().as_secs() < 30);
    assert_eq!(labels(dir.path()).len(), 1);
}
