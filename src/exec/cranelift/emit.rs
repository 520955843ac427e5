//! The one emitter: a [`Machine`] whose values are Cranelift values, for one case or for four lanes.
//!
//! Every operation of the language reaches it through [`Op::apply`], so that compiled code is the same formula
//! as every other executor's. What Cranelift offers is used directly; nothing is decided here about meaning.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::immediates::Ieee32;
use cranelift_codegen::ir::types::{F32, F32X4, I8, I32, I32X4};
use cranelift_codegen::ir::{self, Endianness, InstBuilder, MemFlagsData, Opcode, SigRef, Type};
use cranelift_codegen::isa::TargetIsa;
use cranelift_frontend::FunctionBuilder;
use rustc_hash::FxHashMap;
use vsonar_ir::machine::Machine;
use vsonar_ir::op::Value;
use vsonar_ir::{Op, Ty};

use super::helpers::Helpers;

/// How many fitness cases a compiled loop runs at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// One case: plain numbers, and `break` is a branch.
    Scalar,
    /// Four cases as the lanes of 128-bit vectors; masks for choices and `break`.
    Lanes4,
}

impl Shape {
    /// Both shapes.
    pub const ALL: [Shape; 2] = [Shape::Scalar, Shape::Lanes4];

    /// How many cases run at once.
    pub const fn lanes(self) -> usize {
        match self {
            Shape::Scalar => 1,
            Shape::Lanes4 => 4,
        }
    }

    /// The name in symbols.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Shape::Scalar => "scalar",
            Shape::Lanes4 => "lanes4",
        }
    }

    /// The Cranelift type that holds a register of this type.
    pub(crate) const fn ty(self, ty: Ty) -> Type {
        match (self, ty) {
            (Shape::Scalar, Ty::F32) => F32,
            (Shape::Scalar, Ty::I32) => I32,
            (Shape::Scalar, Ty::Mask) => I8,
            (Shape::Lanes4, Ty::F32) => F32X4,
            (Shape::Lanes4, Ty::I32 | Ty::Mask) => I32X4,
        }
    }
}

/// Vectors are reinterpreted lane by lane, whatever the byte order of the machine.
const REINTERPRET: MemFlagsData = MemFlagsData::new().with_endianness(Endianness::Little);

/// Constants of the current block, by type and bit pattern, so that each is made once.
type Constants = FxHashMap<(Type, u32), ir::Value>;

/// Builds the body of one function.
pub(crate) struct Emitter<'a, 'f> {
    pub(crate) b: &'a mut FunctionBuilder<'f>,
    shape: Shape,
    /// Whether the target has a single instruction that selects lanes under a mask's sign bits.
    blend: bool,
    constants: Constants,
    helpers: Option<&'a Helpers>,
    /// Signatures of helper calls made so far, by shape and number of operands.
    signatures: Vec<((Shape, usize), SigRef)>,
}

impl<'a, 'f> Emitter<'a, 'f> {
    /// An emitter for values of `shape`. With `helpers`, operations that have one are called, not expanded.
    pub(crate) fn new(
        b: &'a mut FunctionBuilder<'f>,
        isa: &dyn TargetIsa,
        shape: Shape,
        helpers: Option<&'a Helpers>,
    ) -> Emitter<'a, 'f> {
        Emitter {
            b,
            shape,
            blend: has_blend(isa),
            constants: Constants::default(),
            helpers,
            signatures: Vec::new(),
        }
    }

    /// The shape of the values being computed.
    pub(crate) fn shape(&self) -> Shape {
        self.shape
    }

    /// Computes values of another shape from here on.
    pub(crate) fn set_shape(&mut self, shape: Shape) {
        self.shape = shape;
    }

    /// Starts to fill a block. Constants are made anew in each, which costs less than keeping them in
    /// registers or stack slots from block to block.
    pub(crate) fn switch_to_block(&mut self, block: ir::Block) {
        self.b.switch_to_block(block);
        self.forget_constants();
    }

    /// Makes constants anew from here on.
    pub(crate) fn forget_constants(&mut self) {
        self.constants.clear();
    }

    /// One operation that is no leaf.
    pub(crate) fn operation(&mut self, op: Op, args: &[Value<Self>], imm: u32) -> Value<Self> {
        if let Some(address) = self.helpers.and_then(|h| h.address(op, self.shape)) {
            return Value::F32(self.call(address, args));
        }
        op.apply(self, args, imm).expect("a leaf does not come here")
    }

    /// A value of one case, of type `ty`, in every lane of the current shape.
    pub(crate) fn splat(&mut self, ty: Ty, value: ir::Value) -> ir::Value {
        if self.shape == Shape::Scalar {
            return value;
        }
        let value = if ty == Ty::Mask { self.b.ins().bmask(I32, value) } else { value };
        self.b.ins().splat(self.shape.ty(ty), value)
    }

    /// A constant register: its type and bits (a mask's are 0 or 1).
    pub(crate) fn constant(&mut self, ty: Ty, bits: u32) -> ir::Value {
        let bits = if ty == Ty::Mask && self.shape == Shape::Lanes4 { bits.wrapping_neg() } else { bits };
        let ctype = self.shape.ty(ty);
        if let Some(&value) = self.constants.get(&(ctype, bits)) {
            return value;
        }
        let value = match ctype {
            F32 => self.b.ins().f32const(Ieee32::with_bits(bits)),
            I32 | I8 => self.b.ins().iconst(ctype, i64::from(bits)),
            _ => {
                let lanes = [bits.to_le_bytes(); 4].concat();
                let handle = self.b.func.dfg.constants.insert(lanes.into());
                self.b.ins().vconst(ctype, handle)
            }
        };
        self.constants.insert((ctype, bits), value);
        value
    }

    /// Wraps a Cranelift value as a register of type `ty`.
    pub(crate) fn wrap(ty: Ty, value: ir::Value) -> Value<Self> {
        match ty {
            Ty::F32 => Value::F32(value),
            Ty::I32 => Value::I32(value),
            Ty::Mask => Value::Mask(value),
        }
    }

    /// The Cranelift value of a register.
    pub(crate) fn unwrap(value: Value<Self>) -> ir::Value {
        match value {
            Value::F32(v) | Value::I32(v) | Value::Mask(v) => v,
        }
    }

    fn call(&mut self, address: usize, args: &[Value<Self>]) -> ir::Value {
        let key = (self.shape, args.len());
        let signature = match self.signatures.iter().find(|(k, _)| *k == key) {
            Some(&(_, signature)) => signature,
            None => {
                let call_conv = self.b.func.signature.call_conv;
                let signature =
                    self.b.import_signature(Helpers::signature(self.shape, args.len(), call_conv));
                self.signatures.push((key, signature));
                signature
            }
        };
        let callee = self.b.ins().iconst(ir::types::I64, address as i64);
        let args: Vec<ir::Value> = args.iter().map(|arg| arg.f32()).collect();
        let call = self.b.ins().call_indirect(signature, callee, &args);
        self.b.inst_results(call)[0]
    }

    fn fcmp(&mut self, condition: FloatCC, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().fcmp(condition, a, b)
    }

    fn icmp(&mut self, condition: IntCC, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().icmp(condition, a, b)
    }

    /// `a` where the mask holds, else `b`, all of vector type `ty`.
    fn blend(&mut self, ty: Type, mask: ir::Value, a: ir::Value, b: ir::Value) -> ir::Value {
        // A comparison at hand makes the better pattern: a minimum or maximum, or a blend.
        let compares =
            self.b.func.dfg.value_def(mask).inst().is_some_and(|inst| {
                matches!(self.b.func.dfg.insts[inst].opcode(), Opcode::Fcmp | Opcode::Icmp)
            });
        if compares || !self.blend {
            let mask = self.cast(ty, mask);
            return self.b.ins().bitselect(mask, a, b);
        }
        let (a, b) = (self.cast(I32X4, a), self.cast(I32X4, b));
        let chosen = self.b.ins().blendv(mask, a, b);
        self.cast(ty, chosen)
    }

    fn cast(&mut self, to: Type, value: ir::Value) -> ir::Value {
        if self.b.func.dfg.value_type(value) == to {
            return value;
        }
        self.b.ins().bitcast(to, REINTERPRET, value)
    }
}

/// Whether the target lowers `blendv`, the selection under sign bits: x86-64 with SSE 4.1.
fn has_blend(isa: &dyn TargetIsa) -> bool {
    isa.name() == "x64" && isa.isa_flags().iter().any(|f| f.name == "has_sse41" && f.as_bool() == Some(true))
}

impl Machine for Emitter<'_, '_> {
    type F = ir::Value;
    type I = ir::Value;
    type M = ir::Value;

    fn f32(&mut self, value: f32) -> ir::Value {
        self.constant(Ty::F32, value.to_bits())
    }
    fn i32(&mut self, value: i32) -> ir::Value {
        self.constant(Ty::I32, value.cast_unsigned())
    }
    fn mask(&mut self, value: bool) -> ir::Value {
        self.constant(Ty::Mask, u32::from(value))
    }

    fn add(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().fadd(a, b)
    }
    fn sub(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().fsub(a, b)
    }
    fn mul(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().fmul(a, b)
    }
    fn div(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().fdiv(a, b)
    }

    fn lt(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.fcmp(FloatCC::LessThan, a, b)
    }
    fn le(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.fcmp(FloatCC::LessThanOrEqual, a, b)
    }
    fn eq(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.fcmp(FloatCC::Equal, a, b)
    }

    fn select(&mut self, mask: ir::Value, a: ir::Value, b: ir::Value) -> ir::Value {
        match self.shape {
            Shape::Scalar => self.b.ins().select(mask, a, b),
            Shape::Lanes4 => self.blend(F32X4, mask, a, b),
        }
    }
    fn iselect(&mut self, mask: ir::Value, a: ir::Value, b: ir::Value) -> ir::Value {
        match self.shape {
            Shape::Scalar => self.b.ins().select(mask, a, b),
            Shape::Lanes4 => self.blend(I32X4, mask, a, b),
        }
    }

    fn and(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().band(a, b)
    }
    fn or(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().bor(a, b)
    }
    fn not(&mut self, a: ir::Value) -> ir::Value {
        match self.shape {
            Shape::Scalar => {
                let one = self.mask(true);
                self.b.ins().bxor(a, one)
            }
            Shape::Lanes4 => self.b.ins().bnot(a),
        }
    }

    fn to_bits(&mut self, a: ir::Value) -> ir::Value {
        let ty = self.shape.ty(Ty::I32);
        self.cast(ty, a)
    }
    fn from_bits(&mut self, a: ir::Value) -> ir::Value {
        let ty = self.shape.ty(Ty::F32);
        self.cast(ty, a)
    }

    fn iadd(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().iadd(a, b)
    }
    fn isub(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().isub(a, b)
    }
    fn iand(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().band(a, b)
    }
    fn ior(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().bor(a, b)
    }
    fn ixor(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.b.ins().bxor(a, b)
    }
    fn ishl(&mut self, a: ir::Value, bits: u32) -> ir::Value {
        let count = self.b.ins().iconst(I32, i64::from(bits));
        self.b.ins().ishl(a, count)
    }
    fn iushr(&mut self, a: ir::Value, bits: u32) -> ir::Value {
        let count = self.b.ins().iconst(I32, i64::from(bits));
        self.b.ins().ushr(a, count)
    }
    fn ieq(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.icmp(IntCC::Equal, a, b)
    }
    fn ilt(&mut self, a: ir::Value, b: ir::Value) -> ir::Value {
        self.icmp(IntCC::SignedLessThan, a, b)
    }
}
