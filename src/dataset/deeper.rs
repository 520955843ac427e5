//! Images deeper in a folder than one looks: only the table can name them.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::scan::IMAGES;
use crate::frames::folder::{is_hidden, is_image};
use crate::support::printable;

/// Files and folders that are looked at, so that somebody's whole disk is not.
const LOOKED_AT: usize = 100_000;
/// Folders that the text names before it only counts.
const NAMED: usize = 5;

/// Files in subfolders that look like images and that no row of the table names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Deeper {
    /// How many.
    pub images: usize,
    /// The folders they are in, by path in the folder, ascending.
    pub folders: Vec<String>,
    /// Whether there may be more, for the search was given up after 100,000 files.
    pub at_least: bool,
}

impl Deeper {
    /// Those of a folder, without hidden ones and without following links, if there are any; the names are asked about as
    /// the table has them.
    pub(crate) fn find(dir: &Path, is_named: impl Fn(&str) -> bool) -> Option<Deeper> {
        // Where to look, as it is shown, and as names in the table begin.
        let mut places: Vec<(PathBuf, String, String)> = Vec::new();
        let mut found = Deeper { images: 0, folders: Vec::new(), at_least: false };
        places.push((dir.into(), String::new(), String::new()));
        let mut looked_at = 0;
        while let Some((place, shown, begin)) = places.pop() {
            let (at_top, before) = (begin.is_empty(), found.images);
            for entry in place.read_dir().into_iter().flatten().flatten() {
                looked_at += 1;
                if looked_at > LOOKED_AT {
                    found.at_least = true;
                    break;
                }
                let (path, leaf) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
                let Ok(kind) = entry.file_type() else { continue };
                if is_hidden(&path) {
                    continue;
                }
                if kind.is_dir() {
                    let below = format!("{shown}{leaf}/");
                    // Right in `images` is as good as right in the folder.
                    let top = shown.is_empty() && leaf == IMAGES;
                    let begin = if top { String::new() } else { format!("{begin}{leaf}/") };
                    places.push((path, below, begin));
                } else if !at_top && is_image(&path) {
                    // What is below `images` may be named with it or without.
                    let names = [format!("{begin}{leaf}"), format!("{shown}{leaf}")];
                    found.images += usize::from(!names.iter().any(|name| is_named(name)));
                }
            }
            if found.images > before {
                found.folders.push(shown.trim_end_matches('/').to_string());
            }
            if found.at_least {
                break;
            }
        }
        found.folders.sort_unstable();
        (found.images > 0).then_some(found)
    }
}

impl fmt::Display for Deeper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Deeper { images, folders, at_least } = self;
        let least = if *at_least { "at least " } else { "" };
        let (image, are) = if *images == 1 { ("image", "is") } else { ("images", "are") };
        let folder = if folders.len() == 1 { "a subfolder" } else { "subfolders" };
        let mut shown = folders.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
        if folders.len() > NAMED {
            shown += &format!(" and {} more", folders.len() - NAMED);
        }
        write!(f, "{least}{images} {image} in {folder} ({}) {are} not looked at", printable::line(&shown))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_is_deeper_is_counted_unless_it_is_named() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let root = dir.path();
        for file in [
            "a.png",
            "images/b.png",
            "images/c/d.png",
            "e/f/g.JPG",
            "e/f/h.txt",
            "e/i.png",
            ".j/k.png",
            "e/._i.png",
            "e/@eaDir/i.png",
        ] {
            let path = root.join(file);
            fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
            fs::write(path, "").expect("writable");
        }
        let found = Deeper::find(root, |_| false).expect("some");
        assert_eq!((found.images, found.at_least), (3, false));
        assert_eq!(found.folders, ["e", "e/f", "images/c"]);
        assert_eq!(found.to_string(), "3 images in subfolders (e, e/f, images/c) are not looked at");
        let found = Deeper::find(root, |name| ["c/d.png", "e/i.png"].contains(&name)).expect("one");
        assert_eq!(found.to_string(), "1 image in a subfolder (e/f) is not looked at");
        let found = Deeper::find(root, |name| ["images/c/d.png", "e/i.png"].contains(&name)).expect("one");
        assert_eq!(found.folders, ["e/f"], "named from the folder on");
        assert_eq!(Deeper::find(root, |_| true), None);
        assert_eq!(Deeper::find(&root.join("nowhere"), |_| false), None);
    }
}
