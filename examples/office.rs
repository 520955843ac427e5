//! A contact sheet of the three sets recorded in synthetic offices: `cargo run --release --example office -- office.png`.

use image::imageops::{overlay, resize};
use image::{GrayImage, Luma};
use vsonar::dataset::{Constants, TOLERANCE};
use vsonar::world::office::World;

/// Pictures side by side, and of each set; their size on the sheet; the space between them.
const ACROSS: u32 = 6;
const OF_EACH: u32 = 12;
const SIZE: (u32, u32) = (160, 120);
const GAP: u32 = 4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "office.png".into());
    let sets = [World::Nsh.training(), World::Fmrb.training(), World::Nsh.changed(1)];
    let rows = OF_EACH / ACROSS * sets.len() as u32;
    let (width, height) = (ACROSS * (SIZE.0 + GAP) + GAP, rows * (SIZE.1 + GAP) + GAP);
    let mut sheet = GrayImage::from_pixel(width, height, Luma([255]));
    for (s, set) in sets.iter().enumerate() {
        let share = Constants::learn(set, TOLERANCE).score(set);
        println!(
            "{}: {} images, {} cases; best constants: {:.1} %, per column {:.1} %",
            set.name(),
            set.images().len(),
            set.cases().len(),
            100.0 * share.overall_share(),
            100.0 * share.per_column_share()
        );
        for k in 0..OF_EACH {
            let of = k as usize * set.images().len() / OF_EACH as usize;
            let small = resize(&set.images()[of].pixels, SIZE.0, SIZE.1, image::imageops::Triangle);
            let k = s as u32 * OF_EACH + k;
            let (x, y) = (k % ACROSS * (SIZE.0 + GAP) + GAP, k / ACROSS * (SIZE.1 + GAP) + GAP);
            overlay(&mut sheet, &small, i64::from(x), i64::from(y));
        }
    }
    sheet.save(&out)?;
    Ok(())
}
