//! Long operations out of line: functions compiled once, called by address.
//!
//! An operation of the table whose formula expands to more than a few instructions on numbers (the
//! trigonometric ones) adds some 10 microseconds to the compilation of a program wherever it stands, and more than
//! that where many of them compete for registers. Its formula is compiled once at start, by the same emitter, for one
//! number and for four lanes, and programs call it. Where every row of many cases runs, the call takes a third
//! longer than the expansion, because all registers in use are stored around it; but evolved programs leave their
//! rows early, and whole runs were 5 to 35 % shorter with calls (corridor and street images, both presets).

use std::sync::Mutex;

use cranelift_codegen::Context;
use cranelift_codegen::ir::{AbiParam, Function, InstBuilder, Signature, UserFuncName};
use cranelift_codegen::isa::{CallConv, TargetIsa};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use vsonar_ir::op::Value;
use vsonar_ir::{Op, Ty};

use super::emit::{Emitter, Shape};
use super::owned::OwnedModule;
use super::target::{self, Effort};
use crate::exec::ExecError;

/// From this many Cranelift instructions on, an operation is called and not expanded. A call costs about as
/// much to compile as a handful of instructions, and stores the registers in use.
const CALLED_FROM: usize = 16;

/// Helper functions in executable memory, which is freed when they are dropped.
pub(crate) struct Helpers {
    /// Behind a lock only because a module cannot be shared; nobody takes it.
    _module: Mutex<OwnedModule>,
    /// Addresses by shape and operation; 0 for operations that are expanded.
    addresses: [Vec<usize>; 2],
}

impl Helpers {
    /// Compiles the helpers for this machine.
    ///
    /// # Errors
    /// If Cranelift does not know the machine, or memory is refused.
    pub(crate) fn new() -> Result<Helpers, ExecError> {
        let isa = target::host(Effort::Best)?;
        let mut module = OwnedModule::new(isa.clone(), None);
        let addresses = define(&mut module, &*isa)?;
        Ok(Helpers { _module: Mutex::new(module), addresses })
    }

    /// The address of the operation's helper, if it has one.
    pub(crate) fn address(&self, op: Op, shape: Shape) -> Option<usize> {
        let address = self.addresses[shape as usize][op as usize];
        (address != 0).then_some(address)
    }

    /// The signature of a helper of so many operands.
    pub(crate) fn signature(shape: Shape, operands: usize, call_conv: CallConv) -> Signature {
        let mut signature = Signature::new(call_conv);
        let param = AbiParam::new(shape.ty(Ty::F32));
        signature.params.extend(vec![param; operands]);
        signature.returns.push(param);
        signature
    }
}

impl std::fmt::Debug for Helpers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Helpers").finish_non_exhaustive()
    }
}

/// The function of an operation on numbers.
fn function(isa: &dyn TargetIsa, context: &mut FunctionBuilderContext, shape: Shape, op: Op) -> Function {
    let signature = Helpers::signature(shape, op.operands().len(), isa.default_call_conv());
    let mut function = Function::with_name_signature(UserFuncName::default(), signature);
    let mut b = FunctionBuilder::new(&mut function, context);
    let block = b.create_block();
    b.append_block_params_for_function_params(block);
    let mut e = Emitter::new(&mut b, isa, shape, None);
    e.switch_to_block(block);
    let args: Vec<Value<Emitter<'_, '_>>> = e.b.block_params(block).iter().map(|&v| Value::F32(v)).collect();
    let result = e.operation(op, &args, 0).f32();
    e.b.ins().return_(&[result]);
    b.seal_all_blocks();
    b.finalize(isa.frontend_config());
    function
}

/// Compiles the helpers of both shapes; their addresses.
fn define(module: &mut OwnedModule, isa: &dyn TargetIsa) -> Result<[Vec<usize>; 2], ExecError> {
    let mut context = Context::new();
    let mut builder_context = FunctionBuilderContext::new();
    let mut defined = Vec::new();
    for shape in Shape::ALL {
        for &op in Op::ALL {
            if op.is_leaf() || op.result() != Ty::F32 || op.operands().iter().any(|&ty| ty != Ty::F32) {
                continue;
            }
            context.clear();
            context.func = function(isa, &mut builder_context, shape, op);
            if context.func.dfg.num_insts() < CALLED_FROM {
                continue;
            }
            let name = || format!("vsonar_{}_{}", op.name(), shape.name());
            defined.push((shape, op, module.define(&mut context, name)?));
        }
    }
    module.finalize().map_err(ExecError::Memory)?;
    let module = module.module();
    let mut addresses = [vec![0; Op::ALL.len()], vec![0; Op::ALL.len()]];
    for (shape, op, id) in defined {
        addresses[shape as usize][op as usize] = module.get_finalized_function(id) as usize;
    }
    Ok(addresses)
}
