//! Names: of files that annotations point at, of the pictures in a new set, of labels.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::{Region, Surface};

/// The path below a folder that an annotation names, with `/` or `\` between its parts; none if it could lead out of the
/// folder, or to a file that cannot be told by its name.
pub(super) fn below(name: &str) -> Option<PathBuf> {
    let name = name.strip_prefix("./").unwrap_or(name);
    let plain = |part: &str| !part.is_empty() && part != "." && part != ".." && !part.contains([':', '\0']);
    let parts: Vec<&str> = name.split(['/', '\\']).collect();
    parts.iter().all(|part| plain(part)).then(|| parts.iter().collect())
}

/// The path below a folder that an annotation's path leads to from `within`, a folder in it; none if it leads out, or is
/// absolute.
pub(super) fn from_within(within: &str, name: &str) -> Option<String> {
    if name.starts_with(['/', '\\']) {
        return None;
    }
    let mut parts: Vec<&str> = Vec::new();
    for part in within.split('/').chain(name.split(['/', '\\'])) {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(below(part).map(|_| part)?),
        }
    }
    Some(parts.join("/"))
}

/// The file in a folder that the last parts of an annotation's path name, as many of them as find one; with these parts.
/// So pictures that were moved since, or annotated on another machine, are found below their folder.
pub(super) fn by_last_parts(folder: &Path, name: &str) -> Option<(PathBuf, String)> {
    let parts: Vec<&str> = name.split(['/', '\\']).filter(|part| !part.is_empty() && *part != ".").collect();
    let plain = parts.iter().rev().take_while(|part| below(part).is_some()).count();
    (parts.len() - plain..parts.len()).find_map(|from| {
        let last = parts[from..].join("/");
        Some((folder.join(&last), last)).filter(|(path, _)| path.is_file())
    })
}

/// The last part of a path as it stands in an annotation.
pub(super) fn leaf(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// A path without the ending of its last part.
pub(super) fn stem(name: &str) -> &str {
    let start = name.rfind('/').map_or(0, |slash| slash + 1);
    match name[start..].rfind('.') {
        None | Some(0) => name,
        Some(dot) => &name[..start + dot],
    }
}

/// The names of the pictures of a set: PNG files below the folder, no two the same on any file system.
#[derive(Debug, Default)]
pub struct Names(BTreeSet<String>);

impl Names {
    /// A name for a picture that was called so: letters, digits, `.`, `-`, `_` and `/` stay, everything else becomes `_`, and
    /// the ending `.png`. A name that is taken keeps its old ending before the new one; if need be with a letter or more
    /// behind, for numbers at the end tell the order of a drive.
    ///
    /// ```
    /// use vsonar::dataset::import::Names;
    ///
    /// let mut names = Names::default();
    /// assert_eq!(names.png("drive 1/frame_07.jpg"), "drive_1/frame_07.png");
    /// assert_eq!(names.png("drive 1/frame_07.jpeg"), "drive_1/frame_07.jpeg.png");
    /// ```
    pub fn png(&mut self, name: &str) -> String {
        let sane = |c: char| if c.is_alphanumeric() || "._-/".contains(c) { c } else { '_' };
        let name: String = name.replace('\\', "/").chars().map(sane).collect();
        // No empty part, none of dots alone, none hidden.
        let parts = name.split('/').map(|part| part.trim_start_matches('.')).filter(|part| !part.is_empty());
        let name = parts.collect::<Vec<_>>().join("/");
        let name = if name.is_empty() { "picture".to_string() } else { name };
        let lettered = (1usize..).map(|n| format!("{}-{}.png", stem(&name), "b".repeat(n)));
        let mut candidates =
            [format!("{}.png", stem(&name)), format!("{name}.png")].into_iter().chain(lettered);
        candidates.find(|name| self.0.insert(name.to_lowercase())).unwrap_or_default()
    }
}

/// Which labels are ground.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    /// Whether the names are those of the ground, or those of everything else.
    pub named: Named,
    /// The names.
    pub names: BTreeSet<String>,
    /// Names of what nobody knows whether it is ground.
    pub ignored: BTreeSet<String>,
}

/// What the names are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Named {
    /// The ground; what no region covers is not ground.
    Ground,
    /// What is not ground; what no region covers is ground.
    Other,
}

impl Labels {
    /// What is seen where no region is.
    pub(super) fn base(&self) -> Surface {
        match self.named {
            Named::Ground => Surface::Other,
            Named::Other => Surface::Ground,
        }
    }

    /// What is seen in a region of this label.
    pub(super) fn of(&self, label: &str) -> Surface {
        use Surface::{Ground, Ignored, Other};
        if self.ignored.contains(label) {
            return Ignored;
        }
        match (self.named, self.names.contains(label)) {
            (Named::Ground, true) | (Named::Other, false) => Ground,
            (Named::Ground, false) | (Named::Other, true) => Other,
        }
    }

    /// Why a picture with these regions does not count: with the ground named, one without any of it would be blocked all
    /// over. `is_faulty` says whether there are regions that could not be read.
    pub(super) fn nothing_left(
        &self,
        regions: &[(Region, Surface)],
        is_faulty: bool,
    ) -> Option<&'static str> {
        let is_ground = |(_, surface): &(Region, Surface)| *surface == Surface::Ground;
        match self.named {
            Named::Ground if is_faulty && !regions.iter().any(is_ground) => {
                Some("what is ground in it is faulty")
            }
            Named::Ground if regions.is_empty() => Some("nothing is annotated in it"),
            _ => None,
        }
    }

    /// Whether a name was asked for, to be ground or not or to be ignored.
    pub(super) fn asks(&self, label: &str) -> bool {
        self.names.contains(label) || self.ignored.contains(label)
    }

    /// Names that are not among the labels there are.
    pub fn unknown<'a>(&'a self, known: &'a BTreeSet<String>) -> impl Iterator<Item = &'a String> {
        self.names.union(&self.ignored).filter(|name| !known.contains(*name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_below_the_folder() {
        for (name, path) in
            [("a.png", "a.png"), ("./a/b.png", "a/b.png"), ("a\\b.png", "a/b.png"), (".a", ".a")]
        {
            assert_eq!(below(name), Some(PathBuf::from(path)), "{name}");
        }
        for name in [
            "",
            ".",
            "..",
            "/etc/passwd",
            "a/../../b",
            "../a",
            "a//b",
            "a/",
            "C:\\a",
            "\\\\host\\a",
            "a\0b",
            "././a",
        ] {
            assert_eq!(below(name), None, "{name}");
        }
        assert_eq!((leaf("..\\a\\b.jpg"), leaf("../x.png"), leaf("x")), ("b.jpg", "x.png", "x"));
        assert_eq!((stem("a.b/c"), stem("a/b.c.d"), stem("a/.b")), ("a.b/c", "a/b.c", "a/.b"));
    }

    #[test]
    fn paths_from_within_are_followed_as_long_as_they_stay() {
        for (within, name, path) in [
            ("", "a.png", Some("a.png")),
            ("", "./b/../a.png", Some("a.png")),
            ("sub/", "../a.png", Some("a.png")),
            ("sub/", "..\\other\\a.png", Some("other/a.png")),
            ("sub/", "../../a.png", None),
            ("", "..\\a.png", None),
            ("sub/", "/a.png", None),
            ("sub/", "C:\\a.png", None),
        ] {
            assert_eq!(from_within(within, name).as_deref(), path, "{within} {name}");
        }
    }

    #[test]
    fn moved_pictures_are_found_by_the_end_of_their_path() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        for file in ["a.png", "hall/a.png", "hall/b.png"] {
            let path = dir.path().join(file);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
            std::fs::write(path, file).expect("writable");
        }
        for (name, found) in [
            ("a.png", "a.png"),
            ("/home/me/img/a.png", "a.png"),
            ("/home/me/hall/a.png", "hall/a.png"),
            ("C:\\data\\hall\\b.png", "hall/b.png"),
            ("..\\..\\a.png", "a.png"),
            ("./hall//./a.png", "hall/a.png"),
            ("hall/../a.png", "a.png"),
        ] {
            let path = dir.path().join(found);
            assert_eq!(by_last_parts(dir.path(), name), Some((path, found.to_string())), "{name}");
        }
        for none in ["", "..", "a.png/..", "b.png", "hall", "C:a.png"] {
            assert_eq!(by_last_parts(dir.path(), none), None, "{none}");
        }
    }

    #[test]
    fn names_are_sane_and_differ() {
        let mut names = Names::default();
        let given = ["a.jpg", "A.png", "a.JPG", "../x y.png", "/a\\b:c.png", "..", "", "é/ü.bmp", "a.jpg"];
        let made = given.map(|name| names.png(name));
        assert_eq!(
            made,
            [
                "a.png",
                "A.png.png",
                "a.JPG.png",
                "x_y.png",
                "a/b_c.png",
                "picture.png",
                "picture-b.png",
                "é/ü.png",
                "a-b.png"
            ]
        );
    }

    #[test]
    fn labels_are_ground_or_not() {
        use super::super::Surface::*;
        let set = |names: &[&str]| names.iter().map(ToString::to_string).collect::<BTreeSet<_>>();
        let ground = Labels { named: Named::Ground, names: set(&["floor"]), ignored: set(&["glass"]) };
        assert_eq!(["floor", "chair", "glass"].map(|label| ground.of(label)), [Ground, Other, Ignored]);
        let other = Labels { named: Named::Other, ..ground.clone() };
        assert_eq!(["floor", "chair", "glass"].map(|label| other.of(label)), [Other, Ground, Ignored]);
        assert_eq!((ground.base(), other.base()), (Other, Ground));
        let known = set(&["floor", "chair"]);
        assert_eq!(ground.unknown(&known).collect::<Vec<_>>(), ["glass"]);
    }
}
