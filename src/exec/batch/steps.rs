//! Steps: decoded instructions with the addresses of what they read and write, and the loop that runs them.
//!
//! All unsafe code of the interpreter's inner loops is here and in [`super::rows`]. Its ground is one promise,
//! which [`super::plan`] keeps and whoever runs steps answers for: every address in a step is that of [`LANES`]
//! values in a slot, or in a row of strips that is held while the step runs; masks are read only from slots last
//! written as masks, by the same instruction set.

use pulp::{Simd, WithSimd};
use vsonar_ir::op::{Formula, FormulaVisitor, Value};
use vsonar_ir::{Op, Ty};

use super::lanes::Lanes;
use crate::vision::LANES;

/// One instruction. A leaf stands for a copy of the first operand, a binary32.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) op: Op,
    pub(super) imm: u32,
    pub(super) to: *mut f32,
    pub(super) args: [*const f32; 3],
}

/// Runs steps once, for every lane.
pub(super) struct Straight<'a>(&'a [Step]);

impl<'a> Straight<'a> {
    /// These steps, to be run.
    ///
    /// # Safety
    /// The promise of the module holds for the steps as long as this lives, with the instruction set that runs it.
    pub(super) const unsafe fn new(steps: &'a [Step]) -> Straight<'a> {
        Straight(steps)
    }
}

impl WithSimd for Straight<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for step in self.0 {
            // SAFETY: by the contract of `Straight::new`.
            unsafe { run::<S, false>(simd, step) };
        }
    }
}

/// How many vectors the lanes of a group are, or those of its first half.
#[inline(always)]
pub(super) fn vectors<S: Simd, const HALF: bool>() -> usize {
    LANES / if HALF { 2 } else { 1 } / S::F32_LANES
}

/// Runs one step for every lane, or for the first half of them.
///
/// # Safety
/// The promise of the module holds for the step.
#[inline(always)]
pub(super) unsafe fn run<S: Simd, const HALF: bool>(simd: S, step: &Step) {
    if step.op.visit(EveryLane::<S, HALF> { simd, step }).is_none() {
        for k in 0..vectors::<S, HALF>() {
            // SAFETY: by the contract.
            unsafe { store(step.to, k, load::<S>(step.args[0], k)) }
        }
    }
}

/// The binary32s of the vector number `k` of a slot or row.
///
/// # Safety
/// `from` points to [`LANES`] binary32s, and `k` is below `LANES / S::F32_LANES`.
#[inline(always)]
pub(super) unsafe fn load<S: Simd>(from: *const f32, k: usize) -> S::f32s {
    // SAFETY: by the contract the vector is inside; any bits are a value of it.
    unsafe { from.cast::<S::f32s>().add(k).read_unaligned() }
}

/// Writes the vector number `k` of a slot. `T` is a vector type of an instruction set.
///
/// # Safety
/// `to` points to a slot, and `k` is below the number of vectors in it.
#[inline(always)]
pub(super) unsafe fn store<T>(to: *mut f32, k: usize, value: T) {
    // SAFETY: by the contract the vector is inside; a vector of masks is at most as large as one of binary32s.
    unsafe { to.cast::<T>().add(k).write_unaligned(value) }
}

/// The masks of the vector number `k` of a slot.
///
/// # Safety
/// As [`load`], and the slot was last written with masks of this instruction set.
#[inline(always)]
pub(super) unsafe fn load_mask<S: Simd>(from: *const f32, k: usize) -> S::m32s {
    // SAFETY: by the contract these bytes are a value of the type.
    unsafe { from.cast::<S::m32s>().add(k).read_unaligned() }
}

/// A step to be run with the formula of its operation. [`run`] alone makes it, under its contract.
struct EveryLane<'a, S, const HALF: bool> {
    simd: S,
    step: &'a Step,
}

impl<S: Simd, const HALF: bool> FormulaVisitor for EveryLane<'_, S, HALF> {
    type Output = ();

    #[inline(always)]
    fn visit<F: Formula>(self) {
        let types = const { F::OP.operands() };
        let mut machine = Lanes(self.simd);
        let Step { imm, to, args: from, .. } = *self.step;
        for k in 0..vectors::<S, HALF>() {
            let zero = Value::F32(self.simd.splat_f32s(0.0));
            let mut args: [Value<Lanes<S>>; 3] = [zero; 3];
            for (i, ty) in types.iter().enumerate() {
                // SAFETY: the contract of `run`.
                args[i] = unsafe {
                    match ty {
                        Ty::F32 => Value::F32(load::<S>(from[i], k)),
                        Ty::I32 => Value::I32(self.simd.transmute_u32s_f32s(load::<S>(from[i], k))),
                        Ty::Mask => Value::Mask(load_mask::<S>(from[i], k)),
                    }
                };
            }
            // SAFETY: the contract of `run`.
            unsafe {
                match F::apply(&mut machine, &args[..types.len()], imm) {
                    Value::F32(value) => store(to, k, value),
                    Value::I32(value) => store(to, k, value),
                    Value::Mask(value) => store(to, k, value),
                }
            }
        }
    }
}
