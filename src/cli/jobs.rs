//! Several runs at once.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use super::CliError;

/// Stack of a thread that does jobs: it may walk programs as deep as they are nested.
const STACK_BYTES: usize = 64 << 20;

/// How long nothing is heard of jobs before whoever listens is told so.
pub(crate) const IDLE: Duration = Duration::from_secs(1);

/// How runs share the cores.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cores {
    /// Runs at a time.
    pub(crate) jobs: usize,
    /// Threads of all of them together, at least one for each.
    threads: usize,
}

impl Cores {
    /// So many runs at a time (none given: `default` of the threads) on so many threads (none given: one for each core).
    /// There are no more runs at a time than threads that are given.
    pub(crate) fn new(jobs: Option<u16>, threads: Option<u16>, default: impl Fn(usize) -> usize) -> Cores {
        let most = threads.map_or(usize::MAX, usize::from);
        let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let threads = threads.map_or_else(cores, usize::from);
        let jobs = jobs.map_or_else(|| default(threads), usize::from).clamp(1, most.max(1));
        Cores { jobs, threads: threads.max(jobs) }
    }

    /// The same threads for so many runs, of which there are perhaps fewer than jobs.
    pub(crate) fn for_runs(self, runs: usize) -> Cores {
        Cores { jobs: self.jobs.min(runs).max(1), ..self }
    }

    /// Threads of the runs of one job; the first jobs have one more if they cannot be shared equally.
    pub(crate) fn threads_of(&self, job: usize) -> usize {
        self.threads / self.jobs + usize::from(job < self.threads % self.jobs)
    }
}

/// The threads of those asked for that are worth starting: more than a few for each core do nothing but wait, and to
/// wake thousands takes longer than the runs.
pub(crate) fn useful_threads(asked: u16) -> u16 {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    asked.min(u16::try_from(cores.saturating_mul(4)).unwrap_or(u16::MAX))
}

/// Does `work` for each item in order, `cores.jobs` at a time, or all at once if there are fewer; it is told the item and the threads it has, and gives
/// `None` if it was stopped. `done` is called in this thread with each result as it comes. After an error, and once
/// `stop` is set, nothing new is begun; an error sets it.
pub(crate) fn each<I: Sync, T: Send>(
    items: &[I],
    cores: Cores,
    stop: &AtomicBool,
    work: impl Fn(&I, usize) -> Result<Option<T>, CliError> + Sync,
    mut done: impl FnMut(&I, T) -> Result<(), CliError>,
) -> Result<(), CliError> {
    each_watched(items, cores, stop, work, |ended| ended.map_or(Ok(()), |(item, result)| done(item, result)))
}

/// The same; `told` is also called with nothing when for [`IDLE`] there was no result.
pub(crate) fn each_watched<I: Sync, T: Send>(
    items: &[I],
    cores: Cores,
    stop: &AtomicBool,
    work: impl Fn(&I, usize) -> Result<Option<T>, CliError> + Sync,
    mut told: impl FnMut(Option<(&I, T)>) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let cores = cores.for_runs(items.len());
    let next = AtomicUsize::new(0);
    let (sender, results) = mpsc::channel::<(usize, Result<Option<T>, CliError>)>();
    std::thread::scope(|scope| {
        let mut first: Option<CliError> = None;
        for job in 0..cores.jobs {
            let (sender, next, work) = (sender.clone(), &next, &work);
            let share = move || {
                while !stop.load(Ordering::Relaxed) {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(number) else { break };
                    // Whoever listens does so until all senders are gone.
                    let _ = sender.send((number, work(item, cores.threads_of(job))));
                }
            };
            let spawned = std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, share);
            if let Err(error) = spawned {
                stop.store(true, Ordering::Relaxed);
                first.get_or_insert(CliError::Failed(format!(
                    "cannot start a thread: {error}; ask for fewer `--threads`"
                )));
            }
        }
        drop(sender);
        loop {
            let ended = match results.recv_timeout(IDLE) {
                Ok((number, Ok(Some(result)))) => told(Some((&items[number], result))),
                Ok((_, Ok(None))) => Ok(()),
                Ok((_, Err(error))) => Err(error),
                Err(RecvTimeoutError::Timeout) => told(None),
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if let Err(error) = ended {
                stop.store(true, Ordering::Relaxed);
                first.get_or_insert(error);
            }
        }
        first.map_or(Ok(()), Err)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_threads_are_started_that_only_wait() {
        let cores = std::thread::available_parallelism().expect("known").get();
        assert_eq!([1, 2].map(useful_threads), [1, 2]);
        assert!(usize::from(useful_threads(u16::MAX)) <= 4 * cores);
    }

    #[test]
    fn cores_are_shared() {
        let shares = |jobs, threads| {
            let cores = Cores::new(Some(jobs), Some(threads), |_| unreachable!());
            (0..cores.jobs).map(|job| cores.threads_of(job)).collect::<Vec<_>>()
        };
        assert_eq!(shares(1, 4), [4]);
        assert_eq!(shares(3, 8), [3, 3, 2]);
        assert_eq!(shares(4, 2), [1; 2], "as many threads as are given, and no more");
        assert_eq!(Cores::new(None, Some(6), |threads| threads).jobs, 6);
    }

    #[test]
    fn few_runs_have_all_threads() {
        let cores = Cores::new(None, Some(16), |threads| threads);
        let stop = AtomicBool::new(false);
        let mut threads = Vec::new();
        // Each waits for the others, so that each is another job's.
        let all = std::sync::Barrier::new(3);
        let work = |_: &(), threads| {
            all.wait();
            Ok(Some(threads))
        };
        each(&[(); 3], cores, &stop, work, |_, of| {
            threads.push(of);
            Ok(())
        })
        .expect("nothing fails");
        threads.sort_unstable();
        assert_eq!(threads, [5, 5, 6]);
    }

    #[test]
    fn all_is_done_once_and_errors_end_it() {
        let items: Vec<u64> = (0..50).collect();
        for jobs in [1, 3] {
            let cores = Cores { jobs, threads: jobs };
            let stop = AtomicBool::new(false);
            let mut done = Vec::new();
            let square = |&i: &u64, _| Ok((i % 10 != 3).then_some(i * i));
            let all = each(&items, cores, &stop, square, |&i, square| {
                done.push((i, square));
                Ok(())
            });
            assert!(all.is_ok() && !stop.load(Ordering::Relaxed));
            done.sort_unstable();
            assert_eq!(done, (0..50).filter(|i| i % 10 != 3).map(|i| (i, i * i)).collect::<Vec<_>>());
            let fail = |&i: &u64, _| if i == 5 { Err(CliError::Failed("five".into())) } else { Ok(Some(())) };
            let failed = each(&items, cores, &stop, fail, |_, ()| Ok(()));
            assert!(matches!(failed, Err(CliError::Failed(text)) if text == "five"));
            assert!(stop.load(Ordering::Relaxed));
        }
    }
}
