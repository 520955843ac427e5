//! The interpreter's registers: a slot of [`LANES`] values each.

use crate::vision::LANES;

/// A register in every lane of a group. A slot of masks holds them as the instruction set does, in its first bytes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Slot([u32; LANES]);

/// The number of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SlotId(pub(super) u32);

/// The columns asked for.
pub(super) const X_OBSTACLE: SlotId = SlotId(0);
/// The centre columns of the current loop.
pub(super) const X: SlotId = SlotId(1);
/// The lanes of the current loop that have not left it.
pub(super) const ALIVE: SlotId = SlotId(2);
/// The first of the slots that programs number themselves.
pub(super) const FREE: SlotId = SlotId(18);

/// A final register of the first loop, 0 to 4.
pub(super) const fn iter2(register: usize) -> SlotId {
    SlotId(3 + register as u32)
}

/// A carried register of the current loop, 0 to 4.
pub(super) const fn carried(register: usize) -> SlotId {
    SlotId(8 + register as u32)
}

/// The final value of a carried register, 0 to 4.
pub(super) const fn out(register: usize) -> SlotId {
    SlotId(13 + register as u32)
}

/// All slots of a worker. They stay where they are until [`Slots::reserve`] makes room for more.
#[derive(Debug, Default)]
pub(super) struct Slots {
    slots: Vec<Slot>,
}

impl Slots {
    /// Makes room for so many slots; what they hold is unspecified, but initialised.
    pub(super) fn reserve(&mut self, count: usize) {
        if count > self.slots.len() {
            self.slots = vec![Slot([0; LANES]); count];
        }
    }

    /// Where a slot's first lane is, to be read and written until the next [`Slots::reserve`].
    ///
    /// # Panics
    /// If there is no such slot.
    pub(super) fn pointer(&mut self, slot: SlotId) -> *mut f32 {
        assert!((slot.0 as usize) < self.slots.len(), "slot {} is reserved", slot.0);
        // From the start of all, so that no pointer ends the validity of another.
        self.slots.as_mut_ptr().wrapping_add(slot.0 as usize).cast()
    }

    /// Writes a binary32 in each lane.
    pub(super) fn fill(&mut self, slot: SlotId, values: &[f32; LANES]) {
        let to = self.pointer(slot);
        // SAFETY: a slot holds LANES 32-bit values at its aligned start, and `values` is elsewhere.
        unsafe { to.copy_from_nonoverlapping(values.as_ptr(), LANES) }
    }

    /// Writes the same 32 bits in each lane.
    pub(super) fn splat(&mut self, slot: SlotId, bits: u32) {
        self.fill(slot, &[f32::from_bits(bits); LANES]);
    }

    /// The binary32s (or bit patterns) of all lanes.
    pub(super) fn values(&mut self, slot: SlotId) -> [f32; LANES] {
        let mut values = [0.0; LANES];
        // SAFETY: as in `fill`; every bit pattern is a binary32.
        unsafe { values.as_mut_ptr().copy_from_nonoverlapping(self.pointer(slot), LANES) }
        values
    }
}
