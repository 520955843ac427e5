//! `vsonar synth`: the recordings of synthetic offices as data folders.

use std::path::PathBuf;

use vsonar::world::office::World;

use super::CliError;
use super::output::{self, count, shell_word};

const EXAMPLES: &str = "\
Examples:
  vsonar synth --world fmrb --out fmrb
      the set that `vsonar evolve --world fmrb` trains on
  vsonar synth --world fmrb --seed 2 --out elsewhere
      another building of the kind
  vsonar synth --world nsh --seed 3 --changed --out changed
      other things and another camera in another building

nsh has people in its hallways, and a wide stripe of other carpet. In fmrb the lights are burned out along part of a
hallway. combined has every other image of both. The images are in the order in which they were taken.";

/// Write what a robot's camera recorded in a synthetic office, as a data folder
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Which office: nsh, fmrb, or combined for every other image of both
    #[arg(long, value_name = "NAME")]
    world: World,
    /// The new folder; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Another building of the kind; each seed is another one [default: the building trained on; with --changed 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Another building with plants, suitcases, cones and open drawers, which are nowhere else, seen by a camera of
    /// another pitch, height and exposure
    #[arg(long)]
    changed: bool,
    /// How many images; of combined, how many of each building before every other one is taken [default: 69 of nsh,
    /// 71 of fmrb]
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
}

/// Writes a folder.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let dir = &args.out;
    if dir.symlink_metadata().is_ok() {
        let text = format!("{}: exists already and is never overwritten; choose another name", dir.display());
        return Err(CliError::Failed(text));
    }
    let set = args.world.recorded(args.seed, args.changed, args.frames)?;
    set.save(dir)?;
    output::print(&format!(
        "{}: {} of {} x {} pixels, {}\nNext: vsonar evolve --data {}\n",
        dir.display(),
        count(set.images().len() as u64, "image"),
        set.width(),
        set.height(),
        count(set.cases().len() as u64, "case"),
        shell_word(dir)
    ))
}
