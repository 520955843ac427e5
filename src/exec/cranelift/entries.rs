//! The entries of a program and the functions they become.
//!
//! A column is known only when it runs, and the second may depend on the first loop: so a program has up to
//! four entries, column 1, loop 1, column 2, loop 2, and the host resolves columns and strips between them.

use cranelift_codegen::ir::{AbiParam, Function, InstBuilder, Signature};
use cranelift_codegen::isa::TargetIsa;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use vsonar_ir::{Leaf, Loop, Program};

use super::emit::{Emitter, Shape};
use super::emit_loop::{emit_column, emit_loop};
use super::helpers::Helpers;
use super::lanes::{BlockInputs, StripSource};
use crate::exec::wanted;

/// One of the four entries. Which loop is meant is `true` for the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EntryKind {
    /// A column expression, for one case at a time.
    Column { first: bool },
    /// A loop.
    Loop { first: bool },
}

impl EntryKind {
    /// The name in listings.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            EntryKind::Column { first: true } => "column1",
            EntryKind::Loop { first: true } => "loop1",
            EntryKind::Column { first: false } => "column2",
            EntryKind::Loop { first: false } => "loop2",
        }
    }

    /// The end of the name in a profile.
    pub(crate) const fn symbol(self) -> &'static str {
        match self {
            EntryKind::Column { first: true } => "tree1_column",
            EntryKind::Loop { first: true } => "tree1_loop",
            EntryKind::Column { first: false } => "tree2_column",
            EntryKind::Loop { first: false } => "tree2_loop",
        }
    }
}

/// The entries of a program that need code, in the order they run. A column that is the case's own or a
/// constant needs none; a program whose answer is constant has no entries at all.
pub(crate) fn entries(program: &Program) -> Vec<EntryKind> {
    if program.constant_answer().is_some() {
        return Vec::new();
    }
    let mut out = Vec::with_capacity(4);
    for (l, first) in program.first().map(|l| (l, true)).into_iter().chain([(program.second(), false)]) {
        if !matches!(l.column().as_leaf(), Some(Leaf::XObstacle | Leaf::Const(_))) {
            out.push(EntryKind::Column { first });
        }
        out.push(EntryKind::Loop { first });
    }
    out
}

/// Builds the function of an entry.
pub(crate) fn function(
    program: &Program,
    kind: EntryKind,
    shape: Shape,
    isa: &dyn TargetIsa,
    helpers: Option<&Helpers>,
    context: &mut FunctionBuilderContext,
    function: &mut Function,
) {
    let (EntryKind::Column { first } | EntryKind::Loop { first }) = kind;
    let l: &Loop =
        if first { program.first().expect("entries lists what is there") } else { program.second() };
    function.signature = Signature::new(isa.default_call_conv());
    function.signature.params.extend([AbiParam::new(isa.pointer_type()); 3]);
    let mut b = FunctionBuilder::new(function, context);
    let block = b.create_block();
    b.append_block_params_for_function_params(block);
    let &[lane, strips, offset] = b.block_params(block) else { unreachable!("there are three parameters") };
    let mut e = Emitter::new(&mut b, isa, shape, helpers);
    e.switch_to_block(block);
    let mut inputs = BlockInputs { lane };
    match kind {
        EntryKind::Column { .. } => {
            let value = emit_column(&mut e, l.column(), &mut inputs);
            inputs.store(&mut e, 0, value);
        }
        EntryKind::Loop { .. } => {
            let mut source = StripSource::new(strips, offset, l, program.height());
            let wanted = wanted(program, first);
            let finals = emit_loop(&mut e, l, program.height(), wanted, &mut source, &mut inputs);
            for (register, value) in finals.into_iter().enumerate() {
                if let Some(value) = value {
                    inputs.store(&mut e, register, value);
                }
            }
        }
    }
    e.b.ins().return_(&[]);
    b.seal_all_blocks();
    b.finalize(isa.frontend_config());
}
