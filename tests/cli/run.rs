//! `vsonar run`: frames in, answers out.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Output, Stdio};

use image::{GrayImage, Luma};
use serde_json::Value;
use vsonar::camera::Camera;
use vsonar::camera::ground::{Ground, Status};
use vsonar::detector::{CompiledDetector, Detector};
use vsonar::frames::y4m::{Chroma, Header, Reader, Writer};
use vsonar::frames::{Frame, FrameSource, Rate};
use vsonar::tree::Individual;

use crate::common::*;

/// Fractional answers, and none that is a number left of column 20.
const PROGRAM: &str = "(individual (iterate-up 3x3 x-obstacle (if-le gradient 30 read-a
    (prog2 (set-a (if-le x-obstacle 20 (* 1e30 1e30) (* y 1.1))) break))))";

fn place() -> Place {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    place
}

/// Frames that differ, of any size.
fn frames(count: u32, width: u32, height: u32) -> Vec<GrayImage> {
    let frame = |i: u32| {
        GrayImage::from_fn(width, height, |x, y| {
            let foot = 4 + (5 * i + x / 3) % (height - 8);
            Luma([if y > foot { 60 + ((x * 7 + y * 3 + i) % 9) as u8 } else { 190 - (x % 5) as u8 }])
        })
    };
    (0..count).map(frame).collect()
}

fn raw(frames: &[GrayImage]) -> Vec<u8> {
    frames.iter().flat_map(|frame| frame.as_raw().iter().copied()).collect()
}

fn y4m(chroma: Chroma, frames: &[GrayImage]) -> Vec<u8> {
    let (width, height) = frames[0].dimensions();
    let header = Header { width, height, rate: Rate::new(10, 1), chroma, limited: None };
    let mut writer = Writer::new(Vec::new(), header).expect("room");
    frames.iter().for_each(|frame| writer.write_gray(frame).expect("room"));
    writer.into_inner()
}

/// Runs the command with these bytes on its standard input.
fn fed(place: &Place, bytes: &[u8], arguments: &[&str]) -> Output {
    let mut command = place.command(&[&["run"], arguments].concat());
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("started");
    let mut input = child.stdin.take().expect("piped");
    std::thread::scope(|scope| {
        // A command that ends early does not read everything.
        scope.spawn(move || drop(input.write_all(bytes)));
        child.wait_with_output().expect("it ends")
    })
}

/// The lines of a run that says nothing else.
fn lines(place: &Place, bytes: &[u8], arguments: &[&str]) -> Vec<Value> {
    let output = fed(place, bytes, &[arguments, &["--quiet"]].concat());
    let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && complaint.is_empty(), "{arguments:?}: {complaint}");
    parsed(&output.stdout)
}

fn parsed(stdout: &[u8]) -> Vec<Value> {
    let text = std::str::from_utf8(stdout).expect("UTF-8");
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

/// A list of numbers by their bits; null is no number.
fn bits(list: &Value) -> Vec<Option<u32>> {
    let number = |value: &Value| value.as_f64().map(|v| (v as f32).to_bits());
    list.as_array().expect("a list").iter().map(number).collect()
}

/// The same for numbers of the library.
fn bits_of(numbers: impl IntoIterator<Item = f32>) -> Vec<Option<u32>> {
    numbers.into_iter().map(|v| v.is_finite().then_some(v.to_bits())).collect()
}

fn answers(frames: &[GrayImage], columns: &[u32]) -> Vec<Vec<f32>> {
    let individual: Individual = PROGRAM.parse().expect("sound");
    let (width, height) = frames[0].dimensions();
    let detector = CompiledDetector::compile_individual(&individual, width, height).expect("compiled");
    let answer = |frame: &GrayImage| {
        let mut rows = vec![0.0; columns.len()];
        detector.detect(frame, columns, &mut rows).expect("of its size");
        rows
    };
    frames.iter().map(answer).collect()
}

#[test]
fn every_form_of_input_gives_the_answers_of_the_library() {
    let place = place();
    for (width, height) in [(64, 48), (65, 49), (17, 16)] {
        let frames = frames(4, width, height);
        let columns: Vec<u32> = (0..12).map(|i| (2 * i + 1) * width / 24).collect();
        let expected = answers(&frames, &columns);
        let fractional = |row: &f32| row.fract() != 0.0 && row.is_finite();
        assert!(width <= 20 || expected.iter().flatten().any(fractional));
        assert!(expected.iter().flatten().any(|row| row.is_infinite()));
        let check = |what: &str, lines: &[Value], time: Option<f64>| {
            assert_eq!(lines.len(), frames.len(), "{what}");
            for (i, (line, expected)) in lines.iter().zip(&expected).enumerate() {
                assert_eq!(line["frame"], i, "{what}");
                assert_eq!(line["columns"], serde_json::json!(columns), "{what}");
                assert_eq!(bits(&line["rows"]), bits_of(expected.iter().copied()), "{what}, frame {i}");
                assert!(line["latency_us"].is_u64(), "{what}");
                match time {
                    Some(rate) => assert_eq!(line["time"], i as f64 / rate, "{what}"),
                    None => assert!(line["time"].is_null(), "{what}"),
                }
            }
        };
        let size = format!("{width}x{height}");
        for chroma in Chroma::ALL {
            let stream = y4m(chroma, &frames);
            check(&format!("{chroma:?} {size}"), &lines(&place, &stream, &["p.gp"]), Some(10.0));
            place.write("film", &stream);
            let read = lines(&place, &[], &["p.gp", "--input", "film", "--size", &size, "--fps", "4"]);
            check("a file", &read, Some(4.0));
        }
        for format in ["auto", "raw"] {
            let flags = ["p.gp", "--format", format, "--size", &size, "--fps", "2"];
            check(format, &lines(&place, &raw(&frames), &flags), Some(2.0));
        }
        let by_the_clock = lines(&place, &raw(&frames), &["p.gp", "--size", &size]);
        let times: Vec<f64> =
            by_the_clock.iter().map(|line| line["time"].as_f64().expect("a time")).collect();
        assert!(times[0] == 0.0 && times.is_sorted() && times[3] > 0.0, "{times:?}");
        let folder = format!("folder-{size}");
        std::fs::create_dir(place.path(&folder)).expect("writable");
        for (i, frame) in frames.iter().enumerate() {
            frame.save(place.path(&folder).join(format!("f{}.png", i + 8))).expect("writable");
        }
        let read = lines(&place, &[], &["p.gp", "--input", &folder]);
        check("a folder", &read, None);
        let names: Vec<&str> = read.iter().map(|line| line["image"].as_str().expect("a name")).collect();
        assert_eq!(names, ["f8.png", "f9.png", "f10.png", "f11.png"]);
        let one = lines(&place, &[], &["p.gp", "--input", &format!("{folder}/f8.png")]);
        assert_eq!((one.len(), bits(&one[0]["rows"])), (1, bits(&read[0]["rows"])));
    }
}

#[test]
fn rows_are_those_of_eval() {
    let place = place();
    let csv = place.ok(&["eval", "p.gp", "--data", "data", "--answers", "-"]);
    let mut expected = std::collections::BTreeMap::new();
    for line in csv.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let answer: f32 = fields[3].parse().expect("a number");
        expected.insert((fields[0].to_string(), fields[1].to_string()), answer);
    }
    let read = lines(&place, &[], &["p.gp", "--input", "data", "--columns", "8,20,33,51"]);
    let mut compared = 0;
    for line in &read {
        let image = line["image"].as_str().expect("a name").to_string();
        let of_image = ["8", "20", "33", "51"].map(|x| expected[&(image.clone(), x.to_string())]);
        assert_eq!(bits(&line["rows"]), bits_of(of_image), "{image}");
        compared += 4;
    }
    assert_eq!((compared, expected.len()), (24, 24));
    // The compiler's form states its own size.
    let vir = place.ok(&["ir", "p.gp", "--size", "64x48"]);
    place.write("p.vir", vir);
    let again = lines(&place, &[], &["p.vir", "--input", "data", "--columns", "8,20,33,51"]);
    let rows = |lines: &[Value]| -> Vec<Value> { lines.iter().map(|line| line["rows"].clone()).collect() };
    assert_eq!(rows(&again), rows(&read));
    let stream = raw(&frames(2, 64, 48));
    assert_eq!(lines(&place, &stream, &["p.vir", "--format", "raw"]).len(), 2);
}

#[test]
fn a_stream_cut_off_gives_its_whole_frames_and_an_error() {
    let place = place();
    let frames = frames(3, 64, 48);
    for (bytes, flags) in [(raw(&frames), &["--size", "64x48"][..]), (y4m(Chroma::C420, &frames), &[])] {
        let output = fed(&place, &bytes[..bytes.len() - 100], &[&["p.gp"], flags].concat());
        assert_eq!(parsed(&output.stdout).len(), 2);
        let complaint = one_error(&output, 1);
        assert!(complaint.contains("standard input, frame 2: the stream ends after"), "{complaint}");
    }
}

#[test]
fn what_cannot_be_read_is_refused() {
    let place = place();
    let stream = y4m(Chroma::Mono, &frames(2, 64, 48));
    let deep = b"YUV4MPEG2 W64 H48 F25:1 C420p10\n".to_vec();
    let picture = std::fs::read(place.path("data/images/drive_a_0.png")).expect("there");
    place.write("odd.vir", place.ok(&["ir", "p.gp", "--size", "32x32"]));
    place.write("text.txt", "text");
    place.write("bad.gp", "(individual");
    let before = place.everything();
    for (bytes, flags, code, said) in [
        (&stream[..], &["p.gp", "--size", "32x32"][..], 1, "scale=32:32"),
        (&stream, &["odd.vir"], 1, "standard input: 64x48 pixels, where 32x32"),
        (&stream, &["odd.vir", "--size", "64x48"], 2, "--size"),
        (&stream, &["bad.gp"], 1, "bad.gp"),
        (&stream, &["p.gp", "--columns", "64,"], 2, "--columns: 64"),
        (&stream, &["p.gp", "--columns", "65"], 2, "--columns: 65"),
        (&stream, &["p.gp", "--columns", "0"], 2, "--columns"),
        (&stream, &["p.gp", "--output", "ranges"], 2, "--camera"),
        (&stream, &["p.gp", "--camera", "camera.toml"], 2, "--output"),
        (&stream, &["p.gp", "--output", "ranges", "--camera", "none.toml"], 1, "none.toml"),
        (&stream, &["p.gp", "--format", "raw"], 2, "--size"),
        (&stream, &["p.gp", "--format", "images"], 2, "--input"),
        (&stream, &["p.gp", "--median", "2"], 2, "--median"),
        (&stream, &["p.gp", "--every", "1s"], 2, "--record"),
        (&stream, &["p.gp", "--record", "r", "--every", "1"], 2, "500ms"),
        (&stream, &["p.gp", "--fps", "0"], 2, "--fps"),
        (&stream, &["p.gp", "--limit", "0"], 2, "--limit"),
        (&stream[..40], &["p.gp", "--size", "64x48", "--format", "y4m"], 1, "standard input"),
        (&deep, &["p.gp"], 1, "-pix_fmt yuv420p"),
        (&picture, &["p.gp"], 1, "is not a Y4M stream"),
        (&[], &["p.gp"], 1, "nothing in it"),
        (&[], &["p.gp", "--size", "64x48"], 1, "nothing in it"),
        (&[], &["p.gp", "--input", "none"], 1, "none: cannot read the frames"),
        (&[], &["p.gp", "--input", "text.txt"], 1, "is not a Y4M stream"),
        (&[], &["p.gp", "--input", "text.txt", "--format", "images"], 1, "text.txt"),
        (&[], &["p.gp", "--input", "data", "--format", "y4m"], 2, "--format"),
        (&[], &["p.gp", "--input", "data", "--record", "r"], 2, "give --fps"),
        (&[], &["p.gp", "--input", "data", "--size", "32x32"], 1, "data: 64x48"),
    ] {
        let output = fed(&place, bytes, flags);
        let complaint = one_error(&output, code);
        assert!(complaint.contains(said), "{flags:?}: {complaint}");
        assert!(output.stdout.is_empty(), "{flags:?}");
    }
    assert!(before == place.everything(), "something is left behind");
}

#[test]
fn an_overlay_is_a_film_of_the_answers() {
    let place = place();
    let frames = frames(3, 65, 49);
    for (scale, flags) in [(9, &[][..]), (2, &["--scale", "2"])] {
        let flags = [&["p.gp", "--output", "overlay", "--columns", "40,", "--quiet"], flags].concat();
        let output = fed(&place, &y4m(Chroma::C422, &frames), &flags);
        assert!(output.status.success() && output.stderr.is_empty());
        let mut reader = Reader::new(&output.stdout[..], "overlay").expect("Y4M");
        let header = *reader.header();
        assert_eq!((header.width, header.height), (scale * 65, scale * 49));
        assert_eq!(
            (header.rate, header.chroma, header.limited),
            (Rate::new(10, 1), Chroma::C444, Some(false))
        );
        let (mut frame, mut count) = (Frame::default(), 0);
        while reader.read(&mut frame).expect("whole") {
            let at = |x, y| frame.pixels.get_pixel(x, y).0[0];
            let middle = 40 * scale + scale / 2;
            assert_eq!((at(middle, 0), at(middle, 49 * scale - 1)), (0, 255), "the bar");
            assert_eq!(at(scale, 49 * scale - 1), frames[count].get_pixel(1, 48).0[0], "the frame");
            count += 1;
        }
        assert_eq!(count, 3);
    }
    let raw = fed(&place, &raw(&frames), &["p.gp", "--output", "overlay", "--size", "65x49"]);
    assert!(raw.stdout.starts_with(b"YUV4MPEG2 W585 H441 F30:1 "), "no rate is known");
}

#[test]
fn recorded_frames_are_what_came_in() {
    let place = place();
    let frames = frames(23, 64, 48);
    let stream = y4m(Chroma::C420, &frames);
    let names = |folder: &str| {
        let entries = std::fs::read_dir(place.path(folder)).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("readable").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    let numbered =
        |numbers: &[u32]| -> Vec<String> { numbers.iter().map(|i| format!("frame_{i:06}.png")).collect() };
    for (folder, flags, numbers) in [
        ("new/a", &[][..], &[0, 10, 20][..]),
        ("b", &["--every", "500ms"], &[0, 5, 10, 15, 20]),
        ("c", &["--every", "9f", "--output", "overlay"], &[0, 9, 18]),
        ("d", &["--fps", "20"], &[0, 20]),
    ] {
        let flags = [&["p.gp", "--quiet", "--record", folder], flags].concat();
        let output = fed(&place, &stream, &flags);
        assert!(output.status.success() && output.stderr.is_empty());
        assert_eq!(names(folder), numbered(numbers));
        for &number in numbers {
            let path = place.path(folder).join(format!("frame_{number:06}.png"));
            assert_eq!(image::open(path).expect("an image").into_luma8(), frames[number as usize]);
        }
    }
    // Never overwritten.
    let before = place.everything();
    let complaint = one_error(&fed(&place, &stream, &["p.gp", "--record", "b"]), 1);
    assert!(complaint.contains("frame_0000") && complaint.contains("new folder"), "{complaint}");
    assert!(before == place.everything());
    // They can be labelled as they are.
    let rows = lines(&place, &[], &["p.gp", "--input", "b"]);
    assert_eq!(rows[1]["image"], "frame_000005.png");
}

#[test]
fn a_limit_ends_the_run_whoever_goes_on_sending() {
    let place = place();
    let stream = y4m(Chroma::C420, &frames(5, 64, 48));
    assert_eq!(lines(&place, &stream, &["p.gp", "--limit", "3"]).len(), 3);
    assert_eq!(lines(&place, &stream, &["p.gp", "--limit", "9"]).len(), 5);
    // What comes behind the last frame that counts does not matter.
    let cut = &stream[..stream.len() - 7];
    assert_eq!(lines(&place, cut, &["p.gp", "--limit", "4"]).len(), 4);
    let mut command = place.command(&["run", "p.gp", "--limit", "2", "--quiet"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("started");
    let mut input = child.stdin.take().expect("piped");
    input.write_all(&stream).expect("heard");
    // The input stays open.
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn the_median_of_three_frames_is_believed() {
    let place = place();
    let frames = frames(9, 64, 48);
    let columns = [8, 30, 63];
    let single = answers(&frames, &columns);
    let read =
        lines(&place, &raw(&frames), &["p.gp", "--size", "64x48", "--median", "3", "--columns", "8,30,63"]);
    let mut changed = 0;
    for (i, line) in read.iter().enumerate() {
        let expected = (0..columns.len()).map(|c| {
            let mut last: Vec<f32> = (0..3.min(i + 1)).map(|back| single[i - back][c]).collect();
            if !last[0].is_finite() {
                return last[0];
            }
            last.retain(|row| row.is_finite());
            last.sort_by(f32::total_cmp);
            // Of two the larger row, which is nearer.
            last[last.len() / 2]
        });
        let expected = bits_of(expected);
        assert_eq!(bits(&line["rows"]), expected, "frame {i}");
        changed += usize::from(expected != bits_of(single[i].iter().copied()));
    }
    assert!(changed > 2, "the frames are too much alike");
    let plain =
        lines(&place, &raw(&frames), &["p.gp", "--size", "64x48", "--median", "1", "--columns", "8,30,63"]);
    for (line, expected) in plain.iter().zip(&single) {
        assert_eq!(bits(&line["rows"]), bits_of(expected.iter().copied()));
    }
}

#[test]
fn ranges_are_those_of_the_library() {
    let place = place();
    place.write("camera.toml", "height = 0.8\npitch = 20\nfield_of_view = 90\n");
    let camera = Camera::load(&place.path("camera.toml")).expect("sound");
    let ground = Ground::new(&camera, 64, 48);
    let frames = frames(6, 64, 48);
    let columns = [8, 30, 63];
    let flags = ["p.gp", "--output", "ranges", "--camera", "camera.toml", "--columns", "8,30,63"];
    let read = lines(&place, &y4m(Chroma::C444, &frames), &flags);
    for (line, rows) in read.iter().zip(answers(&frames, &columns)) {
        let ranges: Vec<_> = columns.iter().zip(&rows).map(|(&x, &row)| ground.locate(x, row)).collect();
        assert_eq!(bits(&line["rows"]), bits_of(rows));
        assert_eq!(bits(&line["bearing"]), bits_of(ranges.iter().map(|r| r.bearing)));
        assert_eq!(bits(&line["distance"]), bits_of(ranges.iter().map(|r| r.distance)));
        assert_eq!(bits(&line["nearest"]), bits_of(ranges.iter().map(|r| r.nearest)));
        assert_eq!(bits(&line["farthest"]), bits_of(ranges.iter().map(|r| r.farthest)));
        let words = ranges.iter().map(|range| match range.status {
            Status::Obstacle => "obstacle",
            Status::NoneInView => "none-in-view",
            Status::Invalid => "invalid",
        });
        assert_eq!(line["status"], serde_json::json!(words.collect::<Vec<_>>()));
    }
    assert_eq!(read.len(), 6);
}

#[test]
fn the_summary_counts_and_quiet_says_nothing() {
    let place = place();
    let stream = y4m(Chroma::C420, &frames(5, 64, 48));
    let output = fed(&place, &stream, &["p.gp", "--record", "r", "--every", "2f"]);
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(said.starts_with("5 frames in ") && said.contains("; 3 recorded\n"), "{said}");
    assert!(said.contains("frames/s") && said.contains("median") && said.contains("95 %"), "{said}");
    assert!(!said.contains("dropped") && plain(&said) && said.ends_with('\n'), "{said}");
    let nothing = fed(&place, b"YUV4MPEG2 W64 H48\n", &["p.gp"]);
    assert!(nothing.status.success() && nothing.stderr.starts_with(b"0 frames in "));
    let limited = b"YUV4MPEG2 W64 H48 XCOLORRANGE=LIMITED\n";
    let said = String::from_utf8(fed(&place, limited, &["p.gp"]).stderr).expect("UTF-8");
    assert!(said.starts_with("note: ") && said.contains("-pix_fmt gray"), "{said}");
    assert!(lines(&place, limited, &["p.gp"]).is_empty());
}

#[test]
fn live_frames_are_answered_or_dropped() {
    let place = place();
    let stream = y4m(Chroma::Mono, &frames(400, 64, 48));
    let output = fed(&place, &stream, &["p.gp", "--live"]);
    assert!(output.status.success());
    let numbers: Vec<u64> =
        parsed(&output.stdout).iter().map(|line| line["frame"].as_u64().expect("a number")).collect();
    assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
    assert_eq!(numbers.last(), Some(&399), "the newest frame always comes");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    let dropped = 400 - numbers.len();
    let expected = if dropped == 0 { String::new() } else { format!("; {dropped} further") };
    assert!(said.starts_with(&format!("{} frame", numbers.len())) && said.contains(&expected), "{said}");
}

#[test]
fn a_reader_that_leaves_ends_the_run_quietly() {
    let place = place();
    let stream = y4m(Chroma::Mono, &frames(2000, 64, 48));
    for output in ["rows", "overlay"] {
        let mut command = place.command(&["run", "p.gp", "--output", output]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("started");
        let (mut input, bytes) = (child.stdin.take().expect("piped"), stream.clone());
        let sender = std::thread::spawn(move || input.write_all(&bytes).is_err());
        let mut out = child.stdout.take().expect("piped");
        out.read_exact(&mut [0; 100]).expect("it begins");
        drop(out);
        let output = child.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && said.is_empty(), "{:?}: {said}", output.status);
        assert!(sender.join().expect("no panic"), "not everything was read");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_run_that_waits_for_a_frame() {
    let place = place();
    let stream = y4m(Chroma::Mono, &frames(2, 64, 48));
    for quiet in [false, true] {
        let flags: &[&str] = if quiet { &["--quiet"] } else { &[] };
        let mut command = place.command(&[&["run", "p.gp"], flags].concat());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("started");
        // It stays open, and the third frame never comes.
        let mut input = child.stdin.take().expect("piped");
        input.write_all(&stream).and_then(|()| input.flush()).expect("heard");
        let mut out = BufReader::new(child.stdout.take().expect("piped"));
        for i in 0..2 {
            let mut line = String::new();
            out.read_line(&mut line).expect("a line, as soon as it is known");
            assert!(line.starts_with(&format!("{{\"frame\":{i},")), "{line}");
        }
        crate::interruption::interrupt(&child);
        let output = child.wait_with_output().expect("it ends");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(130), "{said}");
        assert!(if quiet { said.is_empty() } else { said.starts_with("2 frames in ") }, "{said}");
    }
}

#[test]
fn a_full_device_is_an_error_of_the_output() {
    if !std::path::Path::new("/dev/full").exists() {
        return;
    }
    let place = place();
    for output in ["rows", "overlay"] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("writable");
        let mut command = place.command(&["run", "p.gp", "--input", "data", "--output", output]);
        let complaint = one_error(&command.stdout(full).output().expect("started"), 1);
        assert!(complaint.contains("standard output") && complaint.contains("make room"), "{complaint}");
    }
}
