//! `vsonar drive`: a program on a simulated robot, until it hits something.

use std::fmt::Write as _;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use vsonar::dataset::TOLERANCE;
use vsonar::drive::map;
use vsonar::drive::published::PUBLISHED;
use vsonar::drive::run::{Run, Settings, drive};
use vsonar::drive::summary::Summary;
use vsonar::drive::video::Video;
use vsonar::ir::opt;
use vsonar::world::office::{FRAME_RATE, Kind, Office, World};

use super::drive_sensor::{Against, Building, Others, Sensor, kind};
use super::drive_tables::{Report, SensorReport, Timing, line, text};
use super::drive_view::{Ended, Meter};
use super::executor::with_stack;
use super::jobs::{Cores, each_watched};
use super::new_folder::NewFolder;
use super::program::Loaded;
use super::run_columns::{self, Columns};
use super::view::Style;
use super::{CliError, interrupt, output};

const EXAMPLES: &str = "\
Examples:
  vsonar drive runs/fmrb-seed-1
  vsonar drive best.gp --world nsh --runs 10 --against all
  vsonar drive best.gp --median --out drives --video

The robot is round, 0.48 m wide, with two driven wheels. Ten times a second its camera gives a picture, the compiled
program answers for each column, the camera's geometry turns rows into distances, and a reactive controller wanders
about. A run ends when the body touches anything, after a minute on one spot (stuck), or when its time is over.
`squares`: how many squares of 1 m it has been in. `in view`: what was hit had been in the picture within the last
second. Each run starts elsewhere; runs of one number start at the same place for all. The same flags give the same
runs, whatever the threads.

With --out the folder gets drive.json, paths.csv (sensor,run,seconds,x,y) and SENSOR-run-N.svg, a map of each run.";

/// Drive a simulated robot by a program, until it hits something
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The program, .gp or .vir; or a run folder, for its best one
    program: PathBuf,
    /// The building: fmrb or nsh
    #[arg(long, value_name = "NAME", default_value = "fmrb", value_parser = kind)]
    world: Kind,
    /// Another building of this kind than the one that `evolve --world` trains in
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Another building with things that training did not show, seen by a camera of another pitch, height and exposure
    #[arg(long)]
    changed: bool,
    /// How many runs
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    runs: u64,
    /// So many columns, evenly spread; or these, as in 26,80,134 (a single one as in 160,)
    #[arg(long, value_name = "N|X,X", default_value = "12", value_parser = run_columns::parse)]
    columns: Columns,
    /// The limit on a run's time, simulated
    #[arg(long, value_name = "MINUTES", default_value = "45", value_parser = minutes)]
    minutes: f64,
    /// Believe the median of a column's last 3 answers
    #[arg(long)]
    median: bool,
    /// Drive with these as well: `all`, or names with commas between them: sonar (ideal), truth (no errors), constant,
    /// gradient, polly, lorigo, ulrich
    #[arg(long, value_name = "LIST")]
    against: Option<Others>,
    /// Tune the rivals on the training set of this world, nsh, fmrb or combined, instead of that of `--world`
    #[arg(long, value_name = "NAME", requires = "against")]
    tune_on: Option<World>,
    /// A folder to make, for maps and all numbers; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write run 1 of the program to the folder as a video too (Y4M, 69 MB for each simulated minute)
    #[arg(long, requires = "out")]
    video: bool,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    threads: Option<u16>,
    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
    /// Show nothing before the tables
    #[arg(long, short)]
    quiet: bool,
}

fn minutes(text: &str) -> Result<f64, String> {
    let minutes = text.parse::<f64>().ok().filter(|m| (0.01..=10_000.0).contains(m));
    minutes.ok_or_else(|| "give a number of minutes, 0.01 to 10000".to_string())
}

/// The name of the file that holds the video.
const VIDEO: &str = "run-1.y4m";

/// Drives and reports.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let mut folder = args.out.as_deref().map(NewFolder::check).transpose()?;
    let building = Building { kind: args.world, seed: args.seed, changed: args.changed };
    let office = building.office()?;
    let columns = args.columns.of(office.size().0)?;
    let mut sensors = vec![program(&args.program, &office)?];
    sensors.extend(others(&args));
    let settings = Settings { seconds: args.minutes * 60.0, ..Settings::default() };
    if let Some(threads) = args.threads {
        // Pictures are rendered by all threads of the pool; a pool that is there already does as well.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    }
    let stop = interrupt::stop_flag()?;
    if let Some(folder) = &mut folder {
        folder.make()?;
    }
    let items: Vec<Item> = (1..=args.runs)
        .flat_map(|number| (0..sensors.len()).map(move |sensor| Item { sensor, number }))
        .collect();
    let most = (settings.seconds * FRAME_RATE).round() as u64;
    let meter = Meter::start(Style::of(args.quiet, args.json), items.len() as u64, most);
    let drives =
        Drives { args: &args, office: &office, columns: &columns, settings, sensors: &sensors, stop: &stop };
    let runs = drives.all(&items, folder.as_ref(), &meter)?;
    let (real_seconds, simulated_seconds) = meter.times();
    drop(meter);
    let done: usize = runs.iter().map(Vec::len).sum();
    let report = Report {
        vsonar: env!("CARGO_PKG_VERSION"),
        building: building.describe(),
        world: args.world.name(),
        seed: args.seed,
        changed: args.changed,
        columns,
        median: args.median,
        settings,
        sensors: sensors
            .iter()
            .zip(runs)
            .map(|(sensor, runs)| SensorReport {
                sensor: sensor.name().to_string(),
                tuned: sensor.tuned(),
                summary: Summary::of(&runs),
                runs,
            })
            .collect(),
        published: PUBLISHED,
        timing: Timing { simulated_seconds, real_seconds },
    };
    if done > 0 {
        if let Some(folder) = folder {
            write(&folder, &office, &report)?;
            folder.finish()?;
        }
        if args.json { output::print_json(&report)? } else { output::print(&text(&report))? }
    }
    if stop.load(Ordering::Relaxed) {
        return Err(CliError::Interrupted(format!("interrupted; {done} of {} runs had ended", items.len())));
    }
    Ok(())
}

/// What the program is held against, tuned where it is to be tuned.
fn others(args: &Args) -> Vec<Sensor> {
    let asked = args.against.clone().unwrap_or_default().0;
    let any_rival = asked.iter().any(|one| matches!(one, Against::Rival(_)));
    let training = any_rival.then(|| {
        let own = match args.world {
            Kind::Nsh => World::Nsh,
            Kind::Fmrb => World::Fmrb,
        };
        args.tune_on.unwrap_or(own).training()
    });
    let sensor = |one: &Against| match (one, &training) {
        (Against::Sonar, _) => Some(Sensor::Sonar),
        (Against::Truth, _) => Some(Sensor::Truth),
        (Against::Rival(rival), Some(set)) => Some(Sensor::Rival(Box::new(rival.tune(set, TOLERANCE)))),
        (Against::Rival(_), None) => None,
    };
    asked.iter().filter_map(sensor).collect()
}

/// The program, optimised for the office's pictures.
fn program(path: &Path, office: &Office) -> Result<Sensor, CliError> {
    let path = if path.is_dir() { path.join("best.gp") } else { path.to_path_buf() };
    let size = office.size();
    let program = with_stack(|| -> Result<_, CliError> {
        let loaded = Loaded::load(&path)?;
        if let Some((width, height)) = loaded.size().filter(|&own| own != size) {
            let text = format!(
                "{} is for images of {width}x{height} pixels, but the robot's camera has {}x{}; use the .gp, or \
                 `vsonar ir --size {}x{}`",
                path.display(),
                size.0,
                size.1,
                size.0,
                size.1
            );
            return Err(CliError::Failed(text));
        }
        Ok(opt::optimise(&loaded.lowered(size)))
    })??;
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    Ok(Sensor::Program(name, Box::new(program)))
}

/// A run of a sensor, by its place in the list.
#[derive(Debug, Clone, Copy)]
struct Item {
    sensor: usize,
    number: u64,
}

/// What all runs share.
struct Drives<'a> {
    args: &'a Args,
    office: &'a Office,
    columns: &'a [u32],
    settings: Settings,
    sensors: &'a [Sensor],
    stop: &'a AtomicBool,
}

impl Drives<'_> {
    /// The runs of each sensor, by number; some are missing if it was stopped.
    fn all(
        &self,
        items: &[Item],
        folder: Option<&NewFolder>,
        meter: &Meter,
    ) -> Result<Vec<Vec<Run>>, CliError> {
        let cores = Cores::new(None, self.args.threads, |threads| threads);
        let mut runs = vec![Vec::new(); self.sensors.len()];
        let mut ended = Ended::default();
        let work = |item: &Item, _| self.one(*item, folder, meter);
        each_watched(items, cores, self.stop, work, |result| {
            if let Some((item, run)) = result {
                ended.runs += 1;
                ended.frames += (run.seconds * FRAME_RATE).round() as u64;
                meter.say(&line(self.sensors[item.sensor].name(), &run))?;
                runs[item.sensor].push(run);
            }
            meter.show(ended);
            Ok(())
        })?;
        for runs in &mut runs {
            runs.sort_by_key(|run| run.number);
        }
        Ok(runs)
    }

    fn one(&self, item: Item, folder: Option<&NewFolder>, meter: &Meter) -> Result<Option<Run>, CliError> {
        let Item { sensor, number } = item;
        let sensor = &self.sensors[sensor];
        let mut source =
            sensor.make(self.office, self.columns, self.args.median, self.args.seed.unwrap_or_default())?;
        let filmed = self.args.video && number == 1 && matches!(sensor, Sensor::Program(..));
        let mut video = match folder.filter(|_| filmed) {
            Some(folder) => Some(Video::new(BufWriter::new(folder.create(VIDEO)?), self.office.size())?),
            None => None,
        };
        let run = drive(self.office, &mut *source, &self.settings, number, self.stop, |frame| {
            meter.frame();
            video.as_mut().map_or(Ok(()), |video| video.frame(frame))
        })?;
        if let Some(video) = video {
            let file = video.into_inner().into_inner().map_err(std::io::IntoInnerError::into_error)?;
            file.sync_all()?;
        }
        Ok(run)
    }
}

/// Fills the folder.
fn write(folder: &NewFolder, office: &Office, report: &Report) -> Result<(), CliError> {
    folder.write("drive.json", format!("{}\n", serde_json::to_string_pretty(report)?).as_bytes())?;
    let mut paths = "sensor,run,seconds,x,y\n".to_string();
    for SensorReport { sensor, runs, .. } in &report.sensors {
        for run in runs {
            for (i, (x, y)) in run.path.iter().enumerate() {
                let seconds = (i as f64 / 2.0).min(run.seconds);
                // Writing to a string cannot fail.
                let _ = writeln!(paths, "{},{},{seconds},{x:.3},{y:.3}", quoted(sensor), run.number);
            }
            let caption = format!("{}: {}", report.building, line(sensor, run));
            let map = map::svg(office, run, report.settings.body.radius, &caption);
            folder.write(&format!("{}-run-{}.svg", sensor, run.number), map.as_bytes())?;
        }
    }
    folder.write("paths.csv", paths.as_bytes())
}

/// A field of CSV.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_string()
    }
}
