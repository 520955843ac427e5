//! A program's answers looked at one by one: by column, image and distance, the errors, and some pictures.

use std::io::Cursor;

use base64::Engine as _;
use image::imageops::thumbnail;
use image::{ImageFormat, RgbImage};

use super::compare::BRIEFS;
use super::model::{Answers, Group, Histogram, Measure, Part, Picture, Tally};
use crate::camera::Camera;
use crate::camera::ground::{Ground, Status};
use crate::dataset::{Case, Constants, Dataset, Transience};
use crate::evolve::is_correct;
use crate::ir::Rect;
use crate::report::{Column, Style, draw};

/// The worst images that are shown.
const WORST: usize = 10;
/// The best images that are shown.
const BEST: usize = 4;
/// Bytes of the pictures of a report on one run as PNG files, at most; in base 64 they are a third more.
const PICTURE_BYTES: usize = 5 << 19;
/// Stretches of rows, where distances are not known.
const STRETCHES: u32 = 8;
/// Edges of the stretches of distance in metres.
const EDGES: [f32; 8] = [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0];
/// Bins of the histogram to either side of the one around 0.
const BINS: i64 = 12;

/// What the pictures of a run may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureRoom {
    /// Bytes of all of them, as PNG files.
    pub bytes: usize,
    /// The longest side of one, in pixels.
    pub side: u32,
    /// The images that stand for all.
    pub views: Views,
}

/// Which images stand for all of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Views {
    /// The one whose share of correct answers is nearest to that of all.
    Typical,
    /// So many, evenly chosen whatever the answers: the same for every program.
    Even(usize),
}

impl Views {
    /// Their places in a list of images in the order of the set; `all` is the share of correct answers of all of them.
    fn choose(self, images: &[&(usize, Group)], all: f64) -> Vec<usize> {
        match self {
            Views::Typical => {
                let off = |i: usize| (images[i].1.tally.fitness() - all).abs();
                let from_middle = |i: usize| i.abs_diff(images.len() / 2);
                let order = |a: &usize, b: &usize| {
                    off(*a).total_cmp(&off(*b)).then(from_middle(*a).cmp(&from_middle(*b)))
                };
                (0..images.len()).min_by(order).into_iter().collect()
            }
            Views::Even(most) => {
                let count = most.min(images.len());
                // The first and the last image are often the oddest.
                (0..count).map(|i| (2 * i + 1) * images.len() / (2 * count)).collect()
            }
        }
    }
}

impl PictureRoom {
    /// In a report on so many runs, so that it stays below 5 MB.
    pub fn of(runs: usize) -> PictureRoom {
        match runs {
            0 | 1 => PictureRoom { bytes: PICTURE_BYTES, side: 480, views: Views::Typical },
            // Each has curves of its own as well.
            2..=4 => PictureRoom { bytes: 4 * PICTURE_BYTES / 5 / runs, side: 320, views: Views::Even(3) },
            5..=10 => PictureRoom { bytes: 4 * PICTURE_BYTES / 5 / runs, side: 240, views: Views::Even(1) },
            11..=BRIEFS => {
                PictureRoom { bytes: 4 * PICTURE_BYTES / 5 / runs, side: 160, views: Views::Even(1) }
            }
            _ => PictureRoom { bytes: 0, side: 160, views: Views::Even(0) },
        }
    }
}

/// What answers are looked at with.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// The part of the data.
    pub part: Part,
    /// Rows within which an answer is correct.
    pub tolerance: f64,
    /// The camera, where it is known.
    pub camera: Option<&'a Camera>,
    /// The best constants of the training cases.
    pub constants: &'a Constants,
    /// The window of the program's second tree, to be drawn.
    pub window: Option<Rect>,
    /// What pictures may take.
    pub pictures: PictureRoom,
}

impl Tally {
    /// Counts a case.
    fn add(&mut self, answer: f32, label: u32, tolerance: f64) {
        let label = f64::from(label);
        self.cases += 1;
        let kind = match answer {
            row if is_correct(row, label, tolerance) => &mut self.correct,
            row if !row.is_finite() => &mut self.not_finite,
            row if f64::from(row) > label => &mut self.too_near,
            _ => &mut self.too_far,
        };
        *kind += 1;
    }
}

impl Answers {
    /// Looks at `answers`, one for each case of the set in its order.
    ///
    /// # Panics
    /// If there are not as many answers as cases.
    pub fn of(set: &Dataset, answers: &[f32], look: &Look) -> Answers {
        assert_eq!(answers.len(), set.cases().len(), "an answer for each case");
        let group = |name: String, keep: &dyn Fn(&Case) -> bool| {
            let mut tally = Tally::default();
            let mut solved = 0;
            for (case, &answer) in set.cases().iter().zip(answers).filter(|(case, _)| keep(case)) {
                tally.add(answer, case.y, look.tolerance);
                solved += usize::from(look.constants.is_correct(case));
            }
            let constant = (tally.cases > 0).then(|| solved as f64 / tally.cases as f64);
            Group { name, tally, constant }
        };
        let columns = set.columns().into_iter().map(|x| group(x.to_string(), &|case| case.x == x));
        let mut images: Vec<(usize, Group)> = (set.images().iter().enumerate())
            .map(|(i, image)| (i, group(image.name.clone(), &|case| case.image == i)))
            .filter(|(_, group)| group.tally.cases > 0)
            .collect();
        images.sort_by(|(_, a), (_, b)| a.tally.fitness().total_cmp(&b.tally.fitness()));
        let all = group(String::new(), &|_| true).tally;
        let mut in_order: Vec<&(usize, Group)> = images.iter().collect();
        in_order.sort_by_key(|(number, _)| *number);
        let chosen = look.pictures.views.choose(&in_order, all.fitness());
        let seen: Vec<&(usize, Group)> = chosen.into_iter().map(|i| in_order[i]).collect();
        let mut left = look.pictures.bytes;
        let views = pictures(set, answers, &seen, look, &mut left);
        let extremes = extremes(&images);
        let pictures = pictures(set, answers, &extremes, look, &mut left);
        let ground = look.camera.map(|camera| Ground::new(camera, set.width(), set.height()));
        let distances = match &ground {
            Some(ground) => by_metres(ground, &group),
            None => by_rows(set.height(), &group),
        };
        Answers {
            part: look.part,
            all,
            columns: columns.collect(),
            distances: distances.into_iter().filter(|group| group.tally.cases > 0).collect(),
            measure: if ground.is_some() { Measure::Metres } else { Measure::Rows },
            errors: Histogram::of(set, answers, look.tolerance),
            transience: Transience::of(set, answers, look.tolerance),
            views,
            pictures,
            images: images.into_iter().map(|(_, group)| group).collect(),
        }
    }
}

type Grouping<'a> = dyn Fn(String, &dyn Fn(&Case) -> bool) -> Group + 'a;

fn by_metres(ground: &Ground, group: &Grouping) -> Vec<Group> {
    let distance = |case: &Case| {
        let range = ground.locate(case.x, case.y as f32);
        if range.status == Status::Obstacle { range.distance } else { f32::INFINITY }
    };
    let stretch = |i: usize| {
        let (near, far) = (EDGES[i], EDGES.get(i + 1).copied().unwrap_or(f32::INFINITY));
        let name = if far.is_finite() { format!("{near} to {far} m") } else { format!("{near} m and more") };
        group(name, &|case| {
            let distance = distance(case);
            near <= distance && distance < far
        })
    };
    let mut groups: Vec<Group> = (0..EDGES.len()).map(stretch).collect();
    groups.push(group("none in view".to_string(), &|case| distance(case).is_infinite()));
    groups
}

fn by_rows(height: u32, group: &Grouping) -> Vec<Group> {
    let edge = |i: u32| (u64::from(height) * u64::from(i) / u64::from(STRETCHES)) as u32;
    let stretch = |i: u32| {
        let (low, high) = (edge(i), edge(i + 1));
        group(format!("{low} to {} rows", high.saturating_sub(1)), &|case| {
            (low..high).contains(&(height - 1).saturating_sub(case.y))
        })
    };
    (0..STRETCHES).map(stretch).collect()
}

impl Histogram {
    /// Of the finite answers, in bins as wide as the answers that count as correct around the middle one.
    fn of(set: &Dataset, answers: &[f32], tolerance: f64) -> Histogram {
        // No finite answer is farther off, so that a greater tolerance makes no other bins.
        let tolerance = tolerance.min(2.0 * f64::from(f32::MAX));
        let width = (2.0 * tolerance).max(1.0);
        let mut errors: Vec<f64> = (set.cases().iter().zip(answers))
            .filter(|(_, answer)| answer.is_finite())
            .map(|(case, &answer)| f64::from(answer) - f64::from(case.y))
            .collect();
        let mut counts = vec![0usize; (2 * BINS + 1) as usize];
        for error in &errors {
            // By the rule of a correct answer, so that the middle bin holds just those.
            let beyond = ((error.abs() - tolerance).max(0.0) / width).ceil().min(BINS as f64) as i64;
            let bin = if *error < 0.0 { -beyond } else { beyond };
            counts[(bin + BINS) as usize] += 1;
        }
        let middle = |numbers: &mut Vec<f64>| {
            numbers.sort_unstable_by(f64::total_cmp);
            (!numbers.is_empty()).then(|| crate::statistics::quantile(numbers, 0.5))
        };
        let median = middle(&mut errors);
        let mut magnitudes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
        let median_magnitude = middle(&mut magnitudes);
        let bins = (-BINS..=BINS).map(|bin| bin as f64 * width).zip(counts).collect();
        Histogram { width, bins, median, median_magnitude }
    }
}

/// The worst images and a few of the best; `images` begin with the worst.
fn extremes(images: &[(usize, Group)]) -> Vec<&(usize, Group)> {
    let wrong = images.iter().filter(|(_, group)| group.tally.correct < group.tally.cases);
    let worst: Vec<_> = wrong.take(WORST).collect();
    let best = BEST.min(images.len() - worst.len());
    worst.into_iter().chain(images.iter().rev().take(best)).collect()
}

/// Pictures of these images, as far as there is room: so many bytes are left.
fn pictures(
    set: &Dataset,
    answers: &[f32],
    images: &[&(usize, Group)],
    look: &Look,
    left: &mut usize,
) -> Vec<Picture> {
    let mut pictures = Vec::new();
    for (number, group) in images {
        let columns: Vec<Column> = (set.cases().iter().zip(answers))
            .filter(|(case, _)| case.image == *number)
            .map(|(case, &answer)| Column { x: case.x, label: case.y, answer })
            .collect();
        let picture = picture(&set.images()[*number].pixels, &columns, look);
        let mut png = Cursor::new(Vec::new());
        // Writing to memory does not fail; a picture that could not be written would be no picture.
        if picture.write_to(&mut png, ImageFormat::Png).is_err() {
            continue;
        }
        let png = png.into_inner();
        let Some(rest) = left.checked_sub(png.len()) else { break };
        *left = rest;
        pictures.push(Picture {
            name: group.name.clone(),
            tally: group.tally,
            size: picture.dimensions(),
            png: base64::engine::general_purpose::STANDARD.encode(png),
        });
    }
    pictures
}

/// The image with the answers in it, no side longer than there is room for: marks are as wide as the picture is large, so that
/// they stay visible in a reduced one.
fn picture(pixels: &image::GrayImage, columns: &[Column], look: &Look) -> RgbImage {
    let longest = pixels.width().max(pixels.height()).max(1);
    let style = Style { tolerance: look.tolerance, window: look.window, scale: (320 / longest).max(1) };
    let picture = draw(pixels, columns, &style);
    let reduced = |side: u32| {
        let side = u64::from(side) * u64::from(look.pictures.side) / u64::from(longest);
        // at most what there is room for, since no side is longer than the longest
        (side as u32).max(1)
    };
    match longest > look.pictures.side {
        true => thumbnail(&picture, reduced(picture.width()), reduced(picture.height())),
        false => picture,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::NamedImage;

    fn set(width: u32, height: u32, labels: &[u32]) -> Dataset {
        let pixels = || image::GrayImage::from_fn(width, height, |x, y| image::Luma([(x * y % 251) as u8]));
        let images = (0..labels.len()).map(|i| NamedImage { name: format!("a_{i}.png"), pixels: pixels() });
        let cases = labels.iter().enumerate().map(|(image, &y)| Case { image, x: 8, y }).collect();
        Dataset::new("set", images.collect(), cases).expect("sound")
    }

    fn looked(set: &Dataset, answers: &[f32], camera: Option<&Camera>) -> Answers {
        looked_with(set, answers, camera, PictureRoom::of(1))
    }

    fn looked_with(
        set: &Dataset,
        answers: &[f32],
        camera: Option<&Camera>,
        pictures: PictureRoom,
    ) -> Answers {
        let constants = Constants::learn(set, 10.0);
        let look = Look {
            part: Part::Training,
            tolerance: 10.0,
            camera,
            constants: &constants,
            window: None,
            pictures,
        };
        Answers::of(set, answers, &look)
    }

    #[test]
    fn cases_are_counted_once_in_every_grouping() {
        let set = set(32, 240, &[0, 30, 120, 239]);
        let camera = Camera { height: 0.8, pitch: 30.0, field_of_view: 60.0, distortion: 0.0 };
        for camera in [None, Some(&camera)] {
            let found = looked(&set, &[0.0, 90.0, f32::NAN, 200.0], camera);
            let all = Tally { cases: 4, correct: 1, too_near: 1, too_far: 1, not_finite: 1 };
            assert_eq!(found.all, all);
            for groups in [&found.columns, &found.images, &found.distances] {
                assert_eq!(groups.iter().map(|g| g.tally.cases).sum::<usize>(), 4);
                assert_eq!(groups.iter().map(|g| g.tally.correct).sum::<usize>(), 1);
            }
            assert_eq!(found.images[3].name, "a_0.png", "the best is last");
            assert_eq!(found.errors.bins.iter().map(|bin| bin.1).sum::<usize>(), 3, "finite ones");
            assert_eq!((found.errors.median, found.errors.median_magnitude), (Some(0.0), Some(39.0)));
            assert_eq!(found.pictures.len(), 4);
            let names = |found: &Answers| found.views.iter().map(|p| p.name.clone()).collect::<Vec<_>>();
            assert_eq!(
                names(&found),
                ["a_2.png"],
                "0 is nearer to a quarter than 1, and it is in the middle"
            );
            let views = |views| PictureRoom { views, ..PictureRoom::of(1) };
            let even = looked_with(&set, &[0.0, 90.0, f32::NAN, 200.0], camera, views(Views::Even(3)));
            assert_eq!(names(&even), ["a_0.png", "a_2.png", "a_3.png"], "whatever the answers");
        }
        let edges = looked(&set, &[10.0, 20.0, 130.5, 208.9], None).errors;
        let there: Vec<_> = edges.bins.iter().filter(|bin| bin.1 > 0).copied().collect();
        assert_eq!(there, [(-40.0, 1), (0.0, 2), (20.0, 1)], "the middle bin holds what is correct");
        let metres = looked(&set, &[0.0; 4], Some(&camera));
        assert_eq!(metres.measure, Measure::Metres);
        assert_eq!(metres.distances.last().map(|g| g.name.as_str()), Some("none in view"));
    }

    #[test]
    fn pictures_of_large_images_are_reduced_and_keep_to_their_budget() {
        let set = set(1920, 1080, &[500, 500, 500]);
        let mut found = looked(&set, &[500.0, 511.0, 900.0], None);
        let sizes: Vec<_> = found.pictures.iter().map(|picture| picture.size).collect();
        assert_eq!(sizes, [(480, 270); 3]);
        let bytes: usize = found.pictures.iter().map(|picture| picture.png.len()).sum();
        assert!(bytes > 0 && bytes < 4 << 20, "{bytes}");
        let constants = Constants::learn(&set, 10.0);
        let look = Look {
            part: Part::Holdout,
            tolerance: 10.0,
            camera: None,
            constants: &constants,
            window: None,
            pictures: PictureRoom {
                bytes: found.pictures.remove(0).png.len(),
                views: Views::Even(0),
                ..PictureRoom::of(1)
            },
        };
        assert_eq!(Answers::of(&set, &[500.0, 511.0, 900.0], &look).pictures.len(), 1);
    }
}
