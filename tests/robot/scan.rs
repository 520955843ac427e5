//! The laser scan in C, held against the library's.

use std::path::{Path, PathBuf};
use std::process::Command;

use vsonar::camera::scan::{LaserScan, Scan};

use crate::c::{file, needed};
use crate::sample::{Export, FRAMES, columns, raw};
use crate::tools::{examples, fails, fed, folder, has, run};

/// What the example chooses.
const COLUMNS: u32 = 12;

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

/// Builds the example with a greatest range of its own.
fn build(compiler: &str, export: &Export, range_max: f32) -> PathBuf {
    let program = export.folder.join("laser_scan");
    let mut command = Command::new(compiler);
    command.args(["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
    command.arg(format!("-DRANGE_MAX={range_max:?}f"));
    command.args(["laser_scan_main.c", "laser_scan.c"].map(|name| examples().join(name)));
    command.arg("-I").arg(&export.folder).arg(export.folder.join("libdetector.a")).arg("-lm");
    run(command.arg("-o").arg(&program));
    program
}

/// Holds a message, that of frame `i` at four frames a second, against the library's; its ranges.
fn compare(about: &str, i: usize, yaml: &str, expected: &LaserScan) -> Vec<f32> {
    let found = parse(yaml);
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
    assert_eq!(bits(&found), bits(expected), "{about}: {found:?} instead of {expected:?}");
    let (sec, nanosec) = (i / 4, i % 4 * 250_000_000);
    let header = format!("sec: {sec}\n    nanosec: {nanosec}\n  frame_id: camera_footprint\n");
    assert!(yaml.contains(&header), "{about}: {yaml}");
    found.ranges
}

#[test]
fn the_scan_is_the_librarys() {
    let compilers: Vec<&str> =
        ["gcc", "clang"].into_iter().filter(|compiler| has(compiler, compiler)).collect();
    let folder = folder("scan");
    let input = file(&folder, "input", &raw(&FRAMES));
    let mut all = Vec::new();
    for export in Export::all(&folder).into_iter().chain([Export::pincushion(&folder)]) {
        let Some(ground) = export.ground else { continue };
        let expected = export.expected(&FRAMES, &columns(COLUMNS));
        let scan = Scan::new(&ground, &columns(COLUMNS));
        for (compiler, range_max) in compilers.iter().flat_map(|compiler| [(compiler, 5.0), (compiler, 0.8)])
        {
            let program = build(compiler, &export, range_max);
            let printed = fed(Command::new(&program).arg("4"), &input);
            let messages: Vec<&str> = printed.split_terminator("---\n").collect();
            assert_eq!(messages.len(), expected.len());
            for (i, (yaml, ranges)) in messages.into_iter().zip(&expected).enumerate() {
                let about = format!("{compiler}, {}, up to {range_max}, frame {i}", export.name);
                all.extend(compare(&about, i, yaml, &scan.fill(ranges, range_max, 0.25)));
            }
            assert!(fails(&mut Command::new(&program), 1, Path::new("/dev/null")).contains("no frame"));
            if has("readelf", "binutils") {
                let found = needed(&program);
                let allowed = |name: &String| name.starts_with("libc.") || name.starts_with("libm.");
                assert!(found.iter().all(allowed), "{found:?}");
            }
        }
    }
    let count = |which: fn(f32) -> bool| all.iter().filter(|&&range| which(range)).count();
    let counts = [count(f32::is_finite), count(f32::is_infinite), count(f32::is_nan)];
    assert!(
        compilers.is_empty() || counts.iter().all(|&count| count > 20),
        "{counts:?}: the sample says little"
    );
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
