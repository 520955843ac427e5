//! Code of one program that lives as long as its owner.

use std::marker::PhantomData;
use std::sync::{Mutex, PoisonError};

use cranelift_codegen::Context;
use cranelift_frontend::FunctionBuilderContext;
use cranelift_jit::{JITBuilder, JITModule};
use vsonar_ir::Program;

use super::code::{Code, Entries};
use super::compiler;
use super::emit::Shape;
use super::entries;
use super::target::{self, Effort};
use crate::exec::ExecError;

/// A program compiled with all optimisation, in a module of its own, which is freed on drop.
pub(crate) struct OwnedCode {
    entries: Entries,
    /// Behind a lock only because a module cannot be shared; nobody takes it before the end.
    module: Mutex<Option<JITModule>>,
}

impl OwnedCode {
    /// Compiles a program for this machine.
    ///
    /// # Errors
    /// If Cranelift has no code generator for it or refuses the program, or the system refuses the memory.
    pub(crate) fn compile(program: &Program, shape: Shape) -> Result<OwnedCode, ExecError> {
        let isa = target::host(Effort::Best)?;
        let builder = JITBuilder::with_isa(isa.clone(), cranelift_module::default_libcall_names());
        let mut module = JITModule::new(builder);
        let entries = define(program, shape, &*isa, &mut module);
        match entries {
            Ok(entries) => Ok(OwnedCode { entries, module: Mutex::new(Some(module)) }),
            Err(error) => {
                // SAFETY: nothing of it has been handed out.
                unsafe { module.free_memory() };
                Err(error)
            }
        }
    }

    /// The code, for as long as this lives.
    pub(crate) fn code(&self) -> Code<'_> {
        // SAFETY: the entries are of the module, which is freed on drop, and the result borrows `self`.
        unsafe { Code::new(self.entries, PhantomData) }
    }
}

fn define(
    program: &Program,
    shape: Shape,
    isa: &dyn cranelift_codegen::isa::TargetIsa,
    module: &mut JITModule,
) -> Result<Entries, ExecError> {
    let mut context = Context::new();
    let mut builder_context = FunctionBuilderContext::new();
    let mut defined = Vec::new();
    for kind in entries::entries(program) {
        context.clear();
        entries::function(program, kind, shape, isa, None, &mut builder_context, &mut context.func);
        defined.push((kind, compiler::define(module, &mut context)?));
    }
    compiler::finish(module, program, shape, &defined)
}

impl Drop for OwnedCode {
    fn drop(&mut self) {
        let module = self.module.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(module) = module {
            // SAFETY: whoever runs the code borrows `self`.
            unsafe { module.free_memory() };
        }
    }
}

impl std::fmt::Debug for OwnedCode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OwnedCode").finish_non_exhaustive()
    }
}
