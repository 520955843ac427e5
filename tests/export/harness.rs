//! Exported C run on images: a program in C that reads images, calls every exported function, and writes down what
//! they give; and what they must give, from the reference evaluator.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use image::GrayImage;
use vsonar::camera::ground::{Ground, median_of_three};
use vsonar::export::{Request, c, header};
use vsonar::ir::machine::Scalar;
use vsonar::ir::reference;
use vsonar::vision::WindowSums;

use crate::common::same;
use crate::tools::{Compiler, in_parallel, run};

/// Images of one size.
#[derive(Clone)]
pub(crate) struct Images {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) images: Vec<GrayImage>,
}

/// Detectors, each with what tells where it comes from, and images for them.
pub(crate) struct Sample {
    pub(crate) requests: Vec<(String, Request)>,
    pub(crate) images: Vec<Images>,
    /// Every so many columns are asked for.
    pub(crate) column_step: usize,
}

/// A sample's files: the detectors in some translation units, the harness, the images.
pub(crate) struct Files {
    pub(crate) folder: PathBuf,
    units: Vec<String>,
}

const HARNESS: &str = include_str!("harness.c");

impl Sample {
    fn images_of(&self, request: &Request) -> usize {
        let size = (request.program.width(), request.program.height());
        self.images.iter().position(|i| (i.width, i.height) == size).expect("there are images for it")
    }

    fn columns(&self, images: &Images) -> Vec<u32> {
        (0..images.width).step_by(self.column_step).collect()
    }

    /// What the harness must write: for each detector and image the rows of all columns, then the same with ranges.
    pub(crate) fn expected(&self) -> Vec<Vec<f32>> {
        let sums: Vec<Vec<WindowSums>> =
            self.images.iter().map(|set| set.images.iter().map(WindowSums::new).collect()).collect();
        let expected = self.requests.iter().map(|(_, request)| {
            let index = self.images_of(request);
            let columns = self.columns(&self.images[index]);
            let answer = |sums: &WindowSums, x: u32| reference::answer(&request.program, sums, x as f32);
            let rows: Vec<Vec<f32>> =
                sums[index].iter().map(|sums| columns.iter().map(|&x| answer(sums, x)).collect()).collect();
            let mut out = rows.concat();
            if request.camera.is_some() {
                out.extend(ranges(request, &columns, &rows));
            }
            out
        });
        expected.collect()
    }

    /// Writes the files, the detectors in so many units.
    pub(crate) fn write(&self, folder: PathBuf, units: usize) -> Files {
        let mut headers = String::new();
        let mut table = String::new();
        let mut sources = vec![String::new(); units];
        for (i, (_, request)) in self.requests.iter().enumerate() {
            sources[i % units].push_str(&c::source(request));
            headers.push_str(&header::header(request, None));
            let (name, up) = (request.symbol.as_str(), request.symbol.upper());
            let _ = writeln!(table, "DETECTOR({name}, {up}, {})", self.images_of(request));
        }
        let mut sizes = String::new();
        let mut pixels = Vec::new();
        for set in &self.images {
            let _ = writeln!(sizes, "{{{}, {}, {}}},", set.width, set.height, set.images.len());
            set.images.iter().for_each(|image| pixels.extend_from_slice(image.as_raw()));
        }
        let wrappers: String = self
            .requests
            .iter()
            .map(|(_, request)| {
                let name = request.symbol.as_str();
                match request.camera {
                    Some(_) => format!("WITH_RANGES({name}, {})\n", request.symbol.upper()),
                    None => format!("WITHOUT_RANGES({name})\n"),
                }
            })
            .collect();
        let harness = HARNESS
            .replace("/*HEADERS*/", "#include \"all.h\"")
            .replace("/*WRAPPERS*/", &wrappers)
            .replace("/*DETECTORS*/", &table)
            .replace("/*SIZES*/", &sizes)
            .replace("/*STEP*/", &self.column_step.to_string());
        std::fs::write(folder.join("all.h"), headers).expect("files can be written");
        std::fs::write(folder.join("harness.c"), harness).expect("files can be written");
        std::fs::write(folder.join("images"), pixels).expect("files can be written");
        let mut names = vec!["harness".to_string()];
        for (i, source) in sources.iter().enumerate() {
            names.push(format!("unit{i}"));
            std::fs::write(folder.join(format!("unit{i}.c")), source).expect("files can be written");
        }
        Files { folder, units: names }
    }

    /// Of a detector's values the rows that it finds, without the ranges.
    pub(crate) fn rows<'v>(&self, detector: usize, values: &'v [f32]) -> &'v [f32] {
        let images = &self.images[self.images_of(&self.requests[detector].1)];
        &values[..images.images.len() * self.columns(images).len()]
    }

    /// Compares what a harness wrote.
    pub(crate) fn compare(&self, compiler: &Compiler, expected: &[Vec<f32>], found: &[u8]) {
        let mut words = found.as_chunks::<4>().0.iter().map(|bytes| f32::from_ne_bytes(*bytes));
        for ((about, request), expected) in self.requests.iter().zip(expected) {
            for (i, &wanted) in expected.iter().enumerate() {
                let word = words.next().unwrap_or_else(|| panic!("{compiler}: the output ends too soon"));
                assert!(
                    same(word, wanted),
                    "{compiler}, {about}, value {i} of {}: {word:e} ({:#x}) instead of {wanted:e} ({:#x})\n{}",
                    expected.len(),
                    word.to_bits(),
                    wanted.to_bits(),
                    request.program
                );
            }
        }
        assert!(words.next().is_none(), "{compiler}: the output is too long");
    }
}

/// The six words of each range, image after image.
fn ranges(request: &Request, columns: &[u32], rows: &[Vec<f32>]) -> Vec<f32> {
    let camera = request.camera.as_ref().expect("there is a camera");
    let ground = Ground::new(camera, request.program.width(), request.program.height());
    let mut state = vec![[f32::NAN; 2]; columns.len()];
    let mut out = Vec::new();
    for rows in rows {
        for ((&row, &x), state) in rows.iter().zip(columns).zip(&mut state) {
            let mut believed = row;
            if request.median {
                believed = median_of_three(&mut Scalar, row, state[0], state[1]);
                *state = [row, state[0]];
            }
            let range = ground.range(&mut Scalar, x as f32, believed);
            out.extend([believed, range.bearing, range.distance, range.nearest, range.farthest]);
            out.push(f32::from_bits(range.status.cast_unsigned()));
        }
    }
    out
}

impl Files {
    /// Compiles the files and runs the harness; what it wrote.
    pub(crate) fn run(&self, compiler: &Compiler) -> Vec<u8> {
        let folder = self.folder.join(file_name(compiler));
        std::fs::create_dir_all(&folder).expect("folders can be made");
        in_parallel(&self.units, |unit| {
            let source = self.folder.join(format!("{unit}.c"));
            run(compiler.command().arg("-c").arg(source).arg("-o").arg(folder.join(format!("{unit}.o"))));
        });
        let program = folder.join("harness");
        let objects = self.units.iter().map(|unit| folder.join(format!("{unit}.o")));
        run(compiler.command().args(objects).arg("-o").arg(&program));
        let output = folder.join("answers");
        run(compiler.runner(&program).arg(self.folder.join("images")).arg(&output));
        std::fs::read(output).expect("the harness wrote it")
    }

    /// Compiles the harness alone, links it with detectors that are compiled already, and runs it in `folder`; what
    /// it wrote.
    pub(crate) fn run_with(&self, compiler: &Compiler, detectors: &[PathBuf], folder: &Path) -> Vec<u8> {
        std::fs::create_dir_all(folder).expect("folders can be made");
        let program = folder.join("harness");
        let mut command = compiler.command();
        command.arg(self.folder.join("harness.c")).args(detectors).arg("-o").arg(&program);
        run(command.arg(format!("-Wl,-rpath,{}", self.folder.display())));
        let output = folder.join("answers");
        run(compiler.runner(&program).arg(self.folder.join("images")).arg(&output));
        std::fs::read(output).expect("the harness wrote it")
    }

    /// Checks that the compiled detectors need nothing from elsewhere, and export what the interface says.
    pub(crate) fn check_symbols(&self, compiler: &Compiler) {
        const ENTRIES: [&str; 4] = ["detect", "ranges", "reset", "info"];
        for unit in self.units.iter().filter(|unit| *unit != "harness") {
            let object = self.folder.join(file_name(compiler)).join(format!("{unit}.o"));
            let symbols = run(Command::new("nm").arg("-g").arg(object)).stdout;
            for line in String::from_utf8_lossy(&symbols).lines() {
                let name = line.rsplit(' ').next().unwrap_or_default();
                let expected =
                    line.contains(" T ") && ENTRIES.iter().any(|e| name.ends_with(&format!("_{e}")));
                assert!(expected, "{compiler}, {unit}: unexpected symbol {line:?}");
            }
        }
    }
}

/// A compiler's name for files.
fn file_name(compiler: &Compiler) -> String {
    compiler.to_string().replace(|c: char| !c.is_ascii_alphanumeric(), "_")
}

/// Writes a source file.
pub(crate) fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("files can be written");
    path
}
