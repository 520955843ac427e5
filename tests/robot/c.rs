//! The example in C: every compiler, every kind of input, wrong input, and what it is linked with.

use std::path::{Path, PathBuf};
use std::process::Command;

use image::GrayImage;

use crate::sample::{Export, FRAMES, HEIGHT, WIDTH, raw, y4m};
use crate::tools::{examples, fails, fed, folder, has, run};

/// Options that leave no warning unheard.
const STRICT: [&str; 6] = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// Builds `sonar.c` against an export's static library, or its source.
pub(crate) fn build(compiler: &str, export: &Export, form: &str, program: &str) -> PathBuf {
    let program = export.folder.join(program);
    let mut command = Command::new(compiler);
    command.args(STRICT).arg(examples().join("sonar.c")).arg("-I").arg(&export.folder);
    run(command.arg(export.folder.join(form)).arg("-o").arg(&program));
    program
}

/// Writes a file that a program is to read.
pub(crate) fn file(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("files can be written");
    path
}

#[test]
fn every_compiler_gives_the_librarys_bits() {
    let folder = folder("compilers");
    let input = file(&folder, "raw", &raw(&FRAMES));
    for export in Export::all(&folder) {
        for compiler in ["gcc", "clang"].into_iter().filter(|compiler| has(compiler, compiler)) {
            for form in ["libdetector.a", "detector.c"] {
                let program = build(compiler, &export, form, "sonar");
                let about = format!("{compiler} {form}");
                export.check(&about, &fed(&mut Command::new(&program), &input), &FRAMES, 12);
                for n in [1, 7, WIDTH] {
                    let printed = fed(Command::new(&program).arg(n.to_string()), &input);
                    export.check(&format!("{about}, {n} columns"), &printed, &FRAMES, n);
                }
            }
        }
    }
}

#[test]
fn the_robot_says_what_vsonar_run_says() {
    if !has("cc", "gcc") {
        return;
    }
    let folder = folder("run");
    let input = file(&folder, "input", &raw(&FRAMES));
    for export in Export::all(&folder) {
        let program = build("cc", &export, "libdetector.a", "sonar");
        let on_robot = fed(Command::new(program).arg("9"), &input);
        let mut run = Command::new(env!("CARGO_BIN_EXE_vsonar"));
        run.arg("run").arg(&export.program).args(["--columns", "9", "--format", "raw", "--quiet"]);
        run.args(["--size", "320x240"]).args(&export.options);
        if export.ground.is_some() {
            run.args(["--output", "ranges"]);
        }
        let here = fed(&mut run, &input);
        // Numbers as binary32: they are printed with as many digits as it takes, which differ.
        let parse = |line: &str| -> serde_json::Map<String, serde_json::Value> {
            let mut line: serde_json::Map<_, _> = serde_json::from_str(line).expect("an object");
            line.remove("time");
            line.remove("latency_us");
            for number in line.values_mut().filter_map(|value| value.as_array_mut()).flatten() {
                if let Some(value) = number.as_f64() {
                    *number = f64::from(value as f32).into();
                }
            }
            line
        };
        let lines = |text: &str| text.lines().map(parse).collect::<Vec<_>>();
        assert_eq!(lines(&on_robot), lines(&here), "{}", export.name);
    }
}

/// Headers of Y4M and the bytes of colour after each frame.
pub(crate) fn forms() -> Vec<(String, usize)> {
    let size = format!("W{WIDTH} H{HEIGHT}");
    let (quarter, half, all) =
        ((WIDTH * HEIGHT / 2) as usize, (WIDTH * HEIGHT) as usize, (2 * WIDTH * HEIGHT) as usize);
    vec![
        (format!("{size} F30:1 Ip A1:1 C420jpeg XYSCSS=420JPEG XCOLORRANGE=LIMITED"), quarter),
        (format!("{size} F30:1 C420mpeg2"), quarter),
        (format!("C420paldv {size}"), quarter),
        (format!("{size} C420"), quarter),
        (size.clone(), quarter),
        (format!("{size} Cmono XCOLORRANGE=FULL"), 0),
        (format!("{size} C422 F25:1"), half),
        (format!("{size} C444"), all),
    ]
}

#[test]
fn luma_is_taken_out_of_every_form_of_y4m() {
    if !has("cc", "gcc") {
        return;
    }
    let folder = folder("y4m");
    let export = Export::varied(&folder);
    let program = build("cc", &export, "libdetector.a", "sonar");
    for (header, colours) in forms() {
        let input = file(&folder, "input", &y4m(&FRAMES, &header, colours));
        export.check(&header, &fed(&mut Command::new(&program), &input), &FRAMES, 12);
    }
    // Pixels that begin as the name of Y4M does, but go on in another way.
    let mut frames: Vec<GrayImage> = FRAMES[..2].to_vec();
    for frame in &mut frames {
        let pixels: &mut [u8] = frame.as_mut();
        pixels[..10].copy_from_slice(b"YUV4MPEG2-");
    }
    let input = file(&folder, "input", &raw(&frames));
    export.check("raw", &fed(&mut Command::new(&program), &input), &frames, 12);
}

/// Inputs that are none, and what the complaint has to say.
pub(crate) fn wrong_inputs() -> Vec<(Vec<u8>, &'static str)> {
    let frames = raw(&FRAMES);
    let size = (WIDTH * HEIGHT) as usize;
    let (header, colours) = forms().swap_remove(0);
    let sound = y4m(&FRAMES, &header, colours);
    let whole = sound.len();
    let begin = format!("YUV4MPEG2 {header}\n").len();
    let other = |header: &str| y4m(&FRAMES[..1], header, 0);
    vec![
        (vec![], "there is no frame"),
        (sound[..begin].to_vec(), "there is no frame"),
        (frames[..5].to_vec(), "frame 0: the input ends before its last pixel"),
        (frames[..size - 1].to_vec(), "frame 0: the input ends before its last pixel"),
        (frames[..size + 1].to_vec(), "frame 1: the input ends before its last pixel"),
        (sound[..20].to_vec(), "frame 0: the input ends in a header of Y4M"),
        (sound[..begin + 3].to_vec(), "frame 0: this is not where a frame of Y4M begins"),
        (sound[..begin + 5].to_vec(), "frame 0: the input ends in a header of Y4M"),
        (sound[..begin + 6 + size - 1].to_vec(), "frame 0: the input ends before its last pixel"),
        (sound[..whole - 1].to_vec(), "frame 7: the input ends before its last colour"),
        ([&sound[..], b"FRAMED"].concat(), "frame 8: the input ends in a header of Y4M"),
        ([&sound[..], b"frame\n"].concat(), "frame 8: this is not where a frame of Y4M begins"),
        (other("W640 H480 Cmono"), "640 x 480 pixels, but the detector is for 320 x 240"),
        (other("W240 H320 Cmono"), "240 x 320 pixels"),
        (other("Cmono"), "the detector is for 320 x 240"),
        (other("W320 H240 C420p10"), "C420p10: convert it"),
        (other("W320 H240 C444alpha"), "C444alpha: convert it"),
        (other("W320 H240 C411"), "C411: convert it"),
        (other(&format!("W320 H240 X{}", "x".repeat(5000))), "header of Y4M"),
    ]
}

#[test]
fn wrong_input_is_refused() {
    if !has("cc", "gcc") {
        return;
    }
    let folder = folder("wrong");
    let export = Export::varied(&folder);
    let program = build("cc", &export, "libdetector.a", "sonar");
    for (bytes, said) in wrong_inputs() {
        let input = file(&folder, "input", &bytes);
        let complaint = fails(&mut Command::new(&program), 1, &input);
        assert!(complaint.contains(said), "{complaint} instead of {said}");
    }
    let input = file(&folder, "input", &raw(&FRAMES[..1]));
    for wrong in ["0", "321", "-1", "x", "12x", "", "99999999999999999999"] {
        let complaint = fails(Command::new(&program).arg(wrong), 2, &input);
        assert!(complaint.contains("1 to 320"), "{complaint}");
    }
    assert!(fails(&mut Command::new(&program), 1, &folder).contains("cannot read standard input"));
    let full = Path::new("/dev/full");
    if full.exists() {
        let full = std::fs::OpenOptions::new().write(true).open(full).expect("it is for everyone");
        let output =
            Command::new(&program).stdin(std::fs::File::open(&input).expect("there")).stdout(full).output();
        let output = output.expect("it can be started");
        assert_eq!(output.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&output.stderr).contains("cannot write"));
    }
}

/// The libraries that a program or a library names, out of its dynamic section.
pub(crate) fn needed(path: &Path) -> Vec<String> {
    let printed = run(Command::new("readelf").arg("-d").arg(path).env("LC_ALL", "C")).stdout;
    let named = |line: &str| {
        line.split_once("Shared library: [").map(|(_, name)| name.trim_end_matches(']').to_string())
    };
    String::from_utf8_lossy(&printed).lines().filter_map(named).collect()
}

#[test]
fn nothing_but_the_c_library_is_linked() {
    if !has("readelf", "binutils") || !has("cc", "gcc") {
        return;
    }
    let folder = folder("linked");
    for export in Export::all(&folder) {
        let program = build("cc", &export, "libdetector.a", "sonar");
        let found = needed(&program);
        assert!(
            !found.is_empty() && found.iter().all(|name| name.starts_with("libc.")),
            "{}: {found:?}",
            export.name
        );
        assert_eq!(needed(&export.folder.join("libdetector.so")), [""; 0], "{}", export.name);
    }
}

#[test]
fn valgrind_finds_nothing() {
    if !has("valgrind", "valgrind") || !has("cc", "gcc") {
        return;
    }
    let folder = folder("valgrind");
    let frames = &FRAMES[..3];
    let input = file(&folder, "input", &y4m(frames, &forms()[0].0, forms()[0].1));
    for export in Export::all(&folder) {
        let program = build("cc", &export, "libdetector.a", "sonar");
        let mut command = Command::new("valgrind");
        command.args(["--quiet", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all"]);
        // The very last column and the first are among these: reads beyond the frame would show.
        export.check("valgrind", &fed(command.arg(&program).arg("320"), &input), frames, WIDTH);
    }
}
