//! `vsonar drive`: a program on a simulated robot, until it hits something.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use vsonar::drive::map;
use vsonar::drive::published::PUBLISHED;
use vsonar::drive::run::{Run, Settings, drive};
use vsonar::drive::summary::Summary;
use vsonar::drive::video::Video;
use vsonar::ir::opt;
use vsonar::support::durable;
use vsonar::support::printable::ShownPath as _;
use vsonar::world::office::{FRAME_RATE, Kind, Office, World};

use super::drive_scores::{Sets, own_world};
use super::drive_sensor::{Against, Building, Others, Sensor, kind};
use super::drive_tables::{Report, SensorReport, Timing, line, outcome, text};
use super::drive_view::{Ended, Meter};
use super::executor::with_stack;
use super::jobs::{Cores, each_watched, useful_threads};
use super::new_folder::NewFolder;
use super::program::{Loaded, detector};
use super::progress::{Bar, Style};
use super::run_columns::{self, Columns};
use super::{CliError, interrupt, output};

const EXAMPLES: &str = "\
Examples:
  vsonar drive runs/fmrb-seed-1
  vsonar drive best.gp --world nsh --runs 10 --against all
  vsonar drive best.gp --median --out drives --video

The robot is round, 0.48 m wide, with two driven wheels. Ten times a second its camera gives a picture, the compiled \
program answers for each column, the camera's geometry turns rows into distances, and a reactive controller wanders \
about. A run ends when the body touches anything, after a minute on one spot (stuck), or when its time is over. \
`squares`: how many squares of 1 m it has been in. `in view`: what was hit had been in the picture within the last \
second. Each run starts elsewhere; runs of one number start at the same place for all. The same flags give the same \
runs, whatever the threads. With --against the table also shows how all do on labelled images.

With --out the folder gets drive.json, paths.csv (sensor,run,seconds,x,y) and SENSOR-run-N.svg, a map of each run; the \
program is the sensor `program`.";

/// Drive a simulated robot by a program, until it hits something
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub(crate) struct Args {
    /// The program, .gp or .vir; or a run folder, for its best one
    program: PathBuf,
    /// The building: fmrb or nsh [default: nsh for a run that was made in it, else fmrb]
    #[arg(long, value_name = "NAME", value_parser = kind)]
    world: Option<Kind>,
    /// Another building of this kind than the one that `evolve --world` trains in; by default 1 chooses its winner and 2 is
    /// held out [default: the building trained on; with --changed 3]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The building of the seed with plants, suitcases, cones and open drawers, which are nowhere else, seen by a camera of
    /// another pitch, height and exposure
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
    /// gradient, polly, lorigo, ulrich, flow (this frame and an earlier one)
    #[arg(long, value_name = "LIST")]
    against: Option<Others>,
    /// Tune the rivals on the training set of this world, nsh, fmrb or combined [default: that of the program's run if
    /// it was in a world, else that of `--world`]
    #[arg(long, value_name = "NAME", requires = "against")]
    tune_on: Option<World>,
    /// A folder to make, for maps and all numbers; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write run 1 of the program to the folder as a video too (Y4M, 69 MB for each simulated minute)
    #[arg(long, requires = "out")]
    video: bool,
    /// Threads, at most four for each core [default: one for each core]
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
    let threads = args.threads.map(useful_threads);
    if let Some(threads) = threads {
        // Whatever runs on rayon's own pool does so from here on: the office, the tuning, the pictures. The pool cannot
        // be there already, for nothing of this process has asked for it.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
        pool.map_err(|e| CliError::Failed(format!("cannot start threads: {e}; ask for fewer `--threads`")))?;
    }
    let world = match args.world {
        Some(world) => world,
        None if own_world(&args.program)? == Some(World::Nsh) => Kind::Nsh,
        None => Kind::Fmrb,
    };
    let style = Style::of(args.quiet);
    let busy = Bar::spinner(style, "preparing the building");
    let building = Building { kind: world, seed: args.seed, changed: args.changed };
    let office = building.office()?;
    let columns = args.columns.of(office.size().0)?;
    let program_file = super::program::file(&args.program)?;
    let mut sensors = vec![program(&program_file, &office, args.quiet)?];
    let choose = |asked: &Others| Sets::choose(&args.program, world, args.tune_on, asked.rivals());
    let sets = args.against.as_ref().map(choose).transpose()?;
    if let Some((asked, sets)) = args.against.as_ref().zip(sets.as_ref()) {
        sensors.extend(others(asked, sets)?);
    }
    let scores = |sensor| sets.as_ref().map_or(Ok(None), |sets| sets.scores(sensor));
    let scores = sensors.iter().map(scores).collect::<Result<Vec<_>, _>>()?;
    let settings = Settings { seconds: args.minutes * 60.0, ..Settings::default() };
    let stop = interrupt::stop_flag()?;
    if let Some(folder) = &mut folder {
        folder.make()?;
    }
    let items: Vec<Item> = (1..=args.runs)
        .flat_map(|number| (0..sensors.len()).map(move |sensor| Item { sensor, number }))
        .collect();
    let most = (settings.seconds * FRAME_RATE).round() as u64;
    drop(busy);
    let meter = Meter::start(style, items.len() as u64, most);
    let drives = Drives {
        args: &args,
        threads,
        seed: building.effective_seed(),
        office: &office,
        columns: &columns,
        settings,
        sensors: &sensors,
        stop: &stop,
        film_error: Mutex::default(),
    };
    let (runs, driven) = drives.all(&items, folder.as_ref(), &meter);
    let film_error = drives.film_error.into_inner().unwrap_or_else(PoisonError::into_inner);
    let (real_seconds, simulated_seconds) = meter.times();
    drop(meter);
    let done: usize = runs.iter().map(Vec::len).sum();
    // An error stops the runs as well.
    let interrupted = stop.load(Ordering::Relaxed) && driven.is_ok() && done < items.len();
    let report = Report {
        vsonar: env!("CARGO_PKG_VERSION"),
        building: building.describe(),
        program: program_file,
        world: world.name(),
        seed: building.effective_seed(),
        changed: args.changed,
        columns,
        median: args.median,
        asked: items.len(),
        interrupted,
        settings,
        tuned_on: sets.map(|sets| sets.tuned_on),
        sensors: sensors
            .iter()
            .zip(scores)
            .zip(runs)
            .map(|((sensor, scores), runs)| SensorReport {
                sensor: sensor.name(),
                tuned: sensor.tuned(),
                scores,
                summary: Summary::of(&runs),
                runs,
            })
            .collect(),
        published: PUBLISHED,
        timing: Timing { simulated_seconds, real_seconds },
    };
    // Neither a full disk nor a reader who has gone takes the results away from the other.
    let (mut written, mut printed) = (Ok(()), Ok(()));
    if done > 0 {
        if let Some(folder) = folder {
            written = write(&folder, &office, &report).and_then(|()| folder.finish());
        }
        printed = if args.json { output::print_json(&report) } else { output::print(&text(&report)) };
    }
    driven?;
    written?;
    film_error.map_or(Ok(()), Err)?;
    if interrupted {
        return Err(CliError::Interrupted(format!("interrupted; {done} of {} runs had ended", items.len())));
    }
    printed
}

/// What the program is held against, tuned where it is to be tuned.
fn others(asked: &Others, sets: &Sets) -> Result<Vec<Sensor>, CliError> {
    let tuner = sets.copies.tuner(&sets.training, sets.tuned_on.tolerance);
    let sensor = |one: &Against| {
        Ok(match *one {
            Against::Sonar => Sensor::Sonar,
            Against::Truth => Sensor::Truth,
            Against::Rival(rival) => Sensor::Rival(Box::new(tuner.tune(rival))),
            Against::Flow => sets.flow()?,
        })
    };
    asked.0.iter().map(sensor).collect()
}

/// The program, made for the office's pictures.
fn program(path: &Path, office: &Office, quiet: bool) -> Result<Sensor, CliError> {
    let size = office.size();
    let program = with_stack(|| -> Result<_, CliError> {
        let loaded = Loaded::load(path)?;
        loaded.check_images(path, size)?;
        if let Err(other) = loaded.provenance().check_size(size) {
            output::say(&format!("note: {} {other}, as the robot's camera gives them", path.shown()));
        }
        Ok(detector(&opt::optimise(&loaded.lowered(size)), quiet))
    })??;
    Ok(Sensor::Program(Arc::new(program)))
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
    threads: Option<u16>,
    /// That of the building, and of the noise of the sonars.
    seed: Option<u64>,
    office: &'a Office,
    columns: &'a [u32],
    settings: Settings,
    sensors: &'a [Sensor],
    stop: &'a AtomicBool,
    /// Why there is no video; it ends that alone.
    film_error: Mutex<Option<CliError>>,
}

impl Drives<'_> {
    /// The runs of each sensor, by number; some are missing if it was stopped, or failed.
    fn all(
        &self,
        items: &[Item],
        folder: Option<&NewFolder>,
        meter: &Meter,
    ) -> (Vec<Vec<Run>>, Result<(), CliError>) {
        let cores = Cores::new(None, self.threads, |threads| threads);
        let mut runs = vec![Vec::new(); self.sensors.len()];
        let mut ended = Ended::default();
        let work = |item: &Item, _| self.one(*item, folder, meter);
        let done = each_watched(items, cores, self.stop, work, |result| {
            if let Some((item, run)) = result {
                ended.runs += 1;
                ended.frames += (run.seconds * FRAME_RATE).round() as u64;
                meter.say(&line(self.sensors[item.sensor].name(), &run));
                runs[item.sensor].push(run);
            }
            meter.show(ended);
            Ok(())
        });
        for runs in &mut runs {
            runs.sort_by_key(|run| run.number);
        }
        (runs, done)
    }

    fn one(&self, item: Item, folder: Option<&NewFolder>, meter: &Meter) -> Result<Option<Run>, CliError> {
        let Item { sensor, number } = item;
        let sensor = &self.sensors[sensor];
        let seed = self.seed.unwrap_or_default();
        let mut source = sensor.make(self.office, self.columns, self.args.median, seed)?;
        let filmed = self.args.video && number == 1 && matches!(sensor, Sensor::Program(_));
        let folder = folder.filter(|_| filmed);
        let mut film = folder.and_then(|folder| self.film(folder, Film::new(folder, self.office.size())));
        let run = drive(self.office, &mut *source, &self.settings, number, self.stop, |frame| {
            meter.frame();
            if let (Some(folder), Some(running)) = (folder, &mut film)
                && let Err(error) = running.video.frame(frame)
            {
                film = self.film(folder, Err(folder.cannot_write(VIDEO, &error)));
            }
            Ok(())
        })?;
        if let (Some(folder), Some(film)) = (folder, film) {
            match run {
                Some(_) => drop(self.film(folder, film.finish(folder))),
                // A part of a run is none.
                None => folder.remove(VIDEO),
            }
        }
        Ok(run)
    }

    /// What became of a step in making the video; if it failed, the file is taken away.
    fn film<T>(&self, folder: &NewFolder, step: Result<T, CliError>) -> Option<T> {
        step.map_err(|error| {
            folder.remove(VIDEO);
            self.film_error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        })
        .ok()
    }
}

/// The video of a run in the folder.
struct Film {
    video: Video<BufWriter<File>>,
}

impl Film {
    fn new(folder: &NewFolder, size: (u32, u32)) -> Result<Film, CliError> {
        let video = Video::new(BufWriter::new(folder.create(VIDEO)?), size);
        Ok(Film { video: video.map_err(|error| folder.cannot_write(VIDEO, &error))? })
    }

    fn finish(self, folder: &NewFolder) -> Result<(), CliError> {
        let file = self.video.into_inner().into_inner().map_err(io::IntoInnerError::into_error);
        file.and_then(|file| durable::sync_file(&file, folder.part()))
            .map_err(|error| folder.cannot_write(VIDEO, &error))
    }
}

/// Fills the folder.
fn write(folder: &NewFolder, office: &Office, report: &Report) -> Result<(), CliError> {
    folder.write("drive.json", format!("{}\n", serde_json::to_string_pretty(report)?).as_bytes())?;
    let mut paths = "sensor,run,seconds,x,y\n".to_string();
    for SensorReport { sensor, runs, .. } in &report.sensors {
        for run in runs {
            for (i, (x, y)) in run.path.iter().enumerate() {
                let seconds = (i as f64 * Run::PATH_SECONDS).min(run.seconds);
                // Writing to a string cannot fail.
                let _ = writeln!(paths, "{sensor},{},{seconds},{x:.3},{y:.3}", run.number);
            }
            let heading = format!("Run {} of {sensor} in {}", run.number, report.building);
            let map = map::svg(office, run, report.settings.body.radius, &heading, &outcome(run));
            folder.write(&format!("{}-run-{}.svg", sensor, run.number), map.as_bytes())?;
        }
    }
    folder.write("paths.csv", paths.as_bytes())
}
