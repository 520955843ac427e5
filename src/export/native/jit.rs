//! The detector's code in this process.

use std::sync::Mutex;

use vsonar_ir::Program;

use super::module::Definer;
use super::{NativeError, Target};
use crate::exec::MAX_STACK;
use crate::exec::cranelift::owned::{self, OwnedModule};
use crate::exec::cranelift::{Effort, Shape};

/// luma, row stride, pixel stride, columns, how many, rows, bytes from row to row.
type Entry = unsafe extern "C" fn(*const u8, usize, usize, *const i32, usize, *mut f32, usize) -> i32;

/// A program's code, freed when this is dropped. The same functions as in an exported object, but for this very
/// machine.
pub(crate) struct JitRows {
    entry: Entry,
    width: u32,
    height: u32,
    /// Behind a lock only because a module cannot be shared; nobody takes it.
    _module: Mutex<OwnedModule>,
}

impl JitRows {
    /// Compiles a program for this machine.
    ///
    /// # Errors
    /// If there is no code generator for this machine or it refuses the program, or the system refuses the memory.
    pub(crate) fn compile(program: &Program) -> Result<JitRows, NativeError> {
        let target = Target::native();
        JitRows::compile_for(program, &target, target.shape())
    }

    /// The same with fewer of this machine's instructions.
    pub(super) fn compile_for(
        program: &Program,
        target: &Target,
        shape: Shape,
    ) -> Result<JitRows, NativeError> {
        // Safe code calls it on any thread.
        let isa = target.isa(Effort::once(program), true)?;
        let mut module = OwnedModule::new(isa.clone(), None);
        let rows = Definer::new(module.module(), isa).rows(&owned::prefix(program), program, shape)?;
        if rows.stack > MAX_STACK {
            return Err(NativeError::Stack { bytes: rows.stack });
        }
        module.finalize().map_err(|error| NativeError::Memory(error.to_string()))?;
        let address = module.module().get_finalized_function(rows.id);
        // SAFETY: the function is built with this signature in the machine's own calling convention.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(address) };
        Ok(JitRows { entry, width: program.width(), height: program.height(), _module: Mutex::new(module) })
    }

    /// Writes the rows of `columns`, in an image whose rows of pixels lie `row_stride` bytes from each other, and
    /// the pixels of a row one byte. What it gives is 0 or one of the error codes of [`crate::export`]; after an
    /// error nothing has been written.
    ///
    /// # Panics
    /// If the pixels are fewer than the image has, or there are not as many rows as columns.
    pub(crate) fn run(&self, luma: &[u8], row_stride: usize, columns: &[u32], rows: &mut [f32]) -> i32 {
        let (width, height) = (self.width as usize, self.height as usize);
        let needed = (height - 1).checked_mul(row_stride).and_then(|bytes| bytes.checked_add(width));
        assert!(
            row_stride >= width && needed.is_some_and(|bytes| luma.len() >= bytes),
            "the image is all there"
        );
        assert_eq!(columns.len(), rows.len());
        // SAFETY: the code is alive as long as `self`. It reads the pixels of the image alone, which are there as
        // has been checked, and as many columns as it is told (signed numbers there, of the same size: one beyond them
        // is negative, and refused like every column outside the image), and writes as many rows, a binary32 from each
        // other.
        unsafe {
            (self.entry)(
                luma.as_ptr(),
                row_stride,
                1,
                columns.as_ptr().cast(),
                columns.len(),
                rows.as_mut_ptr(),
                size_of::<f32>(),
            )
        }
    }
}

impl std::fmt::Debug for JitRows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("JitRows").finish_non_exhaustive()
    }
}
