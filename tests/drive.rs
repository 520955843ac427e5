//! The robot in the loop: what it does in the office, and what is written of it.

use std::sync::atomic::AtomicBool;

use image::GrayImage;
use rayon::prelude::*;
use vsonar::dataset::spread;
use vsonar::detector::{DetectError, Detector};
use vsonar::drive::map;
use vsonar::drive::run::{End, Run, Settings, drive};
use vsonar::drive::sonar::Sonar;
use vsonar::drive::source::{Camera, RangeSource};
use vsonar::drive::summary::Summary;
use vsonar::drive::video::Video;
use vsonar::frames::{Frame, FrameSource, y4m};
use vsonar::world::office::{Kind, Office};

/// Sees an obstacle where the picture is lighter than the floor, roughly.
struct Light;

impl Detector for Light {
    fn width(&self) -> u32 {
        320
    }

    fn height(&self) -> u32 {
        240
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        for (row, &x) in rows.iter_mut().zip(columns) {
            let light = |&y: &u32| image.get_pixel(x, y).0[0] > 150;
            *row = (0..240).rev().find(light).unwrap_or(0) as f32;
        }
        Ok(())
    }
}

fn run(office: &Office, source: &mut dyn RangeSource, number: u64, minutes: f64) -> Run {
    let settings = Settings { seconds: 60.0 * minutes, ..Settings::default() };
    let run = drive(office, source, &settings, number, &AtomicBool::new(false), |_| Ok(()));
    run.expect("the pictures fit").expect("nobody stops it")
}

#[test]
fn an_ideal_sonar_wanders_for_hundreds_of_metres() {
    let office = Office::new(Kind::Fmrb, 1);
    let runs: Vec<Run> = (0..4).map(|number| run(&office, &mut Sonar::new(1), number, 20.0)).collect();
    let sum = Summary::of(&runs).expect("there are runs");
    assert!(sum.collisions <= 1 && sum.stuck == 0, "{sum:?}");
    assert!(sum.metres.mean > 200.0 && sum.speed > 0.2, "{sum:?}");
    assert!(sum.accuracy.is_none());
}

#[test]
fn the_building_is_seen_and_not_one_corner_of_it() {
    for seed in 1..=4 {
        let office = Office::new(Kind::Fmrb, seed);
        let run = run(&office, &mut Sonar::new(1), 0, 20.0);
        assert!(run.squares > 30 && run.metres > 200.0, "{seed}: {} {}", run.squares, run.metres);
    }
}

#[test]
fn true_rows_do_as_well_and_are_right() {
    let office = Office::new(Kind::Fmrb, 2);
    let runs: Vec<Run> = (0..3)
        .map(|number| run(&office, &mut Camera::with_truth(&office, spread(12, 320)), number, 10.0))
        .collect();
    let sum = Summary::of(&runs).expect("there are runs");
    assert!(sum.collisions <= 1 && sum.metres.mean > 100.0, "{sum:?}");
    let accuracy = sum.accuracy.expect("it has rows");
    assert_eq!((accuracy.correct, accuracy.lasting.errors), (accuracy.answers, 0));
    assert!(accuracy.answers >= 12 * 600 * 10);
}

#[test]
fn a_run_is_the_same_on_any_number_of_threads() {
    let on = |threads: usize| -> Vec<Run> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        // The office is built by these threads too, and the runs are under way at once.
        pool.install(|| {
            let office = Office::new(Kind::Fmrb, 1);
            let one = |number: u64| {
                let mut camera = Camera::with(Box::new(Light), &office, spread(12, 320), true);
                run(&office, &mut camera, number, 0.2)
            };
            (1..=4).into_par_iter().map(one).collect()
        })
    };
    let once = on(1);
    assert_eq!(once, on(4));
    assert_ne!(once[0].path, once[1].path, "runs start elsewhere");
    assert!(once[0].accuracy.is_some_and(|a| a.answers > 0));
}

#[test]
fn a_map_is_well_formed() {
    let office = Office::new(Kind::Fmrb, 1);
    let run = run(&office, &mut Sonar::new(1), 1, 0.5);
    let text = map::svg(&office, &run, 0.24, "fmrb: <run & 1>", "<a & \u{1b}b>");
    let mut open: Vec<&str> = Vec::new();
    for tag in text.split('<').skip(1) {
        let (tag, rest) = tag.split_once('>').expect("tags end");
        assert!(!rest.contains('>') && tag.matches('"').count() % 2 == 0, "{tag}");
        let name = tag.split([' ', '/']).find(|name| !name.is_empty()).expect("a name");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty() && !text.contains("NaN") && !text.contains("inf"), "{text}");
    assert!(text.contains(r"&lt;a &amp; \u{1b}b&gt;") && text.contains(">2 m<"), "{text}");
    let lines = text.matches("<line ").count();
    assert_eq!(lines, office.walls().len());
    let path = text.split("<polyline class=\"way\" points=\"").nth(1).and_then(|rest| rest.split('"').next());
    assert_eq!(path.map(|points| points.split(' ').count()), Some(run.path.len()));
    assert_eq!(run.end, End::Limit);
}

#[test]
fn a_video_can_be_read_again() {
    let office = Office::new(Kind::Fmrb, 1);
    let mut video = Video::new(Vec::new(), office.size()).expect("room");
    let mut camera = Camera::with_truth(&office, spread(6, 320));
    let settings = Settings { seconds: 0.5, pictures: true, ..Settings::default() };
    let stop = AtomicBool::new(false);
    let run = drive(&office, &mut camera, &settings, 1, &stop, |frame| video.frame(frame));
    assert!(run.expect("room").is_some());
    let bytes = video.into_inner();
    let mut reader = y4m::Reader::new(&bytes[..], "video").expect("a stream");
    assert_eq!((reader.header().width, reader.header().height), office.size());
    let (mut frame, mut count) = (Frame::default(), 0);
    while reader.read(&mut frame).expect("whole frames") {
        let gray = frame.pixels.get_pixel(0, 200).0[0];
        assert!((1..255).contains(&gray), "the picture, beside the bars");
        assert_eq!(frame.pixels.get_pixel(26, 239).0[0], 255, "the bar in the first column");
        count += 1;
    }
    assert_eq!(count, 5);
}
