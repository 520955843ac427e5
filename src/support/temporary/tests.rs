//! Tests of files and folders beside their place.

use super::*;
use std::io::Write;

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("readable");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn file(path: &Path) -> TemporaryFile {
    TemporaryFile::beside(path, &Access::Ordinary).expect("writable")
}

#[test]
fn a_file_is_placed_or_removed() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("file");
    let mut new = file(&path);
    new.file().write_all(b"one").expect("writable");
    assert!(names(dir.path())[0].starts_with(".file.") && !path.exists());
    new.replace(&path).expect("writable");
    assert_eq!(names(dir.path()), ["file"]);
    // Not over what is there, unless that is asked for.
    assert_eq!(file(&path).place_new(&path).expect_err("there").kind(), io::ErrorKind::AlreadyExists);
    drop(file(&path));
    assert_eq!(
        (names(dir.path()), fs::read(&path).expect("there")),
        (vec!["file".to_string()], b"one".to_vec())
    );
    file(&path).replace(&path).expect("writable");
    assert_eq!(fs::read(&path).expect("there"), b"");
    file(&path).place_new(&dir.path().join("another")).expect("free");
    assert_eq!(names(dir.path()), ["another", "file"]);
}

#[test]
fn a_folder_is_placed_or_removed() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("folder");
    let new = TemporaryFolder::beside(&path).expect("writable");
    fs::write(new.path().join("file"), "").expect("writable");
    drop(new);
    assert_eq!(names(dir.path()), [""; 0]);
    let new = TemporaryFolder::beside(&path).expect("writable");
    fs::write(new.path().join("file"), "").expect("writable");
    new.place(&path).expect("free");
    assert_eq!(names(&path), ["file"]);
    let new = TemporaryFolder::beside(&path).expect("writable");
    assert!(new.place(&path).is_err(), "what is there is not replaced");
    assert_eq!(names(dir.path()), ["folder"]);
}

#[test]
fn names_differ_and_fit() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for leaf in ["file".to_string(), "x".repeat(255), "é".repeat(127), format!("x{}", "é".repeat(127))] {
        let path = dir.path().join(&leaf);
        let [one, another] = [file(&path), file(&path)];
        assert_ne!(one.file.path(), another.file.path());
        one.replace(&path).expect("writable");
        drop(another);
        fs::remove_file(&path).expect("there");
    }
    for path in ["/", "..", ""] {
        assert!(TemporaryFile::beside(Path::new(path), &Access::Ordinary).is_err());
        assert!(TemporaryFolder::beside(Path::new(path)).is_err());
    }
}

#[test]
fn leftovers_are_removed_and_nothing_else() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| dir.path().join(name);
    // As a process leaves it that is killed.
    let left = ["0123456789abcdef", "fedcba9876543210"];
    let long = "x".repeat(255);
    for digits in left {
        fs::write(at(&format!(".file.{digits}.tmp")), "half").expect("writable");
        fs::create_dir_all(at(&format!(".file.{digits}.part/images"))).expect("writable");
        fs::write(at(&format!(".{}.{digits}.tmp", &long[..STEM])), "half").expect("writable");
    }
    let foreign = [
        "file",
        ".file.tmp",
        ".file.0123.tmp",
        ".file.0123456789abcdeg.tmp",
        ".file.0123456789ABCDEF.tmp",
        ".file.0123456789abcdef.tmp2",
        ".file0123456789abcdef.tmp",
        ".other.0123456789abcdef.tmp",
        "file.0123456789abcdef.tmp",
        ".0123456789abcdef.tmp",
    ];
    for name in foreign {
        fs::write(at(name), "").expect("writable");
    }
    // A folder under the name of a file, and the reverse, are not ours.
    fs::create_dir(at(".file.00000000000000aa.tmp")).expect("writable");
    fs::write(at(".file.00000000000000aa.part"), "").expect("writable");
    // What is being filled stays.
    let (busy, folder) = (file(&at("file")), TemporaryFolder::beside(&at("file")).expect("writable"));
    clear(&at("file"));
    clear(&at(&long));
    assert!(busy.file.path().exists() && folder.path().exists());
    drop((busy, folder));
    let mut expected: Vec<String> = foreign.map(String::from).to_vec();
    expected.extend([".file.00000000000000aa.part", ".file.00000000000000aa.tmp"].map(String::from));
    expected.sort();
    assert_eq!(names(dir.path()), expected);
}

#[cfg(unix)]
#[test]
fn links_and_pipes_under_such_names_do_no_harm() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let victim = dir.path().join("victim");
    fs::create_dir(&victim).expect("writable");
    fs::write(victim.join("file"), "precious").expect("writable");
    for ending in ["tmp", "part"] {
        let link = dir.path().join(format!(".file.0123456789abcdef.{ending}"));
        std::os::unix::fs::symlink(&victim, &link).expect("a link");
    }
    let pipe = dir.path().join(".file.00000000000000aa.tmp");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo is there").success());
    clear(&dir.path().join("file"));
    assert_eq!(fs::read(victim.join("file")).expect("there"), b"precious");
}

#[cfg(unix)]
#[test]
fn modes_are_right_from_the_first_byte() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("file");
    let mode = |path: &Path| path.metadata().expect("there").permissions().mode() & 0o777;
    let made = |access: &Access| mode(TemporaryFile::beside(&path, access).expect("writable").file.path());
    fs::write(&path, "").expect("writable");
    assert_eq!(made(&Access::Ordinary), mode(&path), "as the umask has it");
    assert_eq!(made(&Access::Private), 0o600);
    for other in [0o600, 0o640, 0o400, 0o664] {
        fs::set_permissions(&path, Permissions::from_mode(other)).expect("ours");
        assert_eq!(made(&Access::Like(path.metadata().expect("there"))), other);
    }
    let folder = TemporaryFolder::beside(&path).expect("writable");
    fs::create_dir(dir.path().join("folder")).expect("writable");
    assert_eq!(mode(folder.path()), mode(&dir.path().join("folder")));
}

/// Many at once make and clear away files of one name; none takes another's for a leftover.
#[test]
fn nobody_loses_a_file_to_who_clears() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("file");
    std::thread::scope(|scope| {
        for number in 0..4u8 {
            let path = &path;
            scope.spawn(move || {
                for _ in 0..200 {
                    clear(path);
                    let mut new = file(path);
                    new.file().write_all(&[number]).expect("writable");
                    new.replace(path).expect("it is still there");
                }
            });
        }
    });
    assert_eq!(names(dir.path()), ["file"]);
}
