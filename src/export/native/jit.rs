//! The detector's code in this process.

use std::sync::{Mutex, PoisonError};

use cranelift_jit::{JITBuilder, JITModule};
use vsonar_ir::Program;

use super::module::Definer;
use super::{NativeError, Target};
use crate::exec::cranelift::Shape;

/// luma, row stride, pixel stride, columns, how many, rows, bytes from row to row.
type Entry = unsafe extern "C" fn(*const u8, usize, usize, *const i32, usize, *mut f32, usize) -> i32;

/// A program's code, freed when this is dropped. The same functions as in an exported object, but for this very
/// machine.
pub(crate) struct JitRows {
    entry: Entry,
    width: u32,
    height: u32,
    /// Behind a lock only because a module cannot be shared; nobody takes it before the end.
    module: Mutex<Option<JITModule>>,
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
        let isa = target.isa(true)?;
        let builder = JITBuilder::with_isa(isa.clone(), cranelift_module::default_libcall_names());
        let mut module = JITModule::new(builder);
        let entry = (|| {
            let rows = Definer::new(&mut module, isa).rows("detector", program, shape)?;
            module.finalize_definitions()?;
            Ok(module.get_finalized_function(rows.id))
        })();
        match entry {
            Ok(address) => {
                // SAFETY: the function is built with this signature in the machine's own calling convention.
                let entry = unsafe { std::mem::transmute::<*const u8, Entry>(address) };
                let (width, height) = (program.width(), program.height());
                Ok(JitRows { entry, width, height, module: Mutex::new(Some(module)) })
            }
            Err(error) => {
                // SAFETY: nothing of it has been handed out.
                unsafe { module.free_memory() };
                Err(error)
            }
        }
    }

    /// Writes the rows of `columns`, in an image whose rows of pixels lie `row_stride` bytes from each other, and
    /// the pixels of a row one byte. What it gives is 0 or one of the error codes of [`crate::export`]; after an
    /// error nothing has been written.
    ///
    /// # Panics
    /// If the pixels are fewer than the image has, or there are not as many rows as columns.
    pub(crate) fn run(&self, luma: &[u8], row_stride: usize, columns: &[u32], rows: &mut [f32]) -> i32 {
        let (width, height) = (self.width as usize, self.height as usize);
        assert!(
            row_stride >= width && luma.len() >= (height - 1) * row_stride + width,
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

impl Drop for JitRows {
    fn drop(&mut self) {
        let module = self.module.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(module) = module {
            // SAFETY: whoever runs the code borrows `self`.
            unsafe { module.free_memory() };
        }
    }
}

impl std::fmt::Debug for JitRows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("JitRows").finish_non_exhaustive()
    }
}
