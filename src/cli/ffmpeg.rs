//! The installed ffmpeg: reads every kind of video, and writes them.

use std::ffi::{OsStr, OsString};
use std::io::{self, Read};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::CliError;

/// Names another ffmpeg than the one that is found on the search path.
const VARIABLE: &str = "VSONAR_FFMPEG";

/// How much of what ffmpeg says is kept, and how many lines of it are shown.
const KEPT: usize = 1 << 16;
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

/// ffmpeg while it works. It ends when this is dropped, or at Ctrl-C.
pub(crate) struct Running {
    child: Arc<Mutex<Child>>,
    over: Arc<AtomicBool>,
    watcher: Option<JoinHandle<()>>,
    said: Option<JoinHandle<String>>,
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

    /// Waits for its end; the last things that it said, if it failed.
    pub(crate) fn finish(mut self) -> Result<Result<(), String>, CliError> {
        let status = self.wait()?;
        let said = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        Ok(if status.success() { Ok(()) } else { Err(shortened(&said, status)) })
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

/// All that is said, but for what is too long, which is read and forgotten so that nobody waits.
fn listen(mut errors: impl Read) -> String {
    let mut kept = Vec::new();
    let _ = errors.by_ref().take(KEPT as u64).read_to_end(&mut kept);
    let _ = io::copy(&mut errors, &mut io::sink());
    String::from_utf8_lossy(&kept).into_owned()
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
}
