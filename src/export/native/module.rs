//! Puts a detector's functions into a module: an object file's, or this process's.

use cranelift_codegen::binemit::Reloc;
use cranelift_codegen::ir::{ExternalName, Function};
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::{Context, FinalizedRelocTarget};
use cranelift_frontend::FunctionBuilderContext;
use cranelift_module::{FuncId, Linkage, Module, ModuleError};

use super::plan::Plan;
use super::rows::{self, Rows};
use super::{NativeError, fill};
use crate::exec::MAX_COMPILED;
use crate::exec::cranelift::Shape;
use vsonar_ir::Program;

/// A function and what it needs of the stack.
#[derive(Debug, Clone, Copy)]
pub(super) struct Defined {
    pub(super) id: FuncId,
    /// Bytes of stack that a call takes, those of the functions it calls included.
    pub(super) stack: usize,
}

/// Compiles functions into a module.
pub(super) struct Definer<'m, M: Module> {
    pub(super) module: &'m mut M,
    pub(super) isa: OwnedTargetIsa,
    context: Context,
    pub(super) builder_context: FunctionBuilderContext,
}

/// What a call itself puts on the stack: return address and frame pointer, with room to align.
const CALL_BYTES: usize = 32;

impl<'m, M: Module> Definer<'m, M> {
    /// `isa` is what the module compiles for.
    pub(super) fn new(module: &'m mut M, isa: OwnedTargetIsa) -> Definer<'m, M> {
        Definer { module, isa, context: Context::new(), builder_context: FunctionBuilderContext::new() }
    }

    /// Declares a function of this name, seen from outside or not, and compiles what `build` makes of it.
    pub(super) fn define(
        &mut self,
        name: &str,
        linkage: Linkage,
        deepest_call: usize,
        build: impl FnOnce(&mut M, &mut FunctionBuilderContext, &mut Function),
    ) -> Result<Defined, NativeError> {
        self.context.clear();
        build(self.module, &mut self.builder_context, &mut self.context.func);
        let id = self.module.declare_function(name, linkage, &self.context.func.signature)?;
        self.module.define_function(id, &mut self.context)?;
        let Some(code) = self.context.compiled_code() else { unreachable!("the function has been compiled") };
        for relocation in code.buffer.relocs() {
            check(name, relocation.kind, &relocation.target)?;
        }
        let frame = code.buffer.frame_layout().map_or(0, |layout| layout.frame_to_fp_offset as usize);
        // Probes touch whole pages, the last of which may end beyond the frame.
        let page = 1 << self.isa.flags().probestack_size_log2();
        let probed = if self.isa.flags().enable_probestack() && frame >= page { page } else { 0 };
        Ok(Defined { id, stack: frame + probed + CALL_BYTES + deepest_call })
    }

    /// The function that finds rows, with the fills of its loops.
    pub(super) fn rows(
        &mut self,
        prefix: &str,
        program: &Program,
        shape: Shape,
    ) -> Result<Defined, NativeError> {
        if program.len() > MAX_COMPILED {
            return Err(NativeError::TooLong { instructions: program.len() });
        }
        let plans = rows::plans(program);
        let vectors = shape == Shape::Lanes4;
        let mut fills = [None; 2];
        for (number, plan) in plans.iter().enumerate() {
            let Some(plan) = plan else { continue };
            let same = number == 1 && plans[0].as_ref().is_some_and(|first| first.fills_like(plan));
            fills[number] =
                if same { fills[0] } else { Some(self.fill(prefix, number + 1, plan, vectors)?) };
        }
        let deepest = fills.iter().flatten().map(|fill: &Defined| fill.stack).max().unwrap_or(0);
        let isa = self.isa.clone();
        self.define(&format!("{prefix}_rows"), Linkage::Local, deepest, |module, context, function| {
            let rows = Rows { program, plans: &plans, shape, isa: &*isa };
            rows.function(context, function, |function| {
                fills.map(|fill| fill.map(|fill: Defined| module.declare_func_in_func(fill.id, function)))
            });
        })
    }

    fn fill(
        &mut self,
        prefix: &str,
        number: usize,
        plan: &Plan,
        vectors: bool,
    ) -> Result<Defined, NativeError> {
        let isa = self.isa.clone();
        self.define(&format!("{prefix}_fill{number}"), Linkage::Local, 0, |_, context, function| {
            fill::function(plan, vectors, &*isa, context, function);
        })
    }
}

/// Refuses code that would call anything but the detector's own functions.
fn check(name: &str, kind: Reloc, target: &FinalizedRelocTarget) -> Result<(), NativeError> {
    match target {
        FinalizedRelocTarget::Func(_) | FinalizedRelocTarget::ExternalName(ExternalName::User(_)) => Ok(()),
        FinalizedRelocTarget::ExternalName(other) => {
            Err(NativeError::Call { function: name.to_string(), callee: format!("{other:?} ({kind:?})") })
        }
    }
}

impl From<ModuleError> for NativeError {
    fn from(error: ModuleError) -> NativeError {
        match error {
            ModuleError::Allocation { err } => NativeError::Memory(err.to_string()),
            // What the code generator says stands inside.
            ModuleError::Compilation(error) => NativeError::Compile(error.to_string()),
            other => NativeError::Compile(other.to_string()),
        }
    }
}
