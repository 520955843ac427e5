//! What optimised programs were found to do, within a limit of memory.
//!
//! Most offspring compute nothing new: unlike as trees, they come out of the optimiser as a program that was run
//! before. The key is the whole program, compared in full, so a known result is the result.

use std::hash::BuildHasher;
use std::mem::size_of;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rustc_hash::{FxBuildHasher, FxHashMap};
use vsonar_ir::{Inst, Program};

/// Parts that are locked on their own, so that threads rarely meet.
const SHARDS: usize = 64;

/// A map from programs to `V` that forgets the oldest half when it is full.
#[derive(Debug)]
pub(super) struct ProgramCache<V> {
    shards: Vec<Mutex<Shard<V>>>,
    /// Bytes a young map may hold before it becomes the old one.
    limit: usize,
}

#[derive(Debug)]
struct Shard<V> {
    young: FxHashMap<Program, V>,
    old: FxHashMap<Program, V>,
    bytes: usize,
}

impl<V: Clone> ProgramCache<V> {
    /// An empty cache of about so many bytes at most.
    pub(super) fn new(bytes: usize) -> ProgramCache<V> {
        let shard = || Shard { young: FxHashMap::default(), old: FxHashMap::default(), bytes: 0 };
        let shards = (0..SHARDS).map(|_| Mutex::new(shard())).collect();
        ProgramCache { shards, limit: bytes / (2 * SHARDS) }
    }

    fn shard(&self, program: &Program) -> MutexGuard<'_, Shard<V>> {
        let hash = FxBuildHasher.hash_one(program);
        // The maps inside use the other bits. A map whose holder panicked is still a map.
        self.shards[hash as usize / 8 % SHARDS].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What is known of the program.
    pub(super) fn get(&self, program: &Program) -> Option<V> {
        let shard = self.shard(program);
        shard.young.get(program).or_else(|| shard.old.get(program)).cloned()
    }

    /// Remembers what the program does.
    pub(super) fn insert(&self, program: &Program, value: V) {
        let mut shard = self.shard(program);
        let bytes = 2 * size_of::<(Program, V)>() + program.len() * size_of::<Inst>();
        if shard.bytes + bytes > self.limit {
            shard.old = std::mem::take(&mut shard.young);
            shard.bytes = 0;
        }
        shard.bytes += bytes;
        shard.young.insert(program.clone(), value);
    }
}
