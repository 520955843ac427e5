//! Exports, frames for them, and what the library says of these.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use image::GrayImage;
use vsonar::camera::Camera;
use vsonar::camera::ground::{Ground, Range, Status, median_of_three};
use vsonar::detector::{CompiledDetector, Detector};
use vsonar::ir::machine::Scalar;
use vsonar::ir::{Program, opt, text};
use vsonar::lower::lower;
use vsonar::tree::Individual;
use vsonar::world;

use crate::tools;

pub(crate) const WIDTH: u32 = 320;
pub(crate) const HEIGHT: u32 = 240;

/// That of the built-in corridor, with a lens that bends.
pub(crate) const CAMERA: Camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: -0.1 };

/// The published program, and one whose answers are of every kind: fractions, rows outside the image, numbers that are
/// not finite in some frames only.
const PROGRAMS: [(&str, &str); 2] = [("fmrb", "examples/fmrb.gp"), ("varied", "tests/robot/varied.vir")];

/// A few frames of a drive along the built-in corridor.
pub(crate) static FRAMES: LazyLock<Vec<GrayImage>> = LazyLock::new(|| {
    world::default_dataset(1).images().iter().step_by(4).take(8).map(|image| image.pixels.clone()).collect()
});

/// A folder that `vsonar export` has written.
pub(crate) struct Export {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    /// The program's file.
    pub(crate) program: PathBuf,
    /// The camera and the median, as `vsonar export` and `vsonar run` take them.
    pub(crate) options: Vec<OsString>,
    pub(crate) ground: Option<Ground>,
    median: bool,
    detector: CompiledDetector,
}

impl Export {
    /// One export of each kind of each program, in folders below this one.
    pub(crate) fn all(below: &Path) -> Vec<Export> {
        let kinds = [("rows", false, false), ("ranges", true, false), ("median", true, true)];
        let make = |(program, path)| {
            kinds.map(|(kind, camera, median)| {
                Export::new(below, program, path, kind, camera.then_some(&CAMERA), median)
            })
        };
        PROGRAMS.into_iter().flat_map(make).collect()
    }

    /// The one of these programs whose answers vary, with ranges and a median.
    pub(crate) fn varied(below: &Path) -> Export {
        let (program, path) = PROGRAMS[1];
        Export::new(below, program, path, "median", Some(&CAMERA), true)
    }

    /// The same program behind a lens whose widest bearings are between the top and the bottom row.
    pub(crate) fn pincushion(below: &Path) -> Export {
        let (program, path) = PROGRAMS[1];
        let camera = Camera { pitch: 10.0, distortion: 0.5, ..CAMERA };
        Export::new(below, program, path, "pincushion", Some(&camera), false)
    }

    fn new(
        below: &Path,
        program: &str,
        path: &str,
        kind: &str,
        camera: Option<&Camera>,
        median: bool,
    ) -> Export {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        let name = format!("{program}-{kind}");
        let folder = below.join(&name);
        let mut options: Vec<OsString> = Vec::new();
        if let Some(camera) = camera {
            let file = below.join(format!("{name}.toml"));
            std::fs::write(&file, camera.to_toml("")).expect("files can be written");
            options.extend(["--camera".into(), file.into()]);
        }
        if median {
            options.extend(["--median".into(), "3".into()]);
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_vsonar"));
        command.arg("export").arg(&path).arg("--out").arg(&folder).args(["--name", "detector", "--quiet"]);
        command.args(&options);
        tools::run(&mut command);
        let detector = CompiledDetector::compile(&load(&path)).expect("there is a code generator");
        let ground = camera.map(|camera| Ground::new(camera, WIDTH, HEIGHT));
        Export { name, folder, program: path, options, ground, median, detector }
    }

    /// The rows of each frame, without a median.
    pub(crate) fn rows(&self, frames: &[GrayImage], columns: &[u32]) -> Vec<Vec<f32>> {
        let frame = |frame: &GrayImage| {
            let mut rows = vec![0.0; columns.len()];
            self.detector.detect(frame, columns, &mut rows).expect("frames and columns fit");
            rows
        };
        frames.iter().map(frame).collect()
    }

    /// What is known of each column of each frame; of an export without a camera the row only.
    pub(crate) fn expected(&self, frames: &[GrayImage], columns: &[u32]) -> Vec<Vec<Range>> {
        let mut state = vec![[f32::NAN; 2]; columns.len()];
        let frame = |rows: Vec<f32>| {
            let column = |((&column, row), state): ((&u32, f32), &mut [f32; 2])| {
                let Some(ground) = self.ground else {
                    let none = f32::NAN;
                    return Range {
                        row,
                        bearing: none,
                        distance: none,
                        nearest: none,
                        farthest: none,
                        status: Status::Invalid,
                    };
                };
                let believed =
                    if self.median { median_of_three(&mut Scalar, row, state[0], state[1]) } else { row };
                *state = [row, state[0]];
                ground.locate(column, believed)
            };
            columns.iter().zip(rows).zip(&mut state).map(column).collect()
        };
        self.rows(frames, columns).into_iter().map(frame).collect()
    }

    /// Holds lines of JSON, as the examples print them, against the library.
    pub(crate) fn check(&self, about: &str, printed: &str, frames: &[GrayImage], n: u32) {
        let columns = columns(n);
        let expected = self.expected(frames, &columns);
        let lines: Vec<&str> = printed.lines().collect();
        assert_eq!(lines.len(), frames.len(), "{about}, {}", self.name);
        for (i, (line, expected)) in lines.into_iter().zip(expected).enumerate() {
            let about = format!("{about}, {}, frame {i}", self.name);
            let found: serde_json::Value =
                serde_json::from_str(line).unwrap_or_else(|e| panic!("{about}: {e}: {line}"));
            assert_eq!(found["frame"], i, "{about}");
            let array = |name: &str| -> Vec<&serde_json::Value> {
                let found = found[name].as_array().unwrap_or_else(|| panic!("{about}: no {name} in {line}"));
                assert_eq!(found.len(), columns.len(), "{about}: {name}");
                found.iter().collect()
            };
            let numbers = |name: &str, of: fn(&Range) -> f32| {
                for ((found, expected), column) in array(name).into_iter().zip(&expected).zip(&columns) {
                    number(found, of(expected), &format!("{about}, {name} of column {column}"));
                }
            };
            assert_eq!(array("columns"), columns, "{about}");
            numbers("rows", |range| range.row);
            if self.ground.is_none() {
                assert_eq!(found.as_object().expect("an object").len(), 3, "{about}: {line}");
                continue;
            }
            numbers("bearing", |range| range.bearing);
            numbers("distance", |range| range.distance);
            numbers("nearest", |range| range.nearest);
            numbers("farthest", |range| range.farthest);
            let word = |range: &Range| match range.status {
                Status::Obstacle => "obstacle",
                Status::NoneInView => "none-in-view",
                Status::Invalid => "invalid",
            };
            assert_eq!(array("status"), expected.iter().map(word).collect::<Vec<_>>(), "{about}");
        }
    }
}

/// So many columns, evenly spread, as the examples choose them.
pub(crate) fn columns(n: u32) -> Vec<u32> {
    (0..n).map(|i| (2 * i + 1) * WIDTH / (2 * n)).collect()
}

/// A program, optimised.
fn load(path: &Path) -> Program {
    let source = std::fs::read_to_string(path).expect("the program can be read");
    let program = match source.parse::<Individual>() {
        Ok(individual) => lower(&individual, WIDTH, HEIGHT),
        Err(_) => text::parse(&source).expect("a program"),
    };
    opt::optimise(&program)
}

/// Holds a printed number against the one it stands for: the same bits, or null for what is not finite.
fn number(found: &serde_json::Value, expected: f32, about: &str) {
    if expected.is_finite() {
        let found =
            found.as_f64().unwrap_or_else(|| panic!("{about}: no number instead of {expected}")) as f32;
        assert_eq!(found.to_bits(), expected.to_bits(), "{about}: {found} instead of {expected}");
    } else {
        assert!(found.is_null(), "{about}: {found} instead of {expected}");
    }
}

/// Frames as raw pixels.
pub(crate) fn raw(frames: &[GrayImage]) -> Vec<u8> {
    frames.iter().flat_map(|frame| frame.as_raw().iter().copied()).collect()
}

/// Frames as Y4M, the colours of each after its luma.
pub(crate) fn y4m(frames: &[GrayImage], header: &str, colours: usize) -> Vec<u8> {
    let mut out = format!("YUV4MPEG2 {header}\n").into_bytes();
    for (i, frame) in frames.iter().enumerate() {
        // Parameters of a single frame are allowed.
        out.extend_from_slice(if i == 1 { b"FRAME Ip\n" } else { b"FRAME\n" });
        out.extend_from_slice(frame.as_raw());
        out.extend((0..colours).map(|c| (c % 251) as u8));
    }
    out
}

/// The sample itself: it has answers of every kind, or the tests say little.
#[test]
fn the_sample_is_varied() {
    let export = Export::varied(&tools::folder("sample"));
    let found = export.expected(&FRAMES, &columns(64));
    let mut counts = [0; 3];
    found.iter().flatten().for_each(|range| counts[range.status as usize] += 1);
    assert!(counts.iter().all(|&count| count > 10), "{counts:?}");
    let fractions = found.iter().flatten().filter(|r| r.row.is_finite() && r.row.fract() != 0.0).count();
    assert!(fractions > 100, "{fractions}");
    // The median has an effect.
    let plain = Export { median: false, ..export }.expected(&FRAMES, &columns(64));
    let changed = plain
        .iter()
        .flatten()
        .zip(found.iter().flatten())
        .filter(|(a, b)| a.row.to_bits() != b.row.to_bits());
    assert!(changed.count() > 20);
}
