//! `vsonar run`: a program on the frames of a camera, as they come.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use vsonar::camera::Camera;
use vsonar::camera::ground::Ground;
use vsonar::frames::feed::{Feed, Next, Pace};
use vsonar::frames::record::{Every, Recorder};
use vsonar::frames::{Frame, MAX_PIXELS, Rate};
use vsonar::ir::opt;
use vsonar::report::{MAX_SCALE, fitting_scale};
use vsonar::support::printable;
use vsonar::support::printable::ShownPath as _;

use super::executor::with_stack;
use super::gray_note::note_gray;
use super::output;
use super::program::{self, Loaded, size};
use super::run_columns::{self, Columns};
use super::run_input::{self, Format, Input};
use super::run_latency::Tally;
use super::run_output::{Sink, Timing};
use super::run_worker::Worker;
use super::{CliError, interrupt};

const EXAMPLES: &str = "\
Examples:
  ffmpeg -i /dev/video0 -vf scale=320:240 -pix_fmt gray -f yuv4mpegpipe - | vsonar run best.gp --live
  ffmpeg -i drive.mp4 -vf scale=320:240 -pix_fmt gray -f yuv4mpegpipe - |
    vsonar run best.gp --output overlay | ffplay -
  vsonar run best.gp --input photos --columns 26,80,134 > rows.jsonl
  ... | vsonar run best.gp --camera camera.toml --output ranges --median 3
  ... | vsonar run best.gp --record frames --every 1s       frames to be labelled, beside the rows

A frame is a line of JSON, written as soon as it is known:
  {\"frame\":0,\"time\":0.0,\"latency_us\":310,\"columns\":[13,40,...],\"rows\":[101.0,null,...]}
`frame` counts those of the input from 0, `time` is in seconds, `latency_us` runs from when the frame had been read \
until its answers were known. Rows count from the top, as the program answers them: they may be fractional or outside \
the image, and are null where they are no finite number. Images have their name in `image` too, and no time without \
--fps. With `--output ranges` there are, for each column, `bearing` (radians, to the left positive), `distance`, \
`nearest` and `farthest` (metres; null where nothing is in view, or nothing known) and `status` (obstacle, \
none-in-view or invalid).

Only the luma of a frame counts, as it stands there; `-pix_fmt gray` gives it the range 0 to 255, which images have. \
At the end the speed is told on standard error. Ctrl-C ends the run too, with exit code 130.";

/// Run a program on the frames of a camera, a video or a folder
///
/// Frames come in on standard input, rows, ranges or frames with the answers drawn over them go out.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The program, .gp or .vir; or a run folder, for its best one
    program: PathBuf,
    /// Where the frames are: a file, a folder of images, or - for standard input
    #[arg(long, value_name = "PATH", default_value = "-")]
    input: PathBuf,
    /// What the input holds
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t = Format::Auto)]
    format: Format,
    /// Size of the frames, needed for raw ones; a .vir file states its own [default: what the input says]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// So many columns, evenly spread; or these, as in 26,80,134 (a single one as in 160,)
    #[arg(long, value_name = "N|X,X", default_value = "12", value_parser = run_columns::parse)]
    columns: Columns,
    /// What is written for each frame
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = Output::Rows)]
    output: Output,
    /// The camera and how it is mounted, for ranges, and for distances on an overlay
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Believe the median of a column's last 3 answers; 1 believes each
    #[arg(long, value_name = "N", default_value = "1", value_parser = ["1", "3"])]
    median: String,
    /// Frames a second, as in 30, 29.97 or 30000/1001 [default: what the input says, else by the clock]
    #[arg(long, value_name = "RATE")]
    fps: Option<Rate>,
    /// Take the newest frame and drop those that came while another one was worked on, which are counted
    #[arg(long)]
    live: bool,
    /// Keep frames as PNG in this folder, to be labelled; none in it is ever overwritten
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// How far apart recorded frames are: a time, as in 1s, 500ms or 2min, or frames, as in 10f
    #[arg(long, value_name = "TIME", default_value_t = Every::Seconds(1.0), requires = "record")]
    every: Every,
    /// End after so many frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    limit: Option<u64>,
    /// Enlarge the frames of an overlay this many times [default: to a width of about 640 pixels]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SCALE)))]
    scale: Option<u32>,
    /// Say nothing on standard error but errors
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Output {
    /// Lines of JSON with the row of the lowest pixel that is not floor in each column
    Rows,
    /// The same with bearing and distances; needs --camera
    Ranges,
    /// A Y4M stream of the frames with the answers drawn over them, for ffplay
    Overlay,
}

/// Frames in, answers out.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    if args.output == Output::Ranges && args.camera.is_none() {
        return Err(CliError::Usage(
            "--output ranges needs --camera, a file that says how the camera is mounted".to_string(),
        ));
    }
    if args.output == Output::Rows && args.camera.is_some() {
        return Err(CliError::Usage("--camera is for `--output ranges` and `--output overlay`".to_string()));
    }
    let camera = args.camera.as_deref().map(Camera::load).transpose()?;
    let file = program::file(&args.program)?;
    let loaded = with_stack(|| Loaded::load(&file))??;
    note_gray(&args.program);
    loaded.check_size(&file, args.size)?;
    let size = loaded.size().or(args.size);
    let stop = interrupt::stop_flag()?;
    let (path, format) = (args.input.clone(), args.format);
    let Some(input) = unless_stopped(&stop, move || run_input::open(path, format, size))? else {
        return Err(CliError::Interrupted("interrupted before the first frame".to_string()));
    };
    let input = input?;
    input.check_size(size)?;
    let size = (input.source.width(), input.source.height());
    if !args.quiet {
        loaded.note_size(&file, size);
    }
    let detector = with_stack(|| program::detector(&opt::optimise(&loaded.lowered(size)), args.quiet))?;
    let columns = args.columns.of(size.0)?;
    if let (Some(camera), Some(path)) = (&camera, &args.camera) {
        let checked = camera.check(size.0, size.1);
        checked.map_err(|error| CliError::Failed(format!("{}: {error}", path.shown())))?;
    }
    let ground = camera.map(|camera| Ground::new(&camera, size.0, size.1));
    let worker = Worker::new(detector, columns, args.median == "3", ground);
    work(&args, input, worker, &stop)
}

/// Does something that may wait for a long time, or gives nothing once `stop` is set.
fn unless_stopped<T: Send + 'static>(
    stop: &AtomicBool,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<Option<T>, CliError> {
    let (sender, receiver) = channel();
    // If nobody listens any more, the command has been stopped.
    std::thread::Builder::new().spawn(move || drop(sender.send(work())))?;
    loop {
        match receiver.recv_timeout(Duration::from_millis(20)) {
            Ok(done) => return Ok(Some(done)),
            Err(RecvTimeoutError::Timeout) if stop.load(Ordering::Relaxed) => return Ok(None),
            Err(RecvTimeoutError::Timeout) => {}
            Err(error) => return Err(error.into()),
        }
    }
}

/// Tells a frame's time.
struct Clock {
    rate: Option<Rate>,
    /// Whether frames without a rate have the time at which they came.
    wall: bool,
    first: Option<Instant>,
}

impl Clock {
    fn seconds(&mut self, frame: &Frame) -> Option<f64> {
        let first = *self.first.get_or_insert(frame.arrived);
        let wall = || self.wall.then(|| (frame.arrived - first).as_secs_f64());
        self.rate.map(|rate| rate.seconds(frame.index)).or_else(wall)
    }
}

fn work(args: &Args, input: Input, mut worker: Worker, stop: &Arc<AtomicBool>) -> Result<(), CliError> {
    let mut clock = Clock { rate: args.fps.or(input.source.rate()), wall: !input.images, first: None };
    let mut recorder = None;
    if let Some(folder) = &args.record {
        if matches!(args.every, Every::Seconds(_)) && clock.rate.is_none() && input.images {
            let text =
                "--every: images have no time of their own; give --fps, or a distance in frames, as in 10f";
            return Err(CliError::Usage(text.to_string()));
        }
        recorder = Some(Recorder::new(folder, args.every)?);
    }
    if input.limited && !args.quiet {
        output::say(&format!(
            "note: {} says that its luma goes from 16 to 235 only, and it is taken as it is; `-pix_fmt gray` makes \
             ffmpeg stretch it to the 0 to 255 of images",
            printable::line(&input.origin)
        ));
    }
    let mut sink = sink(args, &input, clock.rate)?;
    let pace = if args.live { Pace::Newest } else { Pace::Every };
    let mut feed = Feed::start(input.source, pace)?;
    let mut tally = Tally::start();
    let mut frame = Frame::default();
    let mut each = |tally: &mut Tally| -> Result<Next, CliError> {
        let next = feed.next(&mut frame, || stop.load(Ordering::Relaxed))?;
        tally.dropped = feed.dropped();
        if next != Next::Frame {
            return Ok(next);
        }
        let detection = worker.answer(&frame)?;
        let latency = frame.arrived.elapsed();
        let seconds = clock.seconds(&frame);
        let timing = Timing { seconds, latency_us: u64::try_from(latency.as_micros()).unwrap_or(u64::MAX) };
        sink.write(&frame, &worker.answers, timing).map_err(|e| CliError::output(&e))?;
        tally.frame(detection, latency, frame.arrived.elapsed());
        if let Some(recorder) = &mut recorder {
            recorder.offer(&frame, seconds.unwrap_or_default())?;
            tally.kept = Some(recorder.kept());
        }
        Ok(next)
    };
    let ended = loop {
        if args.limit.is_some_and(|limit| tally.frames >= limit) {
            break Ok(Next::End);
        }
        match each(&mut tally) {
            Ok(Next::Frame) => {}
            // What comes with Ctrl-C, as a stream cut off or a reader that has gone, is none of our errors.
            Err(_) if stop.load(Ordering::Relaxed) => break Ok(Next::Stopped),
            end => break end,
        }
    };
    let stopped = ended? == Next::Stopped;
    let summary = if args.quiet { String::new() } else { tally.summary() };
    if stopped {
        return Err(CliError::Interrupted(summary));
    }
    if !summary.is_empty() {
        output::say(&summary);
    }
    Ok(())
}

fn sink(args: &Args, input: &Input, rate: Option<Rate>) -> Result<Sink, CliError> {
    if args.output != Output::Overlay {
        return Ok(Sink::lines(args.output == Output::Ranges));
    }
    let (width, height) = (input.source.width(), input.source.height());
    let scale = args.scale.unwrap_or_else(|| fitting_scale(width));
    if u64::from(width) * u64::from(height) * u64::from(scale).pow(2) > MAX_PIXELS {
        let text =
            format!("--scale: frames of {width}x{height} pixels are too large to be enlarged {scale} times");
        return Err(CliError::Usage(text));
    }
    Sink::overlay((width, height), scale, rate).map_err(|e| CliError::output(&e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_that_of_the_rate_or_of_the_clock() {
        let start = Instant::now();
        let frame =
            |index| Frame { index, arrived: start + Duration::from_millis(10 * index), ..Frame::default() };
        let times = |rate, wall| {
            let mut clock = Clock { rate, wall, first: None };
            [2, 4].map(|i| clock.seconds(&frame(i)))
        };
        assert_eq!(times(Rate::new(10, 1), true), [Some(0.2), Some(0.4)]);
        assert_eq!(times(None, true), [Some(0.0), Some(0.02)]);
        assert_eq!(times(None, false), [None, None]);
    }
}
