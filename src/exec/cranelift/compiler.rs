//! Compiles programs one after the other, with contexts and memory that are used again.
//!
//! Code generation goes through cranelift-jit. A module made and freed for each program costs some 2 to 4
//! microseconds more than an arena of our own would, of 30 to 120 in all; a module that serves
//! [`PROGRAMS_PER_MODULE`] programs costs within 2 of the arena, and brings relocations, the instruction cache and
//! branch protection with it. The module's memory is reserved without being committed, is writable until the
//! program is finished and executable from then on, never both, and is given back with the module.

use std::marker::PhantomData;
use std::sync::Arc;

use cranelift_codegen::Context;
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_frontend::FunctionBuilderContext;
use cranelift_jit::{ArenaMemoryProvider, JITBuilder, JITModule};
use cranelift_module::{FuncId, Module, ModuleError};
use vsonar_ir::Program;

use super::code::{Code, Entries};
use super::emit::Shape;
use super::entries::{self, EntryKind};
use super::helpers::Helpers;
use super::target::{self, Effort};
use crate::exec::ExecError;

/// After so many programs a module and its memory are given back.
const PROGRAMS_PER_MODULE: usize = 256;

/// Address space reserved for a module's code, in bytes.
const MODULE_BYTES: usize = 64 << 20;

/// A compiler of one thread: programs in, code out, the code valid until the next program.
pub(crate) struct Compiler {
    shape: Shape,
    isa: OwnedTargetIsa,
    helpers: Arc<Helpers>,
    context: Context,
    builder_context: FunctionBuilderContext,
    module: Option<JITModule>,
    /// Programs compiled into the module.
    programs: usize,
}

impl Compiler {
    /// A compiler for this machine.
    ///
    /// # Errors
    /// If Cranelift has no code generator for it.
    pub(crate) fn new(shape: Shape, helpers: Arc<Helpers>) -> Result<Compiler, ExecError> {
        Ok(Compiler {
            shape,
            isa: target::host(Effort::Fast)?,
            helpers,
            context: Context::new(),
            builder_context: FunctionBuilderContext::new(),
            module: None,
            programs: 0,
        })
    }

    /// Compiles a program. The code lives until the compiler is used again.
    ///
    /// # Errors
    /// If Cranelift refuses the program or the system refuses the memory.
    pub(crate) fn compile(&mut self, program: &Program) -> Result<Code<'_>, ExecError> {
        if self.programs >= PROGRAMS_PER_MODULE {
            self.free();
        }
        let fresh = self.module.is_none();
        let entries = match self.define(program) {
            // The rest of the module's memory may be too short where all of it is not.
            Err(ExecError::Memory(_)) if !fresh => {
                self.free();
                self.define(program)
            }
            result => result,
        };
        match entries {
            Ok(entries) => {
                self.programs += 1;
                // SAFETY: the entries come from the module, which is freed by methods that need `&mut self`
                // alone; the result borrows it.
                Ok(unsafe { Code::new(entries, PhantomData) })
            }
            Err(error) => {
                // Half a program may be left in it.
                self.free();
                Err(error)
            }
        }
    }

    fn define(&mut self, program: &Program) -> Result<Entries, ExecError> {
        let module = match &mut self.module {
            Some(module) => module,
            None => self.module.insert(new_module(&self.isa)?),
        };
        let mut defined: Vec<(EntryKind, FuncId)> = Vec::with_capacity(4);
        for kind in entries::entries(program) {
            self.context.clear();
            let function = &mut self.context.func;
            let helpers = Some(&*self.helpers);
            entries::function(
                program,
                kind,
                self.shape,
                &*self.isa,
                helpers,
                &mut self.builder_context,
                function,
            );
            defined.push((kind, define(module, &mut self.context)?));
        }
        finish(module, program, self.shape, &defined)
    }

    /// Gives the module's memory back.
    fn free(&mut self) {
        self.programs = 0;
        if let Some(module) = self.module.take() {
            // SAFETY: code handed out borrows the compiler, so none is in use.
            unsafe { module.free_memory() };
        }
    }
}

impl Drop for Compiler {
    fn drop(&mut self) {
        self.free();
    }
}

fn new_module(isa: &OwnedTargetIsa) -> Result<JITModule, ExecError> {
    let memory = ArenaMemoryProvider::new_with_size(MODULE_BYTES)
        .map_err(|e| ExecError::Memory(std::io::Error::other(e.to_string())))?;
    let mut builder = JITBuilder::with_isa(isa.clone(), cranelift_module::default_libcall_names());
    builder.memory_provider(Box::new(memory));
    Ok(JITModule::new(builder))
}

/// Adds the context's function to a module.
pub(crate) fn define(module: &mut JITModule, context: &mut Context) -> Result<FuncId, ExecError> {
    let id = module.declare_anonymous_function(&context.func.signature).map_err(error)?;
    module.define_function(id, context).map_err(error)?;
    Ok(id)
}

/// Makes the functions added since the last time executable.
pub(crate) fn finalize(module: &mut JITModule) -> Result<(), ExecError> {
    module.finalize_definitions().map_err(|e| match error(e) {
        ExecError::Compile(message) => ExecError::Memory(std::io::Error::other(message)),
        other => other,
    })
}

/// Makes the program's functions, added since the last time, executable.
pub(crate) fn finish(
    module: &mut JITModule,
    program: &Program,
    shape: Shape,
    defined: &[(EntryKind, FuncId)],
) -> Result<Entries, ExecError> {
    finalize(module)?;
    let addresses = defined.iter().map(|&(kind, id)| (kind, module.get_finalized_function(id)));
    Ok(Entries::new(program, shape, addresses))
}

/// What went wrong in a module.
fn error(error: ModuleError) -> ExecError {
    match error {
        ModuleError::Allocation { err } => ExecError::Memory(err),
        other => ExecError::Compile(other.to_string()),
    }
}
