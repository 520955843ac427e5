//! What is said of figures that tell little: of images that the program was chosen by, or of few images.

use super::cases::Cases;
use super::output::{count, from_here, shell_flag, shell_word};
use super::source::Source;
use super::source_folder::Folder;

/// Images to train on, below which no figure means anything.
const FEW: usize = 20;

/// A word on the figures of a run with these cases, with a command that gives better ones; none if they can be believed.
pub(crate) fn caution(source: &Source, cases: &Cases) -> Option<String> {
    let Source::Folder(folder) = source else { return None };
    let images = cases.train.images().len();
    let few = (images < FEW).then(|| {
        let test =
            if cases.holdout.is_none() { ", and hold some of them out by `--holdout 20%`" } else { "" };
        format!(
            "{} to train on: too few for any figure to mean anything; label some seventy{test}.",
            count(images as u64, "image")
        )
    });
    let untested = (few.is_none() && cases.holdout.is_none()).then(|| {
        format!(
            "No images are held out: these figures are of images that the program was chosen by, and it may do much worse \
             on others. To test it on images that it has not seen:\n  {}",
            command(folder)
        )
    });
    few.or(untested)
}

/// The same run with a part held out.
fn command(folder: &Folder) -> String {
    let mut command = format!("vsonar evolve --data {}", shell_word(&from_here(&folder.train)));
    let flags = [("--train-match", &folder.train_match), ("--validation-match", &folder.validation_match)];
    for (flag, value) in flags.into_iter().chain([("--validation", &folder.validation_part)]) {
        value.iter().for_each(|value| command += &format!(" {}", shell_flag(flag, value)));
    }
    folder
        .validation
        .iter()
        .for_each(|dir| command += &format!(" --validation {}", shell_word(&from_here(dir))));
    command + " --holdout 20%"
}

#[cfg(test)]
mod tests {
    use vsonar::world::Corridor;

    use super::*;

    #[test]
    fn training_figures_are_called_so() {
        let small = Corridor { width: 16, height: 16, columns: 1, ..Corridor::default() };
        let set = |frames| small.render(1, frames).expect("possible");
        let folder =
            Folder { train: "/my photos".into(), train_match: Some("a*".into()), ..Folder::default() };
        let source = Source::Folder(folder);
        let said = |frames, holdout: Option<usize>| {
            let holdout = holdout.map(set);
            caution(&source, &Cases { train: set(frames), validation: None, holdout, left_out: 0 })
        };
        // Of these few no part could be held out.
        let few = said(2, None).expect("two images are nothing");
        assert!(
            few.starts_with("2 images to train on: too few") && few.ends_with("out by `--holdout 20%`."),
            "{few}"
        );
        let untested = said(FEW, None).expect("nothing is held out");
        assert!(
            untested.ends_with("\n  vsonar evolve --data '/my photos' --train-match 'a*' --holdout 20%"),
            "{untested}"
        );
        assert!(
            untested.starts_with("No images are held out") && !untested.contains("too few"),
            "{untested}"
        );
        assert!(said(FEW - 1, Some(5)).is_some_and(|text| !text.contains("--holdout")));
        assert_eq!(said(FEW, Some(5)), None);
    }
}
