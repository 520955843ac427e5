//! The installed ffmpeg: reads every kind of video, and writes them.

use std::ffi::{OsStr, OsString};
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::CliError;

/// Names another ffmpeg than the one that is found on the search path.
const VARIABLE: &str = "VSONAR_FFMPEG";

/// How much of what ffmpeg says is kept, in bytes, how much of it is a line at most, and how many lines are shown.
const KEPT: usize = 1 << 16;
const LONGEST_LINE: u64 = 1 << 12;
const LINES: usize = 3;

/// Between two looks at Ctrl-C, and at whether it has ended.
const TICK: Duration = Duration::from_millis(10);

/// ffmpeg without arguments but those that keep it quiet and away from the terminal.
pub(crate) fn command() -> Command {
    let mut command = Command::new(program());
    command.args(["-hide_banner", "-nostdin", "-loglevel", "error"]);
    command
}

fn program() -> OsString {
    std::env::var_os(VARIABLE).filter(|path| !path.is_empty()).unwrap_or_else(|| "ffmpeg".into())
}

/// A path that ffmpeg takes for a file, whatever it begins with and whatever is in it.
pub(crate) fn file(path: &Path) -> OsString {
    let mut name = OsString::from("file:");
    name.push(path);
    name
}

/// Arguments that make it count, on standard error, what it writes.
pub(crate) const COUNTS: [&str; 2] = ["-progress", "pipe:2"];

/// The frames that it wrote, by its own last count; none where it did not count.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counts {
    frames: Option<u64>,
    repeated: u64,
    dropped: u64,
}

impl Counts {
    /// Takes a line of what [`COUNTS`] makes it say; whether it is one.
    fn read(&mut self, line: &str) -> bool {
        let Some((key, value)) = line.trim_end().split_once('=') else { return false };
        let number = || value.trim().parse().ok();
        match key {
            "frame" => self.frames = number(),
            "dup_frames" => self.repeated = number().unwrap_or_default(),
            "drop_frames" => self.dropped = number().unwrap_or_default(),
            "fps" | "bitrate" | "total_size" | "out_time" | "out_time_us" | "out_time_ms" | "speed"
            | "progress" => {}
            key => return key.starts_with("stream_") && key.ends_with("_q"),
        }
        true
    }

    /// Whether other frames came than the video has, one by one.
    pub(crate) fn contradict(self, came: u64) -> bool {
        self.frames.is_some_and(|frames| frames != came) || self.repeated > 0 || self.dropped > 0
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Counts { frames, repeated, dropped } = self;
        write!(f, "{} with {repeated} repeated, and {dropped} dropped", frames.unwrap_or_default())
    }
}

/// ffmpeg while it works. It ends when this is dropped, or at Ctrl-C.
pub(crate) struct Running {
    child: Arc<Mutex<Child>>,
    over: Arc<AtomicBool>,
    watcher: Option<JoinHandle<()>>,
    said: Option<JoinHandle<(String, Counts)>>,
}

impl Running {
    /// Starts it with pipes for what it reads and writes.
    pub(crate) fn start(mut command: Command, stop: &Arc<AtomicBool>) -> Result<Running, CliError> {
        command.stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|e| not_there(command.get_program(), &e))?;
        let errors = child.stderr.take();
        let said = thread::spawn(move || errors.map(listen).unwrap_or_default());
        let (child, over) = (Arc::new(Mutex::new(child)), Arc::new(AtomicBool::new(false)));
        let watcher = {
            let (child, over, stop) = (child.clone(), over.clone(), stop.clone());
            thread::spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    if stop.load(Ordering::Relaxed) {
                        // If it has ended by itself there is nothing to be done.
                        let _ = lock(&child).kill();
                        return;
                    }
                    thread::sleep(TICK);
                }
            })
        };
        Ok(Running { child, over, watcher: Some(watcher), said: Some(said) })
    }

    /// What it writes, if that is a pipe and has not been taken.
    pub(crate) fn output(&self) -> Option<ChildStdout> {
        lock(&self.child).stdout.take()
    }

    /// What it reads, if that is a pipe and has not been taken.
    pub(crate) fn input(&self) -> Option<ChildStdin> {
        lock(&self.child).stdin.take()
    }

    /// Waits for its end; what it counted, or the last things that it said, if it failed.
    pub(crate) fn finish(mut self) -> Result<Result<Counts, String>, CliError> {
        let status = self.wait()?;
        let (said, counts) = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        Ok(if status.success() { Ok(counts) } else { Err(shortened(&said, status)) })
    }

    fn wait(&self) -> io::Result<ExitStatus> {
        loop {
            // Not with the lock held all the time, for Ctrl-C needs it.
            if let Some(status) = lock(&self.child).try_wait()? {
                return Ok(status);
            }
            thread::sleep(TICK);
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(watcher) = self.watcher.take() {
            let _ = watcher.join();
        }
        // Of one that has ended both do nothing.
        let mut child = lock(&self.child);
        let _ = child.kill();
        let _ = child.wait();
    }
}

fn lock(child: &Mutex<Child>) -> MutexGuard<'_, Child> {
    child.lock().unwrap_or_else(PoisonError::into_inner)
}

/// All that is said, but for counts and what is too long, which is read and forgotten so that nobody waits.
fn listen(errors: impl Read) -> (String, Counts) {
    let (mut said, mut counts) = (Vec::new(), Counts::default());
    let mut errors = BufReader::new(errors);
    let mut line = Vec::new();
    while matches!(errors.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line), Ok(1..)) {
        if !counts.read(&String::from_utf8_lossy(&line)) && said.len() < KEPT {
            said.extend_from_slice(&line);
        }
        line.clear();
    }
    (String::from_utf8_lossy(&said).into_owned(), counts)
}

/// The last few lines, without the addresses in memory that ffmpeg puts before some.
fn shortened(said: &str, status: ExitStatus) -> String {
    let line = |line: &str| {
        let line = match line.split_once("] ") {
            Some((origin, rest)) if origin.starts_with('[') && origin.contains(" @ ") => rest,
            _ => line,
        };
        line.trim().chars().take(200).collect::<String>()
    };
    let mut lines: Vec<String> = said.lines().map(line).filter(|line| !line.is_empty()).collect();
    lines.dedup();
    let last = lines.split_off(lines.len().saturating_sub(LINES));
    if last.is_empty() { format!("it ended with {status}") } else { last.join("; ") }
}

fn not_there(program: &OsStr, error: &io::Error) -> CliError {
    CliError::Failed(format!(
        "cannot run `{}`: {error}; install ffmpeg (`apt install ffmpeg`, `brew install ffmpeg`, or from ffmpeg.org), or \
         tell where it is with {VARIABLE}=/path/to/ffmpeg",
        program.to_string_lossy()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn what_it_says_is_shortened() {
        use std::os::unix::process::ExitStatusExt;
        let status = ExitStatus::from_raw(256);
        let said =
            "[mov,mp4 @ 0x55d0] moov atom not found\nmoov atom not found\n\nfile:a.mp4: Invalid data\n";
        assert_eq!(shortened(said, status), "moov atom not found; file:a.mp4: Invalid data");
        assert_eq!(shortened("1\n2\n3\n4\n5", status), "3; 4; 5");
        assert_eq!(shortened("", status), "it ended with exit status: 1");
        assert_eq!(shortened(&"x".repeat(999), status).len(), 200);
    }

    #[test]
    fn names_are_files() {
        assert_eq!(file(Path::new("-y.mp4")), "file:-y.mp4");
        assert_eq!(file(Path::new("http:/a%d.mp4")), "file:http:/a%d.mp4");
    }

    #[test]
    fn counts_are_told_from_what_it_says() {
        let block = |frames: u32, repeated: u32, end: &str| {
            format!(
                "frame={frames}\nfps=0.00\nstream_0_0_q=-0.0\nbitrate= 12.5kbits/s\ntotal_size=1\nout_time_us=1\n\
                 out_time_ms=1\nout_time=00:00:00.000001\ndup_frames={repeated}\ndrop_frames=0\nspeed=1x\nprogress={end}\n"
            )
        };
        let text = format!("one\n{}two=2\n{}three", block(7, 0, "continue"), block(20, 2, "end"));
        let (said, counts) = listen(text.as_bytes());
        assert_eq!(said, "one\ntwo=2\nthree");
        assert_eq!(counts, Counts { frames: Some(20), repeated: 2, dropped: 0 });
        assert!(counts.contradict(20) && counts.contradict(18));
        let sound = Counts { repeated: 0, ..counts };
        assert!(!sound.contradict(20) && sound.contradict(19));
        assert!(!Counts::default().contradict(20), "one that does not count");
        // However much it says, its last count is heard.
        let long = format!("{}\n{}", "x".repeat(KEPT), "a line\n".repeat(KEPT)) + &block(3, 0, "end");
        let (said, counts) = listen(long.as_bytes());
        assert!(said.len() < KEPT + LONGEST_LINE as usize && counts.frames == Some(3));
    }
}
