//! Values that wait in memory while a tile is made.

use cranelift_codegen::ir::{self, InstBuilder, MemFlagsData, StackSlot};

use super::emit::{Emitter, Shape};

/// Values in memory.
pub(super) struct Kept {
    pub(super) slot: StackSlot,
    pub(super) types: Vec<ir::Type>,
    /// The first so many are carried from row to row.
    pub(super) carried: usize,
    /// The others: registers of the body.
    pub(super) invariants: Vec<(usize, Shape)>,
}

impl Kept {
    /// Bytes for each value, and the logarithm of it.
    pub(super) const BYTES: i32 = 1 << Kept::ALIGN;
    pub(super) const ALIGN: u8 = 4;

    pub(super) fn address(&self, e: &mut Emitter<'_, '_>) -> ir::Value {
        e.b.ins().stack_addr(ir::types::I64, self.slot, 0)
    }

    /// Stores the first values.
    pub(super) fn store(&self, e: &mut Emitter<'_, '_>, values: &[ir::Value]) {
        let address = self.address(e);
        for (i, &value) in values.iter().enumerate() {
            e.b.ins().store(MemFlagsData::trusted(), value, address, Kept::BYTES * i as i32);
        }
    }

    /// Loads them all.
    pub(super) fn load(&self, e: &mut Emitter<'_, '_>) -> Vec<ir::Value> {
        let address = self.address(e);
        let load = |(i, &ty): (usize, &ir::Type)| {
            e.b.ins().load(ty, MemFlagsData::trusted(), address, Kept::BYTES * i as i32)
        };
        self.types.iter().enumerate().map(load).collect()
    }
}
