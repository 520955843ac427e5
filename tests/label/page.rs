//! The page in Chromium: labelling by keys, pointer and finger, in several windows, with a server that goes away.

use serde_json::{Value, json};
use vsonar::dataset::Dataset;

use crate::browser::{Browser, Screen, is_there};
use crate::common::*;

/// The row of the mark at a column of an image, if it is on the disk.
fn label(dir: &tempfile::TempDir, image: u32, x: u32) -> Option<u32> {
    labels(dir.path()).get(&(format!("frame_{image}.png"), x)).copied()
}

/// Where a point of the image is in the window.
pub(crate) fn place(browser: &Browser, x: f64, y: f64) -> (i64, i64) {
    let script = format!(
        "(() => {{ const box = document.getElementById('picture').getBoundingClientRect(); \
         const scale = Math.min((box.width - 16) / 160, (box.height - 30) / 120); \
         return [box.left + box.width / 2 + ({x} - 80) * scale, box.top + box.height / 2 + ({y} - 60) * scale]; }})()"
    );
    let place = browser.get(&script);
    let number = |i: usize| place[i].as_f64().expect("a number").round() as i64;
    (number(0), number(1))
}

#[test]
fn what_the_command_notes_stands_on_the_page() {
    if !is_there() {
        return;
    }
    let dir = images(2);
    std::fs::create_dir(below(&dir, "deeper")).expect("writable");
    std::fs::copy(below(&dir, "frame_1.png"), below(&dir, "deeper/a.png")).expect("writable");
    std::fs::write(below(&dir, "broken.png"), "no image").expect("writable");
    let served = Label::start(dir.path(), &[]);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    let shown = |id: &str| {
        let text = browser.get(&format!("document.getElementById('{id}').innerText"));
        text.as_str().unwrap_or_default().to_string()
    };
    assert!(
        shown("notes").contains("1 image in a subfolder (deeper) is not looked at"),
        "{}",
        shown("notes")
    );
    assert!(shown("left-out").contains("broken.png: "), "{}", shown("left-out"));
    std::fs::remove_dir_all(below(&dir, "deeper")).expect("removable");
    std::fs::remove_file(below(&dir, "broken.png")).expect("removable");
    drop(served);
    let served = Label::start(dir.path(), &[]);
    browser.open(served.address());
    assert_eq!(browser.get("['notes', 'left-out'].every((id) => document.getElementById(id).hidden)"), true);
}

#[test]
fn by_keyboard_alone() {
    if !is_there() {
        return;
    }
    let dir = images(3);
    let served = Label::start(dir.path(), &["--columns", "20,60,100"]);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    // Where there is nothing to go by, the mark begins somewhere; ten rows and one row are what they say.
    browser.keys(&["Enter"]);
    browser.wait_saved();
    let start = label(&dir, 1, 20).expect("a mark");
    browser.keys(&["1", "Shift+Up", "Up", "Up", "Down"]);
    browser.wait_saved();
    assert_eq!(label(&dir, 1, 20), Some(start - 11));
    browser.keys(&["2", "PageDown", "3", "g"]);
    browser.wait_saved();
    assert_eq!((label(&dir, 1, 60), label(&dir, 1, 100)), (Some(start - 1), Some(0)));
    // The image was complete, so the next one is shown, with the previous one's rows to be accepted.
    browser.wait("document.getElementById('name').textContent === 'frame_2.png'");
    browser.keys(&["Enter", "x"]);
    browser.wait_saved();
    assert_eq!((label(&dir, 2, 20), label(&dir, 2, 60)), (Some(start - 11), None));
    let skips = std::fs::read_to_string(below(&dir, "labels.skip.csv")).expect("there");
    assert_eq!(skips, "image,x\nframe_2.png,60\n");
    // Undo takes back one step after the other.
    browser.keys(&["u"]);
    browser.wait_saved();
    assert_eq!(std::fs::read_to_string(below(&dir, "labels.skip.csv")).expect("there"), "image,x\n");
    browser.keys(&["Ctrl+z"]);
    browser.wait_saved();
    assert_eq!(label(&dir, 2, 20), None);
    // One key copies the previous image.
    browser.keys(&["c"]);
    browser.wait_saved();
    let row = |image| [20, 60, 100].map(|x| label(&dir, image, x));
    assert_eq!(row(2), row(1));
    browser.keys(&["2", "Delete"]);
    browser.wait_saved();
    assert_eq!(label(&dir, 2, 60), None);
    browser.keys(&["u", "n", "c", "p", "p"]);
    browser.wait_saved();
    assert_eq!(row(3), row(1));
    assert_eq!(browser.text("name"), "frame_1.png");
    assert_eq!(browser.get("document.body.dataset.done"), "9");
    // Zoom, help and the buttons can be had without a pointer, too.
    browser.keys(&["Plus", "Plus", "-", "0", "?"]);
    browser.wait("document.getElementById('help').open");
    browser.keys(&["Escape"]);
    browser.wait("!document.getElementById('help').open");
    let reached = |browser: &Browser| browser.get("document.activeElement.id");
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..30 {
        browser.keys(&["Tab"]);
        seen.insert(reached(&browser).as_str().unwrap_or_default().to_string());
    }
    for id in ["picture", "zoom-in", "next", "accept", "ground", "skip", "undo", "help-open"] {
        assert!(seen.contains(id), "{id} cannot be reached: {seen:?}");
    }
    drop(browser);
    let set = Dataset::load(dir.path()).expect("a sound data set");
    assert_eq!(set.cases().len(), 9);
}

#[test]
fn by_pointer() {
    if !is_there() {
        return;
    }
    let dir = images(1);
    let served = Label::start(dir.path(), &["--columns", "20,60,100"]);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    // A click near a column places its mark: the edge between obstacle and floor is where the pointer is.
    browser.drag(&[place(&browser, 63.0, 80.0)], false);
    browser.wait_saved();
    assert_eq!(label(&dir, 1, 60), Some(79));
    // A drag stays at the column it began at, and may end outside the image.
    let path = [(98.0, 30.0), (70.0, 40.0), (22.0, 50.0)].map(|(x, y)| place(&browser, x, y));
    browser.drag(&path, false);
    browser.wait_saved();
    assert_eq!((label(&dir, 1, 100), label(&dir, 1, 20)), (Some(49), None));
    let path = [(20.5, 30.0), (20.5, -4.0)].map(|(x, y)| place(&browser, x, y));
    browser.drag(&path, false);
    browser.wait_saved();
    assert_eq!(label(&dir, 1, 20), Some(0));
    browser.press("undo");
    browser.wait_saved();
    assert_eq!(label(&dir, 1, 20), None);
    browser.press("skip");
    browser.wait_saved();
    assert!(
        std::fs::read_to_string(below(&dir, "labels.skip.csv")).expect("there").ends_with("frame_1.png,20\n")
    );
}

#[test]
fn on_a_phone() {
    if !is_there() {
        return;
    }
    let dir = images(2);
    let served = Label::start(dir.path(), &[]);
    let browser = Browser::start(Screen::Phone);
    browser.open(served.address());
    assert_eq!(browser.get("innerWidth"), 390);
    assert_eq!(browser.get("document.documentElement.scrollWidth <= innerWidth"), true);
    // Every button is large enough for a finger, and inside the window.
    let small = browser.get(
        "[...document.querySelectorAll('button')].filter((b) => b.offsetParent).map((b) => [b.id, b.getBoundingClientRect()]) \
         .filter(([, r]) => r.width < 40 || r.height < 40 || r.left < 0 || r.right > innerWidth + 1 || r.bottom > innerHeight + 1) \
         .map(([id, r]) => `${id} ${r.width}x${r.height} at ${r.left},${r.top}`)",
    );
    assert_eq!(small, json!([]));
    let columns: Vec<u32> = serde_json::from_value(served.ready["columns"].clone()).expect("numbers");
    browser.drag(&[place(&browser, f64::from(columns[2]) + 1.0, 50.0), place(&browser, 60.0, 60.0)], true);
    browser.wait_saved();
    assert_eq!(label(&dir, 1, columns[2]), Some(59));
    // Taps that the driver makes are not always clicks, so the buttons are clicked; their size is held above.
    let click = |id: &str| browser.get(&format!("document.getElementById('{id}').click()"));
    click("up");
    wait_until("one row up", || label(&dir, 1, columns[2]) == Some(58));
    for id in ["undo", "undo", "ground", "accept", "skip"] {
        click(id);
    }
    browser.wait("document.body.dataset.done === '3'");
    browser.wait_saved();
    let found = labels(dir.path());
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(std::fs::read_to_string(below(&dir, "labels.skip.csv")).expect("there").contains("frame_1.png"));
}

#[test]
fn on_a_phone_held_sideways() {
    if !is_there() {
        return;
    }
    let dir = images(2);
    let program = below(&dir, "p.gp");
    std::fs::write(&program, "(individual (iterate-up 3x3 x-obstacle (set-a 33)))").expect("writable");
    let served = Label::start(dir.path(), &["--suggest", program.to_str().expect("UTF-8")]);
    let browser = Browser::start(Screen::Sideways);
    browser.open(served.address());
    browser.get("document.getElementById('suggest').click()");
    browser.wait("!document.getElementById('take').hidden");
    browser.wait("document.getElementById('picture').dataset.image === '1'");
    assert_eq!(browser.get("[innerWidth, innerHeight]"), json!([740, 360]));
    assert_eq!(browser.get("document.documentElement.scrollWidth <= innerWidth"), true);
    let height = browser.get("document.getElementById('picture').getBoundingClientRect().height");
    assert!(height.as_f64().expect("a number") >= 250.0, "the picture is {height} pixels high");
    let status = browser.get("document.getElementById('status').getBoundingClientRect()");
    let side = |name: &str| status[name].as_f64().expect("a number");
    assert!(side("height") > 10.0 && side("top") >= 0.0 && side("bottom") <= 360.0, "{status}");
    assert!(!browser.text("status").is_empty());
    // Each button can be had: it is in the window, if need be after its row was moved, and nothing lies on it.
    let out_of_reach = browser.get(
        "[...document.querySelectorAll('button')].filter((b) => b.offsetParent && !b.disabled).map((b) => { \
         b.scrollIntoView({ block: 'nearest', inline: 'nearest' }); const r = b.getBoundingClientRect(); \
         const at = document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2); \
         const whole = r.left >= 0 && r.top >= 0 && r.right <= innerWidth + 1 && r.bottom <= innerHeight + 1; \
         return whole && b.contains(at) && r.width >= 40 && r.height >= 36 ? '' : \
         `${b.id || b.textContent} ${r.width}x${r.height} at ${r.left},${r.top}`; }).filter((text) => text)",
    );
    assert_eq!(out_of_reach, json!([]));
    let buttons =
        browser.get("[...document.querySelectorAll('button')].filter((b) => b.offsetParent).length");
    assert_eq!(buttons, 6 + 12 + 5, "columns, tools, zoom, brightness and help");
    // Nothing but the picture is moved to see it all.
    assert_eq!(browser.get("[scrollX, scrollY]"), json!([0, 0]));
}

#[test]
fn capital_letters_act_as_small_ones() {
    if !is_there() {
        return;
    }
    let dir = images(4);
    let program = below(&dir, "p.gp");
    std::fs::write(&program, "(individual (iterate-up 3x3 x-obstacle (set-a 33)))").expect("writable");
    let more = ["--columns", "20,60", "--suggest", program.to_str().expect("UTF-8")];
    let served = Label::start(dir.path(), &more);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    let shown = |name: &str| {
        let image = "document.getElementById('picture').dataset.image === location.hash.slice(1)";
        browser.wait(&format!("document.getElementById('name').textContent === '{name}' && {image}"));
    };
    // As caps lock has them, without Shift; the driver would press Shift for them.
    let pressed = |key: &str, how: &str| {
        browser.get(&format!(
            "document.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true, {how} }}))"
        ));
    };
    shown("frame_1.png");
    pressed("G", "");
    pressed("X", "");
    shown("frame_2.png");
    browser.wait_saved();
    assert_eq!(browser.get("document.body.dataset.done"), "2");
    assert_eq!((label(&dir, 1, 20), label(&dir, 1, 60)), (Some(0), None));
    pressed("C", "");
    browser.wait("document.body.dataset.done === '4'");
    pressed("Z", "ctrlKey: true");
    browser.wait("document.body.dataset.done === '2'");
    // Held down, a key that moves goes on; one that marks does not.
    pressed("N", "repeat: true");
    shown("frame_3.png");
    pressed("P", "repeat: true");
    pressed("P", "repeat: true");
    shown("frame_1.png");
    pressed("F", "");
    shown("frame_2.png");
    pressed("G", "repeat: true");
    // One answer, not all of them.
    pressed("S", "");
    pressed("A", "");
    browser.wait("document.body.dataset.done === '3'");
    browser.wait_saved();
    assert_eq!((label(&dir, 2, 20), label(&dir, 2, 60)), (Some(33), None));
}

#[test]
fn two_windows_see_and_keep_each_others_marks() {
    if !is_there() {
        return;
    }
    let dir = images(2);
    let served = Label::start(dir.path(), &["--columns", "20,60,100"]);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    browser.open_another(served.address());
    browser.keys(&["2", "g", "1", "g"]);
    browser.wait_saved();
    browser.window(0);
    browser.wait("document.body.dataset.done === '2'");
    browser.keys(&["3", "Enter"]);
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 3);
    // This one's undo is of its own mark only.
    browser.keys(&["p", "u", "u"]);
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 2);
    browser.wait("document.getElementById('status').textContent === 'Nothing to undo.'");
    // A step that somebody has changed since is not taken back.
    browser.keys(&["3", "g", "p"]);
    browser.wait_saved();
    served.mark("frame_1.png", 100, json!(0), json!(44));
    browser.wait("document.querySelectorAll('#columns .value')[2].textContent === '44'");
    browser.keys(&["u"]);
    browser.wait("document.getElementById('status').textContent.startsWith('Not undone')");
    assert_eq!(label(&dir, 1, 100), Some(44));
    // A mark that has not seen the other's is refused, and that is told. No news comes between the two.
    browser.get(
        "(() => { const ask = window.fetch; \
         window.fetch = (what, how) => { \
         if (!String(what).startsWith('changes')) return ask(what, how); \
         window.deaf = true; return new Promise(() => {}); }; })()",
    );
    // The page asks for the next news once it has those before.
    browser.wait("window.deaf === true");
    served.mark("frame_1.png", 20, json!(0), json!(33));
    browser.keys(&["1", "Down"]);
    browser.wait_saved();
    assert_eq!(label(&dir, 1, 20), Some(33));
    browser.wait("document.getElementById('alert').textContent.includes('marked elsewhere')");
    browser.wait("document.querySelectorAll('#columns .value')[0].textContent === '33'");
}

#[test]
fn closing_and_reloading_lose_nothing() {
    if !is_there() {
        return;
    }
    let dir = images(3);
    let served = Label::start(dir.path(), &["--columns", "20,60,100"]);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    browser.open_another(served.address());
    // Nothing is answered for a while, so that all but the first mark are still in the window when it is closed.
    let held = std::fs::File::create(below(&dir, ".labels.lock")).expect("writable");
    held.lock().expect("free");
    browser.keys(&["g", "g", "g"]);
    browser.keys(&["x"]);
    assert_ne!(browser.get("document.getElementById('saved-text').textContent"), "Saved");
    browser.close_window();
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(labels(dir.path()).len(), 0);
    drop(held);
    wait_until("all marks", || labels(dir.path()).len() == 3 && below(&dir, "labels.skip.csv").exists());
    browser.window(0);
    browser.reload();
    assert_eq!(browser.get("document.body.dataset.done"), "4");
    browser.keys(&["f"]);
    browser.wait("document.getElementById('name').textContent === 'frame_2.png'");
    browser.reload();
    assert_eq!(browser.text("name"), "frame_2.png");
}

#[test]
fn marks_wait_for_a_server_that_comes_back() {
    if !is_there() {
        return;
    }
    let (dir, place) = (images(2), tempfile::tempdir().expect("a temporary folder"));
    let address = below(&place, "address");
    let more = ["--columns", "20,60,100", "--address", address.to_str().expect("UTF-8")];
    let first = Label::start(dir.path(), &more);
    let browser = Browser::start(Screen::Desktop);
    browser.open(first.address());
    browser.keys(&["g"]);
    browser.wait_saved();
    // Killed, with no time to say anything.
    drop(first);
    browser.keys(&["g", "x"]);
    browser.wait("document.getElementById('saved').dataset.state === 'lost'");
    browser.wait("document.getElementById('alert').textContent.startsWith('2 marks are not saved yet')");
    assert_eq!(labels(dir.path()).len(), 1);
    let warned = browser.get(
        "(() => { const event = new Event('beforeunload', { cancelable: true }); window.dispatchEvent(event); \
         return event.defaultPrevented; })()",
    );
    assert_eq!(warned, true);
    let second = Label::start(dir.path(), &more);
    browser.wait_saved();
    browser.wait("document.getElementById('alert').hidden");
    assert_eq!(labels(dir.path()).len(), 2);
    assert_eq!(second.json("GET", "session", "")["marks"].as_array().map(Vec::len), Some(3));
    browser.keys(&["Enter"]);
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 3);
}

#[test]
fn suggestions_are_shown_and_taken() {
    if !is_there() {
        return;
    }
    let dir = images(1);
    let program = below(&dir, "level.gp");
    // In column x it answers the row x / 2.
    std::fs::write(&program, "(individual (iterate-up 2x2 x-obstacle (set-a (* x-obstacle 0.5))))")
        .expect("writable");
    let more = ["--columns", "20,60,100", "--suggest", program.to_str().expect("UTF-8")];
    let served = Label::start(dir.path(), &more);
    assert_eq!(served.json("GET", "suggestions/0", ""), json!([10, 30, 50]));
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    browser.keys(&["s", "a"]);
    browser.wait("document.body.dataset.done === '1'");
    browser.keys(&["Enter", "Shift+a"]);
    browser.wait("document.body.dataset.done === '3'");
    browser.wait_saved();
    assert_eq!([20, 60, 100].map(|x| label(&dir, 1, x)), [Some(10), Some(10), Some(50)]);
    browser.keys(&["2", "a"]);
    browser.wait_saved();
    assert_eq!(label(&dir, 1, 60), Some(30));
}

/// The words that the demand is about: twenty images, six columns, keys alone. How long each key takes is what
/// `examples/label_pace.rs` measures; here it is only printed.
#[test]
fn twenty_images_by_keyboard() {
    if !is_there() {
        return;
    }
    let dir = images(20);
    let served = Label::start(dir.path(), &[]);
    assert_eq!(served.ready["progress"]["asked"], 120);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    let start = std::time::Instant::now();
    for i in 0..120 {
        let keys: &[&str] = match i % 5 {
            0 => &["Up", "Up", "Enter"],
            3 => &["Shift+Down", "Up", "Enter"],
            _ => &["Enter"],
        };
        browser.keys(keys);
    }
    browser.wait_saved();
    println!("120 marks as fast as the driver presses keys: {:.1} s", start.elapsed().as_secs_f64());
    assert_eq!(browser.get("document.body.dataset.done"), "120");
    assert!(browser.text("status").starts_with("Every column of every image is marked"));
    let found = labels(dir.path());
    assert_eq!(found.len(), 120);
    let set = Dataset::load(dir.path()).expect("a sound data set");
    assert_eq!((set.images().len(), set.cases().len(), set.columns().len()), (20, 120, 6));
    let order: Vec<&str> = set.images().iter().map(|image| image.name.as_str()).collect();
    assert_eq!((order[0], order[9]), ("frame_1.png", "frame_10.png"));
    assert_eq!(
        browser.get("document.getElementById('bar').getAttribute('aria-valuenow')"),
        Value::from("120")
    );
}
