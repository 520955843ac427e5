//! Transience: whether errors last.
//!
//! Martin (2006) found that errors of evolved detectors are mostly gone in the next frame, and concludes that a filter
//! over a few frames removes them. An error that stays while the robot drives on is another matter. So errors in a column
//! are followed through the frames of a sequence: wrong frames in a row are one episode.
//!
//! A frame is a labelled frame: where a data set has every tenth image of a video, an error of one frame may have lasted
//! for up to twenty images. And a column is followed through those frames of a sequence in which it is labelled. An error
//! that begins in the last of them has no next frame: nobody can tell whether it lasts, so it is counted apart.

use std::collections::BTreeMap;

use serde::Serialize;
use vsonar_ir::machine::Scalar;

use super::Dataset;
use crate::camera::ground::median_of_three;

/// Wrong answers by how long they last, for sequences of any origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Lasting {
    /// Errors: wrong answers.
    pub errors: usize,
    /// Runs of them in consecutive frames of a column.
    pub episodes: usize,
    /// Those that last a single frame.
    pub single: usize,
    /// Those that begin in the last frame of a sequence: neither transient nor lasting.
    pub undecided: usize,
    /// Frames of the longest.
    pub longest: usize,
}

impl Lasting {
    /// Counts an episode of so many frames, which ends with its sequence or before. One of no frames is none.
    pub fn episode(&mut self, frames: usize, ends_with_sequence: bool) {
        self.errors += frames;
        self.episodes += usize::from(frames > 0);
        self.single += usize::from(frames == 1 && !ends_with_sequence);
        self.undecided += usize::from(frames == 1 && ends_with_sequence);
        self.longest = self.longest.max(frames);
    }

    /// Both together.
    pub fn and(self, other: Lasting) -> Lasting {
        Lasting {
            errors: self.errors + other.errors,
            episodes: self.episodes + other.episodes,
            single: self.single + other.single,
            undecided: self.undecided + other.undecided,
            longest: self.longest.max(other.longest),
        }
    }

    /// Share of the errors that last a single frame, 0 to 1, of those of which it can be told; none without any.
    pub fn single_of_errors(&self) -> Option<f64> {
        self.share(self.errors)
    }

    /// Share of the episodes that do.
    pub fn single_of_episodes(&self) -> Option<f64> {
        self.share(self.episodes)
    }

    fn share(&self, of: usize) -> Option<f64> {
        let decided = of - self.undecided;
        (decided > 0).then(|| self.single as f64 / decided as f64)
    }
}

/// How long errors last.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Transience {
    /// Wrong answers in columns that are labelled in at least two frames of a sequence. Elsewhere nobody can tell.
    pub errors: usize,
    /// Runs of wrong answers in consecutive frames of a column.
    pub episodes: usize,
    /// Those that last a single frame; as each is one wrong answer, also the errors that do.
    pub single: usize,
    /// Those that begin in the last frame of a sequence, which has no next one: they are no part of the shares.
    pub undecided: usize,
    /// Share of the errors that last a single frame, 0 to 1; none without errors of which it can be told.
    pub single_of_errors: Option<f64>,
    /// Share of the episodes that do.
    pub single_of_episodes: Option<f64>,
    /// The longest episode, of equally long ones the first by sequence and column; none without errors.
    pub longest: Option<Episode>,
    /// Correct cases, of all, if each answer is replaced by the median of this and the last two frames.
    pub median_correct: usize,
    /// The same as a share of all cases, 0 to 1.
    pub median_fitness: f64,
}

/// Wrong answers in consecutive frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Episode {
    /// How many frames.
    pub frames: usize,
    /// The column.
    pub column: u32,
    /// Name of the first image.
    pub image: String,
}

impl Transience {
    /// Follows `answers`, one for each case of the set in its order, through [`Dataset::sequences`]. An answer is correct
    /// if it is finite and within `tolerance` rows of the label. `None` if no column is labelled in two frames of a
    /// sequence.
    ///
    /// The median is [`median_of_three`], that of `vsonar run --median 3`: it looks back only, the first frame of a
    /// sequence stands as it is, and of two frames the nearer obstacle is believed.
    ///
    /// ```
    /// use vsonar::dataset::{Case, Dataset, NamedImage, Transience};
    ///
    /// let image = |i| NamedImage { name: format!("a_{i}.png"), pixels: image::GrayImage::new(16, 16) };
    /// let cases = (0..5).map(|image| Case { image, x: 8, y: 5 }).collect();
    /// let set = Dataset::new("drive", (0..5).map(image).collect(), cases)?;
    /// // One wrong frame between right ones.
    /// let transience = Transience::of(&set, &[5.0, 5.0, 15.0, 5.0, 5.0], 2.0).expect("a sequence");
    /// assert_eq!((transience.errors, transience.single, transience.median_correct), (1, 1, 5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Panics
    /// If there are not as many answers as cases.
    pub fn of(set: &Dataset, answers: &[f32], tolerance: f64) -> Option<Transience> {
        assert_eq!(answers.len(), set.cases().len(), "an answer for each case");
        let mut found = Transience {
            errors: 0,
            episodes: 0,
            single: 0,
            undecided: 0,
            single_of_errors: None,
            single_of_episodes: None,
            longest: None,
            median_correct: 0,
            median_fitness: 0.0,
        };
        let correct = |answer: f32, case: usize| {
            let label = f64::from(set.cases()[case].y);
            answer.is_finite() && (f64::from(answer) - label).abs() <= tolerance
        };
        let series = series(set);
        let mut lasting = Lasting::default();
        for cases in &series {
            let medians = medians(cases.iter().map(|&case| answers[case]));
            found.median_correct +=
                cases.iter().zip(medians).filter(|&(&case, row)| correct(row, case)).count();
            if cases.len() > 1 {
                for episode in cases.split(|&case| correct(answers[case], case)) {
                    lasting.episode(episode.len(), episode.last() == cases.last());
                    found.lengthen(set, episode);
                }
            }
        }
        (found.errors, found.episodes) = (lasting.errors, lasting.episodes);
        (found.single, found.undecided) = (lasting.single, lasting.undecided);
        found.single_of_errors = lasting.single_of_errors();
        found.single_of_episodes = lasting.single_of_episodes();
        found.median_fitness = found.median_correct as f64 / answers.len() as f64;
        series.iter().any(|cases| cases.len() > 1).then_some(found)
    }

    fn lengthen(&mut self, set: &Dataset, episode: &[usize]) {
        let Some(&first) = episode.first() else { return };
        let frames = episode.len();
        if self.longest.as_ref().is_none_or(|longest| longest.frames < frames) {
            let case = set.cases()[first];
            let image = set.images()[case.image].name.clone();
            self.longest = Some(Episode { frames, column: case.x, image });
        }
    }
}

/// For each sequence and each column in it its cases, in the order of the frames.
fn series(set: &Dataset) -> Vec<Vec<usize>> {
    let mut of_image = vec![Vec::new(); set.images().len()];
    for (i, case) in set.cases().iter().enumerate() {
        of_image[case.image].push(i);
    }
    let mut series = Vec::new();
    for sequence in set.sequences() {
        let mut columns: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for &case in sequence.images.iter().flat_map(|&image| &of_image[image]) {
            columns.entry(set.cases()[case].x).or_default().push(case);
        }
        series.extend(columns.into_values());
    }
    series
}

/// Each answer's median with the two before.
fn medians(answers: impl Iterator<Item = f32>) -> impl Iterator<Item = f32> {
    let mut before = [f32::NAN; 2];
    answers.map(move |answer| {
        let [previous, one_before] = before;
        before = [answer, previous];
        median_of_three(&mut Scalar, answer, previous, one_before)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Case, NamedImage};

    /// Images of these names with the columns 3 and 9, all labelled 8.
    fn set(names: &[&str]) -> Dataset {
        let image =
            |name: &&str| NamedImage { name: name.to_string(), pixels: image::GrayImage::new(16, 16) };
        let cases = (0..names.len()).flat_map(|image| [3, 9].map(|x| Case { image, x, y: 8 })).collect();
        Dataset::new("set", names.iter().map(image).collect(), cases).expect("sound")
    }

    #[test]
    fn errors_are_followed_by_column_and_end_with_the_sequence() {
        // The table's order is not that of time.
        let set = set(&["a_3.png", "a_1.png", "a_2.png", "b_1.png", "b_2.png"]);
        let wrong = f32::NAN;
        let answers = [
            [wrong, 8.0], // a_3
            [8.0, wrong], // a_1
            [wrong, 8.0], // a_2
            [wrong, 2.0], // b_1: another sequence
            [8.0, 15.0],  // b_2
        ];
        let found = Transience::of(&set, answers.as_flattened(), 1.0).expect("sequences");
        assert_eq!((found.errors, found.episodes, found.single), (6, 4, 2));
        let longest = Episode { frames: 2, column: 3, image: "a_2.png".into() };
        assert_eq!(found.longest, Some(longest));
        assert_eq!((found.single_of_errors, found.single_of_episodes), (Some(2.0 / 6.0), Some(0.5)));
        // A missing answer stays missing, and is no part of later medians; a lone number stands.
        assert_eq!(found.median_correct, 4);
        assert_eq!(found.median_fitness, 0.4);
    }

    #[test]
    fn a_median_removes_what_lasts_one_frame_and_follows_what_lasts_two() {
        let names: Vec<String> = (0..7).map(|i| format!("a_{i}.png")).collect();
        let set = set(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let [single, double] = [[8.0, 8.0, 0.0, 8.0, 8.0, 8.0, 8.0], [8.0, 8.0, 0.0, 0.0, 8.0, 8.0, 8.0]];
        let answers: Vec<f32> = single.into_iter().zip(double).flat_map(|(a, b)| [a, b]).collect();
        let found = Transience::of(&set, &answers, 2.0).expect("a sequence");
        assert_eq!((found.errors, found.episodes, found.single), (3, 2, 1));
        // All seven of the first column; the second is wrong in the fourth and fifth frame.
        assert_eq!(found.median_correct, 7 + 5);
        let right = Transience::of(&set, &[8.0; 14], 2.0).expect("a sequence");
        assert_eq!((right.errors, right.longest.as_ref(), right.single_of_errors), (0, None, None));
    }

    #[test]
    fn an_error_in_the_last_frame_is_neither_transient_nor_lasting() {
        let set = set(&["a_1.png", "a_2.png", "a_3.png"]);
        // One that is over, one that has just begun; and one that has gone on for two frames, which can be told.
        let answers = [[0.0, 8.0], [8.0, 0.0], [0.0, 0.0]];
        let found = Transience::of(&set, answers.as_flattened(), 1.0).expect("a sequence");
        assert_eq!((found.errors, found.episodes, found.single, found.undecided), (4, 3, 1, 1));
        assert_eq!((found.single_of_errors, found.single_of_episodes), (Some(1.0 / 3.0), Some(0.5)));
        let answers = [[8.0, 8.0], [8.0, 8.0], [0.0, 8.0]];
        let found = Transience::of(&set, answers.as_flattened(), 1.0).expect("a sequence");
        assert_eq!((found.errors, found.undecided, found.single_of_errors), (1, 1, None));
        assert_eq!(found.longest.map(|longest| longest.frames), Some(1));
    }

    #[test]
    fn images_by_themselves_tell_nothing() {
        assert_eq!(Transience::of(&set(&["hall.png", "lab.png"]), &[8.0; 4], 2.0), None);
    }
}
