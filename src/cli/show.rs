//! `vsonar show`: pictures of a program's answers.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use image::{ImageFormat, RgbImage};
use rayon::prelude::*;
use vsonar::dataset::TOLERANCE;
use vsonar::frames::Rate;
use vsonar::report::{MAX_SCALE, MOST_DETECTORS, Style, Tile, fitting_scale};
use vsonar::support::printable::ShownPath as _;
use vsonar::tree::Individual;
use vsonar::world::office::World;

use super::eval_cases::{cases_of, run_of};
use super::executor::{Choice, answers};
use super::gray_note::note_gray;
use super::memory::MemoryArgs;
use super::new_folder::NewFolder;
use super::output::{self, count};
use super::progress::Bar;
use super::show_drawing::Drawing;
use super::show_video::Video;
use super::{CliError, eval, interrupt, program, progress, source_made};

const EXAMPLES: &str = "\
Examples:
  vsonar show runs/photos-seed-1/best.gp --data photos --out pictures
  vsonar show best.gp --data photos --match 'run_C*' --sheet-columns 4 --out pictures
  vsonar show runs/fmrb-seed-1/best.gp --out pictures
  vsonar show runs/fmrb-seed-1/best.gp runs/fmrb-seed-2/best.gp --out pictures --video answers.mp4 --fps 4

White bars cover what the program takes for ground, black bars what it takes for an obstacle. A cross stands at \
the ideal answer, a square of the size of the program's window at its own; both are green where the answer is \
correct. Where it is wrong they are orange, with a ring around the answer. An answer outside the image has an \
arrow head at that border, one that is not a number a question mark and a dashed bar. Of several programs each has a bar \
of its own colour, with its letter at the foot, and a line below the picture.";

/// The sheet of all pictures.
const SHEET: &str = "contact-sheet";

/// Pictures on one sheet; further ones go to further sheets, so that no sheet grows beyond what a viewer opens.
const SHEET_TILES: usize = 240;

/// Draw a program's answers into the images, or those of several side by side
///
/// Writes a PNG for each image, and all of them on a contact sheet of at most 2 MB, the worst first: contact-sheet.png
/// (with more than 240 images also contact-sheet-2.png and so on).
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The program, a .gp file, or a run folder, for its best one; or several, to be seen side by side
    #[arg(required = true, value_name = "PROGRAM")]
    programs: Vec<PathBuf>,
    /// Folder with `labels.csv` and the images it names [default: what the run of the program given first holds out, or what
    /// it is trained on if that is nothing or the run goes on; without a run the held-out building of the world fmrb]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Only the images whose names match this pattern, e.g. 'run_C*'
    #[arg(long = "match", value_name = "GLOB")]
    pattern: Option<String>,
    /// The folder to make; one that exists is left alone
    #[arg(long, value_name = "DIR", required_unless_present = "video")]
    out: Option<PathBuf>,
    /// Write the pictures as frames of a video, too: .y4m, or through the installed ffmpeg .mp4, .mkv, .mov or .webm; a
    /// file that exists is left alone
    #[arg(long, value_name = "FILE")]
    video: Option<PathBuf>,
    /// Frames a second of the video
    #[arg(long, value_name = "N", default_value = "4", requires = "video")]
    fps: Rate,
    /// What runs the program; all give the same answers
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Choice::Auto)]
    executor: Choice,
    #[command(flatten)]
    memory: MemoryArgs,
    #[arg(long, value_name = "ROWS", value_parser = eval::tolerance, allow_negative_numbers = true, help = eval::tolerance_help())]
    tolerance: Option<f64>,
    /// Pictures side by side on the contact sheet
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=64))]
    sheet_columns: u32,
    /// Enlarge the images this many times [default: to a width of about 640 pixels]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SCALE)))]
    scale: Option<u32>,
}

/// Draws the pictures.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    pictures(args, interrupt::stop_flag)
}

/// Draws the pictures. `watch` is called once there is something that Ctrl-C must not leave behind, and gives
/// the flag that it sets.
fn pictures(args: Args, watch: impl FnOnce() -> Result<Arc<AtomicBool>, CliError>) -> Result<(), CliError> {
    if args.programs.len() > MOST_DETECTORS {
        let text = format!(
            "{} programs are more than fit into a picture; give {MOST_DETECTORS} at most",
            args.programs.len()
        );
        return Err(CliError::Usage(text));
    }
    let programs = args.programs.iter().map(|path| program::file(path)).collect::<Result<Vec<_>, _>>()?;
    let loaded = programs.iter().map(Individual::load_with_text).collect::<Result<Vec<_>, _>>()?;
    let mut folder = args.out.as_deref().map(NewFolder::check).transpose()?;
    let video = args.video.as_deref().map(Video::check).transpose()?;
    let _busy = Bar::spinner(progress::Style::of(false), "drawing the pictures");
    let executor = args.executor.make()?;
    let first = &args.programs[0];
    let run = run_of(first).filter(|_| args.data.is_none());
    let own = cases_of(run.as_deref().unwrap_or(first), args.data.as_deref(), None, None, args.memory)?;
    let (mut set, tolerance) = own.unwrap_or_else(|| {
        let set = World::Fmrb.elsewhere(source_made::other_office());
        (set.named("the held-out images of the world fmrb"), TOLERANCE)
    });
    let tolerance = args.tolerance.unwrap_or(tolerance);
    if let Some(pattern) = &args.pattern {
        set = set.select(pattern)?;
    }
    args.memory.check([&set])?;
    if args.data.is_some() {
        args.programs.iter().for_each(|program| note_gray(program));
    }
    for (path, (_, text)) in programs.iter().zip(&loaded) {
        program::note_size(path, text, (set.width(), set.height()));
    }
    let individuals: Vec<Individual> = loaded.into_iter().map(|(individual, _)| individual).collect();
    let answers: Vec<Vec<f32>> = individuals
        .iter()
        .map(|individual| answers(&*executor, individual, &set))
        .collect::<Result<_, _>>()?;
    let window = match &individuals[..] {
        [only] => Some(only.second().rect()),
        _ => None,
    };
    let style = Style { tolerance, window, scale: args.scale.unwrap_or_else(|| fitting_scale(set.width())) };
    let drawing = Drawing::new(&set, &args.programs, &answers, style);
    let stop = watch()?;
    let mut said = String::new();
    if let (Some(folder), Some(out)) = (&mut folder, &args.out) {
        let sheets = write_pictures(&drawing, folder, args.sheet_columns as usize, &stop)?;
        let images = count(set.images().len() as u64, "picture");
        said += &format!(
            "{}: {images} of {}, all of them on {}\n",
            out.shown(),
            Path::new(set.name()).shown(),
            sheets.join(", ")
        );
    }
    if let (Some(video), Some(path)) = (video, &args.video) {
        let frames = (0..set.images().len()).map(|i| drawing.keyed(i, &drawing.picture(i)));
        video.write(frames, args.fps, &stop)?;
        let images = count(set.images().len() as u64, "frame");
        said += &format!("{}: {images}\n", path.shown());
    }
    // At the end, so that nothing appears if anything fails.
    folder.map_or(Ok(()), NewFolder::finish)?;
    output::print(&format!("{said}{}\n", drawing.result()))
}

/// Writes a picture of each image and the sheets into the folder; the names of the sheets.
fn write_pictures(
    drawing: &Drawing,
    folder: &mut NewFolder,
    sheet_columns: usize,
    stop: &AtomicBool,
) -> Result<Vec<String>, CliError> {
    let images = drawing.set().images();
    let sheets = sheet_names(images.len());
    let names = file_names(images.iter().map(|i| i.name.as_str()), &sheets);
    let go_on = || match stop.load(Ordering::Relaxed) {
        true => Err(CliError::Interrupted("interrupted; no pictures were written".to_string())),
        false => Ok(()),
    };
    folder.make()?;
    let folder = &*folder;
    for (sheet, part) in sheets.iter().zip(drawing.worst_first().chunks(SHEET_TILES)) {
        let tile = |&i: &usize| -> Result<Tile, CliError> {
            go_on()?;
            let picture = drawing.picture(i);
            folder.write(&names[i], &png(&drawing.keyed(i, &picture))?)?;
            Ok(drawing.tile(i, &picture))
        };
        let tiles = part.par_iter().map(tile).collect::<Result<Vec<Tile>, CliError>>()?;
        go_on()?;
        folder.write(sheet, &drawing.sheet(&tiles, sheet_columns)?)?;
    }
    go_on()?;
    Ok(sheets)
}

fn png(picture: &RgbImage) -> Result<Vec<u8>, CliError> {
    let mut png = Cursor::new(Vec::new());
    picture.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}

/// The names of the sheets for this many images.
fn sheet_names(images: usize) -> Vec<String> {
    let name = |n| if n == 1 { format!("{SHEET}.png") } else { format!("{SHEET}-{n}.png") };
    (1..=images.div_ceil(SHEET_TILES)).map(name).collect()
}

/// A file name for each image: its own with the ending `.png`; where that is taken, on a file system that does
/// not tell capitals apart either, `.png` behind the whole name, and then numbers.
fn file_names<'a>(images: impl Iterator<Item = &'a str>, sheets: &[String]) -> Vec<String> {
    let mut taken: BTreeSet<String> = sheets.iter().cloned().collect();
    images
        .map(|image| {
            // the last part only, for a folder's name may have a dot too
            let leaf = image.rfind('/').map_or(0, |slash| slash + 1);
            let stem = match image[leaf..].rfind('.') {
                None | Some(0) => image,
                Some(dot) => &image[..leaf + dot],
            };
            let numbered = (2u64..).map(|n| format!("{image}-{n}.png"));
            [format!("{stem}.png"), format!("{image}.png")]
                .into_iter()
                .chain(numbered)
                .find(|name| taken.insert(name.to_lowercase()))
                .unwrap_or_default()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;
    use image::{GrayImage, Luma};
    use vsonar::dataset::{Case, Dataset, NamedImage};

    /// Answers the lowest row at which the gradient is more than 50.
    const PROGRAM: &str = "(individual (iterate-up 3x3 x-obstacle
        (if-le gradient 50 read-a (prog2 (set-a y) break))))";

    /// A folder with a program and a data set in it.
    fn place(names: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().expect("a temporary folder");
        fs::write(dir.path().join("p.gp"), PROGRAM).expect("writable");
        let pixels = GrayImage::from_fn(32, 24, |_, y| Luma([if y < 10 { 200 } else { 40 }]));
        let images = names.iter().map(|&n| NamedImage { name: n.into(), pixels: pixels.clone() }).collect();
        let cases = (0..names.len()).flat_map(|image| [8, 24].map(|x| Case { image, x, y: 9 })).collect();
        let set = Dataset::new("data", images, cases).expect("sound");
        set.save(dir.path().join("data")).expect("writable");
        dir
    }

    fn args(dir: &Path) -> Args {
        Args {
            programs: vec![dir.join("p.gp")],
            data: Some(dir.join("data")),
            pattern: None,
            out: Some(dir.join("out")),
            video: None,
            fps: "4".parse().expect("a rate"),
            executor: Choice::Reference,
            memory: MemoryArgs::default(),
            tolerance: None,
            sheet_columns: 2,
            scale: Some(2),
        }
    }

    /// A process can watch for Ctrl-C only once, so the tests do not.
    fn shown(args: Args) -> Result<(), CliError> {
        pictures(args, || Ok(Arc::default()))
    }

    fn entries(dir: &Path) -> Vec<String> {
        let entries = fs::read_dir(dir).expect("a folder").map(|e| e.expect("readable"));
        let mut names: Vec<_> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn writes_a_picture_an_image_and_a_sheet() {
        let dir = place(&["a.png", "sub/b.png", "c.png"]);
        shown(args(dir.path())).expect("sound input");
        assert_eq!(entries(dir.path()), ["data", "out", "p.gp"]);
        assert_eq!(entries(&dir.path().join("out")), ["a.png", "c.png", "contact-sheet.png", "sub"]);
        assert_eq!(entries(&dir.path().join("out/sub")), ["b.png"]);
        let picture = image::open(dir.path().join("out/a.png")).expect("a picture").into_rgb8();
        assert_eq!(picture.dimensions(), (64, 48));
        // away from the marks: an obstacle at the top of column 8, ground at its bottom
        assert_eq!(*picture.get_pixel(17, 1), image::Rgb([0, 0, 0]));
        assert_eq!(*picture.get_pixel(17, 46), image::Rgb([255, 255, 255]));
    }

    #[test]
    fn a_pattern_selects() {
        let dir = place(&["a.png", "b.png"]);
        shown(Args { pattern: Some("b*".into()), ..args(dir.path()) }).expect("sound input");
        assert_eq!(entries(&dir.path().join("out")), ["b.png", "contact-sheet.png"]);
    }

    #[test]
    fn errors_leave_nothing_behind() {
        let dir = place(&["a.png"]);
        let before = entries(dir.path());
        let fails = |args: Args, text: &str| match shown(args) {
            Err(CliError::Failed(message)) => assert!(message.contains(text), "{message}"),
            other => panic!("{other:?}"),
        };
        fails(Args { pattern: Some("z*".into()), ..args(dir.path()) }, "z*");
        fails(Args { out: Some(dir.path().join("data")), ..args(dir.path()) }, "exists already");
        fails(Args { out: Some(dir.path().join("no/out")), ..args(dir.path()) }, "cannot make the folder");
        fails(Args { out: Some(dir.path().join("..")), ..args(dir.path()) }, "does not name");
        fails(Args { programs: vec![dir.path().join("no.gp")], ..args(dir.path()) }, "no.gp");
        assert_eq!(entries(dir.path()), before);

        let mut folder = NewFolder::check(&dir.path().join("out")).expect("free");
        folder.make().expect("writable");
        folder.write("x.png", b"x").expect("writable");
        // the name of a folder that would have to be inside a file
        folder.write("x.png/y.png", b"y").expect_err("in the way");
        drop(folder);
        assert_eq!(entries(dir.path()), before);
        // somebody else takes the name in the meantime
        let mut folder = NewFolder::check(&dir.path().join("out")).expect("free");
        folder.make().expect("writable");
        fs::write(dir.path().join("out"), "theirs").expect("writable");
        folder.finish().expect_err("in the way");
        assert_eq!(fs::read(dir.path().join("out")).expect("still there"), b"theirs");
        assert_eq!(entries(dir.path()), ["data", "out", "p.gp"]);
    }

    #[test]
    fn an_interruption_leaves_nothing_behind() {
        let dir = place(&["a.png", "b.png"]);
        let before = entries(dir.path());
        let interrupted = pictures(args(dir.path()), || Ok(Arc::new(AtomicBool::new(true))));
        assert!(matches!(interrupted, Err(CliError::Interrupted(_))), "{interrupted:?}");
        assert_eq!(entries(dir.path()), before);
    }

    #[test]
    fn no_two_files_have_one_name() {
        let names = |images: &[&str]| file_names(images.iter().copied(), &sheet_names(1));
        assert_eq!(names(&["a.jpg", "d.x/b.pgm", "c", ".d"]), ["a.png", "d.x/b.png", "c.png", ".d.png"]);
        assert_eq!(names(&["a.png", "a.jpg", "A.bmp"]), ["a.png", "a.jpg.png", "A.bmp.png"]);
        assert_eq!(
            names(&["a.png", "b.png", "a.jpg.png", "a.jpg"]),
            ["a.png", "b.png", "a.jpg.png", "a.jpg-2.png"]
        );
        assert_eq!(names(&["contact-sheet.png"]), ["contact-sheet.png.png"]);
    }

    #[test]
    fn many_images_take_several_sheets() {
        assert_eq!(sheet_names(SHEET_TILES), ["contact-sheet.png"]);
        assert_eq!(sheet_names(SHEET_TILES + 1), ["contact-sheet.png", "contact-sheet-2.png"]);
    }
}
