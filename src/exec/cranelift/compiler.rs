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
use cranelift_jit::ArenaMemoryProvider;
use cranelift_module::{FuncId, ModuleError};
use vsonar_ir::Program;

use super::code::{Code, Entries};
use super::emit::Shape;
use super::entries::{self, EntryKind};
use super::helpers::Helpers;
use super::owned::{self, OwnedModule};
use super::target::{self, Effort};
use crate::exec::{ExecError, MAX_COMPILED, MAX_STACK};

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
    module: Option<OwnedModule>,
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
    /// If Cranelift refuses the program, the system refuses the memory, or the program is too long.
    pub(crate) fn compile(&mut self, program: &Program) -> Result<Code<'_>, ExecError> {
        check_length(program)?;
        if self.programs >= PROGRAMS_PER_MODULE {
            self.module = None;
        }
        let fresh = self.module.is_none();
        let entries = match self.define(program) {
            // The rest of the module's memory may be too short where all of it is not.
            Err(ExecError::Memory(_)) if !fresh => self.define(program),
            result => result,
        }?;
        self.programs += 1;
        // SAFETY: the entries come from the module, which is freed by methods that need `&mut self` alone; the
        // result borrows it.
        Ok(unsafe { Code::new(entries, PhantomData) })
    }

    /// Adds the program to the module. After an error, or a panic, which may leave half a program, there is no module
    /// any more.
    fn define(&mut self, program: &Program) -> Result<Entries, ExecError> {
        let mut module = match self.module.take() {
            Some(module) => module,
            None => {
                self.programs = 0;
                new_module(&self.isa)?
            }
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
            let name = || format!("{}_{}", owned::prefix(program), kind.symbol());
            defined.push((kind, module.define(&mut self.context, name)?));
            check_stack(&self.context)?;
        }
        let entries = finish(&mut module, program, self.shape, &defined)?;
        self.module = Some(module);
        Ok(entries)
    }
}

/// Refuses programs that are too long to be compiled.
pub(super) fn check_length(program: &Program) -> Result<(), ExecError> {
    match program.len() {
        0..=MAX_COMPILED => Ok(()),
        instructions => Err(ExecError::TooLong { instructions }),
    }
}

/// Refuses code that takes more stack than a thread may have.
fn check_stack(context: &Context) -> Result<(), ExecError> {
    let layout = context.compiled_code().and_then(|code| code.buffer.frame_layout());
    match layout.map_or(0, |layout| layout.frame_to_fp_offset as usize) {
        0..=MAX_STACK => Ok(()),
        bytes => {
            Err(ExecError::Compile(format!("it takes {bytes} bytes of stack; {MAX_STACK} is the limit")))
        }
    }
}

fn new_module(isa: &OwnedTargetIsa) -> Result<OwnedModule, ExecError> {
    let memory = ArenaMemoryProvider::new_with_size(MODULE_BYTES)
        .map_err(|e| ExecError::Memory(std::io::Error::other(e.to_string())))?;
    Ok(OwnedModule::new(isa.clone(), Some(Box::new(memory))))
}

/// Makes the program's functions, added since the last time, executable.
pub(crate) fn finish(
    module: &mut OwnedModule,
    program: &Program,
    shape: Shape,
    defined: &[(EntryKind, FuncId)],
) -> Result<Entries, ExecError> {
    module.finalize().map_err(ExecError::Memory)?;
    let module = module.module();
    let addresses = defined.iter().map(|&(kind, id)| (kind, module.get_finalized_function(id)));
    Ok(Entries::new(program, shape, addresses))
}

/// What went wrong in a module.
pub(crate) fn error(error: ModuleError) -> ExecError {
    match error {
        ModuleError::Allocation { err } => ExecError::Memory(err),
        other => ExecError::Compile(other.to_string()),
    }
}
