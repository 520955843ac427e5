//! Pictures and sheets by their pixels.

use image::{GrayImage, Luma, Rgb, RgbImage};

use super::picture::{RIGHT, WRONG};
use super::*;
use crate::ir::Rect;

const BLACK: Rgb<u8> = Rgb([0, 0, 0]);
const WHITE: Rgb<u8> = Rgb([255, 255, 255]);
const GRAY: Rgb<u8> = Rgb([99, 99, 99]);

fn gray(width: u32, height: u32) -> GrayImage {
    GrayImage::from_pixel(width, height, Luma([99]))
}

fn column(x: u32, label: u32, answer: f32) -> Column {
    Column { x, label, answer }
}

fn one(answer: f32) -> RgbImage {
    draw(&gray(320, 240), &[column(160, 120, answer)], &Style::default())
}

/// How many pixels of a colour there are in the rows `top..bottom`.
fn pixels(picture: &RgbImage, colour: Rgb<u8>, rows: std::ops::Range<u32>) -> usize {
    picture.enumerate_pixels().filter(|(_, y, p)| rows.contains(y) && **p == colour).count()
}

#[test]
fn the_bar_changes_at_the_answer() {
    for (answer, last_black) in [(60.0, 60), (60.99, 60), (0.0, 0), (239.0, 239), (-0.0, 0)] {
        // the label is far from the places looked at
        let picture = one(answer);
        let at = |y: u32| *picture.get_pixel(160, y);
        // a ring of 8 pixels stands around the answer, the cross at 120
        let clear = |y: u32| y.abs_diff(answer as u32) > 10 && y.abs_diff(120) > 10;
        for y in (0..240).filter(|&y| clear(y)) {
            assert_eq!(at(y), if y <= last_black { BLACK } else { WHITE }, "{answer}, row {y}");
        }
        // inside the ring, where no square is drawn
        if last_black == 60 {
            assert_eq!((at(60), at(61)), (BLACK, WHITE), "{answer}");
        }
        // three pixels of bar, one of outline at each side, and the image beside
        for (x, colour) in [(157, GRAY), (158, WHITE), (159, BLACK), (161, BLACK), (162, WHITE), (163, GRAY)]
        {
            if last_black == 60 {
                assert_eq!(*picture.get_pixel(x, 20), colour, "column {x}");
            }
        }
    }
}

#[test]
fn right_and_wrong_differ_in_colour_and_shape() {
    let (right, wrong) = (one(130.0), one(130.5));
    assert!(pixels(&right, RIGHT, 0..240) > 0 && pixels(&right, WRONG, 0..240) == 0);
    assert!(pixels(&wrong, WRONG, 0..240) > 0 && pixels(&wrong, RIGHT, 0..240) == 0);
    // the cross is at the label either way, and reaches out of the bar
    for (picture, colour) in [(&right, RIGHT), (&wrong, WRONG)] {
        for (x, y) in [(160, 120), (160, 115), (155, 120), (165, 120)] {
            assert_eq!(*picture.get_pixel(x, y), colour, "{x}, {y}");
        }
        assert_eq!(*picture.get_pixel(157, 117), GRAY);
    }
    // the ring is around the wrong answer only: what differs is more than the colour
    let marks = |p: &RgbImage, colour| pixels(p, colour, 0..240);
    assert!(marks(&wrong, WRONG) > marks(&right, RIGHT) + 20);
    assert_eq!(*wrong.get_pixel(160 - 7, 131), WRONG);
    assert_eq!(*right.get_pixel(160 - 7, 130), GRAY);
}

#[test]
fn the_tolerance_decides() {
    let image = gray(64, 48);
    let style = |tolerance| Style { tolerance, ..Style::default() };
    let columns = [column(32, 20, 23.25)];
    assert_eq!(pixels(&draw(&image, &columns, &style(3.25)), WRONG, 0..48), 0);
    assert_eq!(pixels(&draw(&image, &columns, &style(3.0)), RIGHT, 0..48), 0);
}

#[test]
fn the_square_is_the_window() {
    let rect = Rect::new(8, 3);
    let style = Style { window: rect, scale: 3, ..Style::default() };
    let picture = draw(&gray(160, 120), &[column(80, 20, 28.0)], &style);
    // columns 80 - 3 to 80 + 4, rows 27 to 29, times three
    for (x, y) in [(77 * 3, 27 * 3), (85 * 3 - 1, 27 * 3), (77 * 3, 30 * 3 - 1), (85 * 3 - 1, 30 * 3 - 1)] {
        assert_eq!(*picture.get_pixel(x, y), RIGHT, "{x}, {y}");
    }
    assert_ne!(*picture.get_pixel(77 * 3 - 1, 27 * 3), RIGHT);
    assert_ne!(*picture.get_pixel(85 * 3, 29 * 3), RIGHT);
    // at a corner of the image, the window is moved into it
    let picture = draw(&gray(160, 120), &[column(159, 119, 119.0)], &style);
    assert_eq!(*picture.get_pixel(152 * 3, 117 * 3), RIGHT);
}

#[test]
fn answers_outside_the_image_point_to_its_border() {
    for answer in [-0.5, -1e30, f32::NEG_INFINITY] {
        let picture = one(answer);
        assert_eq!(*picture.get_pixel(160, 230), WHITE, "{answer}");
        assert_eq!(*picture.get_pixel(160, 40), WHITE, "{answer}");
        assert_eq!(*picture.get_pixel(160, 2), WRONG, "{answer}");
        assert_eq!(pixels(&picture, WRONG, 200..240), 0, "{answer}");
    }
    for answer in [239.5, 1e30, f32::INFINITY] {
        let picture = one(answer);
        assert_eq!(*picture.get_pixel(160, 10), BLACK, "{answer}");
        assert_eq!(*picture.get_pixel(160, 200), BLACK, "{answer}");
        assert_eq!(*picture.get_pixel(160, 237), WRONG, "{answer}");
        assert_eq!(pixels(&picture, WRONG, 0..40), 0, "{answer}");
    }
    // outside and still within the tolerance
    let picture = draw(&gray(320, 240), &[column(160, 2, -3.0)], &Style::default());
    assert!(pixels(&picture, RIGHT, 0..240) > 0 && pixels(&picture, WRONG, 0..240) == 0);
}

#[test]
fn an_answer_that_is_no_number_claims_no_row() {
    for nan in [f32::NAN, -f32::NAN] {
        let picture = draw(&gray(320, 240), &[column(160, 60, nan)], &Style::default());
        // dashes of four pixels, in both halves
        for y in [0, 40, 200, 232] {
            assert_eq!(*picture.get_pixel(160, y), BLACK, "row {y}");
            assert_eq!(*picture.get_pixel(160, y + 4), WHITE, "row {}", y + 4);
        }
        assert!(pixels(&picture, WRONG, 110..130) > 20, "a question mark in its ring");
    }
}

#[test]
fn marks_at_the_borders_are_cut() {
    let answers = [0.0, 7.5, 15.0, -4.0, 99.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    for (width, height) in [(16, 16), (17, 400), (400, 17), (1, 1), (0, 0)] {
        for scale in [0, 1, 2, 3, MAX_SCALE, u32::MAX] {
            for window in [None, Rect::new(8, 8), Rect::new(2, 2)] {
                let style = Style { window, scale, ..Style::default() };
                let xs = [0, 1, 8, 15, width, u32::MAX];
                let columns: Vec<Column> =
                    xs.iter().flat_map(|&x| answers.map(|a| column(x, x.min(20), a))).collect();
                let picture = draw(&gray(width, height), &columns, &style);
                let scale = scale.clamp(1, MAX_SCALE);
                assert_eq!(picture.dimensions(), (width * scale, height * scale));
            }
        }
    }
}

#[test]
fn dense_columns_leave_the_image_visible() {
    let columns: Vec<Column> = (0..80).map(|i| column(4 * i, 120, 120.0)).collect();
    let picture = draw(&gray(320, 240), &columns, &Style::default());
    // away from the answers
    assert!(pixels(&picture, GRAY, 0..100) >= 16_000, "half of the image");
    assert_eq!(*picture.get_pixel(40, 50), BLACK);
    assert_eq!(*picture.get_pixel(42, 50), GRAY);
    assert_eq!(*picture.get_pixel(40, 190), WHITE);
    // every column asked for: nothing is left to see, but nothing breaks either
    let columns: Vec<Column> = (0..320).map(|x| column(x, 120, 120.0)).collect();
    assert_eq!(*draw(&gray(320, 240), &columns, &Style::default()).get_pixel(41, 50), BLACK);
}

#[test]
fn pictures_without_columns_are_the_image() {
    let image = GrayImage::from_fn(20, 16, |x, y| Luma([(16 * y + x) as u8]));
    let picture = draw(&image, &[], &Style { scale: 2, ..Style::default() });
    for (x, y, pixel) in picture.enumerate_pixels() {
        assert_eq!(pixel.0, [image.get_pixel(x / 2, y / 2).0[0]; 3]);
    }
}

fn tile(width: u32, height: u32, name: &str) -> Tile {
    Tile::new(&RgbImage::from_pixel(width, height, Rgb([1, 2, 3])), name, 5, 6)
}

#[test]
fn sheets_have_rows_of_columns() {
    let tiles: Vec<Tile> = (0..7).map(|i| tile(320, 240, &format!("{i}.png"))).collect();
    let size = |columns, heading| contact_sheet(&tiles, columns, heading).dimensions();
    let (one, two, three) = (size(1, ""), size(2, ""), size(3, ""));
    let (step, margin) = (two.0 - one.0, 2 * one.0 - two.0);
    assert!(step > 320 && margin < 40);
    assert_eq!(three.0, one.0 + 2 * step);
    // 7, 4 and 3 rows
    let row = two.1 - three.1;
    assert!(row > 240 && row < 300);
    assert_eq!(one.1, two.1 + 3 * row);
    // no more columns than tiles, at least one
    assert_eq!(size(99, ""), size(7, ""));
    assert_eq!(size(0, ""), one);
    // a heading makes it higher, not wider
    let headed = size(2, LEGEND);
    assert!(headed.0 == two.0 && headed.1 > two.1);
}

#[test]
fn tiles_are_reduced_and_keep_their_proportions() {
    let filled = |tile: &Tile| {
        let sheet = contact_sheet(std::slice::from_ref(tile), 1, "");
        let of = |p: &(u32, u32, &Rgb<u8>)| *p.2 == Rgb([1, 2, 3]);
        let found: Vec<(u32, u32)> = sheet.enumerate_pixels().filter(of).map(|(x, y, _)| (x, y)).collect();
        let (xs, ys) = (found.iter().map(|p| p.0), found.iter().map(|p| p.1));
        let side = |min: Option<u32>, max: Option<u32>| max.unwrap() - min.unwrap() + 1;
        let size = (side(xs.clone().min(), xs.max()), side(ys.clone().min(), ys.max()));
        assert_eq!(found.len() as u32, size.0 * size.1);
        size
    };
    assert_eq!(filled(&tile(640, 480, "a")), (320, 240));
    assert_eq!(filled(&tile(320, 240, "a")), (320, 240));
    assert_eq!(filled(&tile(16, 16, "a")), (16, 16));
    assert_eq!(filled(&tile(100, 2000, "a")), (16, 320));
    assert_eq!(filled(&tile(3000, 2, "a")), (320, 1));
}

/// Of images that no format makes small, in their colours.
#[test]
fn a_sheet_s_file_is_as_small_as_it_is_to_be() {
    let mut state = 1u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let mut tile = |i: usize| {
        let image = GrayImage::from_fn(320, 240, |_, y| Luma([(y / 2) as u8 + noise() / 4]));
        let columns = [column(100, 120, 120.0), column(200, 120, 10.0)];
        Tile::new(&draw(&image, &columns, &Style::default()), format!("frame_{i}.png"), 1, 2)
    };
    let tiles: Vec<Tile> = (0..30).map(&mut tile).collect();
    let of = |most: usize| {
        let file = contact_sheet_png(&tiles, 6, LEGEND, &[], most).expect("encoded");
        let picture = image::load_from_memory(&file).expect("a picture").into_rgb8();
        (file.len(), picture)
    };
    let (whole, large) = of(usize::MAX);
    assert_eq!(large.dimensions(), contact_sheet(&tiles, 6, LEGEND).dimensions());
    let (bytes, small) = of(500_000);
    assert!(whole > 600_000 && bytes <= 500_000 && bytes > 300_000, "{whole} {bytes}");
    assert!(small.width() < large.width() && small.width() > large.width() / 3, "{:?}", small.dimensions());
    // Marks keep their colours.
    let orange = |picture: &RgbImage| picture.pixels().filter(|p| **p == WRONG).count();
    assert!(orange(&large) > 1000 && orange(&small) > 100, "{} {}", orange(&large), orange(&small));
    // What cannot be so small is as small as it gets.
    assert!(of(1).0 < bytes);
}

#[test]
fn captions_stay_in_their_place() {
    let long = "a very long name, ".repeat(500) + "語.png";
    for (width, columns) in [(320, 2), (16, 3), (1, 1)] {
        let short: Vec<Tile> = (0..4).map(|_| tile(width, 16, "")).collect();
        let named: Vec<Tile> = (0..4).map(|_| tile(width, 16, &long)).collect();
        let (short, named) = (contact_sheet(&short, columns, ""), contact_sheet(&named, columns, ""));
        assert_eq!(short.dimensions(), named.dimensions());
        assert!(pixels(&named, WHITE, 0..named.height()) > 0);
        // the name leaves the score alone
        assert_eq!(
            pixels(&short, WRONG, 0..short.height()),
            pixels(&named, WRONG, 0..named.height()),
            "{width}"
        );
        // and does not reach into the margin at the right
        let edge = named.width() - 10;
        assert!(named.enumerate_pixels().all(|(x, _, p)| x < edge || *p != WHITE));
    }
    // scores of any length
    let huge = Tile::new(&RgbImage::new(16, 16), "x", usize::MAX, usize::MAX);
    assert_eq!(
        contact_sheet(&[huge], 1, "").dimensions(),
        contact_sheet(&[tile(16, 16, "")], 1, "").dimensions()
    );
}

#[test]
fn a_sheet_without_tiles_is_its_heading() {
    let sheet = contact_sheet(&[], 4, "nothing to see");
    assert!(pixels(&sheet, WHITE, 0..sheet.height()) > 0);
    let (bare, headed) = (contact_sheet(&[], 4, ""), sheet);
    assert!(bare.height() < headed.height());
}
