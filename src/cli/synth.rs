//! `vsonar synth`: the recordings of synthetic offices as data folders.

use std::path::{Path, PathBuf};

use vsonar::camera::{Camera, CameraError};
use vsonar::dataset::Dataset;
use vsonar::support::bounded::Bounded;
use vsonar::world::Progress;
use vsonar::world::office::{Office, OfficeError, Plan, Setup, World, record_told};

use super::{CliError, recording};
use vsonar::support::printable::ShownPath as _;

const EXAMPLES: &str = "\
Examples:
  vsonar synth --world fmrb --out fmrb
      the set that `vsonar evolve --world fmrb` trains on
  vsonar synth --world fmrb --seed 2 --out elsewhere
      another building of the kind
  vsonar synth --world nsh --seed 3 --changed --out changed
      other things and another camera in another building
  vsonar synth --plan attic.plan --camera camera.toml --out attic
      a building of your own: its lines are explained at `Plan` in the library's documentation

nsh has people in its hallways, and a wide stripe of other carpet. In fmrb the lights are burned out along part of a \
hallway. combined has every other image of both. The images are in the order in which they were taken.";

/// Write what a robot's camera recorded in a synthetic office, as a data folder
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub(crate) struct Args {
    /// Which office: nsh, fmrb, or combined for every other image of both
    #[arg(long, value_name = "NAME", required_unless_present = "plan")]
    world: Option<World>,
    /// A building of your own instead, from this file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["world", "changed"])]
    plan: Option<PathBuf>,
    /// The camera that looks at it, as written by `vsonar calibrate` [default: 0.8 m high, 51 degrees down, 90 degrees
    /// wide]
    #[arg(long, value_name = "FILE", requires = "plan", conflicts_with = "world")]
    camera: Option<PathBuf>,
    /// The new folder; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Another building of the kind; each seed is another one [default: the building trained on; with --changed 3];
    /// with --plan another drive through it [default: 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The building of the seed with plants, suitcases, cones and open drawers, which are nowhere else, seen by a camera of
    /// another pitch, height and exposure
    #[arg(long)]
    changed: bool,
    /// How many images; of combined, how many of each building before every other one is taken [default: 69 of nsh,
    /// 71 of fmrb, 70 with --plan]
    #[arg(long, value_name = "N", value_parser = recording::frames())]
    frames: Option<usize>,
}

/// Writes a folder.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let dir = args.out.clone();
    recording::write(&dir, move |progress| match (args.world, &args.plan) {
        (Some(world), _) => Ok(world.recorded_told(args.seed, args.changed, args.frames, progress)?),
        (None, Some(plan)) => planned(plan, &args, progress),
        (None, None) => Err(CliError::Usage("give --world or --plan".to_string())),
    })
}

/// Reads a plan; the library takes no longer ones. It may come through a pipe.
const PLAN: Bounded = Bounded::to(1 << 20).or_pipes();
/// Images of a building of one's own.
const FRAMES: usize = 70;

/// What is recorded in the building of a file.
fn planned(path: &Path, args: &Args, progress: &Progress) -> Result<Dataset, CliError> {
    let text = PLAN.text(path).map_err(|e| CliError::file(path, "read the plan", &e))?;
    let plan: Plan = text.parse().map_err(|e| CliError::Failed(located(path, &format!("{e}"))))?;
    let mut setup = Setup::default();
    if let Some(path) = &args.camera {
        let camera = Camera::load(path)?;
        setup.check_camera(&camera).map_err(|e| not_rendered(path, &e))?;
        setup = setup.seen_by(&camera);
    }
    let office = Office::build(&plan, &setup, 0)?;
    let (frames, seed) = (args.frames.unwrap_or(FRAMES), args.seed.unwrap_or(1));
    record_told(&office, "plan", frames, seed, progress).map_err(|e| match e {
        OfficeError::Start { start, .. } => {
            let line = line_of_start(&text, start).map_or(String::new(), |line| format!("{line}:"));
            CliError::Failed(format!("{}:{line} {e}", path.shown()))
        }
        OfficeError::NoStart { .. } => CliError::Failed(format!("{}: {e}", path.shown())),
        e => e.into(),
    })
}

/// Where in the text of a plan its start of this number is, the first being 0: a line, from 1.
fn line_of_start(text: &str, start: usize) -> Option<usize> {
    let is_start = |line: &str| line.split_whitespace().next().is_some_and(|word| word == "start");
    text.lines().enumerate().filter(|(_, line)| is_start(line)).nth(start).map(|(i, _)| i + 1)
}

/// A camera's file that can be right, but by which no pictures are rendered.
pub(crate) fn not_rendered(path: &Path, error: &CameraError) -> CliError {
    CliError::Failed(format!("{}: no pictures are rendered by this camera: {error}", path.shown()))
}

/// `FILE:3: ...` for what begins with `line 3: `, as compilers have it.
fn located(path: &Path, error: &str) -> String {
    let path = path.shown();
    match error.strip_prefix("line ").and_then(|rest| rest.split_once(": ")) {
        Some((line, rest)) => format!("{path}:{line}: {rest}"),
        None => format!("{path}: {error}"),
    }
}
