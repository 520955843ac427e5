//! The pictures of `vsonar show`: of one program as in the paper, of several side by side.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use image::RgbImage;
use vsonar::dataset::Dataset;
use vsonar::report::{
    Column, LEGEND, LEGEND_SEVERAL, Style, Tile, contact_sheet, contact_sheet_of_several, draw, draw_several,
    letter, with_lines,
};

use super::output::percent;

/// A data set and what programs answer to it.
pub(crate) struct Drawing<'a> {
    set: &'a Dataset,
    style: Style,
    /// What the programs are called, shortly.
    names: Vec<String>,
    /// The cases with the answers of each program, image by image.
    columns: Vec<Vec<Vec<Column>>>,
}

impl<'a> Drawing<'a> {
    /// Of at least one program and its answers to all cases.
    pub(crate) fn new(
        set: &'a Dataset,
        programs: &[PathBuf],
        answers: &[Vec<f32>],
        style: Style,
    ) -> Drawing<'a> {
        let mut columns = vec![vec![Vec::new(); programs.len()]; set.images().len()];
        for (program, answers) in answers.iter().enumerate() {
            for (case, &answer) in set.cases().iter().zip(answers) {
                columns[case.image][program].push(Column { x: case.x, label: case.y, answer });
            }
        }
        Drawing { set, style, names: short_names(programs), columns }
    }

    pub(crate) fn set(&self) -> &Dataset {
        self.set
    }

    /// An image with the answers.
    pub(crate) fn picture(&self, image: usize) -> RgbImage {
        let pixels = &self.set.images()[image].pixels;
        match &self.columns[image][..] {
            [only] => draw(pixels, only, &self.style),
            several => draw_several(pixels, several, &self.style),
        }
    }

    /// The picture of an image, with lines below it that tell the programs apart, if there are several.
    pub(crate) fn keyed(&self, image: usize, picture: &RgbImage) -> RgbImage {
        if self.names.len() == 1 {
            return picture.clone();
        }
        let all = self.set.cases().len();
        let line = |(program, name): (usize, &String)| {
            let here = self.correct(image, program);
            let share = percent(self.correct_of_all(program) as f64 / all.max(1) as f64);
            format!("{here}/{} here, {share} of all: {name}", self.columns[image][program].len())
        };
        with_lines(picture, &self.names.iter().enumerate().map(line).collect::<Vec<_>>())
    }

    /// The picture on the sheet.
    pub(crate) fn tile(&self, image: usize, picture: &RgbImage) -> Tile {
        let name = &self.set.images()[image].name;
        let total = self.columns[image].first().map_or(0, Vec::len);
        let correct: Vec<usize> = (0..self.names.len()).map(|program| self.correct(image, program)).collect();
        match correct[..] {
            [only] => Tile::new(picture, name, only, total),
            _ => Tile::of_several(picture, name, &correct, total),
        }
    }

    /// A sheet of tiles.
    pub(crate) fn sheet(&self, tiles: &[Tile], columns: usize) -> RgbImage {
        let set = self.set.name();
        match &self.names[..] {
            [only] => {
                contact_sheet(tiles, columns, &format!("{only} on {set}: {}. {LEGEND}", self.result_of(0)))
            }
            several => {
                let heading = format!("{} programs on {set}. {LEGEND_SEVERAL}", several.len());
                let key = |(i, name): (usize, &String)| format!("{name}: {}", self.result_of(i));
                let keys: Vec<String> = several.iter().enumerate().map(key).collect();
                contact_sheet_of_several(tiles, columns, &heading, &keys)
            }
        }
    }

    /// How the programs do, in words.
    pub(crate) fn result(&self) -> String {
        match &self.names[..] {
            [_] => self.result_of(0),
            several => {
                let line =
                    |(i, name): (usize, &String)| format!("{} {name}: {}", letter(i), self.result_of(i));
                several.iter().enumerate().map(line).collect::<Vec<_>>().join("\n")
            }
        }
    }

    fn result_of(&self, program: usize) -> String {
        let (correct, all) = (self.correct_of_all(program), self.set.cases().len());
        format!(
            "{correct} of {all} answers correct within {} rows ({})",
            self.style.tolerance,
            percent(correct as f64 / all.max(1) as f64)
        )
    }

    fn correct(&self, image: usize, program: usize) -> usize {
        self.columns[image][program].iter().filter(|c| c.is_correct(self.style.tolerance)).count()
    }

    fn correct_of_all(&self, program: usize) -> usize {
        (0..self.columns.len()).map(|image| self.correct(image, program)).sum()
    }
}

/// The names of the files, with as many of the folders around them as it takes to tell them apart.
fn short_names(paths: &[PathBuf]) -> Vec<String> {
    let last = |path: &Path, parts: usize| {
        let all: Vec<_> =
            path.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
        all[all.len().saturating_sub(parts)..].join("/")
    };
    let longest = paths.iter().map(|path| path.components().count()).max().unwrap_or(1);
    let named = |parts: usize| paths.iter().map(|path| last(path, parts)).collect::<Vec<_>>();
    let differ = |names: &Vec<String>| names.iter().collect::<BTreeSet<_>>().len() == names.len();
    (1..=longest).map(named).find(differ).unwrap_or_else(|| named(longest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_short_as_they_can_be() {
        let short = |paths: &[&str]| short_names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(short(&["runs/a/best.gp"]), ["best.gp"]);
        assert_eq!(short(&["runs/a/best.gp", "runs/b/best.gp"]), ["a/best.gp", "b/best.gp"]);
        assert_eq!(short(&["x/a/best.gp", "y/a/best.gp"]), ["x/a/best.gp", "y/a/best.gp"]);
        assert_eq!(short(&["a.gp", "b/a.gp"]), ["a.gp", "b/a.gp"]);
        assert_eq!(short(&["a.gp", "a.gp"]), ["a.gp", "a.gp"]);
    }
}
