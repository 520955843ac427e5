//! Settings of the code generator.

use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::settings::{self, Configurable};
use vsonar_ir::Program;

use super::frame::LONG;
use crate::exec::ExecError;

/// How much effort goes into code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effort {
    /// For programs that run once over a few hundred cases: compiling is the larger part of the cost. And for long ones,
    /// whose values wait in memory: the optimiser would fetch them from there too early, to live long again.
    Fast,
    /// For what is compiled once.
    Best,
}

impl Effort {
    /// The effort for a program that is compiled once.
    pub(crate) fn once(program: &Program) -> Effort {
        if program.len() > LONG { Effort::Fast } else { Effort::Best }
    }

    /// The optimiser's level, in Cranelift's settings.
    pub(crate) const fn level(self) -> &'static str {
        match self {
            Effort::Fast => "none",
            Effort::Best => "speed",
        }
    }
}

/// The machine this process runs on, with the settings for the effort.
///
/// # Errors
/// If Cranelift has no code generator for it.
pub(crate) fn host(effort: Effort) -> Result<OwnedTargetIsa, ExecError> {
    let unsupported = |e: String| ExecError::Compile(e);
    let mut flags = settings::builder();
    let verifier = if cfg!(debug_assertions) { "true" } else { "false" };
    for (name, value) in [
        ("opt_level", effort.level()),
        // The single pass allocator compiles in two thirds of the time, but its code, which keeps everything on
        // the stack from row to row, runs at half to a third of the speed.
        ("regalloc_algorithm", "backtracking"),
        ("enable_verifier", verifier),
        ("is_pic", "false"),
        ("use_colocated_libcalls", "false"),
        ("unwind_info", "false"),
        ("preserve_frame_pointers", "false"),
        ("machine_code_cfg_info", "false"),
        // A frame may be larger than the page that guards a stack's end. Smaller ones, which nearly all are, have none.
        ("enable_probestack", "true"),
        ("probestack_strategy", "inline"),
        ("enable_alias_analysis", "false"),
        ("enable_heap_access_spectre_mitigation", "false"),
        ("enable_table_access_spectre_mitigation", "false"),
    ] {
        flags
            .set(name, value)
            .map_err(|e| unsupported(format!("the setting {name}={value} is refused: {e}")))?;
    }
    let builder = cranelift_native::builder().map_err(|e| unsupported(e.to_string()))?;
    builder.finish(settings::Flags::new(flags)).map_err(|e| unsupported(e.to_string()))
}
