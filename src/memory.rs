//! The memory that images may take, and the order in which they are decoded so that they stay below it.

use std::fs;
use std::ops::Range;
use std::sync::OnceLock;

/// The limit in bytes where the machine does not report its memory.
const UNKNOWN: u64 = 8 << 30;

/// Bytes that images and what is computed of them may take unless another limit is given: three quarters of the
/// machine's memory, or of what the process may address if that is less (`ulimit -v`); 8 GiB where both are unknown.
pub fn default_limit() -> u64 {
    static LIMIT: OnceLock<u64> = OnceLock::new();
    *LIMIT.get_or_init(|| limit_of(physical_memory().into_iter().chain(addressable()).min()))
}

fn limit_of(there: Option<u64>) -> u64 {
    there.map_or(UNKNOWN, |bytes| bytes / 4 * 3)
}

/// Bytes that the process may address, if that is limited.
#[cfg(unix)]
fn addressable() -> Option<u64> {
    use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
    let (soft, _) = getrlimit(Resource::RLIMIT_AS).ok()?;
    (soft != RLIM_INFINITY).then_some(soft)
}

#[cfg(not(unix))]
fn addressable() -> Option<u64> {
    None
}

/// The physical memory of this machine in bytes, if it can be found out.
fn physical_memory() -> Option<u64> {
    total_of(&fs::read_to_string("/proc/meminfo").ok()?)
}

/// The total in the text of /proc/meminfo, which has kibibytes.
fn total_of(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024).filter(|&bytes| bytes > 0)
}

/// Bytes that are needed, as GiB, rounded up to thousandths.
pub(crate) fn gib_needed(bytes: u64) -> f64 {
    thousandths(bytes).ceil() / 1000.0
}

/// Bytes that are allowed, as GiB, rounded down to thousandths.
pub(crate) fn gib_allowed(bytes: u64) -> f64 {
    thousandths(bytes).floor() / 1000.0
}

fn thousandths(bytes: u64) -> f64 {
    bytes as f64 / (1u64 << 30) as f64 * 1000.0
}

/// Divides a list of costs in bytes into stretches that follow each other, the costs of each at most `room` together.
/// A cost above `room` is a stretch of its own.
///
/// ```
/// assert_eq!(vsonar::memory::stretches(&[3, 4, 5, 20, 1], 10), [0..2, 2..3, 3..4, 4..5]);
/// ```
pub fn stretches(costs: &[u64], room: u64) -> Vec<Range<usize>> {
    let mut stretches: Vec<Range<usize>> = Vec::new();
    let mut sum = 0u64;
    for (i, &cost) in costs.iter().enumerate() {
        sum = sum.saturating_add(cost);
        match stretches.last_mut() {
            Some(last) if sum <= room => last.end = i + 1,
            _ => {
                stretches.push(i..i + 1);
                sum = cost;
            }
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_three_quarters() {
        let total = total_of("MemFree: 1 kB\nMemTotal:       24684096 kB\n");
        assert_eq!(total, Some(24_684_096 << 10));
        assert_eq!(limit_of(total), 3 * 24_684_096 * 256);
        for text in ["", "MemTotal: 5\n", "MemTotal: many kB\n", "MemTotal: 0 kB\n", "MemTotal: -1 kB\n"] {
            assert_eq!(total_of(text), None, "{text:?}");
        }
        assert_eq!(limit_of(None), 8 << 30);
        #[cfg(target_os = "linux")]
        assert!(physical_memory().expect("reported by the system") > 64 << 20);
    }

    #[test]
    fn stretches_hold_everything_once() {
        assert!(stretches(&[], 5).is_empty());
        assert_eq!(stretches(&[1, 1, 1, 9], 4), [0..3, 3..4]);
        assert_eq!(stretches(&[u64::MAX, u64::MAX], 5), [0..1, 1..2]);
        assert_eq!(stretches(&[5, 0, 1, 5], 5), [0..2, 2..3, 3..4]);
    }

    #[test]
    fn shown_numbers_never_make_a_need_fit() {
        let one = 1 << 30;
        assert_eq!([0, one, one + 1].map(gib_needed), [0.0, 1.0, 1.001]);
        assert_eq!([0, one, one + 1, one - 1].map(gib_allowed), [0.0, 1.0, 1.0, 0.999]);
    }
}
