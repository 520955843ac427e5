//! A shared library, through the system's linker.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::Symbol;
use super::native::Target;
use crate::support::printable::ShownPath as _;
use crate::support::temporary::{self, TemporaryFolder};

/// Why there is no shared library.
#[derive(Debug, thiserror::Error)]
pub enum SharedError {
    /// No linker was found.
    #[error(
        "no linker for {target}: tried {tried}; install one of them ({hint}), name another with `--linker`, or leave \
         `shared` and `python` out of `--emit`"
    )]
    NoLinker {
        /// What is linked for.
        target: String,
        /// The programs tried.
        tried: String,
        /// A package that has one.
        hint: String,
    },
    /// The linker fails.
    #[error("the linker {linker} fails ({status}): {message}")]
    Failed {
        /// The program.
        linker: String,
        /// How it ended.
        status: String,
        /// What it said.
        message: String,
    },
    /// The linker cannot be started.
    #[error("cannot start the linker {linker}: {source}; name another with `--linker`")]
    Start {
        /// The program.
        linker: String,
        /// What went wrong.
        source: io::Error,
    },
    /// A file for it or of it.
    #[error("cannot hand {} to the linker: {source}; make room in the folder for temporary files, or set TMPDIR", path.shown())]
    File {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        source: io::Error,
    },
}

/// The name of the shared library's file.
pub fn file_name(symbol: &Symbol, target: &Target) -> String {
    if target.is_windows() {
        format!("{symbol}.dll")
    } else if target.is_apple() {
        format!("lib{symbol}.dylib")
    } else {
        format!("lib{symbol}.so")
    }
}

/// How a linker is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flavour {
    /// Like GNU ld.
    Elf,
    /// Like GNU ld, through a compiler.
    ElfCompiler,
    /// Through Apple's compiler, or one that works like it.
    AppleCompiler,
    /// LLVM's linker for Apple's files.
    Apple,
    /// Microsoft's.
    Windows,
}

/// The linkers to try, in turn.
fn candidates(target: &Target) -> Vec<(String, Flavour)> {
    let named = |names: &[&str], flavour| -> Vec<(String, Flavour)> {
        names.iter().map(|name| ((*name).to_string(), flavour)).collect()
    };
    if target.is_windows() {
        return named(&["lld-link", "link.exe"], Flavour::Windows);
    }
    if target.is_apple() {
        let own = if target.is_host() { named(&["cc"], Flavour::AppleCompiler) } else { Vec::new() };
        return [own, named(&["ld64.lld"], Flavour::Apple)].concat();
    }
    let prefix = format!("{}-linux-gnu-", target.processor());
    let mut out = named(&[&format!("{prefix}ld")], Flavour::Elf);
    if target.is_host() {
        out = [named(&["ld"], Flavour::Elf), out, named(&["cc"], Flavour::ElfCompiler)].concat();
    }
    out.extend(named(&[&format!("{prefix}gcc")], Flavour::ElfCompiler));
    out.extend(named(&["ld.lld"], Flavour::Elf));
    out
}

/// The flavour of a linker that the user names.
fn flavour_of(linker: &Path, target: &Target) -> Flavour {
    let name = linker.file_name().unwrap_or_default().to_string_lossy();
    let compiler =
        ["cc", "gcc", "clang", "c++", "g++"].iter().any(|c| name.contains(c)) && !name.contains("ld");
    match (target.is_windows(), target.is_apple(), compiler) {
        (true, _, _) => Flavour::Windows,
        (_, true, true) => Flavour::AppleCompiler,
        (_, true, false) => Flavour::Apple,
        (_, _, true) => Flavour::ElfCompiler,
        (_, _, false) => Flavour::Elf,
    }
}

fn arguments(
    flavour: Flavour,
    symbol: &Symbol,
    target: &Target,
    exports: &[&str],
    [object, out]: [&Path; 2],
) -> Vec<OsString> {
    let leaf = file_name(symbol, target);
    let mut words: Vec<OsString> = Vec::new();
    let mut add = |text: &[&str]| words.extend(text.iter().map(OsString::from));
    match flavour {
        Flavour::Elf => {
            // What the loader relocates is the addresses of four texts: not worth pages of their own.
            add(&["-shared", "-soname", &leaf, "-z", "noexecstack", "-z", "norelro", "--no-undefined", "-o"]);
        }
        Flavour::ElfCompiler => {
            add(&["-shared", "-nostdlib", &format!("-Wl,-soname,{leaf}"), "-Wl,-z,noexecstack,-z,norelro"]);
            add(&["-Wl,--no-undefined", "-o"]);
        }
        Flavour::AppleCompiler => add(&["-dynamiclib", "-install_name", &format!("@rpath/{leaf}"), "-o"]),
        Flavour::Apple => {
            let processor = if target.processor() == "aarch64" { "arm64" } else { "x86_64" };
            add(&["-dylib", "-arch", processor, "-platform_version", "macos", "11.0", "11.0"]);
            add(&["-install_name", &format!("@rpath/{leaf}"), "-o"]);
        }
        Flavour::Windows => {
            add(&["/dll", "/noentry", "/nodefaultlib", "/nologo"]);
            for suffix in exports {
                add(&[&format!("/export:{symbol}_{suffix}")]);
            }
            let mut option = OsString::from("/out:");
            option.push(out);
            words.push(option);
        }
    }
    if flavour != Flavour::Windows {
        words.push(out.into());
    }
    words.push(object.into());
    words
}

/// Links an object file, whose functions `NAME_` and one of `exports` are seen from outside. `linker` names the program to use; without it the usual ones are tried in turn.
///
/// # Errors
/// If there is no linker, or it fails.
pub fn link(
    symbol: &Symbol,
    object: &[u8],
    target: &Target,
    linker: Option<&Path>,
    exports: &[&str],
) -> Result<Vec<u8>, SharedError> {
    // What a process that was killed has left there goes.
    let place = std::env::temp_dir().join("vsonar-link");
    temporary::clear(&place);
    let scratch = TemporaryFolder::beside(&place);
    let file = |path: &Path| {
        let path = path.to_path_buf();
        move |source| SharedError::File { path, source }
    };
    let scratch = scratch.map_err(file(&std::env::temp_dir()))?;
    let input = scratch.path().join(format!("{symbol}.o"));
    let output = scratch.path().join(file_name(symbol, target));
    std::fs::write(&input, object).map_err(file(&input))?;
    let tried: Vec<(String, Flavour)> = match linker {
        Some(path) => vec![(path.display().to_string(), flavour_of(path, target))],
        None => candidates(target),
    };
    for (program, flavour) in &tried {
        let words = arguments(*flavour, symbol, target, exports, [&input, &output]);
        match Command::new(program).args(words).output() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(source) => return Err(SharedError::Start { linker: program.clone(), source }),
            Ok(done) if done.status.success() && output.exists() => {
                return std::fs::read(&output).map_err(file(&output));
            }
            Ok(done) => return Err(failed(program, &done)),
        }
    }
    let names: Vec<&str> = tried.iter().map(|(name, _)| name.as_str()).collect();
    let processor = target.processor().replace('_', "-");
    let hint = if target.is_windows() || target.is_apple() {
        "Debian's package lld".to_string()
    } else {
        format!("Debian's package binutils-{processor}-linux-gnu or lld")
    };
    Err(SharedError::NoLinker { target: target.triple(), tried: names.join(", "), hint })
}

fn failed(program: &str, done: &Output) -> SharedError {
    let said = [&done.stderr, &done.stdout].map(|bytes| String::from_utf8_lossy(bytes).trim().to_string());
    let mut message = said.into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join("; ");
    if message.is_empty() {
        message = "it said nothing, and there is no library; name another with `--linker`".to_string();
    }
    SharedError::Failed { linker: program.to_string(), status: done.status.to_string(), message }
}
