//! Places on the stack where the registers of a long block wait until they are used.
//!
//! The register allocator compares each value with all that live at the same time, so that its time grows as the square
//! of a block in which many values live long. A long block is therefore emitted in parts: after each one, what is still
//! wanted goes to memory, and a later part loads what it uses. No value lives longer than a part then, and the time grows
//! as the block.

use cranelift_codegen::ir::{self, InstBuilder, MemFlagsData, StackSlot, StackSlotData, StackSlotKind};

use super::emit::Emitter;

/// Where a value is in memory, in units of [`Homes::BYTES`], and its type.
#[derive(Debug, Clone, Copy)]
pub(super) struct Home {
    number: u32,
    ty: ir::Type,
}

/// A stack slot with room for values that come and go.
pub(super) struct Homes {
    slot: StackSlot,
    /// The slot's address, once it is used in the current part.
    address: Option<ir::Value>,
    count: u32,
    free: Vec<u32>,
}

impl Homes {
    /// Bytes for each value: the largest is a vector.
    const BYTES: u32 = 1 << Homes::ALIGN;
    const ALIGN: u8 = 4;

    /// No homes yet, in the function being emitted.
    pub(super) fn new(e: &mut Emitter<'_, '_>) -> Homes {
        let data = StackSlotData::new(StackSlotKind::ExplicitSlot, Homes::BYTES, Homes::ALIGN);
        Homes { slot: e.b.create_sized_stack_slot(data), address: None, count: 0, free: Vec::new() }
    }

    /// Begins a part: addresses and constants are made anew.
    pub(super) fn begin_part(&mut self, e: &mut Emitter<'_, '_>) {
        self.address = None;
        e.forget_constants();
    }

    /// Stores a value in a home of its own.
    pub(super) fn store(&mut self, e: &mut Emitter<'_, '_>, value: ir::Value) -> Home {
        let number = self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            e.b.func.sized_stack_slots[self.slot].size = self.count * Homes::BYTES;
            self.count - 1
        });
        let home = Home { number, ty: e.b.func.dfg.value_type(value) };
        let address = self.address(e);
        e.b.ins().store(MemFlagsData::trusted(), value, address, home.offset());
        home
    }

    /// Loads the value of a home.
    pub(super) fn load(&mut self, e: &mut Emitter<'_, '_>, home: Home) -> ir::Value {
        let address = self.address(e);
        e.b.ins().load(home.ty, MemFlagsData::trusted(), address, home.offset())
    }

    /// Lets another value have the home.
    pub(super) fn release(&mut self, home: Home) {
        self.free.push(home.number);
    }

    fn address(&mut self, e: &mut Emitter<'_, '_>) -> ir::Value {
        *self.address.get_or_insert_with(|| e.b.ins().stack_addr(ir::types::I64, self.slot, 0))
    }
}

impl Home {
    /// Whether the value is in lanes.
    pub(super) fn is_vector(self) -> bool {
        self.ty.is_vector()
    }

    fn offset(self) -> i32 {
        (self.number * Homes::BYTES).cast_signed()
    }
}
