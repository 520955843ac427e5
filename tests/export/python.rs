//! The Python binding, with NumPy and without it, over a library that is compiled from the C form.

use std::process::Command;

use vsonar::export::{Request, c, python};
use vsonar::ir::reference;
use vsonar::vision::WindowSums;

use crate::common;
use crate::harness::write;
use crate::interface::request;
use crate::tools::{folder, has, run};

/// Interpreters that are tried, and whether they leave out what is installed beside the standard library.
const INTERPRETERS: [(&str, &[&str]); 3] =
    [("python3", &["-S", "-E"]), ("python3", &[]), ("/usr/bin/python3", &[])];

#[test]
fn the_binding_gives_the_reference_bits() {
    if !has("gcc", &["--version"]) || !has("python3", &["--version"]) {
        return;
    }
    let numpy = INTERPRETERS.iter().rev().find(|(command, options)| {
        let output = Command::new(command).args(*options).args(["-c", "import numpy"]).output();
        output.is_ok_and(|output| output.status.success())
    });
    if numpy.is_none() {
        let required = std::env::var_os("VSONAR_REQUIRE_TOOLS").is_some();
        assert!(!required, "no Python has NumPy, but VSONAR_REQUIRE_TOOLS is set");
        eprintln!("skipped: no Python has NumPy");
    }
    let mut random = vsonar::ir::generate::Random::new(43_000);
    for median in [false, true] {
        let folder = folder(&format!("python{}", u8::from(median)));
        let request = request("det", "(\"program\" */ é)", median);
        let (width, height) = (request.program.width(), request.program.height());
        let image = common::image(&mut random, width, height);
        let sums = WindowSums::new(&image);
        let rows: Vec<String> = (0..width)
            .map(|x| reference::answer(&request.program, &sums, x as f32).to_bits().to_string())
            .collect();
        let source = write(&folder, "det.c", &c::source(&request));
        write(&folder, "det.py", &python::python(&request));
        std::fs::write(folder.join("pixels"), image.as_raw()).expect("files can be written");
        write(&folder, "rows", &rows.join(" "));
        let script = write(&folder, "check.py", include_str!("check.py"));
        let library = folder.join(if cfg!(target_os = "macos") { "libdet.dylib" } else { "libdet.so" });
        run(Command::new("gcc").args(["-O2", "-shared", "-fPIC"]).arg(source).arg("-o").arg(library));
        for (command, options) in [&INTERPRETERS[0]].into_iter().chain(numpy) {
            run(Command::new(command).args(*options).arg(&script).arg(if options.is_empty() {
                "numpy"
            } else {
                ""
            }));
        }
    }
}

#[test]
fn what_needs_a_camera_is_told_to_need_one() {
    if !has("gcc", &["--version"]) || !has("python3", &["--version"]) {
        return;
    }
    let folder = folder("python-rows");
    let request = Request { camera: None, ..request("det", "", false) };
    let source = write(&folder, "det.c", &c::source(&request));
    write(&folder, "det.py", &python::python(&request));
    let script = write(&folder, "check_rows.py", include_str!("check_rows.py"));
    let library = folder.join(if cfg!(target_os = "macos") { "libdet.dylib" } else { "libdet.so" });
    run(Command::new("gcc").args(["-O2", "-shared", "-fPIC"]).arg(source).arg("-o").arg(library));
    run(Command::new("python3").args(["-S", "-E"]).arg(script));
}
