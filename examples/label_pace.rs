//! How long each key takes on the page of `vsonar label`, when 20 images (120 marks) are labelled by keyboard at the
//! pace of a person: from the key to the painted page, and to the mark on the disk.
//!
//! ```text
//! cargo run --release --example label_pace                       120 marks in two and a half minutes
//! cargo run --release --example label_pace -- fast shots         without pauses; pictures of the page into `shots`
//! ```
//! Chromium and chromedriver must be installed. The images are rendered, into a temporary folder.

use std::sync::Arc;
use std::time::{Duration, Instant};

use vsonar::label::{Columns, Session, serve};
use vsonar::tree::Random;
use vsonar::web::Server;
use vsonar::world::Corridor;

#[allow(dead_code)] // what the tests of the page need beside
#[path = "../tests/label/browser.rs"]
mod browser;

use browser::{Browser, Screen};

const IMAGES: usize = 20;

/// Notes for every key when the page had been painted after it, and when its mark was saved.
const NOTES: &str = "
window.notes = [];
addEventListener('keydown', (event) => {
  if (['Shift', 'Control'].includes(event.key)) return;
  const note = { key: event.key, start: event.timeStamp, painted: null, saved: null };
  window.notes.push(note);
  const look = () => {
    // Runs after the frame that this callback belongs to has been drawn.
    const channel = new MessageChannel();
    channel.port1.onmessage = () => {
      const now = performance.now();
      const shown = document.getElementById('picture').dataset.image === location.hash.slice(1);
      if (shown && note.painted === null) note.painted = now - note.start;
      if (document.getElementById('saved').dataset.state === 'saved') note.saved = now - note.start;
      if (note.painted === null || note.saved === null) requestAnimationFrame(look);
    };
    channel.port2.postMessage(null);
  };
  requestAnimationFrame(look);
}, true);
return true;";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let fast = arguments.first().is_some_and(|word| word == "fast");
    let dir = tempfile::tempdir()?;
    let set = Corridor::default().render(1, IMAGES)?;
    for (i, image) in set.images().iter().enumerate() {
        image.pixels.save(dir.path().join(format!("frame_{}.png", i + 1)))?;
    }
    let session = Arc::new(Session::open(dir.path(), &Columns::Spread(6))?);
    let server = Server::bind(0)?;
    let address = server.address();
    let _running = serve(session.clone(), server)?;
    if !browser::is_there() {
        return Ok(());
    }
    if let Some(shots) = arguments.get(1) {
        return pictures(&address, shots);
    }
    let browser = Browser::start(Screen::Desktop);
    browser.open(&address);
    browser.get(&format!("(() => {{ {NOTES} }})()"));
    let mut random = Random::stream(1, 0, 0);
    let mut pause = |from: f64, to: f64| {
        if !fast {
            std::thread::sleep(Duration::from_secs_f64(from + random.unit() * (to - from)));
        }
    };
    let mut dice = Random::stream(2, 0, 0);
    let start = Instant::now();
    for _ in 0..6 * IMAGES {
        // Looking, then a few keys to the edge, then the next column.
        pause(0.5, 1.2);
        let direction = if dice.unit() < 0.5 { "Up" } else { "Down" };
        if dice.unit() < 0.2 {
            browser.keys(&[&format!("Shift+{direction}")]);
            pause(0.15, 0.3);
        }
        for _ in 0..dice.below(5) {
            browser.keys(&[direction]);
            pause(0.08, 0.2);
        }
        let last = dice.unit();
        browser.keys(&[if last < 0.05 {
            "g"
        } else if last < 0.08 {
            "x"
        } else {
            "Enter"
        }]);
    }
    browser.wait_saved();
    let taken = start.elapsed();
    let notes = browser.get("window.notes");
    let notes = notes.as_array().ok_or("no notes")?;
    let progress = session.progress();
    println!(
        "{} of {} marks in {:.0} s, {} keys",
        progress.labels + progress.skipped,
        progress.asked,
        taken.as_secs_f64(),
        notes.len()
    );
    for what in ["painted", "saved"] {
        let mut times: Vec<f64> = notes.iter().filter_map(|note| note[what].as_f64()).collect();
        times.sort_by(f64::total_cmp);
        let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize];
        let slow = times.iter().filter(|time| **time > 100.0).count();
        println!(
            "from key to {what}: median {:.0} ms, 95 % within {:.0} ms, longest {:.0} ms; {slow} of {} over 100 ms",
            at(0.5),
            at(0.95),
            at(1.0),
            times.len()
        );
    }
    Ok(())
}

/// The page on several screens.
fn pictures(address: &str, folder: &str) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    for (name, screen) in [("light", Screen::Desktop), ("dark", Screen::Dark), ("phone", Screen::Phone)] {
        let browser = Browser::start(screen);
        browser.open(address);
        let save = |what: &str| std::fs::write(format!("{folder}/{name}{what}.png"), browser.screenshot());
        browser.keys(&["Enter", "Up", "Enter", "Down", "g", "x"]);
        browser.wait_saved();
        browser.wait("document.getElementById('picture').dataset.image !== ''");
        save("")?;
        browser.keys(&["Plus", "Plus", "Plus"]);
        save("-zoomed")?;
        browser.keys(&["0", "?"]);
        save("-help")?;
    }
    Ok(())
}
