//! `vsonar data import`: a data folder from annotated pictures.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Subcommand;
use vsonar::dataset::import::{
    Classes, Crop, Found, Labels, Named, ValueCounts, Values, View, coco, labelme, masks,
};

use super::CliError;
use super::data_import_names::{Names, listed};
use super::data_import_write::write;
use super::memory::MemoryArgs;
use super::new_folder::NewFolder;
use super::program::size;
use super::run_columns::{self, Columns};

const EXAMPLES: &str = "\
Examples:
  vsonar data import masks photos masks --ground 1 --out labelled
  vsonar data import labelme photos --ground floor,rug --size 320x240 --out labelled
  vsonar data import coco instances.json --images photos --obstacle chair,person --out labelled

What is ground is decided for the pixels of the original picture. Then the part `--crop` is cut out and scaled to `--size`, \
and the label of a column is the lowest row whose middle is in an original pixel that is not ground. The new folder is \
checked as by `vsonar data check`; it appears complete or not at all.";

const MASKS: &str = "\
Examples:
  vsonar data import masks photos masks --ground 7,8 --out labelled
      photos/a.jpg belongs to masks/a.png, in which road (7) and pavement (8) are ground, as in Cityscapes
  vsonar data import masks leftImg8bit/val gtFine/val --ground 7,8 --ignore 0,1,2,3 \\
      --image-suffix _leftImg8bit --mask-suffix _gtFine_labelIds \\
      --crop 0,0,2048,850 --size 512x212 --out streets
      Cityscapes itself, without the bonnet of the car
  vsonar data import masks photos masks --ground '#804080' --mask-suffix _color --out labelled

Numbers are the stored gray levels of masks of 1 to 16 bits, also of gray stored as RGB and of GIF with a gray palette, or \
else indices into a palette, which some programs number anew when they write GIF; colours are compared exactly. A \
column whose label depends on what ignored pixels are gets none. A value that is in no class counts as an obstacle, and is \
reported: without --obstacle, one that occurs mostly in single pixels, as smoothed masks have them at edges.";

const LABELME: &str = "\
Examples:
  vsonar data import labelme photos --ground floor --out labelled
  vsonar data import labelme a.json b.json --obstacle chair,wall --ignore mirror --out labelled

With `--ground` all is an obstacle but the shapes of these names, with `--obstacle` all is ground but them; of shapes that \
cover each other the last one counts. A pixel is in a polygon if its centre is (even-odd rule). Shapes without an area are \
skipped and counted, unless their name was asked for.";

const COCO: &str = "\
Examples:
  vsonar data import coco instances.json --images photos --ground floor --out labelled
  vsonar data import coco instances.json --images photos --obstacle chair,person --columns 40,160,280 --out labelled

Polygons and run lengths are read, as numbers or as text. Of objects that cover each other an obstacle counts more than \
ground. With `--ground`, pictures without any object are left out; with `--obstacle` all of them is ground. Objects \
without an outline, with a box at most, are skipped and counted.";

/// Make a data folder of annotated images: from masks, LabelMe or COCO
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand)]
enum Kind {
    /// A mask for each image, whose numbers or colours tell what is ground
    #[command(after_help = MASKS)]
    Masks {
        /// Folder with the images, and folders within
        images: PathBuf,
        /// Folder with the masks, by the same names but for the ending
        masks: PathBuf,
        /// The numbers or the colours of the ground, as 7,8 or '#804080,#f423e8'
        #[arg(long, value_name = "VALUES")]
        ground: Values,
        /// Those of obstacles: pixels of values that are in no class are then reported [default: all other values]
        #[arg(long, value_name = "VALUES")]
        obstacle: Option<Values>,
        /// Those of pixels of which nobody knows
        #[arg(long, value_name = "VALUES")]
        ignore: Option<Values>,
        /// What names of images end with before the ending; others do not count
        #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
        image_suffix: String,
        /// What names of masks end with
        #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
        mask_suffix: String,
        #[command(flatten)]
        wanted: Wanted,
    },
    /// LabelMe's JSON files, one for each image
    #[command(after_help = LABELME)]
    Labelme {
        /// JSON files, or folders with them
        #[arg(required = true, value_name = "DIR|FILE")]
        paths: Vec<PathBuf>,
        /// Folder with the images, by the last parts of their names [default: inside the JSON files, or the files they name]
        #[arg(long, value_name = "DIR")]
        images: Option<PathBuf>,
        #[command(flatten)]
        labels: LabelArgs,
        #[command(flatten)]
        wanted: Wanted,
    },
    /// A COCO file with the objects of many images
    #[command(after_help = COCO)]
    Coco {
        /// The JSON file
        annotations: PathBuf,
        /// Folder with the images, by their names or the last parts of them
        #[arg(long, value_name = "DIR")]
        images: PathBuf,
        #[command(flatten)]
        labels: LabelArgs,
        #[command(flatten)]
        wanted: Wanted,
    },
}

/// Which names are ground.
#[derive(clap::Args)]
struct LabelArgs {
    #[command(flatten)]
    named: NamedArgs,
    /// The names of what nobody knows whether it is ground
    #[arg(long, value_name = "NAMES")]
    ignore: Vec<Names>,
}

#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct NamedArgs {
    /// The names of the ground; all else is an obstacle. Names stand between commas, one with a comma in double quotes, as
    /// in '"tiles, wet",rug'; the flag can be given again
    #[arg(long, value_name = "NAMES")]
    ground: Vec<Names>,
    /// The names of obstacles; all else is ground
    #[arg(long, value_name = "NAMES")]
    obstacle: Vec<Names>,
}

impl LabelArgs {
    fn labels(self) -> Labels {
        let (named, names) = match self.named.obstacle.is_empty() {
            true => (Named::Ground, self.named.ground),
            false => (Named::Other, self.named.obstacle),
        };
        let set = |names: Vec<Names>| names.into_iter().flat_map(|names| names.0).collect::<BTreeSet<_>>();
        Labels { named, names: set(names), ignored: set(self.ignore) }
    }
}

/// What is wanted of every picture.
#[derive(clap::Args)]
pub(super) struct Wanted {
    /// The new folder; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// How many columns of each image, in the middle of equal parts, or which, as 26,80,134; of the images as they
    /// become
    #[arg(long, value_name = "N|X,X", default_value = "6", value_parser = run_columns::parse)]
    pub(super) columns: Columns,
    #[command(flatten)]
    pub(super) view: ViewArgs,
    /// Leave out objects and images that are damaged or make no sense, and say so, instead of giving up
    #[arg(long)]
    pub(super) skip_faulty: bool,
    #[command(flatten)]
    pub(super) memory: MemoryArgs,
    /// Print what was done, and the report on the folder, as JSON
    #[arg(long)]
    pub(super) json: bool,
}

/// Which part of a picture, and of what size.
#[derive(clap::Args)]
pub(super) struct ViewArgs {
    /// Cut this part out of each image first, in pixels
    #[arg(long, value_name = "LEFT,TOP,WIDTH,HEIGHT", value_parser = crop)]
    crop: Option<Crop>,
    /// Then scale it to this width and height; proportions are kept only if they are the same
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
}

impl ViewArgs {
    pub(super) fn view(&self) -> View {
        View { crop: self.crop, size: self.size }
    }
}

pub(super) fn crop(text: &str) -> Result<Crop, String> {
    let wrong = || "write four whole numbers of pixels, as in 0,40,640,400".to_string();
    let numbers: Option<Vec<u32>> = text.split(',').map(|text| text.trim().parse().ok()).collect();
    match numbers.ok_or_else(wrong)?[..] {
        [left, top, width, height] if width > 0 && height > 0 => Ok(Crop { left, top, width, height }),
        _ => Err(wrong()),
    }
}

/// Makes a folder.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    match args.kind {
        Kind::Masks { images, masks, ground, obstacle, ignore, image_suffix, mask_suffix, wanted } => {
            let (obstacles, ignored) = (obstacle.unwrap_or_default(), ignore.unwrap_or_default());
            for (flag, values) in [("obstacle", &obstacles), ("ignore", &ignored)] {
                if !values.0.is_empty() && values.are_colours() != ground.are_colours() {
                    return Err(CliError::Usage(format!(
                        "--{flag}: give numbers where --ground has numbers, and colours where it has colours"
                    )));
                }
                if let Some(both) = values.0.intersection(&ground.0).next() {
                    return Err(CliError::Usage(format!(
                        "--{flag}: {both} is ground too; decide for one of them"
                    )));
                }
            }
            if let Some(both) = ignored.0.intersection(&obstacles.0).next() {
                return Err(CliError::Usage(format!(
                    "--ignore: {both} is an obstacle too; decide for one of them"
                )));
            }
            let classes = Classes { ground, obstacles, ignored };
            let folder = NewFolder::check(&wanted.out)?;
            let folders = masks::Folders { images, masks, image_suffix, mask_suffix };
            let found = masks::find(&folders, &classes)?;
            let no_ground = |values: &ValueCounts| {
                let mut shown: Vec<String> =
                    values.iter().take(33).map(|(value, _)| value.to_string()).collect();
                if shown.len() > 32 {
                    shown[32] = "others".to_string();
                }
                format!(
                    "no mask has a pixel of --ground {} in the columns asked for; the values there are {}; choose among them",
                    classes.ground,
                    shown.join(", ")
                )
            };
            write(found, wanted, folder, Some(&classes), no_ground)
        }
        Kind::Labelme { paths, images, labels, wanted } => {
            let folder = NewFolder::check(&wanted.out)?;
            let labels = labels.labels();
            let found = labelme::find(&paths, images.as_deref(), &labels)?;
            known(&labels, &found, "shape is labelled")?;
            write(found, wanted, folder, None, |_| no_ground(&labels))
        }
        Kind::Coco { annotations, images, labels, wanted } => {
            let folder = NewFolder::check(&wanted.out)?;
            let labels = labels.labels();
            let found = coco::find(&annotations, &images, &labels)?;
            known(&labels, &found, "category is named")?;
            write(found, wanted, folder, None, |_| no_ground(&labels))
        }
    }
}

/// Refuses names that do not occur, for then they are misspelt.
fn known(labels: &Labels, found: &Found, what: &str) -> Result<(), CliError> {
    // Where a file could not be read, its labels are unknown, and its fault is what matters.
    match labels.unknown(&found.labels).next() {
        Some(name) if found.faulty.is_empty() && found.faulty_objects.is_empty() => {
            let there = listed(found.labels.iter().map(String::as_str).take(40));
            let there = if there.is_empty() { "none".to_string() } else { there };
            Err(CliError::Failed(format!("no {what} {}; there are: {there}", listed([name.as_str()]))))
        }
        _ => Ok(()),
    }
}

fn no_ground(labels: &Labels) -> String {
    match labels.named {
        Named::Ground => {
            format!(
                "nothing is ground in the columns asked for, with --ground {}; is it all of it?",
                listed(labels.names.iter().map(String::as_str))
            )
        }
        Named::Other => {
            "nothing is ground in the columns asked for; are the obstacles named right?".to_string()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_pictures() {
        assert_eq!(crop("1, 2,30,40"), Ok(Crop { left: 1, top: 2, width: 30, height: 40 }));
        for wrong in
            ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,0", "-1,2,3,4", "1,2,3,4294967296", "a,b,c,d"]
        {
            assert!(crop(wrong).is_err(), "{wrong}");
        }
    }
}
