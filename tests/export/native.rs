//! Native code gives the reference evaluator's bits: object files for several processors, linked by the system's
//! compilers, and shared libraries; and it needs nothing from elsewhere.

use std::path::PathBuf;
use std::process::Command;

use vsonar::export::native::{Object, Target};
use vsonar::export::{archive, header, shared};

use crate::c::{fmrb, samples};
use crate::harness::{Sample, write};
use crate::tools::{Compiler, folder, has, run};

/// A target, the compiler that links for it, and what its tools' names begin with.
struct Variant {
    triple: &'static str,
    cpu: &'static str,
    compiler: Compiler,
    prefix: &'static str,
}

const HOST: Compiler = Compiler::native("gcc", &["-O1"]);
const AARCH64: Compiler = Compiler {
    command: "aarch64-linux-gnu-gcc",
    options: &["-O1"],
    emulator: &["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"],
};
const RISCV64: Compiler = Compiler {
    command: "riscv64-linux-gnu-gcc",
    options: &["-O1"],
    emulator: &["qemu-riscv64", "-cpu", "rv64,v=true", "-L", "/usr/riscv64-linux-gnu"],
};
const S390X: Compiler = Compiler {
    command: "s390x-linux-gnu-gcc",
    options: &["-O1"],
    emulator: &["qemu-s390x", "-L", "/usr/s390x-linux-gnu"],
};

/// Everything that can run here: this machine's levels, and other processors in an emulator.
fn variants() -> Vec<Variant> {
    let variant = |triple, cpu, compiler, prefix| Variant { triple, cpu, compiler, prefix };
    let mut out = vec![
        variant("aarch64-unknown-linux-gnu", "generic", AARCH64, "aarch64-linux-gnu-"),
        variant("riscv64gc-unknown-linux-gnu", "generic", RISCV64, "riscv64-linux-gnu-"),
        variant("riscv64gc-unknown-linux-gnu", "v", RISCV64, "riscv64-linux-gnu-"),
        variant("s390x-unknown-linux-gnu", "generic", S390X, "s390x-linux-gnu-"),
    ];
    #[cfg(target_arch = "x86_64")]
    for (cpu, runs) in [
        ("v1", true),
        ("v2", std::arch::is_x86_feature_detected!("sse4.2")),
        ("v3", std::arch::is_x86_feature_detected!("avx2")),
    ] {
        if runs {
            out.push(variant("x86_64-unknown-linux-gnu", cpu, HOST, ""));
        }
    }
    out
}

fn target(variant: &Variant) -> Target {
    Target::new(Some(variant.triple), Some(variant.cpu)).expect("a known target")
}

/// Compiles every detector of a sample to an object file.
fn objects(sample: &Sample, target: &Target, folder: &std::path::Path) -> Vec<PathBuf> {
    std::fs::create_dir_all(folder).expect("folders can be made");
    let compile = |(about, request): &(String, vsonar::export::Request)| {
        let object = Object::compile(request, target).unwrap_or_else(|e| panic!("{target}, {about}: {e}"));
        assert!(object.stack < 128 << 10, "{target}, {about}: {} bytes of stack", object.stack);
        let path = folder.join(format!("{}.o", request.symbol));
        std::fs::write(&path, object.bytes).expect("files can be written");
        path
    };
    sample.requests.iter().map(compile).collect()
}

/// Nothing is needed from elsewhere, and nothing is seen from outside but the interface.
fn check_symbols(prefix: &str, files: &[PathBuf]) {
    let listed = run(Command::new(format!("{prefix}nm")).arg("-g").args(files)).stdout;
    for line in
        String::from_utf8_lossy(&listed).lines().filter(|line| !line.is_empty() && !line.ends_with(':'))
    {
        let name = line.rsplit(' ').next().unwrap_or_default();
        let entry = ["detect", "ranges", "reset", "info"].iter().any(|e| name.ends_with(&format!("_{e}")));
        assert!(line.contains(" T ") && entry, "{prefix}: unexpected symbol {line:?}");
    }
}

/// Words of a big-endian machine as this one has them.
fn in_order(compiler: &Compiler, mut found: Vec<u8>) -> Vec<u8> {
    if compiler.emulator.contains(&"qemu-s390x") && cfg!(target_endian = "little") {
        found.as_chunks_mut::<4>().0.iter_mut().for_each(|word| word.reverse());
    }
    found
}

/// Links every object of a sample into a shared library of its own.
fn libraries(
    sample: &Sample,
    target: &Target,
    objects: &[PathBuf],
    folder: &std::path::Path,
) -> Vec<PathBuf> {
    let link = |((about, request), object): (&(String, vsonar::export::Request), &PathBuf)| {
        let object = std::fs::read(object).expect("a moment ago it was written");
        let exports: &[&str] = if request.camera.is_some() {
            &["detect", "ranges", "reset", "info"]
        } else {
            &["detect", "info"]
        };
        let library = shared::link(&request.symbol, &object, target, None, exports)
            .unwrap_or_else(|e| panic!("{target}, {about}: {e}"));
        let path = folder.join(shared::file_name(&request.symbol, target));
        std::fs::write(&path, library).expect("files can be written");
        path
    };
    sample.requests.iter().zip(objects).map(link).collect()
}

fn check(name: &str, sample: &Sample) {
    let expected = sample.expected();
    let files = sample.write(folder(name), 1);
    for variant in variants().iter().filter(|v| v.compiler.is_there()) {
        let start = std::time::Instant::now();
        let target = target(variant);
        let folder = files.folder.join(target.to_string().replace([' ', '(', ')'], "-"));
        let objects = objects(sample, &target, &folder);
        check_symbols(variant.prefix, &objects);
        let found = files.run_with(&variant.compiler, &objects, &folder);
        sample.compare(&variant.compiler, &expected, &in_order(&variant.compiler, found));
        println!("{name}, {target}: {:.1} s", start.elapsed().as_secs_f64());
    }
}

#[test]
fn shared_libraries_give_the_reference_bits() {
    if !HOST.is_there() || !has("ld", &["--version"]) {
        return;
    }
    let [sample, _] = samples();
    let files = sample.write(folder("native-shared"), 1);
    let target = Target::host();
    let objects = objects(&sample, &target, &files.folder);
    let libraries = libraries(&sample, &target, &objects, &files.folder);
    let undefined = run(Command::new("nm").args(["-D", "-u"]).args(&libraries)).stdout;
    let undefined = String::from_utf8_lossy(&undefined).into_owned();
    assert!(undefined.lines().all(|line| line.is_empty() || line.ends_with(':')), "{undefined}");
    let found = files.run_with(&HOST, &libraries, &files.folder.join("linked"));
    sample.compare(&HOST, &sample.expected(), &found);
}

#[test]
fn objects_give_the_reference_bits() {
    let [optimised, plain] = samples();
    check("native-optimised", &optimised);
    check("native-plain", &plain);
}

/// The published detector on whole images, at every column asked for and the widest spacing of tiles.
#[test]
fn the_published_detector_sees_the_same_natively() {
    check("native-fmrb", &fmrb());
}

/// The published detector as a shared library and out of an archive, under valgrind too.
#[test]
fn libraries_give_the_reference_bits() {
    if !HOST.is_there() || !has("ld", &["--version"]) {
        return;
    }
    let sample = fmrb();
    let expected = sample.expected();
    let files = sample.write(folder("libraries"), 1);
    let target = Target::host();
    let request = &sample.requests[0].1;
    let object = Object::compile(request, &target).expect("compiles");
    let exports = ["detect", "ranges", "reset", "info"];
    let library = shared::link(&request.symbol, &object.bytes, &target, None, &exports).expect("links");
    assert!(library.len() < 64 << 10, "{} bytes", library.len());
    let so = files.folder.join(shared::file_name(&request.symbol, &target));
    std::fs::write(&so, library).expect("files can be written");
    let undefined = run(Command::new("nm").args(["-D", "-u"]).arg(&so)).stdout;
    assert_eq!(String::from_utf8_lossy(&undefined), "");
    let a = files.folder.join("libfmrb.a");
    let bytes = archive::archive("fmrb", &object.bytes, &target).expect("an archive");
    std::fs::write(&a, bytes).expect("files can be written");

    sample.compare(&HOST, &expected, &files.run_with(&HOST, &[so], &files.folder.join("shared")));
    sample.compare(&HOST, &expected, &files.run_with(&HOST, &[a], &files.folder.join("static")));
    if has("valgrind", &["--version"]) {
        let program = files.folder.join("static/harness");
        let mut command = Command::new("valgrind");
        command.args(["--quiet", "--error-exitcode=9"]).arg(program);
        run(command.arg(files.folder.join("images")).arg(files.folder.join("answers")));
    }
}

/// The stack that the header states is what calls take at most, where frames have many pages and where they have few.
#[test]
fn no_more_stack_is_taken_than_stated() {
    const OPERANDS: &str = "raw median median-corner gradient moravec-horizontal moravec-vertical moravec-slash \
                            moravec-backslash";
    let names: Vec<&str> = OPERANDS.split(' ').collect();
    let sum =
        names.iter().fold("1".to_string(), |sum, name| format!("(+ (* {sum} 0.5) (+ {name} {name}-sq))"));
    let all = format!(
        "(individual (iterate-up 8x8 x-obstacle (set-a (max read-a {sum}))) \
         (iterate-down 8x8 iter2-a (prog2 (set-b (max read-b {sum})) (set-a (- read-b (* read-a 0.5))))))"
    );
    let few = "(individual (iterate-up 2x2 x-obstacle (set-a (+ read-a raw))))";
    for (number, source) in [all.as_str(), few].into_iter().enumerate() {
        let mut request = crate::interface::request("det", "", true);
        request.program =
            vsonar::ir::opt::optimise(&vsonar::lower::lower(&source.parse().expect("a program"), 64, 80));
        for variant in variants().iter().filter(|v| v.compiler.is_there()) {
            let target = target(variant);
            let folder = folder(&format!("stack-{number}-{}-{}", variant.triple, variant.cpu));
            let object = Object::compile(&request, &target).unwrap_or_else(|e| panic!("{target}: {e}"));
            assert_eq!(object.stack > 4096, number == 0, "{target}: {} bytes of stack", object.stack);
            write(&folder, "det.h", &header::header(&request, Some(object.stack)));
            std::fs::write(folder.join("det.o"), object.bytes).expect("files can be written");
            let source = write(&folder, "stack.c", include_str!("stack.c"));
            let program = folder.join("stack");
            let mut command = variant.compiler.command();
            command.arg("-fno-optimize-sibling-calls").arg(source).arg(folder.join("det.o"));
            run(command.arg("-o").arg(&program));
            run(&mut variant.compiler.runner(&program));
        }
    }
}

#[test]
fn a_missing_or_failing_linker_is_told() {
    let sample = fmrb();
    let request = &sample.requests[0].1;
    let target = Target::host();
    let link = |linker: &str| {
        let linker = std::path::Path::new(linker);
        shared::link(&request.symbol, b"no object", &target, Some(linker), &[])
            .expect_err("no library")
            .to_string()
    };
    let missing = link("no-such-linker-anywhere");
    assert!(missing.contains("no-such-linker-anywhere") && missing.contains("--emit"), "{missing}");
    let failing = link("false");
    assert!(failing.contains("false fails"), "{failing}");
}
