//! Threads: the same work for each of many items, on all cores.
//!
//! Threads take one item after the other from a shared counter, for their costs differ by a factor of a
//! thousand, and the result is put where the item stands; so neither the order of work nor who does it changes
//! a result.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::evaluate::EvaluateError;

/// Stack of a worker thread: whoever walks trees may recurse.
const STACK_BYTES: usize = 16 << 20;

/// A number of threads.
pub(super) struct Threads {
    pool: rayon::ThreadPool,
}

/// How well the threads were used.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Usage {
    /// From handing out work to its end, as the clock has it.
    pub(super) wall: Duration,
    /// Time the threads were at work, summed over them.
    pub(super) work: Duration,
}

impl Threads {
    /// `threads` 0 means one for each core.
    pub(super) fn new(threads: usize) -> Result<Threads, EvaluateError> {
        let threads = if threads > 0 {
            threads
        } else {
            std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES);
        let pool = pool.build().map_err(|source| EvaluateError::Threads { threads, source })?;
        Ok(Threads { pool })
    }

    /// The pool, for other work.
    pub(super) fn pool(&self) -> &rayon::ThreadPool {
        &self.pool
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Calls `work` for each number of `order`, a permutation of 0 to its length - 1, begun in this order, and
    /// gives the results by number; `None` if `stop` was set before all was done. Of several errors the one of
    /// the lowest number is given, whichever came first.
    pub(super) fn each<T: Send, E: Send>(
        &self,
        order: &[usize],
        stop: &AtomicBool,
        usage: &mut Usage,
        work: impl Fn(usize) -> Result<T, E> + Sync,
    ) -> Result<Option<Vec<T>>, E> {
        let start = Instant::now();
        let (next, failed) = (AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
        let shares = self.pool.broadcast(|_| share(order, &next, &failed, stop, &work));
        let mut results: Vec<Option<T>> = Vec::new();
        results.resize_with(order.len(), || None);
        let mut error: Option<(usize, E)> = None;
        for share in shares {
            usage.work += share.time;
            for (i, result) in share.done {
                results[i] = Some(result);
            }
            error = match (error, share.failed) {
                (Some(a), Some(b)) => Some(if a.0 < b.0 { a } else { b }),
                (a, b) => a.or(b),
            };
        }
        usage.wall += start.elapsed();
        match error {
            Some((_, error)) => Err(error),
            None => Ok(results.into_iter().collect()),
        }
    }
}

/// What one thread did.
struct Share<T, E> {
    done: Vec<(usize, T)>,
    failed: Option<(usize, E)>,
    time: Duration,
}

fn share<T, E>(
    order: &[usize],
    next: &AtomicUsize,
    failed: &AtomicUsize,
    stop: &AtomicBool,
    work: &impl Fn(usize) -> Result<T, E>,
) -> Share<T, E> {
    let start = Instant::now();
    let mut share = Share { done: Vec::new(), failed: None, time: Duration::ZERO };
    while !stop.load(Ordering::Relaxed) {
        let Some(&i) = order.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
        // After an error only what could yield one of a lower number is still of interest.
        if i > failed.load(Ordering::Relaxed) {
            continue;
        }
        match work(i) {
            Ok(result) => share.done.push((i, result)),
            Err(error) => {
                failed.fetch_min(i, Ordering::Relaxed);
                if share.failed.as_ref().is_none_or(|&(j, _)| i < j) {
                    share.failed = Some((i, error));
                }
            }
        }
    }
    share.time = start.elapsed();
    share
}

#[cfg(test)]
mod tests {
    use super::*;

    fn each<T: Send>(
        threads: usize,
        order: &[usize],
        work: impl Fn(usize) -> Result<T, String> + Sync,
    ) -> Result<Option<Vec<T>>, String> {
        let threads = Threads::new(threads).expect("threads");
        threads.each(order, &AtomicBool::new(false), &mut Usage::default(), work)
    }

    #[test]
    fn results_stand_where_their_items_stand() {
        let order: Vec<usize> = (0..100).map(|i| 37 * i % 100).collect();
        let squares: Vec<usize> = (0..100).map(|i| i * i).collect();
        for threads in [1, 2, 5] {
            assert_eq!(each(threads, &order, |i| Ok(i * i)), Ok(Some(squares.clone())));
        }
    }

    #[test]
    fn the_lowest_error_is_given_whatever_the_order() {
        let backwards: Vec<usize> = (0..100).rev().collect();
        let fail = |i: usize| if i % 10 == 3 { Err(format!("{i}")) } else { Ok(i) };
        for threads in [1, 2, 5] {
            assert_eq!(each(threads, &backwards, fail), Err("3".to_string()));
        }
    }

    #[test]
    fn stopped_between_items() {
        let (threads, stop) = (Threads::new(2).expect("threads"), AtomicBool::new(false));
        let begun = AtomicUsize::new(0);
        let order: Vec<usize> = (0..1000).collect();
        let work = |_| -> Result<(), ()> {
            stop.store(begun.fetch_add(1, Ordering::Relaxed) >= 9, Ordering::Relaxed);
            Ok(())
        };
        assert_eq!(threads.each(&order, &stop, &mut Usage::default(), work), Ok(None));
        assert!(begun.into_inner() < 20);
    }

    #[test]
    fn idle_threads_are_not_at_work() {
        let threads = Threads::new(2).expect("threads");
        let mut usage = Usage::default();
        let sleep = |i: usize| -> Result<(), ()> {
            std::thread::sleep(Duration::from_millis([100, 1][i]));
            Ok(())
        };
        threads.each(&[0, 1], &AtomicBool::new(false), &mut usage, sleep).expect("no error");
        assert!(usage.wall >= Duration::from_millis(100));
        assert!(usage.work < usage.wall.mul_f64(1.9), "{usage:?}");
    }
}
