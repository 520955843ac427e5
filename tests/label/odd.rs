//! The page when something is odd: answers get lost, images are missing, the command comes back as another one; and
//! pointers in a view that is zoomed.

use serde_json::{Value, json};

use crate::browser::{Browser, Screen, is_there};
use crate::common::*;
use crate::page::place;

fn begin(more: &[&str]) -> Option<(tempfile::TempDir, Label, Browser)> {
    if !is_there() {
        return None;
    }
    let dir = images(3);
    let served = Label::start(dir.path(), more);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    Some((dir, served, browser))
}

/// The middle of the picture in the window.
fn middle(browser: &Browser) -> (i64, i64) {
    let place = browser.get(
        "(() => { const box = document.getElementById('picture').getBoundingClientRect(); \
         return [box.left + box.width / 2, box.top + box.height / 2]; })()",
    );
    (place[0].as_f64().expect("a number") as i64, place[1].as_f64().expect("a number") as i64)
}

fn only_row(dir: &tempfile::TempDir) -> f64 {
    let found = labels(dir.path());
    assert_eq!(found.len(), 1, "{found:?}");
    found.values().map(|row| f64::from(*row)).sum()
}

#[test]
fn a_drag_in_a_zoomed_view_stays_under_the_pointer() {
    let Some((dir, _served, browser)) = begin(&["--columns", "80,"]) else { return };
    browser.keys(&["Plus", "Plus", "Plus", "Plus"]);
    let (x, y) = middle(&browser);
    let click = |y: i64| {
        browser.drag(&[(x, y)], false);
        browser.wait_saved();
        only_row(&dir)
    };
    let scale = browser.get(
        "(() => { const box = document.getElementById('picture').getBoundingClientRect(); \
         return Math.min((box.width - 16) / 160, (box.height - 30) / 120) * 1.5 ** 4; })()",
    );
    let scale = scale.as_f64().expect("a number");
    let rows = |pixels: i64| (pixels as f64 / scale).round();
    let first = click(y);
    // Near the edges of the view, where it used to come along.
    for to in [y + 240, y - 240] {
        let path: Vec<(i64, i64)> = (0..=12).map(|i| (x, y + (to - y) * i / 12)).collect();
        browser.drag(&path, false);
        browser.wait_saved();
        let expected = first + rows(to - y);
        assert!((only_row(&dir) - expected).abs() <= 1.0, "{} is not {expected}", only_row(&dir));
        assert_eq!(click(y), first, "the view has moved");
    }
    // Nor does it go back from where the wheel has moved it, before keys are used again.
    let wheel = |pixels: i64| {
        browser.get(&format!(
            "document.getElementById('picture').dispatchEvent(new WheelEvent('wheel', {{ deltaY: {pixels}, cancelable: true }}))"
        ));
        browser
            .get("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))");
    };
    browser.drag(&[(x, y - 200)], false);
    wheel(150);
    let moved = click(y);
    assert!((moved - first - rows(150)).abs() <= 1.0, "{moved} after {first}");
}

#[test]
fn a_large_pixel_is_what_is_clicked_on() {
    let Some((dir, _served, browser)) = begin(&["--columns", "80,"]) else { return };
    browser.resize(1600, 1300);
    browser.wait("document.getElementById('picture').clientHeight > 700");
    // Anywhere in it: as the page says, the pixel itself where pixels are large.
    for part in [0.2, 0.5, 0.8] {
        browser.drag(&[place(&browser, 80.5, 50.0 + part)], false);
        browser.wait_saved();
        assert_eq!(only_row(&dir), 50.0, "{part}");
        browser.keys(&["p", "Delete"]);
        browser.wait_saved();
    }
}

#[test]
fn a_drag_is_about_the_image_and_column_it_began_at() {
    let Some((dir, _served, browser)) = begin(&["--columns", "20,80"]) else { return };
    let (x, y) = middle(&browser);
    for key in ["n", "1"] {
        browser.drag_partly(&[(x, y), (x, y + 20)], false, false);
        browser.keys(&[key]);
        browser.let_go();
    }
    browser.drag(&[(x, y)], false);
    browser.wait_saved();
    let found: Vec<_> = labels(dir.path()).into_keys().collect();
    assert_eq!(found, [("frame_2.png".to_string(), 80)]);
}

#[test]
fn an_arrow_held_down_ends_where_it_is_let_go() {
    let Some((dir, _served, browser)) = begin(&["--columns", "80,"]) else { return };
    browser.keys(&["Enter", "p"]);
    browser.wait_saved();
    let start = only_row(&dir);
    browser.get("document.getElementById('up').dispatchEvent(new PointerEvent('pointerdown'))");
    wait_until("some rows up", || only_row(&dir) < start - 2.0);
    browser.get("document.getElementById('up').dispatchEvent(new PointerEvent('pointerup'))");
    browser.wait_saved();
    let held = only_row(&dir);
    let click = "document.getElementById('up').dispatchEvent(new MouseEvent('click', { detail: 1 }))";
    browser.get(click);
    std::thread::sleep(std::time::Duration::from_millis(50));
    browser.wait_saved();
    assert_eq!(only_row(&dir), held);
    // A short press is one row.
    for kind in ["pointerdown", "pointerup"] {
        browser.get(&format!("document.getElementById('up').dispatchEvent(new PointerEvent('{kind}'))"));
    }
    browser.get(click);
    wait_until("one row up", || only_row(&dir) == held - 1.0);
}

/// Lets the next so many answers to marks get lost after the server has done what was asked.
fn lose(browser: &Browser, answers: u32) {
    browser.get(&format!(
        "(() => {{ const ask = window.ask ??= window.fetch; let lost = {answers}; \
         window.fetch = async (what, how) => {{ const answer = await ask(what, how); \
         if (what === 'marks' && lost-- > 0) throw new TypeError('lost'); return answer; }}; }})()"
    ));
}

#[test]
fn a_mark_whose_answer_is_lost_is_not_somebody_elses() {
    let Some((dir, _served, browser)) = begin(&["--columns", "80,"]) else { return };
    lose(&browser, 2);
    browser.keys(&["Up"]);
    wait_until("a mark", || !labels(dir.path()).is_empty());
    let first = only_row(&dir);
    browser.wait("document.getElementById('saved').dataset.state === 'lost'");
    browser.keys(&["Up", "Up"]);
    browser.wait_saved();
    assert_eq!(only_row(&dir), first - 2.0);
    assert_eq!(browser.get("document.getElementById('alert').hidden"), true, "{}", browser.text("alert"));
    browser.keys(&["Delete"]);
    browser.wait_saved();
    // Taken back before it is known to be there.
    lose(&browser, 1);
    browser.keys(&["g", "p"]);
    wait_until("a mark", || !labels(dir.path()).is_empty());
    browser.wait("document.getElementById('saved').dataset.state === 'lost'");
    browser.keys(&["u"]);
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 0);
    assert_eq!(browser.get("document.body.dataset.done"), "0");
}

#[test]
fn there_and_back_again_is_no_step() {
    let Some((dir, _served, browser)) = begin(&["--columns", "20,80"]) else { return };
    browser.keys(&["Enter", "1", "Up", "Down", "u"]);
    browser.wait("document.body.dataset.done === '0'");
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 0);
}

#[test]
fn what_is_not_shown_is_not_marked() {
    let Some((dir, _served, browser)) = begin(&["--columns", "20,80"]) else { return };
    // Before the page has asked for it.
    let (here, away) = (below(&dir, "frame_1.png"), below(&dir, "away"));
    std::fs::rename(&here, &away).expect("movable");
    browser.reload();
    browser.wait("document.getElementById('status').textContent.includes('cannot be shown')");
    let (x, y) = middle(&browser);
    browser.keys_now(&["Enter", "Up", "g", "x", "c"]);
    browser.drag(&[(x, y), (x, y + 9)], false);
    browser.wait("document.getElementById('status').textContent.includes('cannot be marked')");
    assert_eq!(browser.get("document.body.dataset.done"), "0");
    assert!(!below(&dir, "labels.csv").exists() && !below(&dir, "labels.skip.csv").exists());
    // It comes by itself once it can.
    std::fs::rename(&away, &here).expect("movable");
    browser.keys(&["Enter"]);
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 1);
}

#[test]
fn marks_wait_for_their_own_folder_and_columns() {
    if !is_there() {
        return;
    }
    let (dir, other, place) = (images(2), images(2), tempfile::tempdir().expect("a temporary folder"));
    let address = below(&place, "address");
    let with = |columns: &str| {
        let address = address.to_str().expect("UTF-8").to_string();
        ["--address".to_string(), address, "--columns".to_string(), columns.to_string()]
    };
    let start = |dir: &tempfile::TempDir, columns: &str| {
        Label::start(dir.path(), &with(columns).each_ref().map(String::as_str))
    };
    let first = start(&dir, "20,60,100");
    let browser = Browser::start(Screen::Desktop);
    browser.open(first.address());
    browser.keys(&["2"]);
    drop(first);
    browser.keys(&["g"]);
    browser.wait("document.getElementById('saved').dataset.state === 'lost'");
    let second = start(&other, "20,60,100");
    browser.wait("document.getElementById('alert').textContent.includes('another folder')");
    assert_eq!(labels(other.path()).len(), 0);
    drop(second);
    let third = start(&dir, "20,100");
    browser.wait("document.getElementById('alert').textContent.includes('--columns')");
    assert_eq!(labels(dir.path()).len(), 0);
    drop(third);
    let fourth = start(&dir, "20,60,100");
    browser.wait_saved();
    browser.wait("document.getElementById('alert').hidden");
    assert_eq!(labels(dir.path()).into_keys().collect::<Vec<_>>(), [("frame_1.png".to_string(), 60)]);
    assert_eq!(fourth.json("GET", "session", "")["marks"].as_array().map(Vec::len), Some(1));
    // With nothing to wait for, the page goes along to another folder, with nothing of this one to be undone.
    drop(fourth);
    let fifth = start(&other, "30,");
    browser.wait("document.body.dataset.done === '0'");
    browser.keys(&["u"]);
    browser.wait("document.getElementById('status').textContent === 'Nothing to undo.'");
    let images: Value = fifth.json("GET", "session", "")["images"].clone();
    assert_eq!(images, json!(["frame_1.png", "frame_2.png"]));
}

#[test]
fn what_is_under_way_is_not_called_saved() {
    let Some((dir, _served, browser)) = begin(&["--columns", "20,80"]) else { return };
    let held = std::fs::File::create(below(&dir, ".labels.lock")).expect("writable");
    held.lock().expect("free");
    browser.get(
        "(() => { const text = document.getElementById('saved-text'); window.said = []; \
         new MutationObserver(() => window.said.push(text.textContent)).observe(text, { childList: true }); })()",
    );
    browser.keys(&["Enter"]);
    assert_eq!(browser.text("saved-text"), "Saving…");
    drop(held);
    browser.wait_saved();
    assert_eq!(browser.get("window.said"), json!(["Saving…", "Saved"]));
}
