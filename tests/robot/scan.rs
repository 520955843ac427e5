//! The laser scan in C, held against the library's.

use std::process::Command;

use vsonar::camera::scan::{LaserScan, Scan};

use crate::c::{file, needed};
use crate::sample::{Export, FRAMES, columns, raw};
use crate::tools::{examples, fails, fed, folder, has, run};

/// What the example chooses.
const COLUMNS: u32 = 12;
const RANGE_MAX: f32 = 5.0;

/// A message out of its YAML.
fn parse(yaml: &str) -> LaserScan {
    let number = |text: &str| match text {
        ".inf" => f32::INFINITY,
        ".nan" => f32::NAN,
        other => other.parse().unwrap_or_else(|_| panic!("{other:?} is no number")),
    };
    let field = |name: &str| {
        let mut lines = yaml.lines().filter_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
        number(lines.next().unwrap_or_else(|| panic!("no {name} in {yaml}")))
    };
    assert!(yaml.contains("\nintensities: []\n"), "{yaml}");
    LaserScan {
        angle_min: field("angle_min"),
        angle_max: field("angle_max"),
        angle_increment: field("angle_increment"),
        time_increment: field("time_increment"),
        scan_time: field("scan_time"),
        range_min: field("range_min"),
        range_max: field("range_max"),
        ranges: yaml.lines().filter_map(|line| line.strip_prefix("- ").map(number)).collect(),
        intensities: Vec::new(),
    }
}

#[test]
fn the_scan_is_the_librarys() {
    let folder = folder("scan");
    let input = file(&folder, "input", &raw(&FRAMES));
    let (mut finite, mut infinite, mut unknown) = (0, 0, 0);
    for export in Export::all(&folder) {
        let Some(ground) = export.ground else { continue };
        for compiler in ["gcc", "clang"].into_iter().filter(|compiler| has(compiler, compiler)) {
            let program = export.folder.join("laser_scan");
            let mut command = Command::new(compiler);
            command.args(["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
            command.args(["laser_scan_main.c", "laser_scan.c"].map(|name| examples().join(name)));
            command.arg("-I").arg(&export.folder).arg(export.folder.join("libdetector.a")).arg("-lm");
            run(command.arg("-o").arg(&program));
            let printed = fed(Command::new(&program).arg("4"), &input);
            let messages: Vec<&str> = printed.split_terminator("---\n").collect();
            let expected = export.expected(&FRAMES, &columns(COLUMNS));
            assert_eq!(messages.len(), expected.len());
            let scan = Scan::new(&ground, &columns(COLUMNS));
            for (i, (yaml, ranges)) in messages.into_iter().zip(expected).enumerate() {
                let about = format!("{compiler}, {}, frame {i}", export.name);
                let (found, expected) = (parse(yaml), scan.fill(&ranges, RANGE_MAX, 0.25));
                // The library computes these in binary32, without a mathematical library.
                let near = |a: f32, b: f32| assert!((a - b).abs() < 4e-6, "{about}: {a} instead of {b}");
                near(found.angle_min, expected.angle_min);
                near(found.angle_max, expected.angle_max);
                near(found.angle_increment, expected.angle_increment);
                let bits = |scan: &LaserScan| -> Vec<u32> {
                    let numbers = [scan.time_increment, scan.scan_time, scan.range_min, scan.range_max];
                    let all = numbers.iter().chain(&scan.ranges);
                    all.map(|number| if number.is_nan() { f32::NAN } else { *number }.to_bits()).collect()
                };
                assert_eq!(bits(&found), bits(&expected), "{about}: {found:?} instead of {expected:?}");
                let stamp = format!(
                    "sec: {}\n    nanosec: {}\n  frame_id: camera_footprint\n",
                    i / 4,
                    i % 4 * 250_000_000
                );
                assert!(yaml.contains(&stamp), "{about}: {yaml}");
                for range in found.ranges {
                    *if range.is_nan() {
                        &mut unknown
                    } else if range.is_finite() {
                        &mut finite
                    } else {
                        &mut infinite
                    } += 1;
                }
            }
            assert!(
                fails(&mut Command::new(&program), 1, std::path::Path::new("/dev/null")).contains("no frame")
            );
            if has("readelf", "binutils") {
                let found = needed(&program);
                let allowed = |name: &String| name.starts_with("libc.") || name.starts_with("libm.");
                assert!(found.iter().all(allowed), "{found:?}");
            }
        }
    }
    if has("gcc", "gcc") {
        assert!(
            finite > 100 && infinite > 10 && unknown > 10,
            "{finite} {infinite} {unknown}: the sample says little"
        );
    }
}

#[test]
fn without_distances_there_is_no_scan() {
    if !has("cc", "gcc") {
        return;
    }
    let export = Export::all(&folder("no-scan")).swap_remove(0);
    let mut command = Command::new("cc");
    command
        .arg("-c")
        .arg(examples().join("laser_scan.c"))
        .arg("-I")
        .arg(&export.folder)
        .args(["-o", "/dev/null"]);
    let output = command.output().expect("it can be started");
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("export the detector with --camera"));
}
