//! The page as somebody sees it for the first time, large and dark images on it, and what lies on what.

use image::{GrayImage, Luma};
use serde_json::json;

use crate::browser::{Browser, Screen, is_there};
use crate::common::*;

const OPEN: &str = "document.getElementById('help').open";

#[test]
fn the_task_is_shown_the_first_time() {
    if !is_there() {
        return;
    }
    let dir = images(2);
    let first = Label::start(dir.path(), &[]);
    let browser = Browser::start(Screen::Narrow);
    browser.open_as_new(first.address());
    assert_eq!(browser.get(OPEN), true);
    // The task is what is seen first, and the way on is in the window.
    let seen = browser.get(
        "['help-title', 'help'].map((id) => document.getElementById(id).getBoundingClientRect().top >= 0).concat( \
         [...document.querySelectorAll('#help form button')].map((b) => b.getBoundingClientRect().bottom <= innerHeight), \
         [document.querySelector('#help svg').getBoundingClientRect().height > 60, document.getElementById('help').scrollTop === 0])",
    );
    assert_eq!(seen, json!([true, true, true, true, true]));
    // Keys are for the dialog: nothing is marked behind it.
    browser.keys_now(&["g", "x", "Escape"]);
    browser.wait("!document.getElementById('help').open");
    assert_eq!(browser.get("document.body.dataset.done"), "0");
    browser.keys(&["g"]);
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 1);
    // Not again, under another port and for another folder too.
    let other = images(1);
    let second = Label::start(other.path(), &[]);
    browser.open_as_new(second.address());
    assert_eq!(browser.get(OPEN), false);
    browser.keys(&["?"]);
    browser.wait(OPEN);
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn nothing_lies_on_a_column() {
    if !is_there() {
        return;
    }
    // High and wide images: whatever shape fills the room.
    for (width, height) in [(60, 160), (320, 60), (160, 120)] {
        let dir = tempfile::tempdir().expect("a temporary folder");
        GrayImage::from_pixel(width, height, Luma([9])).save(dir.path().join("a.png")).expect("writable");
        let last = format!("1,{}", width - 1);
        let served = Label::start(dir.path(), &["--columns", &last]);
        for screen in [Screen::Narrow, Screen::Phone, Screen::Desktop, Screen::Sideways] {
            let browser = Browser::start(screen);
            browser.open(served.address());
            let on_it = browser.get(
                "(() => { const at = document.getElementById('picture').getBoundingClientRect(); \
                 return [...document.querySelectorAll('button, input, header, footer')].filter((e) => e.offsetParent && !e.closest('dialog')) \
                 .filter((e) => { const r = e.getBoundingClientRect(); \
                 return r.left < at.right && r.right > at.left && r.top < at.bottom && r.bottom > at.top; }) \
                 .map((e) => e.id || e.tagName); })()",
            );
            assert_eq!(on_it, json!([]), "{width}x{height} {screen:?}");
            let room =
                browser.get("document.getElementById('picture').clientHeight").as_f64().expect("a number");
            assert!(room > 150.0, "{room} {screen:?}");
            assert_eq!(browser.get("document.documentElement.scrollWidth <= innerWidth"), true);
        }
    }
}

#[test]
fn dark_images_are_shown_brighter() {
    if !is_there() {
        return;
    }
    let dir = images(2);
    let served = Label::start(dir.path(), &["--columns", "20,60"]);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    let filter = || {
        browser.get("[getComputedStyle(document.getElementById('pixels')).filter, getComputedStyle(document.getElementById('picture')).filter]")
    };
    let slider = "document.getElementById('light')";
    assert_eq!(filter(), json!(["none", "none"]));
    browser.keys(&["b", "b"]);
    assert_eq!(filter(), json!(["brightness(2)", "none"]), "marks keep their colours");
    assert_eq!(browser.get(&format!("{slider}.getAttribute('aria-valuetext')")), "2.0 times");
    assert_eq!(
        browser.get(&format!("{slider}.labels.length > 0 || {slider}.getAttribute('aria-label').length > 9")),
        true
    );
    // It is of the display: it stays for the next image, and marks are made as ever.
    browser.keys(&["g", "g"]);
    browser.wait("document.getElementById('name').textContent === 'frame_2.png'");
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 2);
    assert_eq!(filter(), json!(["brightness(2)", "none"]));
    // It ends somewhere, to both sides; and is taken back by a key or a button.
    browser.keys(&["b"; 12]);
    assert_eq!(filter(), json!(["brightness(8)", "none"]));
    browser.keys(&["d"; 20]);
    assert_eq!(filter(), json!(["brightness(0.5)", "none"]));
    browser.keys(&["r"]);
    assert_eq!(filter(), json!(["none", "none"]));
    assert_eq!(browser.get("document.getElementById('light-reset').disabled"), true);
    // The slider is moved by arrows while it has the focus, and no mark is.
    browser.get(&format!("{slider}.focus()"));
    browser.keys(&["Up", "Up", "Up", "Up"]);
    assert_eq!(filter(), json!(["brightness(4)", "none"]));
    browser.press("light-reset");
    assert_eq!(filter(), json!(["none", "none"]));
    browser.keys(&["Up"]);
    browser.wait("document.body.dataset.done === '3'");
    browser.wait_saved();
    assert_eq!(labels(dir.path()).len(), 3, "with the arrows back where they belong");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn a_sign_while_an_image_loads() {
    if !is_there() {
        return;
    }
    let dir = images(12);
    let served = Label::start(dir.path(), &["--columns", "20,60"]);
    let browser = Browser::start(Screen::Desktop);
    browser.open(served.address());
    browser.wait("document.getElementById('loading').hidden");
    // The next images never come until they are let go.
    browser.get(
        "(() => { const decode = Image.prototype.decode; const wait = new Promise((go) => { window.letGo = go; }); \
         Image.prototype.decode = function () { return wait.then(() => decode.call(this)); }; })()",
    );
    // Those that are near are there already.
    browser.keys_now(&["n", "n", "n", "n"]);
    browser.wait("!document.getElementById('loading').hidden");
    assert_eq!(browser.text("loading"), "Loading frame_5.png …");
    browser.keys_now(&["g"]);
    assert!(browser.text("status").contains("not shown yet"), "{}", browser.text("status"));
    browser.get("window.letGo()");
    browser.wait("document.getElementById('loading').hidden && document.getElementById('picture').dataset.image === '5'");
    // An image that cannot be shown is not said to be on its way.
    std::fs::remove_file(below(&dir, "frame_12.png")).expect("there");
    browser.get("history.replaceState(null, '', '#12')");
    browser.reload();
    browser.wait("document.getElementById('status').textContent.includes('cannot be shown')");
    browser.wait("document.getElementById('loading').hidden");
}

#[test]
fn large_images_are_a_reason_to_scale_them_first() {
    if !is_there() {
        return;
    }
    let dir = tempfile::tempdir().expect("a temporary folder");
    for name in ["a.png", "b.png"] {
        GrayImage::from_fn(1200, 900, |x, y| Luma([(x + y) as u8]))
            .save(dir.path().join(name))
            .expect("writable");
    }
    let served = Label::start(dir.path(), &[]);
    assert_eq!(served.ready["useful_size"], json!([320, 240]));
    let browser = Browser::start(Screen::Narrow);
    browser.open(served.address());
    browser.wait("document.getElementById('alert').textContent.includes('vsonar data resize')");
    // The line above it leaves the picture less room, and it is drawn anew for what is left.
    browser.wait(
        "(() => { const c = document.getElementById('picture'); return c.height === Math.round(c.clientHeight * devicePixelRatio); })()",
    );
    assert!(browser.text("notes").contains("1200 x 900 pixels are more than is of use"));
    // It can be labelled all the same, and then the line is gone.
    browser.keys(&["g"]);
    browser.wait_saved();
    browser.wait("document.getElementById('alert').hidden");
    assert_eq!(labels(dir.path()).len(), 1);
}
