//! Strips of columns other than the cases' own, kept for the next program that asks for the same.
//!
//! Most column expressions of a population are relatives: the same constant, the same shift of the column asked
//! for, the same first loop before them. So what is remembered is the strip of a whole group by the rectangle
//! and the columns of all its lanes, whatever expression they came from. A strip is made whole when it is asked
//! for the second time; a loop that asks first gathers for itself, only as far as it gets.
//!
//! What is kept never changes a result, so that several threads may meet here in any order.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rustc_hash::FxHashMap;
use vsonar_ir::{Operand, Rect};

use super::arena::Arena;
use super::strips::LANES;

/// The columns of a group's lanes in a rectangle. Columns are below 2¹⁶, the largest side of an image.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Key {
    rect: Rect,
    columns: [u16; LANES],
}

/// The strips of one group for one choice of columns, as far as they are wanted.
#[derive(Debug)]
pub struct CachedStrips {
    strips: [OnceLock<Strip>; Operand::COUNT],
}

impl CachedStrips {
    /// An operand's strip: `strip[p * LANES + l]` for position p and lane l. Empty if it was not asked for.
    pub fn strip(&self, operand: Operand) -> &[f32] {
        self.strips[usize::from(operand.index())].get().map_or(&[], |strip| &strip.values)
    }
}

/// A strip whose memory goes back to the pool.
#[derive(Debug)]
struct Strip {
    values: Arena,
    pool: Arc<Pool>,
}

impl Drop for Strip {
    fn drop(&mut self) {
        self.pool.give_back(std::mem::take(&mut self.values));
    }
}

/// Memory that strips had before. To touch fresh memory costs more than to fill it, so none is given to the system.
#[derive(Debug, Default)]
struct Pool {
    idle: Mutex<Vec<Arena>>,
}

impl Pool {
    fn take(&self, len: usize) -> Arena {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        idle.unwrap_or_else(|| Arena::zeroed(len))
    }

    fn give_back(&self, arena: Arena) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(arena);
    }
}

/// What is known of a key: the operands that were asked for, and their strips.
#[derive(Debug)]
struct Known {
    asked: u16,
    strips: Arc<CachedStrips>,
}

/// One group's part, which forgets what was not asked for since its last half was filled.
#[derive(Debug, Default)]
struct Shard {
    young: FxHashMap<Key, Known>,
    old: FxHashMap<Key, Known>,
    bytes: usize,
}

/// Bytes that a key takes, with its place in a map.
const KEY_BYTES: usize = 2 * (size_of::<Key>() + size_of::<Known>() + size_of::<CachedStrips>());

/// Strips under a limit of memory.
#[derive(Debug)]
pub(super) struct StripCache {
    /// By group.
    shards: Vec<Mutex<Shard>>,
    pool: Arc<Pool>,
    /// Length of the longest strip.
    len: usize,
    /// Bytes that the young map of a shard may hold.
    limit: AtomicUsize,
}

impl StripCache {
    /// Nothing is kept until there is a limit. Strips are at most `len` binary32s long.
    pub(super) fn new(groups: usize, len: usize) -> StripCache {
        let shards = (0..groups).map(|_| Mutex::default()).collect();
        StripCache { shards, pool: Arc::default(), len, limit: AtomicUsize::new(0) }
    }

    /// From now on at most about so many bytes are kept.
    pub(super) fn set_limit(&self, bytes: usize) {
        self.limit.store(bytes / 2 / self.shards.len().max(1), Ordering::Relaxed);
    }

    /// The strips of these operands, if they are kept; those that were asked for before and are not there are
    /// made with `fill`. `None` tells the caller to gather for itself.
    pub(super) fn get(
        &self,
        group: usize,
        rect: Rect,
        columns: &[u32; LANES],
        operands: &[Operand],
        fill: impl Fn(Operand, &mut [f32]),
    ) -> Option<Arc<CachedStrips>> {
        let limit = self.limit.load(Ordering::Relaxed);
        if limit == 0 {
            return None;
        }
        let key = Key { rect, columns: columns.map(|column| column as u16) };
        let strips = {
            let mut shard = self.shards[group].lock().unwrap_or_else(PoisonError::into_inner);
            shard.ask(key, operands, limit, self.len * size_of::<f32>())?
        };
        for &operand in operands {
            strips.strips[usize::from(operand.index())].get_or_init(|| {
                let mut values = self.pool.take(self.len);
                fill(operand, &mut values);
                Strip { values, pool: Arc::clone(&self.pool) }
            });
        }
        Some(strips)
    }
}

impl Shard {
    /// The strips of a key, if all of these operands were asked for before.
    fn ask(
        &mut self,
        key: Key,
        operands: &[Operand],
        limit: usize,
        strip_bytes: usize,
    ) -> Option<Arc<CachedStrips>> {
        let wanted = operands.iter().fold(0, |bits, operand| bits | 1u16 << operand.index());
        if !self.young.contains_key(&key) {
            let known = self.old.remove(&key).unwrap_or_else(|| Known {
                asked: 0,
                strips: Arc::new(CachedStrips { strips: [const { OnceLock::new() }; Operand::COUNT] }),
            });
            let bytes =
                KEY_BYTES + known.strips.strips.iter().filter_map(OnceLock::get).count() * strip_bytes;
            if self.bytes + bytes > limit {
                self.old = std::mem::take(&mut self.young);
                self.bytes = 0;
            }
            self.bytes += bytes;
            self.young.insert(key.clone(), known);
        }
        let known = self.young.get_mut(&key)?;
        let ready = known.asked & wanted == wanted;
        known.asked |= wanted;
        if !ready {
            return None;
        }
        let new = operands.iter().filter(|o| known.strips.strips[usize::from(o.index())].get().is_none());
        self.bytes += new.count() * strip_bytes;
        Some(Arc::clone(&known.strips))
    }
}
