//! `vsonar data video`: frames of a video as images to be labelled.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use image::ImageFormat;
use serde::Serialize;
use vsonar::dataset::import::View;
use vsonar::frames::record::Every;
use vsonar::frames::y4m::Reader;
use vsonar::frames::{Frame, FrameError, FrameFault, FrameSource, Rate};
use vsonar::support::printable::ShownPath as _;

use super::data_import::ViewArgs;
use super::ffmpeg::{self, Running};
use super::new_folder::NewFolder;
use super::output::{self, count, shell_word};
use super::progress::{Bar, Style};
use super::{CliError, interrupt, large};

const EXAMPLES: &str = "\
Examples:
  vsonar data video drive.mp4 --out frames                     a frame each second
  vsonar data video drive.mp4 --every 10f --size 320x240 --out frames
  vsonar data video drive.mp4 --start 1:30 --fps 2 --frames 100 --out frames

The video is read by the installed ffmpeg, of whatever kind it is; VSONAR_FFMPEG names another one. The frames become gray \
images frame_000001.png and so on, in their order, to be labelled with `vsonar label DIR`. The new folder appears complete \
or not at all.";

/// Take frames of a video as images to be labelled, through the installed ffmpeg
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The video
    file: PathBuf,
    /// The new folder; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How far apart the frames are: a time, as 1s, 500ms or 2min, or a number of frames, as 10f [default: 1s]
    #[arg(long, value_name = "TIME|FRAMES", conflicts_with = "fps")]
    every: Option<Every>,
    /// How many frames are taken of a second
    #[arg(long, value_name = "N")]
    fps: Option<Rate>,
    /// Where to begin, in seconds or as 1:30 or 1:02:30
    #[arg(long, value_name = "TIME", value_parser = time, allow_negative_numbers = true)]
    start: Option<f64>,
    /// Take so many frames at most
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    #[command(flatten)]
    view: ViewArgs,
    /// Print what was done as JSON
    #[arg(long)]
    json: bool,
}

/// Reads seconds, or hours, minutes and seconds.
fn time(text: &str) -> Result<f64, String> {
    let wrong = || "write a time in seconds, as in 90 or 90.5, or as in 1:30 or 1:02:30".to_string();
    let mut parts = text.rsplit(':');
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let seconds = parts.next().filter(|text| digits(text)).and_then(|text| text.parse::<f64>().ok());
    let mut time = seconds.ok_or_else(wrong)?;
    let sixtieths = text.contains(':');
    let mut unit = 1.0;
    for part in parts {
        unit *= 60.0;
        let number = part.parse::<u32>().map_err(|_| wrong())?;
        time += f64::from(number) * unit;
    }
    let sound = unit <= 3600.0 && (!sixtieths || seconds.is_some_and(|s| s < 60.0)) && time < 1e7;
    if sound { Ok(time) } else { Err(wrong()) }
}

#[derive(Serialize)]
struct Summary {
    folder: PathBuf,
    frames: u64,
    width: u32,
    height: u32,
}

/// Makes a folder.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let mut folder = NewFolder::check(&args.out)?;
    let there =
        std::fs::metadata(&args.file).map_err(|e| CliError::file(&args.file, "read the video", &e))?;
    if there.is_dir() {
        let text = format!("{}: is a folder; give one video at a time", args.file.shown());
        return Err(CliError::Failed(text));
    }
    let stop = interrupt::stop_flag()?;
    folder.make()?;
    let bar = Bar::spinner(Style::of(args.json), "reading the video");
    let mut taken = Err(Failure::Unknown);
    for option in PASSTHROUGH {
        taken = attempt(&args, option, &folder, &bar, &stop);
        if !matches!(taken, Err(Failure::Unknown)) {
            break;
        }
    }
    drop(bar);
    if stop.load(Ordering::Relaxed) {
        return Err(CliError::Interrupted("interrupted; nothing was written".to_string()));
    }
    let (frames, (width, height)) = taken.map_err(|failure| match failure {
        Failure::Of(error) => error,
        Failure::Unknown => CliError::Failed(
            "ffmpeg has no option that keeps frames as they are (neither `-fps_mode` nor `-vsync`); install a version from 4 on"
                .to_string(),
        ),
    })?;
    folder.finish()?;
    if args.json {
        return output::print_json(&Summary { folder: args.out, frames, width, height });
    }
    let word = shell_word(&args.out);
    let note = large::advice(&args.out, (width, height))
        .map_or_else(String::new, |large| format!("note: {large}\n"));
    output::print(&format!(
        "{}: {} of {width} x {height} pixels\n{note}Next: vsonar label {word}\n",
        args.out.shown(),
        count(frames, "frame"),
    ))
}

/// What makes ffmpeg neither repeat nor drop frames for the sake of an even rate: since version 5.1, and before.
const PASSTHROUGH: [&str; 2] = ["-fps_mode", "-vsync"];

/// Why there are no frames.
enum Failure {
    /// This ffmpeg does not know the option.
    Unknown,
    Of(CliError),
}

impl From<CliError> for Failure {
    fn from(error: CliError) -> Failure {
        Failure::Of(error)
    }
}

/// Lets ffmpeg take the frames; how many, and their size.
fn attempt(
    args: &Args,
    option: &str,
    folder: &NewFolder,
    bar: &Bar,
    stop: &Arc<AtomicBool>,
) -> Result<(u64, (u32, u32)), Failure> {
    let running = Running::start(command(args, option), stop)?;
    let taken = take(args, &running, folder, bar, stop);
    let origin = args.file.shown();
    let unrecognized = format!("Unrecognized option '{}'", &option[1..]);
    let failed = |text: String| Failure::Of(CliError::Failed(format!("{origin}: {text}")));
    if let Err(Taken::Failed(error)) = taken {
        return Err(error.into());
    }
    match (taken, running.finish()?) {
        (Ok((frames, _)), Ok(counts)) if counts.contradict(frames) => Err(failed(format!(
            "{} came, but ffmpeg counts {counts}; nothing was written; try another version of ffmpeg",
            count(frames, "frame")
        ))),
        (Ok(taken), Ok(_)) => Ok(taken),
        // What ffmpeg says is nearer to the cause than that there is nothing to read.
        (Err(Taken::Nothing(_)), Err(said)) if said.contains(&unrecognized) => Err(Failure::Unknown),
        (Err(Taken::Nothing(_)), Err(said)) => {
            Err(failed(format!("ffmpeg cannot read it: {said}; is it a video, and whole?")))
        }
        (Err(Taken::Nothing(_)), Ok(_)) if args.start.is_some() => {
            Err(failed("there is no frame at that time or after it; choose an earlier `--start`".to_string()))
        }
        (Err(Taken::Failed(error)), _) | (Err(Taken::Nothing(error) | Taken::CutOff(error)), Ok(_)) => {
            Err(error.into())
        }
        (Ok(_) | Err(Taken::CutOff(_)), Err(said)) => {
            Err(failed(format!("ffmpeg stopped half-way: {said}; nothing was written")))
        }
    }
}

/// ffmpeg with the frames that are wanted on a pipe, as Y4M, and its counts beside what it says.
fn command(args: &Args, passthrough: &str) -> std::process::Command {
    let mut command = ffmpeg::command();
    // A list of files is not to lead to another machine.
    command.args(["-protocol_whitelist", "file,crypto,data"]);
    if let Some(start) = args.start {
        command.arg("-ss").arg(start.to_string());
    }
    command.arg("-i").arg(ffmpeg::file(&args.file)).args(["-map", "0:v:0"]);
    // The first frame of each interval. Half a millisecond of tolerance: times are rounded in some kinds of file.
    let first_of = |seconds: String| {
        let interval = |time: &str| format!("floor(({time}-start_t+0.0005)/({seconds}))");
        format!("isnan(prev_selected_t)+gt({},{})", interval("t"), interval("prev_selected_t"))
    };
    let wanted = match (&args.fps, args.every.unwrap_or(Every::Seconds(1.0))) {
        (Some(rate), _) => first_of(rate.seconds(1).to_string()),
        (None, Every::Seconds(seconds)) => first_of(seconds.to_string()),
        (None, Every::Frames(frames)) => format!("not(mod(n,{frames}))"),
    };
    // Numbered anew, for in some files times go back or stand still.
    command
        .arg("-vf")
        .arg(format!("select='{wanted}',settb=1/25,setpts=N"))
        .args([passthrough, "passthrough"]);
    if let Some(frames) = args.frames {
        command.arg("-frames:v").arg(frames.to_string());
    }
    command.args(["-pix_fmt", "gray", "-f", "yuv4mpegpipe", "pipe:1"]).args(ffmpeg::COUNTS);
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    command
}

/// Why frames were not taken.
enum Taken {
    /// There is not a single one.
    Nothing(CliError),
    /// The last one is not whole.
    CutOff(CliError),
    Failed(CliError),
}

/// Writes the frames; how many, and their size.
fn take(
    args: &Args,
    running: &Running,
    folder: &NewFolder,
    bar: &Bar,
    stop: &Arc<AtomicBool>,
) -> Result<(u64, (u32, u32)), Taken> {
    let origin = args.file.shown();
    let empty = || FrameError { origin: origin.clone(), frame: None, fault: FrameFault::Empty };
    let pipe = running.output().ok_or_else(|| Taken::Nothing(empty().into()))?;
    let mut reader = Reader::new(pipe, &origin).map_err(|error| match error.fault {
        FrameFault::Empty | FrameFault::NotY4m => Taken::Nothing(no_frame(&origin)),
        _ => Taken::Failed(error.into()),
    })?;
    let view = args.view.view();
    let (mut frame, mut frames, mut size) = (Frame::default(), 0, (0, 0));
    let broken = |error: FrameError| match error.fault {
        FrameFault::Truncated { .. } => Taken::CutOff(error.into()),
        _ => Taken::Failed(error.into()),
    };
    while reader.read(&mut frame).map_err(broken)? {
        if stop.load(Ordering::Relaxed) {
            return Err(Taken::Failed(CliError::Interrupted(String::new())));
        }
        frames += 1;
        size = write(&args.file, folder, frames, &view, &mut frame).map_err(Taken::Failed)?;
        bar.message(&count(frames, "frame"));
    }
    if frames == 0 { Err(Taken::Nothing(no_frame(&origin))) } else { Ok((frames, size)) }
}

fn no_frame(origin: &str) -> CliError {
    CliError::Failed(format!("{origin}: there is no frame in it; is it a video?"))
}

fn write(
    video: &Path,
    folder: &NewFolder,
    number: u64,
    view: &View,
    frame: &mut Frame,
) -> Result<(u32, u32), CliError> {
    let pixels = view.of(std::mem::take(&mut frame.pixels));
    let pixels = pixels.map_err(|e| CliError::Failed(format!("{}: {e}", video.shown())))?;
    let mut png = Cursor::new(Vec::new());
    pixels.write_to(&mut png, ImageFormat::Png)?;
    folder.write(&format!("frame_{number:06}.png"), png.get_ref())?;
    Ok(pixels.dimensions())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times() {
        for (text, seconds) in
            [("0", 0.0), ("90.5", 90.5), ("1:30", 90.0), ("1:02:30.25", 3750.25), ("90:00", 5400.0)]
        {
            assert_eq!(time(text), Ok(seconds), "{text}");
        }
        for wrong in
            ["", "-1", ":", "1:", ":1", "1:60", "1:2:3:4", "nan", "inf", "1e3", "1.2.3", "1.5:00", "99999999"]
        {
            assert!(time(wrong).is_err(), "{wrong}");
        }
    }
}
