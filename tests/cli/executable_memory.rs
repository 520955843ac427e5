//! A system that refuses executable memory, as hardened ones do: programs are interpreted, with the same answers.
#![cfg(target_os = "linux")]

use std::os::unix::process::CommandExt;
use std::process::{Command, Output};

use serde_json::Value;

use crate::common::*;

/// Fractional answers, and some that are no number.
const PROGRAM: &str = "(individual (iterate-up 3x3 x-obstacle (if-le gradient 30 read-a
    (prog2 (set-a (if-le x-obstacle 20 (* 1e30 1e30) (* y 1.1))) break))))";

const NOTE: &str =
    "note: the program is interpreted, with the same answers, only slower: no executable memory: ";

fn place() -> Place {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    place
}

/// Has the system refuse to make memory of the command's process executable that was not so when it was mapped.
fn refuse_executable_memory(command: &mut Command) {
    let [load, jump_equal, jump_set, end] = [
        libc::BPF_LD | libc::BPF_W | libc::BPF_ABS,
        libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K,
        libc::BPF_JMP | libc::BPF_JSET | libc::BPF_K,
        libc::BPF_RET | libc::BPF_K,
    ]
    .map(|code| code as u16);
    // The number of the call, and the lower half of its third argument, in the kernel's `struct seccomp_data`.
    let (number, protection) = (0, if cfg!(target_endian = "little") { 32 } else { 36 });
    let filter = |code, jt, jf, k| libc::sock_filter { code, jt, jf, k };
    let mut filters = [
        filter(load, 0, 0, number),
        filter(jump_equal, 0, 3, libc::SYS_mprotect as u32),
        filter(load, 0, 0, protection),
        filter(jump_set, 0, 1, libc::PROT_EXEC.cast_unsigned()),
        filter(end, 0, 0, libc::SECCOMP_RET_ERRNO | libc::EACCES.cast_unsigned()),
        filter(end, 0, 0, libc::SECCOMP_RET_ALLOW),
    ];
    let (none, one): (libc::c_ulong, libc::c_ulong) = (0, 1);
    let filters_mode = libc::c_ulong::from(libc::SECCOMP_MODE_FILTER);
    let set = move || {
        let program = libc::sock_fprog { len: filters.len() as u16, filter: filters.as_mut_ptr() };
        // SAFETY: the calls read the filters, which are alive, and concern the process that is to become the command.
        let done = unsafe {
            libc::prctl(libc::PR_SET_NO_NEW_PRIVS, one, none, none, none) == 0
                && libc::prctl(libc::PR_SET_SECCOMP, filters_mode, &raw const program) == 0
        };
        if done { Ok(()) } else { Err(std::io::Error::last_os_error()) }
    };
    // SAFETY: between fork and exec there are system calls alone.
    unsafe { command.pre_exec(set) };
}

fn refused(place: &Place, arguments: &[&str]) -> Output {
    let mut command = place.command(arguments);
    refuse_executable_memory(&mut command);
    command.output().expect("the command can be started, and filters are there")
}

/// What a command prints that does what it is asked and notes once that the program is interpreted; nothing else, if
/// `alone`.
fn interpreted(place: &Place, arguments: &[&str], alone: bool) -> String {
    let output = refused(place, arguments);
    let complaint = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(output.status.success(), "{arguments:?}: {:?}: {complaint}", output.status);
    let notes = complaint.lines().filter(|line| line.starts_with(NOTE)).count();
    assert_eq!(notes, 1, "{arguments:?}: {complaint}");
    assert!(!alone || complaint.lines().count() == 1, "{arguments:?}: {complaint}");
    assert!(!complaint.contains("--emit") && !complaint.contains("panicked"), "{complaint}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Lines of JSON without the times it took.
fn untimed(text: &str) -> Vec<Value> {
    fn clear(value: &mut Value) {
        match value {
            Value::Object(fields) => {
                fields.retain(|name, _| !["latency_us", "timing"].contains(&name.as_str()));
                fields.values_mut().for_each(clear);
            }
            Value::Array(values) => values.iter_mut().for_each(clear),
            _ => {}
        }
    }
    let lines = serde_json::Deserializer::from_str(text).into_iter::<Value>();
    lines.map(|line| line.expect("JSON")).map(|mut line| (clear(&mut line), line).1).collect()
}

#[test]
fn run_gives_the_same_rows() {
    let place = place();
    let run = ["run", "p.gp", "--input", "data", "--fps", "10"];
    let quiet = [&run[..], &["--quiet"]].concat();
    let compiled = untimed(&place.ok(&quiet));
    assert!(compiled.len() == 6 && compiled.iter().any(|line| line["rows"][0].is_null()), "{compiled:?}");
    assert_eq!(untimed(&interpreted(&place, &run, false)), compiled);
    let output = refused(&place, &quiet);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    assert_eq!(untimed(&String::from_utf8_lossy(&output.stdout)), compiled);
}

#[test]
fn explain_and_drive_tell_the_same() {
    let place = place();
    let explain = ["explain", "p.gp", "--data", "data"];
    let compiled = place.ok(&explain);
    assert!(compiled.contains("as the compiled"), "{compiled}");
    let words = |text: &str| text.split_whitespace().map(str::to_string).collect::<Vec<_>>();
    let told = interpreted(&place, &explain, true);
    assert_eq!(words(&told.replace("as the interpreted", "as the compiled")), words(&compiled));
    let drive = ["drive", "p.gp", "--minutes", "0.01", "--runs", "2", "--json"];
    assert_eq!(
        untimed(&interpreted(&place, &drive, false)),
        untimed(&place.ok(&[&drive[..], &["--quiet"]].concat()))
    );
}

#[test]
fn an_executor_that_compiles_is_refused_with_another_that_serves() {
    let place = place();
    let evolve =
        ["evolve", "--data", "data", "--out", "r", "--population", "20", "--generations", "2", "--seed", "3"];
    for executor in ["cranelift", "cranelift-scalar"] {
        let eval = ["eval", "p.gp", "--data", "data"];
        for command in [&evolve[..], &eval[..]] {
            let complaint = one_error(&refused(&place, &[command, &["--executor", executor]].concat()), 1);
            assert!(complaint.contains("no executable memory"), "{complaint}");
            assert!(complaint.contains("choose `--executor batch`"), "{complaint}");
            assert!(!complaint.contains("tree") && !complaint.contains("--emit"), "{complaint}");
        }
    }
    assert!(!place.path("r").exists());
    // What chooses for itself goes on with what needs no compiling.
    let output = refused(&place, &evolve);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let best = place.read("r/best.gp");
    std::fs::remove_dir_all(place.path("r")).expect("it was there");
    assert!(place.command(&evolve).output().expect("started").status.success());
    assert_eq!(best, place.read("r/best.gp"));
    let report = refused(&place, &["report", "r", "--no-rivals"]);
    let complaint = String::from_utf8_lossy(&report.stderr);
    assert!(report.status.success() && complaint.matches(NOTE).count() == 1, "{complaint}");
}

/// Names of compiled programs, for `perf`: the hash of the program and which of its functions it is.
#[test]
fn profiles_name_programs_and_their_loops() {
    let place = place();
    let commands: [&[&str]; 2] = [
        &["eval", "p.gp", "--data", "data", "--executor", "cranelift", "--json"],
        &["run", "p.gp", "--input", "data", "--quiet"],
    ];
    let mut hashes = Vec::new();
    for (arguments, function) in commands.into_iter().zip(["tree2_loop", "rows"]) {
        let child = place
            .command(arguments)
            .env("PERF_BUILDID_DIR", place.path("buildid"))
            .stdout(std::process::Stdio::null())
            .spawn()
            .expect("the command can be started");
        let map = format!("/tmp/perf-{}.map", child.id());
        assert!(child.wait_with_output().expect("it ends").status.success());
        let text = std::fs::read_to_string(&map).expect("the names of functions");
        std::fs::remove_file(&map).expect("it is there");
        let names = text.lines().filter_map(|line| line.split_whitespace().nth(2));
        let (hash, _) = names
            .filter_map(|name| name.strip_prefix("vsonar_")?.split_once('_'))
            .find(|(hash, end)| hash.len() == 16 && *end == function)
            .unwrap_or_else(|| panic!("{function}: {text}"));
        assert!(hash.bytes().all(|byte| byte.is_ascii_hexdigit()), "{hash}");
        hashes.push(hash.to_string());
    }
    assert_eq!(hashes[0], hashes[1], "the same program for images of the same size");
}
