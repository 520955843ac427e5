//! Names of images in a data folder: one identity for a file, however its name is spelled.
//!
//! An image is looked for in the subfolder `images` first, then next to the table. So `a.png`, `./a.png` and
//! `images/a.png` may be one file, as may be a link and what it leads to, or two cases of a letter.

use std::path::{Component, Path, PathBuf};

use super::scan::IMAGES;

/// Whether a name is a plain relative path: nothing that leads out of the folder on any platform, no second spelling of
/// the same path, nothing the table would not give back.
pub(crate) fn is_confined(name: &str) -> bool {
    let parts: Option<Vec<&str>> = Path::new(name)
        .components()
        .map(|part| match part {
            Component::Normal(part) => part.to_str(),
            _ => None,
        })
        .collect();
    let drive = name.as_bytes().get(1) == Some(&b':');
    !name.is_empty()
        && !drive
        && name.trim() == name
        && !name.contains(['\\', '\0'])
        && parts.is_some_and(|p| p.join("/") == name)
}

/// The plain path that a name in a table stands for: `/` between its parts, where there may be `\`, and neither empty
/// parts nor `.` among them. There is none if it could lead out of the folder.
pub(crate) fn cleaned(name: &str) -> Option<String> {
    if name.starts_with(['/', '\\']) {
        return None;
    }
    let parts: Vec<&str> = name.split(['/', '\\']).filter(|part| !part.is_empty() && *part != ".").collect();
    Some(parts.join("/")).filter(|name| is_confined(name))
}

/// The file of an image.
pub(super) fn image_path(dir: &Path, name: &str) -> Option<PathBuf> {
    [dir.join(IMAGES).join(name), dir.join(name)].into_iter().find(|path| path.is_file())
}

/// What tells the file of a plain name from all others: its path without links, or for a file that is not there the name
/// below the folder of images.
pub(super) fn identity(dir: &Path, name: &str) -> PathBuf {
    let real = image_path(dir, name).and_then(|path| path.canonicalize().ok());
    real.unwrap_or_else(|| Path::new(name).strip_prefix(IMAGES).unwrap_or(Path::new(name)).into())
}

/// The one name of the file of a plain name: the shortest one that finds it in this folder, which is given without links.
pub(crate) fn plain_name(dir: &Path, name: &str) -> String {
    let wanted = identity(dir, name);
    let below = wanted.strip_prefix(dir).ok().and_then(|below| {
        // The separators of the platform become those of tables.
        let parts: Option<Vec<&str>> = below.iter().map(|part| part.to_str()).collect();
        parts.map(|parts| parts.join("/"))
    });
    let spellings = below.iter().map(String::as_str).chain([name]);
    let shorter = |name| str::strip_prefix(name, IMAGES).and_then(|rest| rest.strip_prefix('/'));
    let mut candidates = spellings.flat_map(|name| [shorter(name).unwrap_or(name), name]);
    let found = candidates.find(|name| is_confined(name) && identity(dir, name) == wanted);
    found.unwrap_or(name).to_string()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn names_are_confined() {
        for good in ["a.png", "run 1/a.png", "..a.png", "ä.png", "a,b.png"] {
            assert!(is_confined(good), "{good}");
            assert_eq!(cleaned(good).as_deref(), Some(good));
        }
        for (other, clean) in [
            ("./a.png", "a.png"),
            ("a/./b.png", "a/b.png"),
            ("a//b.png", "a/b.png"),
            (".\\a\\b.png", "a/b.png"),
        ] {
            assert!(!is_confined(other), "{other}");
            assert_eq!(cleaned(other).as_deref(), Some(clean));
        }
        for bad in [
            "",
            ".",
            "/etc/passwd",
            "\\\\host\\a",
            "../a.png",
            "a/../b.png",
            "a\\..\\b",
            "..",
            "C:a.png",
            "C:\\a",
            "a\0b",
        ] {
            assert!(!is_confined(bad), "{bad}");
            assert_eq!(cleaned(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_file_has_one_name() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let root = dir.path().canonicalize().expect("there");
        for file in
            ["a.png", "images/a.png", "images/b.png", "images/images/c.png", "images/run/d.png", "e/f.png"]
        {
            let path = root.join(file);
            fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
            fs::write(path, file).expect("writable");
        }
        for (name, plain) in [
            ("a.png", "a.png"),
            ("images/a.png", "a.png"),
            ("images/b.png", "b.png"),
            ("images/c.png", "images/c.png"),
            ("images/images/c.png", "images/c.png"),
            ("images/run/d.png", "run/d.png"),
            ("e/f.png", "e/f.png"),
            // Not there, but the same all the same.
            ("images/none.png", "none.png"),
            ("none.png", "none.png"),
        ] {
            assert_eq!(plain_name(&root, name), plain, "{name}");
            assert_eq!(identity(&root, name), identity(&root, plain), "{name}");
        }
        assert_ne!(identity(&root, "b.png"), identity(&root, "a.png"));
    }

    #[test]
    #[cfg(unix)]
    fn links_are_the_file_they_lead_to() {
        use std::os::unix::fs::symlink;
        let (dir, other) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("another"));
        let (root, other) = (dir.path().canonicalize().expect("there"), other.path());
        fs::create_dir(root.join("images")).expect("writable");
        fs::write(root.join("images/a.png"), "a").expect("writable");
        fs::write(other.join("b.png"), "b").expect("writable");
        symlink("a.png", root.join("images/c.png")).expect("writable");
        symlink("images/a.png", root.join("d.png")).expect("writable");
        symlink(other.join("b.png"), root.join("e.png")).expect("writable");
        for name in ["a.png", "c.png", "images/c.png", "d.png"] {
            assert_eq!(plain_name(&root, name), "a.png", "{name}");
        }
        // What is elsewhere has no name in the folder but that of the link.
        assert_eq!(plain_name(&root, "e.png"), "e.png");
        assert_eq!(identity(&root, "e.png"), other.join("b.png").canonicalize().expect("there"));
    }
}
