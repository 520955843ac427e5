//! The examples in Python and Rust, and the ways to build: CMake and pkg-config.

use std::path::Path;
use std::process::Command;

use crate::c::{file, forms, wrong_inputs};
use crate::sample::{Export, FRAMES, columns, raw, y4m};
use crate::tools::{examples, fails, fed, folder, has, missing, run};

/// Runs a script as if there were no NumPy.
const WITHOUT_NUMPY: &str = "import sys, runpy; sys.modules['numpy'] = None; sys.argv = sys.argv[1:]; \
    runpy.run_path(sys.argv[0], run_name='__main__')";

/// Python with the script, leaving nothing behind in the folders of others.
fn python(interpreter: &str, numpy: bool, export: &Path) -> Command {
    let mut command = Command::new(interpreter);
    command.arg("-B");
    if !numpy {
        command.args(["-c", WITHOUT_NUMPY]);
    }
    command.arg(examples().join("sonar.py")).arg(export);
    command
}

#[test]
fn python_gives_the_librarys_bits() {
    if !has("python3", "python3") {
        return;
    }
    let folder = folder("python");
    let input = file(&folder, "raw", &raw(&FRAMES));
    let (header, colours) = forms().swap_remove(0);
    let coloured = file(&folder, "y4m", &y4m(&FRAMES, &header, colours));
    // Debian's own interpreter is the one that has Debian's NumPy.
    let knows =
        |i: &&str| Command::new(i).args(["-c", "import numpy"]).output().is_ok_and(|o| o.status.success());
    let with = ["python3", "/usr/bin/python3"].into_iter().find(knows);
    missing(with.is_some(), "python3 with NumPy", "python3-numpy");
    for export in Export::all(&folder) {
        export.check("Python", &fed(&mut python("python3", false, &export.folder), &input), &FRAMES, 12);
        if let Some(with) = with {
            let printed = fed(python(with, true, &export.folder).arg("31"), &coloured);
            export.check("Python with NumPy", &printed, &FRAMES, 31);
        }
    }
}

#[test]
fn python_refuses_wrong_input() {
    if !has("python3", "python3") {
        return;
    }
    let folder = folder("python-wrong");
    let export = Export::varied(&folder);
    for (bytes, said) in wrong_inputs() {
        let input = file(&folder, "input", &bytes);
        let complaint = fails(&mut python("python3", true, &export.folder), 1, &input);
        assert!(complaint.contains(said), "{complaint} instead of {said}");
    }
    let input = file(&folder, "input", &raw(&FRAMES[..1]));
    for wrong in ["0", "321", "-1", "x", ""] {
        let complaint = fails(python("python3", true, &export.folder).arg(wrong), 2, &input);
        assert!(complaint.contains("1 to 320"), "{complaint}");
    }
    let complaint = fails(&mut python("python3", true, &folder), 2, &input);
    assert!(complaint.contains("no export named detector"), "{complaint}");
}

#[test]
fn rust_gives_the_librarys_bits() {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    if !has(&cargo, "cargo") {
        return;
    }
    let folder = folder("rust");
    let export = Export::varied(&folder);
    let manifest = examples().join("rust/Cargo.toml");
    let build = |detector: &Path| {
        let mut command = Command::new(&cargo);
        command.args(["build", "--release", "--offline", "--locked", "--manifest-path"]).arg(&manifest);
        command
            .arg("--target-dir")
            .arg(folder.join("target"))
            .env("DETECTOR_DIR", detector)
            .env("RUSTFLAGS", "-D warnings");
        command
    };
    run(&mut build(&export.folder));
    let program = folder.join("target/release/sonar");
    let pgm = |comment: &str| -> Vec<u8> {
        let header = format!("P5\n{comment}320 240\n255\n");
        FRAMES.iter().flat_map(|frame| [header.as_bytes(), frame.as_raw()].concat()).collect()
    };
    for (about, bytes) in
        [("raw", raw(&FRAMES)), ("PGM", pgm("")), ("PGM with a comment", pgm("# P5 1 1\n  # \n"))]
    {
        let input = file(&folder, "input", &bytes);
        for n in [12, 45] {
            let printed = fed(Command::new(&program).arg(n.to_string()), &input);
            let expected = export.rows(&FRAMES, &columns(n));
            let lines: Vec<Vec<f32>> = printed
                .lines()
                .map(|line| line.split(' ').map(|word| word.parse().expect("a number")).collect())
                .collect();
            let bits = |rows: &[Vec<f32>]| -> Vec<Vec<Option<u32>>> {
                let bits = |row: &f32| (!row.is_nan()).then_some(row.to_bits());
                rows.iter().map(|rows| rows.iter().map(bits).collect()).collect()
            };
            assert_eq!(bits(&lines), bits(&expected), "{about}");
        }
    }
    let sound = pgm("");
    let wrong = [
        (vec![], "there is no frame"),
        (raw(&FRAMES)[..76_801].to_vec(), "frame 1: the input ends before"),
        (sound[..sound.len() - 1].to_vec(), "frame 7: the input ends before"),
        (sound[..9].to_vec(), "frame 0: the input ends before"),
        ([&sound[..], b"P2"].concat(), "frame 8: this is not where a PGM begins"),
        (b"P5 640 480 255 ".to_vec(), "its width is 640, but the detector needs 320"),
        (b"P5 320 240 65535 ".to_vec(), "its greatest gray value is 65535"),
        (b"P5 99999999999999999999999 ".to_vec(), "too long"),
        (b"P5 wide ".to_vec(), "no number"),
    ];
    for (bytes, said) in wrong {
        let complaint = fails(&mut Command::new(&program), 1, &file(&folder, "input", &bytes));
        assert!(complaint.contains(said), "{complaint} instead of {said}");
    }
    for nowhere in [folder.clone(), folder.join("nowhere")] {
        let output = build(&nowhere).output().expect("cargo can be started");
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && complaint.contains("there is no"), "{complaint}");
    }
}

#[test]
fn cmake_builds_the_examples() {
    if !has("cmake", "cmake") || !has("cc", "gcc") || !has("make", "make") {
        return;
    }
    let folder = folder("cmake");
    let input = file(&folder, "input", &raw(&FRAMES));
    for export in Export::all(&folder).into_iter().skip(3) {
        let build = folder.join(format!("build {}", export.name));
        let mut configure = Command::new("cmake");
        configure
            .arg("-S")
            .arg(examples())
            .arg("-B")
            .arg(&build)
            .arg("-DCMAKE_C_FLAGS=-Wall -Wextra -Werror");
        // From where one stands, as one types it.
        run(configure.current_dir(&folder).arg(format!("-DDETECTOR_DIR={}", export.name)));
        run(Command::new("cmake").arg("--build").arg(&build));
        export.check("CMake", &fed(&mut Command::new(build.join("sonar")), &input), &FRAMES, 12);
        assert_eq!(build.join("laser_scan").exists(), export.ground.is_some(), "{}", export.name);
    }
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(examples()).arg("-B").arg(folder.join("none")).arg("-DDETECTOR_DIR=none");
    let output = configure.output().expect("it can be started");
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("there is no libdetector.a"));
}

#[test]
fn pkg_config_knows_how_to_link() {
    if !has("pkg-config", "pkg-config") || !has("cc", "gcc") {
        return;
    }
    let folder = folder("pkg-config");
    let export = Export::varied(&folder);
    let input = file(&folder, "input", &raw(&FRAMES));
    let here = examples().join("detector.pc");
    std::fs::copy(&here, export.folder.join("detector.pc")).expect("files can be copied");
    let ask = || {
        let mut command = Command::new("pkg-config");
        command.args(["--cflags", "--libs"]);
        command
    };
    let prefix = format!("--define-variable=prefix={}", export.folder.display());
    for (i, mut ask) in [ask(), ask()].into_iter().enumerate() {
        // Copied into the export, or pointed at it.
        if i == 0 {
            ask.arg("detector").env("PKG_CONFIG_PATH", &export.folder);
        } else {
            ask.arg(&prefix).arg(&here);
        }
        let flags = String::from_utf8(run(&mut ask).stdout).expect("UTF-8");
        let program = folder.join(format!("sonar{i}"));
        let mut cc = Command::new("cc");
        run(cc.arg(examples().join("sonar.c")).args(flags.split_whitespace()).arg("-o").arg(&program));
        export.check("pkg-config", &fed(&mut Command::new(&program), &input), &FRAMES, 12);
    }
}
