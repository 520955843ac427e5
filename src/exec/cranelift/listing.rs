//! What the compiler makes of a program, for people to read.
//!
//! Listings show the code of the executor with all operations expanded in place, so that they hold no addresses
//! and are the same every time.

use std::fmt::Write as _;

use cranelift_codegen::Context;
use cranelift_codegen::control::ControlPlane;
use cranelift_frontend::FunctionBuilderContext;
use vsonar_ir::Program;

use super::emit::Shape;
use super::entries;
use super::target::{self, Effort};
use crate::exec::ExecError;

/// The Cranelift IR of every entry of a program, one after the other.
///
/// A program whose answer is constant has no entries, which the text says.
///
/// # Errors
/// If Cranelift has no code generator for this machine, or the program is too long.
pub fn clif(program: &Program, shape: Shape) -> Result<String, ExecError> {
    listing(program, shape, |context, _| Ok(context.func.display().to_string()))
}

/// The machine code of every entry of a program, in Cranelift's notation.
///
/// A program whose answer is constant has no entries, which the text says.
///
/// # Errors
/// If Cranelift has no code generator for this machine, refuses the program, or the program is too long.
pub fn asm(program: &Program, shape: Shape) -> Result<String, ExecError> {
    listing(program, shape, |context, isa| {
        context.set_disasm(true);
        let code = context
            .compile(isa, &mut ControlPlane::default())
            .map_err(|e| ExecError::Compile(e.inner.to_string()))?;
        Ok(code.vcode.clone().unwrap_or_default())
    })
}

fn listing(
    program: &Program,
    shape: Shape,
    text: impl Fn(&mut Context, &dyn cranelift_codegen::isa::TargetIsa) -> Result<String, ExecError>,
) -> Result<String, ExecError> {
    super::compiler::check_length(program)?;
    let isa = target::host(Effort::Fast)?;
    let mut out = String::new();
    for kind in entries::entries(program) {
        let mut context = Context::new();
        let mut builder_context = FunctionBuilderContext::new();
        entries::function(program, kind, shape, &*isa, None, &mut builder_context, &mut context.func);
        let text = text(&mut context, &*isa)?;
        let _ = writeln!(out, "; {}\n{}\n", kind.name(), text.trim_end());
    }
    if let Some(answer) = program.constant_answer() {
        let _ = writeln!(out, "; the answer is {answer} for every image and column: there is no code");
    }
    Ok(out)
}
