//! What optimised programs were found to do, within a limit of memory.
//!
//! Most offspring compute nothing new: unlike as trees, they come out of the optimiser as a program that was run
//! before. The key is the whole program, compared in full, so a known result is the result.
//!
//! What is remembered depends on the run alone, never on timing: programs are looked up by all threads while
//! nothing is added, and added in the order of the generation. When the cache is full, the programs go that were
//! not met for the longest time, counted in generations; of those the ones added first.

use std::mem::size_of;
use std::sync::atomic::{AtomicU32, Ordering};

use rustc_hash::FxHashMap;
use vsonar_ir::{Inst, Program};

/// A map from programs to `V`, of a bounded number of bytes.
#[derive(Debug)]
pub(super) struct ProgramCache<V> {
    /// By the program's hash; as a rule a hash has one program.
    entries: FxHashMap<u64, Vec<Entry<V>>>,
    limit: usize,
    /// Bytes a value holds elsewhere.
    value_bytes: usize,
    bytes: usize,
    /// Programs added so far.
    added: u64,
}

#[derive(Debug)]
struct Entry<V> {
    program: Program,
    value: V,
    /// The generation that met the program last. All that look it up at a time write the same number.
    met: AtomicU32,
    /// How many programs were added before it.
    number: u64,
}

impl<V> ProgramCache<V> {
    /// An empty cache of at most `limit` bytes, for values that hold `value_bytes` beside their own size.
    pub(super) fn new(limit: usize, value_bytes: usize) -> ProgramCache<V> {
        ProgramCache { entries: FxHashMap::default(), limit, value_bytes, bytes: 0, added: 0 }
    }

    /// What is known of the program, whose hash is `hash`, and which `generation` has met.
    pub(super) fn get(&self, hash: u64, program: &Program, generation: u32) -> Option<&V> {
        let entry = self.entries.get(&hash)?.iter().find(|entry| entry.program == *program)?;
        entry.met.store(generation, Ordering::Relaxed);
        Some(&entry.value)
    }

    /// Remembers what a program does.
    pub(super) fn insert(&mut self, hash: u64, program: &Program, value: V, generation: u32) {
        let known = self.entries.get_mut(&hash).and_then(|l| l.iter_mut().find(|e| e.program == *program));
        if let Some(known) = known {
            known.value = value;
            known.met = AtomicU32::new(generation);
            return;
        }
        let bytes = self.bytes_of(program);
        if bytes > self.limit {
            return;
        }
        if self.bytes + bytes > self.limit {
            self.evict((self.limit / 4 * 3).min(self.limit - bytes));
        }
        self.bytes += bytes;
        let entry =
            Entry { program: program.clone(), value, met: AtomicU32::new(generation), number: self.added };
        self.added += 1;
        self.entries.entry(hash).or_default().push(entry);
    }

    /// Bytes an entry takes: itself, what it points to, and its place in the map, which is half empty at worst.
    fn bytes_of(&self, program: &Program) -> usize {
        let place = 2 * size_of::<(u64, Vec<Entry<V>>)>();
        place + size_of::<Entry<V>>() + program.len() * size_of::<Inst>() + self.value_bytes
    }

    /// Forgets programs until no more than `target` bytes are left.
    fn evict(&mut self, target: usize) {
        let entries = self.entries.iter_mut();
        let age = |(&hash, entry): (&u64, &mut Entry<V>)| (*entry.met.get_mut(), entry.number, hash);
        let mut order: Vec<(u32, u64, u64)> =
            entries.flat_map(|(hash, list)| list.iter_mut().map(move |e| age((hash, e)))).collect();
        order.sort_unstable();
        for (_, number, hash) in order {
            if self.bytes <= target {
                break;
            }
            let Some(list) = self.entries.get_mut(&hash) else { continue };
            if let Some(place) = list.iter().position(|entry| entry.number == number) {
                let gone = list.swap_remove(place);
                if list.is_empty() {
                    self.entries.remove(&hash);
                }
                self.bytes -= self.bytes_of(&gone.program);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program that answers `answer`; all are of the same size.
    fn program(answer: u32) -> Program {
        let source = format!(
            "vir 1\nimage 64x48\nloop 2 down 3x3\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  varying\n    \
             v0 = y\n    v1 = const {answer}\n    v2 = add v0 v1\n  next a v2\n"
        );
        vsonar_ir::text::parse(&source).unwrap_or_else(|e| panic!("{source}: {e}"))
    }

    fn bytes_each() -> usize {
        ProgramCache::<u32>::new(0, 8).bytes_of(&program(0))
    }

    /// A cache with room for so many of these programs.
    fn cache(room: usize) -> ProgramCache<u32> {
        ProgramCache::new(room * bytes_each(), 8)
    }

    /// Which of the programs 0 to `count` - 1 are there. It looks as generation 0 would, so ages are lost.
    fn there(cache: &ProgramCache<u32>, count: u32) -> Vec<u32> {
        let known = |&i: &u32| match cache.get(u64::from(i % 3), &program(i), 0) {
            Some(&value) => {
                assert_eq!(value, 100 + i, "another program's result");
                true
            }
            None => false,
        };
        (0..count).filter(known).collect()
    }

    /// Hashes collide all the time in these tests: there are three.
    fn insert(cache: &mut ProgramCache<u32>, i: u32, generation: u32) {
        cache.insert(u64::from(i % 3), &program(i), 100 + i, generation);
    }

    #[test]
    fn programs_of_one_hash_are_told_apart() {
        let mut cache = cache(20);
        (0..20).step_by(2).for_each(|i| insert(&mut cache, i, 0));
        assert_eq!(there(&cache, 30), (0..20).step_by(2).collect::<Vec<u32>>());
    }

    #[test]
    fn oldest_generation_first_then_first_added() {
        let mut cache = cache(8);
        (0..8).for_each(|i| insert(&mut cache, i, 1 + i % 2));
        // Full: 0, 2, 4, 6 were met in generation 1, the others in 2. Generation 3 meets 0 and 3 again.
        for i in [0, 3] {
            assert!(cache.get(u64::from(i % 3), &program(i), 3).is_some());
        }
        // Room for six is left before 8 is added: 2 and 4 go.
        insert(&mut cache, 8, 3);
        insert(&mut cache, 9, 3);
        assert!(cache.get(2, &program(2), 3).is_none() && cache.get(1, &program(4), 3).is_none());
        // Then 6, and of those last met in generation 2, the one added first: 1.
        insert(&mut cache, 10, 3);
        assert_eq!(there(&cache, 12), [0, 3, 5, 7, 8, 9, 10]);
    }

    #[test]
    fn bytes_are_bounded() {
        let mut cache = cache(10);
        for i in 0..200 {
            insert(&mut cache, i, i / 7);
            let held = cache.entries.values().map(Vec::len).sum::<usize>();
            assert_eq!(cache.bytes, held * bytes_each());
            assert!(cache.bytes <= cache.limit && held >= (i as usize + 1).min(7), "{held} after {i}");
        }
    }

    #[test]
    fn what_never_fits_is_not_kept() {
        let mut cache = ProgramCache::new(bytes_each() - 1, 8);
        insert(&mut cache, 0, 0);
        assert_eq!((cache.bytes, there(&cache, 1)), (0, vec![]));
    }
}
