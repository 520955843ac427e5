//! The commands of the examples' README, as they stand there.

use std::path::Path;
use std::process::Command;

use crate::tools::{examples, folder, has, run};

/// The code blocks of a shell.
fn blocks(text: &str) -> Vec<&str> {
    text.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default()).collect()
}

#[test]
fn the_commands_of_the_readme_are_true() {
    let needed = [
        ("ffmpeg", "ffmpeg"),
        ("cc", "gcc"),
        ("cmake", "cmake"),
        ("make", "make"),
        ("pkg-config", "pkg-config"),
        ("python3", "python3"),
        ("cargo", "cargo"),
    ];
    if needed.into_iter().filter(|(tool, package)| !has(tool, package)).count() > 0 {
        return;
    }
    let folder = folder("readme");
    let link = folder.join("examples");
    #[cfg(unix)]
    std::os::unix::fs::symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"), link)
        .expect("links can be made");
    // What `vsonar evolve` leaves behind.
    let program = folder.join("runs/fmrb-seed-1/best.gp");
    std::fs::create_dir_all(program.parent().expect("it has one")).expect("folders can be made");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/fmrb.gp"), program)
        .expect("it can be copied");

    let readme = std::fs::read_to_string(examples().join("README.md")).expect("there is one");
    let blocks = blocks(&readme);
    assert_eq!(blocks.len(), 2, "the second needs a video and a camera");
    let own = Path::new(env!("CARGO_BIN_EXE_vsonar")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let mut shell = Command::new("sh");
    shell.arg("-ec").arg(blocks[0]).current_dir(&folder);
    shell.env("PATH", format!("{}:{path}", own.display())).env("CARGO_TARGET_DIR", folder.join("target"));
    let printed = String::from_utf8(run(&mut shell).stdout).expect("UTF-8");

    let json: Vec<&str> = printed.lines().filter(|line| line.starts_with("{\"frame\": ")).collect();
    assert_eq!(json.len(), 120, "C and Python have printed every frame: {printed}");
    assert_eq!(json[..60], json[60..], "and the same");
    assert_eq!(printed.matches("\nintensities: []\n---\n").count(), 60);
    // The rows of Rust: six numbers a line.
    let rows = printed
        .lines()
        .filter(|line| line.split(' ').filter(|word| word.parse::<f32>().is_ok()).count() == 6);
    assert_eq!(rows.count(), 60);
    for product in ["sonar", "build/sonar", "build/laser_scan"] {
        assert!(folder.join(product).exists(), "{product}");
    }
    // The second block is the program on a pipe, of a video that is made here.
    let video =
        "ffmpeg -v error -y -framerate 5 -i corridor/images/corridor_%04d.png -c:v mjpeg -q:v 2 drive.avi\n";
    let pipe = blocks[1].lines().next().expect("a command").replace("drive.mp4", "drive.avi");
    let mut shell = Command::new("sh");
    shell.arg("-ec").arg(format!("{video}{pipe}")).current_dir(&folder);
    let printed = String::from_utf8(run(&mut shell).stdout).expect("UTF-8");
    assert_eq!(printed.lines().count(), 60);
}
