//! The interface: errors, state, what the detector says of itself, options that are refused, clean headers.

use std::path::Path;
use std::process::Command;

use vsonar::export::{Provenance, Request, Symbol, c, header};
use vsonar::ir::{opt, text};

use crate::c::CAMERA;
use crate::harness::write;
use crate::tools::{Compiler, folder, has, run};

/// Everything that a text can do to C.
const NASTY: &str = "(\"quoted\" \\ 'single' */ /* ??/ ??' ??) %d \t \u{1}\u{7f}) // é\u{2028}\u{202e}\u{1F916} \\\n???/\n\n*/*/end";

/// A program that multiplies and adds, with functions and operators of every kind.
pub(crate) fn request(name: &str, provenance: &str, median: bool) -> Request {
    let source = "(individual (iterate-up 5x5 (* x-obstacle 0.99) (set-a (+ (* read-a 0.5) (sin median))))
        (iterate-down 4x4 x-obstacle (prog3 (set-b (+ (* gradient y) (atan2 median-corner iter2-a)))
            (set-c (+ (* moravec-slash-sq 1.5) (tan read-b))) (set-a (+ (* read-a 0.5)
            (+ (* gradient 0.1) (min (cos read-c) (% median-corner read-b))))))))";
    let program = vsonar::lower::lower(&source.parse().expect("a program"), 48, 40);
    Request {
        symbol: Symbol::new(name).expect("an identifier"),
        program: opt::optimise(&program),
        provenance: Provenance {
            program: provenance.into(),
            data: Some("corridor \"??/\"".into()),
            seed: Some(u64::MAX),
            fitness: Some((391, 426)),
            size: None,
        },
        camera: Some(CAMERA),
        median,
    }
}

const GCC: Compiler = Compiler::native("gcc", &[]);

fn write_export(folder: &Path, request: &Request) {
    write(folder, &format!("{}.c", request.symbol), &c::source(request));
    write(folder, &format!("{}.h", request.symbol), &header::header(request, Some(12345)));
}

#[test]
fn errors_states_and_information() {
    if !GCC.is_there() {
        return;
    }
    let folder = folder("interface");
    let long = NASTY.repeat(200);
    for (i, (provenance, median)) in
        [(NASTY, true), (&long, false), ("", true), (&"x".repeat(4000), false)].into_iter().enumerate()
    {
        let request = request("det", provenance, median);
        write_export(&folder, &request);
        write(&folder, "driver.c", include_str!("driver.c"));
        let program = folder.join(format!("driver{i}"));
        let options = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1"];
        let files = ["driver.c", "det.c"].map(|name| folder.join(name));
        run(Command::new("gcc").args(options).arg("-I").arg(&folder).args(files).arg("-o").arg(&program));
        // The driver ends with the line of the check that failed, and else writes the texts down.
        let output = run(&mut Command::new(program));
        let expected = format!("{}\0{provenance}\0", request.provenance.data.as_deref().unwrap_or_default());
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    }
}

#[test]
fn arithmetic_options_are_refused() {
    let folder = folder("refused");
    write_export(&folder, &request("det", "", false));
    let x86: &[&[&str]] = if cfg!(target_arch = "x86_64") { &[&["-mfpmath=387"]] } else { &[] };
    let gcc: &[&[&str]] = &[
        &["-ffast-math"],
        &["-Ofast"],
        &["-O2", "-funsafe-math-optimizations"],
        &["-ffinite-math-only"],
        &["-fno-signed-zeros"],
        &["-freciprocal-math"],
    ];
    let clang: &[&[&str]] = &[&["-ffast-math"], &["-Ofast"], &["-ffinite-math-only"]];
    for (compiler, options) in
        [("gcc", [gcc, x86].concat()), ("clang", clang.to_vec()), ("g++", vec![&["-xc++"]])]
    {
        if !has(compiler, &["--version"]) {
            continue;
        }
        for options in options {
            let output = Command::new(compiler)
                .args(options)
                .args(["-c", "-o", "/dev/null"])
                .arg(folder.join("det.c"))
                .output()
                .expect("the compiler runs");
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(!output.status.success() && said.contains("#error"), "{compiler} {options:?}: {said}");
        }
    }
}

#[test]
fn nothing_is_contracted() {
    let folder = folder("contraction");
    let request = request("det", "", false);
    let source = c::source(&request);
    write(&folder, "det.c", &source);
    let bare: String =
        source.lines().filter(|line| !line.starts_with("#pragma")).map(|l| format!("{l}\n")).collect();
    write(&folder, "bare.c", &bare);
    if !cfg!(target_arch = "x86_64") {
        return;
    }
    let fused = |compiler: &str, options: &[&str], file: &str| {
        let mut command = Command::new(compiler);
        command.args(["-O3", "-mavx2", "-mfma", "-S", "-o", "-"]).args(options).arg(folder.join(file));
        String::from_utf8_lossy(&run(&mut command).stdout).lines().filter(|line| line.contains("vfm")).count()
    };
    if has("gcc", &["--version"]) {
        for options in
            [&[][..], &["-ffp-contract=fast"], &["-std=gnu17", "-ffp-contract=fast", "-flto=1", "-fno-lto"]]
        {
            assert_eq!(fused("gcc", options, "det.c"), 0, "gcc {options:?}");
        }
        assert!(
            fused("gcc", &[], "bare.c") > 3,
            "without the pragma GCC contracts, or this test says nothing"
        );
    }
    if has("clang", &["--version"]) {
        for options in [&[][..], &["-ffp-contract=on"]] {
            assert_eq!(fused("clang", options, "det.c"), 0, "clang {options:?}");
        }
    }
}

#[test]
fn header_and_source_are_clean() {
    let folder = folder("clean");
    for (name, median, camera) in [("one", true, true), ("two", false, true), ("three", false, false)] {
        let mut request = request(name, &NASTY.repeat(100), median);
        request.camera = request.camera.filter(|_| camera);
        write_export(&folder, &request);
        let user = format!(
            "#include \"{name}.h\"\n#include \"{name}.h\"\nint user(void) {{ return {name}_info()->abi - {}_ABI; }}\n",
            request.symbol.upper()
        );
        write(&folder, &format!("{name}_user.c"), &format!("int user(void);\n{user}"));
        write(&folder, &format!("{name}_user.cpp"), &user);
        write(
            &folder,
            &format!("{name}_twice.c"),
            &format!("#include \"{name}.h\"\n#include \"{name}.c\"\n#include \"{name}.h\"\n"),
        );
        let warnings = ["-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"];
        for (compiler, standards, files) in [
            ("gcc", &["c99", "c11", "gnu17"][..], &["_user.c", "_twice.c", ".c"][..]),
            ("clang", &["c99", "c11", "gnu17"], &["_user.c", "_twice.c", ".c"]),
            ("g++", &["c++98", "c++11", "c++17"], &["_user.cpp"]),
            ("clang++", &["c++98", "c++11", "c++17"], &["_user.cpp"]),
        ] {
            if !has(compiler, &["--version"]) {
                continue;
            }
            for standard in standards {
                let files = files.iter().map(|file| folder.join(format!("{name}{file}")));
                run(Command::new(compiler).arg(format!("-std={standard}")).args(warnings).args(files));
            }
        }
    }
}

#[test]
fn a_program_without_windows_is_clean_too() {
    let source = "vir 1\nimage 16x16\nloop 2 up 2x2\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  varying\n    \
                  v0 = const 3\n  next a v0\n";
    let mut request = request("flat", "", true);
    request.program = text::parse(source).expect("a program");
    let folder = folder("flat");
    write_export(&folder, &request);
    for compiler in ["gcc", "clang"] {
        if has(compiler, &["--version"]) {
            let options = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"];
            run(Command::new(compiler).args(options).arg(folder.join("flat.c")));
        }
    }
}
