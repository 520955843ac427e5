//! How much memory the fitness cases may take.

use vsonar::dataset::{Dataset, Variation};
use vsonar::memory;

use super::output::{count, grouped};
use super::{CliError, large};

const GIB: f64 = (1u64 << 30) as f64;

/// The flag that limits the memory. It is no setting of a run, for results do not depend on it.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub(crate) struct MemoryArgs {
    /// Refuse images that would need more memory than this many GiB [default: three quarters of the machine's memory, 8
    /// where that is unknown]
    ///
    /// What every program needs again and again is computed once and held in memory: about 80 bytes for each
    /// pixel of each image.
    #[arg(long, value_name = "GIB", value_parser = gib, allow_negative_numbers = true)]
    memory: Option<u64>,
}

/// What a set needs.
pub(crate) struct Need {
    bytes: u64,
    images: String,
    /// The command that scales the images, if they are larger than is useful.
    resize: Option<String>,
    /// How many runs at a time need it, each for itself.
    times: u64,
}

impl Need {
    /// As it is.
    pub(crate) fn of(set: &Dataset) -> Need {
        Need::grown(set, &Variation::NONE)
    }

    /// With altered copies of its images.
    pub(crate) fn grown(set: &Dataset, variation: &Variation) -> Need {
        let images = set.images().len() as u64;
        let mut number = count(images, "image");
        if variation.copies() > 0 {
            number += &format!(" with {} altered copies", grouped(images * u64::from(variation.copies())));
        }
        let images = format!("{number} of {} x {} pixels", set.width(), set.height());
        let resize = set.folder().and_then(|dir| large::command(dir, (set.width(), set.height())));
        Need { bytes: variation.memory_needed(set), images, resize, times: 1 }
    }

    /// One image of this size.
    pub(crate) fn image((width, height): (u32, u32)) -> Need {
        // the image, and what is computed of it
        let bytes = 81 * u64::from(width) * u64::from(height);
        Need { bytes, images: format!("an image of {width} x {height} pixels"), resize: None, times: 1 }
    }

    /// The same for each of so many runs at a time.
    pub(crate) fn times(self, runs: usize) -> Need {
        Need { times: runs as u64, ..self }
    }
}

impl MemoryArgs {
    /// Bytes that may be taken.
    pub(crate) fn limit(self) -> u64 {
        self.memory.unwrap_or_else(memory::default_limit)
    }

    /// Refuses sets that do not fit into memory together, and tells how many bytes are left if they do. To be asked
    /// before their cases are prepared.
    pub(crate) fn check<'a>(self, sets: impl IntoIterator<Item = &'a Dataset>) -> Result<u64, CliError> {
        self.check_needs(sets.into_iter().map(Need::of))
    }

    /// The same for sets of which some are to grow.
    pub(crate) fn check_needs(self, needs: impl IntoIterator<Item = Need>) -> Result<u64, CliError> {
        let limit = self.limit();
        let (mut need, mut images, mut fewer, mut resize) = (0u64, Vec::new(), "", None);
        for one in needs {
            resize = resize.or(one.resize);
            need = need.saturating_add(one.bytes.saturating_mul(one.times));
            images.push(match one.times {
                1 => one.images,
                times => {
                    fewer = "ask for fewer `--jobs`, ";
                    format!("{} for each of {times} runs at a time", one.images)
                }
            });
        }
        if need <= limit {
            return Ok(limit - need);
        }
        let need = thousandths(need).ceil() / 1000.0;
        let resize = resize.map_or_else(
            || " (half the width and height need a quarter)".to_string(),
            |command| format!(", labels and all, with `{command}`"),
        );
        Err(CliError::Failed(format!(
            "about {need} GiB of memory are needed for {}, but the limit is {} GiB; {fewer}scale the images down{resize}, use \
             fewer images, or raise the limit with `--memory {need}`",
            images.join(" and "),
            thousandths(limit).floor() / 1000.0,
        )))
    }
}

/// Thousandths of a GiB.
fn thousandths(bytes: u64) -> f64 {
    bytes as f64 / GIB * 1000.0
}

/// A number of GiB, in bytes.
fn gib(text: &str) -> Result<u64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    // A number beyond all memory there is becomes the largest.
    number
        .map(|number| (number * GIB).ceil() as u64)
        .ok_or_else(|| "give a number of GiB above 0".to_string())
}

#[cfg(test)]
mod tests {
    use image::GrayImage;
    use vsonar::dataset::{Case, NamedImage};

    use super::*;

    #[test]
    fn numbers_of_gib() {
        assert_eq!((gib("1"), gib("0.5"), gib("1e99")), (Ok(1 << 30), Ok(1 << 29), Ok(u64::MAX)));
        for text in ["0", "-1", "nan", "inf", "much", ""] {
            assert!(gib(text).expect_err(text).contains("above 0"));
        }
    }

    #[test]
    fn the_limit_that_is_advised_is_enough() {
        let image = NamedImage { name: "a.png".into(), pixels: GrayImage::new(64, 48) };
        let set = Dataset::new("set", vec![image], vec![Case { image: 0, x: 1, y: 1 }]).expect("sound");
        let refused = |sets: &[&Dataset], memory| {
            MemoryArgs { memory: Some(memory) }.check(sets.iter().copied()).err().map(|error| match error {
                CliError::Failed(text) => text,
                other => panic!("{other:?}"),
            })
        };
        let need = set.memory_needed();
        assert_eq!(refused(&[&set], need), None);
        assert!(refused(&[&set, &set], 2 * need - 1).is_some() && refused(&[&set, &set], 2 * need).is_none());
        let text = refused(&[&set], need - 1).expect("too little");
        assert!(text.contains("are needed for 1 image of 64 x 48 pixels, but"), "{text}");
        let variation = Variation { copies: 3, mirror: 1.0, ..Variation::NONE };
        let four: Vec<NamedImage> =
            (0..4).map(|i| NamedImage { name: format!("{i}.png"), pixels: GrayImage::new(64, 48) }).collect();
        let cases = (0..4).map(|image| Case { image, x: 1, y: 1 }).collect();
        let grown = Dataset::new("four", four, cases).expect("sound").memory_needed() + 3 * 64 * 48;
        let check = |memory| MemoryArgs { memory: Some(memory) }.check_needs([Need::grown(&set, &variation)]);
        assert!(check(grown - 1).is_err() && check(grown).is_ok(), "as four images, three of them new");
        let eight = |memory| {
            let needs = [Need::grown(&set, &variation).times(8), Need::of(&set)];
            MemoryArgs { memory: Some(memory) }.check_needs(needs)
        };
        let all = 8 * variation.memory_needed(&set) + need;
        assert!(eight(all).is_ok(), "each for itself");
        let Err(CliError::Failed(refusal)) = eight(all - 1) else { panic!("that is too little") };
        assert_eq!(refusal.matches("pixels").count(), 2, "{refusal}");
        assert!(refusal.contains("pixels for each of 8 runs at a time and 1 image of"), "{refusal}");
        assert!(refusal.contains("fewer `--jobs`") && !text.contains("--jobs"), "{refusal}");
        let advised = text.split("--memory ").nth(1).expect("a remedy").trim_end_matches('`');
        assert_eq!(refused(&[&set], gib(advised).expect("a number")), None);
    }
}
