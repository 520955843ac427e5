//! The owner of a JIT module: its memory is given back however the work on it ends, and its functions have names that
//! a profiler can show.

use std::hash::BuildHasher as _;
use std::io;

use cranelift_codegen::Context;
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_jit::{JITBuilder, JITMemoryProvider, JITModule};
use cranelift_module::{FuncId, Linkage, Module, ModuleError};
use rustc_hash::FxBuildHasher;
use vsonar_ir::Program;

use super::compiler::error;
use crate::exec::ExecError;

/// A JIT module whose memory is freed when this is dropped, after an error or a panic as well.
///
/// Addresses of its functions are valid as long as this lives. While a profiler maps addresses to names (see
/// [`profiled`]) the memory is kept instead, so that no address ever stands for two programs.
pub(crate) struct OwnedModule(Option<JITModule>);

impl OwnedModule {
    /// An empty module with memory of its own, or that of `memory`.
    pub(crate) fn new(isa: OwnedTargetIsa, memory: Option<Box<dyn JITMemoryProvider + Send>>) -> OwnedModule {
        let mut builder = JITBuilder::with_isa(isa, cranelift_module::default_libcall_names());
        if let Some(memory) = memory {
            builder.memory_provider(memory);
        }
        OwnedModule(Some(JITModule::new(builder)))
    }

    /// The module.
    pub(crate) fn module(&mut self) -> &mut JITModule {
        self.0.as_mut().unwrap_or_else(|| unreachable!("it is there until the end"))
    }

    /// Adds the context's function. Its name counts for profilers alone.
    pub(crate) fn define(
        &mut self,
        context: &mut Context,
        name: impl FnOnce() -> String,
    ) -> Result<FuncId, ExecError> {
        let module = self.module();
        let signature = &context.func.signature;
        let id = if profiled() {
            let free = free_name(module, name());
            module.declare_function(&free, Linkage::Local, signature).map_err(error)?
        } else {
            module.declare_anonymous_function(signature).map_err(error)?
        };
        module.define_function(id, context).map_err(error)?;
        Ok(id)
    }

    /// Makes the functions that were added since the last time executable, and no longer writable.
    ///
    /// # Errors
    /// If the system refuses.
    pub(crate) fn finalize(&mut self) -> io::Result<()> {
        self.module().finalize_definitions().map_err(|error| match error {
            ModuleError::Allocation { err } => err,
            ModuleError::Backend(error) => io::Error::other(format!("{error:#}")),
            other => io::Error::other(other.to_string()),
        })
    }
}

impl Drop for OwnedModule {
    fn drop(&mut self) {
        if let Some(module) = self.0.take().filter(|_| !profiled()) {
            // SAFETY: whoever calls its functions, which is unsafe, keeps this alive meanwhile.
            unsafe { module.free_memory() };
        }
    }
}

/// Whether names of functions are written where `perf` looks for them, which the module does in this case.
pub(crate) fn profiled() -> bool {
    cfg!(unix) && std::env::var_os("PERF_BUILDID_DIR").is_some()
}

/// The beginning of the names of a program's functions: equal for equal programs.
pub(crate) fn prefix(program: &Program) -> String {
    format!("vsonar_{:016x}", FxBuildHasher.hash_one(program))
}

/// The name, or one with a number if a program is compiled once more.
fn free_name(module: &JITModule, name: String) -> String {
    let numbered = (2u32..).map(|n| format!("{name}.{n}"));
    std::iter::once(name.clone()).chain(numbered).find(|name| module.get_name(name).is_none()).unwrap_or(name)
}
