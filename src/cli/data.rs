//! `vsonar data`: examine a data folder, or make one.

use std::path::PathBuf;

use clap::Subcommand;
use vsonar::camera::Camera;
use vsonar::dataset::{self, TOLERANCE};
use vsonar::world::{Corridor, FRAMES};

use super::memory::MemoryArgs;
use super::output;
use super::program::size;
use super::synth::not_rendered;
use super::{CliError, data_import, data_resize, data_video, large, recording, source_made};

const EXAMPLES: &str = "\
Examples:
  vsonar data check photos                report on a folder, every fault with its line
  vsonar data synth corridor              write a synthetic corridor, with labels
  vsonar data synth elsewhere --seed 2    another building
  vsonar data import labelme photos --ground floor --out labelled
      a folder of what was annotated with LabelMe; also of masks and COCO
  vsonar data resize photos --size 320x240 --out small
      photographs as small as is useful, with their labels
  vsonar data video drive.mp4 --out frames
      images to be labelled, a frame each second";

/// Check a data folder, or make one: of photographs, of annotated images, of a video, or synthetic
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Report what a data folder holds, the best constant answers as the floor to beat, and every fault
    ///
    /// Ends with exit code 1 if there are faults.
    #[command(after_help = "Example:\n  vsonar data check photos")]
    Check {
        /// Folder with `labels.csv` and the images it names
        dir: PathBuf,
        #[command(flatten)]
        memory: MemoryArgs,
        /// Print the report as JSON
        #[arg(long)]
        json: bool,
    },
    /// Write a synthetic corridor, as a robot's camera sees it, as a data folder
    #[command(
        allow_negative_numbers = true,
        after_help = "Example:\n  vsonar data synth corridor && vsonar evolve --data corridor"
    )]
    Synth {
        /// The new folder; one that exists is left alone
        dir: PathBuf,
        /// Which building; each seed is another one
        #[arg(long, value_name = "N", default_value_t = source_made::BUILDING)]
        seed: u64,
        /// How many images
        #[arg(long, value_name = "N", default_value_t = FRAMES, value_parser = recording::frames())]
        frames: usize,
        /// Width and height of the images in pixels
        #[arg(long, value_name = "WxH", value_parser = size, default_value = "320x240")]
        size: (u32, u32),
        /// The camera that looks, as written by `vsonar calibrate` [default: 0.8 m high, 51 degrees down, 90 degrees wide]
        #[arg(long, value_name = "FILE")]
        camera: Option<PathBuf>,
    },
    Import(data_import::Args),
    Resize(data_resize::Args),
    Video(data_video::Args),
}

/// Checks or writes a folder.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    match args.command {
        Command::Import(args) => data_import::run(args),
        Command::Resize(args) => data_resize::run(args),
        Command::Video(args) => data_video::run(args),
        Command::Check { dir, memory, json } => {
            let report = dataset::check_within(&dir, memory.limit());
            if json {
                output::print_json(&report)?;
            } else {
                let size = report.size();
                let large = size.and_then(|size| large::advice(&dir, size));
                // Scaled images are judged by what they become.
                let note = large.or_else(|| large::tolerance(TOLERANCE, size?.1));
                let note = note.map_or_else(String::new, |note| format!("\nnote: {note}\n"));
                output::print(&format!("{report}{note}"))?;
            }
            if report.is_sound() { Ok(()) } else { Err(CliError::Negative) }
        }
        Command::Synth { dir, seed, frames, size: (width, height), camera } => {
            let mut corridor = Corridor { width, height, ..Corridor::default() };
            if let Some(path) = camera {
                let camera = Camera::load(&path)?;
                corridor.check_camera(&camera).map_err(|e| not_rendered(&path, &e))?;
                corridor = corridor.seen_by(&camera);
            }
            recording::write(&dir, move |progress| Ok(corridor.render_told(seed, frames, progress)?))
        }
    }
}
