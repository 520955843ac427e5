//! The pictures of `vsonar show`: of one program as in the paper, of several side by side.

use std::path::PathBuf;

use image::RgbImage;
use vsonar::dataset::Dataset;
use vsonar::dataset::scale::in_proportion;
use vsonar::report::{
    Column, LEGEND, LEGEND_SEVERAL, Style, Tile, contact_sheet_png, draw, draw_several, letter, short_names,
    with_lines,
};

use super::CliError;
use super::output::percent;

/// Bytes of a contact sheet, at most.
const SHEET_BYTES: usize = 2_000_000;

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

    /// The images by how many answers are wrong, of all programs together: the worst first.
    pub(crate) fn worst_first(&self) -> Vec<usize> {
        let right = |image: usize| -> f64 {
            let correct: usize = (0..self.names.len()).map(|program| self.correct(image, program)).sum();
            let all: usize = self.columns[image].iter().map(Vec::len).sum();
            correct as f64 / all.max(1) as f64
        };
        let mut images: Vec<usize> = (0..self.columns.len()).collect();
        images.sort_by(|&a, &b| right(a).total_cmp(&right(b)));
        images
    }

    /// A sheet of tiles as a PNG file.
    pub(crate) fn sheet(&self, tiles: &[Tile], columns: usize) -> Result<Vec<u8>, CliError> {
        let set = self.set.name();
        let (heading, keys) = match &self.names[..] {
            [only] => {
                (format!("{only} on {set}: {}. The worst images first. {LEGEND}", self.result_of(0)), vec![])
            }
            several => {
                let heading =
                    format!("{} programs on {set}. The worst images first. {LEGEND_SEVERAL}", several.len());
                let key = |(i, name): (usize, &String)| format!("{name}: {}", self.result_of(i));
                (heading, several.iter().enumerate().map(key).collect())
            }
        };
        let file = contact_sheet_png(tiles, columns, &heading, &keys, SHEET_BYTES);
        file.map_err(|error| CliError::Failed(format!("the contact sheet cannot be encoded: {error}")))
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
            "{correct} of {all} answers ({}) correct within {}",
            percent(correct as f64 / all.max(1) as f64),
            in_proportion(self.style.tolerance, self.set.height())
        )
    }

    fn correct(&self, image: usize, program: usize) -> usize {
        self.columns[image][program].iter().filter(|c| c.is_correct(self.style.tolerance)).count()
    }

    fn correct_of_all(&self, program: usize) -> usize {
        (0..self.columns.len()).map(|image| self.correct(image, program)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};
    use vsonar::dataset::{Case, NamedImage};

    #[test]
    fn the_worst_images_come_first() {
        let image = |i: usize| NamedImage {
            name: format!("{i}.png"),
            pixels: GrayImage::from_pixel(32, 24, Luma([i as u8])),
        };
        let cases = [(0, 8), (0, 9), (1, 8), (1, 9), (2, 8), (2, 9), (3, 8)].map(|(image, x)| Case {
            image,
            x,
            y: 10,
        });
        let set = Dataset::new("set", (0..4).map(image).collect(), cases.into()).expect("sound");
        let order = |answers: &[Vec<f32>]| {
            let programs: Vec<PathBuf> = (0..answers.len()).map(|i| format!("{i}.gp").into()).collect();
            Drawing::new(&set, &programs, answers, Style { tolerance: 1.0, ..Style::default() }).worst_first()
        };
        let (right, wrong) = (10.0, f32::NAN);
        assert_eq!(order(&[vec![right, right, wrong, wrong, right, wrong, right]]), [1, 2, 0, 3]);
        assert_eq!(order(&[vec![wrong; 7]]), [0, 1, 2, 3]);
        let (one, other) = (vec![right; 7], vec![right, right, right, wrong, wrong, wrong, right]);
        assert_eq!(order(&[one, other]), [2, 1, 0, 3]);
    }
}
