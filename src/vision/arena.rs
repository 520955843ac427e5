//! Aligned memory for strips.

use std::ops::{Deref, DerefMut};

/// As many binary32s as fit a cache line.
const CHUNK: usize = 16;

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Chunk([f32; CHUNK]);

/// A fixed number of binary32s, contiguous and aligned to 64 bytes, so that vector code may use aligned loads.
#[derive(Clone, Default)]
pub struct Arena {
    chunks: Vec<Chunk>,
    len: usize,
}

impl Arena {
    /// `len` zeros.
    pub fn zeroed(len: usize) -> Arena {
        Arena { chunks: vec![Chunk([0.0; CHUNK]); len.div_ceil(CHUNK)], len }
    }

    /// Makes room for at least `len` values, for scratch space that grows with its largest user. The values
    /// are unspecified afterwards, but initialised.
    pub fn grow(&mut self, len: usize) {
        if len > self.len {
            *self = Arena::zeroed(len);
        }
    }
}

impl std::fmt::Debug for Arena {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Arena").field("len", &self.len).finish_non_exhaustive()
    }
}

impl Deref for Arena {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        // SAFETY: a chunk is exactly 16 binary32s without padding (repr(C), size 64, alignment 64), the vector
        // holds at least len / 16 of them rounded up, all initialised, and the borrow of self keeps them.
        unsafe { std::slice::from_raw_parts(self.chunks.as_ptr().cast::<f32>(), self.len) }
    }
}

impl DerefMut for Arena {
    fn deref_mut(&mut self) -> &mut [f32] {
        // SAFETY: as in `deref`; the mutable borrow of self excludes any other.
        unsafe { std::slice::from_raw_parts_mut(self.chunks.as_mut_ptr().cast::<f32>(), self.len) }
    }
}

const _: () = assert!(size_of::<Chunk>() == CHUNK * size_of::<f32>());

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arenas_are_aligned_and_zero() {
        for len in [0, 1, 15, 16, 17, 1000] {
            let mut arena = Arena::zeroed(len);
            assert_eq!(arena.len(), len);
            assert_eq!(arena.as_ptr() as usize % 64, 0);
            assert!(arena.iter().all(|v| v.to_bits() == 0));
            arena.iter_mut().enumerate().for_each(|(i, v)| *v = i as f32);
            assert!(arena.iter().enumerate().all(|(i, v)| *v == i as f32));
        }
    }

    #[test]
    fn growing_never_shrinks() {
        let mut arena = Arena::default();
        arena.grow(40);
        assert_eq!(arena.len(), 40);
        arena.grow(7);
        assert_eq!(arena.len(), 40);
    }
}
