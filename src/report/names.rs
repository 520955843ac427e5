//! Short names for files and folders that are told apart in one report.

use std::collections::BTreeSet;
use std::path::Path;

/// The names of files or folders, with as many of the folders around them as it takes to tell them apart.
///
/// ```
/// let names = vsonar::report::short_names(&["runs/a/best.gp", "runs/b/best.gp"]);
/// assert_eq!(names, ["a/best.gp", "b/best.gp"]);
/// ```
pub fn short_names<P: AsRef<Path>>(paths: &[P]) -> Vec<String> {
    let last = |path: &P, parts: usize| {
        let all: Vec<_> =
            path.as_ref().components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
        all[all.len().saturating_sub(parts)..].join("/")
    };
    let longest = paths.iter().map(|path| path.as_ref().components().count()).max().unwrap_or(1);
    let named = |parts: usize| paths.iter().map(|path| last(path, parts)).collect::<Vec<_>>();
    let differ = |names: &Vec<String>| names.iter().collect::<BTreeSet<_>>().len() == names.len();
    (1..=longest).map(named).find(differ).unwrap_or_else(|| named(longest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_short_as_they_can_be() {
        let short = |paths: &[&str]| short_names(paths);
        assert_eq!(short(&["runs/a/best.gp"]), ["best.gp"]);
        assert_eq!(short(&["runs/a/best.gp", "runs/b/best.gp"]), ["a/best.gp", "b/best.gp"]);
        assert_eq!(short(&["x/a/best.gp", "y/a/best.gp"]), ["x/a/best.gp", "y/a/best.gp"]);
        assert_eq!(short(&["a.gp", "b/a.gp"]), ["a.gp", "b/a.gp"]);
        assert_eq!(short(&["a.gp", "a.gp"]), ["a.gp", "a.gp"]);
    }
}
