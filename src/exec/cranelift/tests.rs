//! Compiled code: every operation, helpers, and the code generator's own verifier.

use std::io;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use cranelift_codegen::ir::Function;
use cranelift_codegen::verify_function;
use cranelift_frontend::FunctionBuilderContext;
use cranelift_jit::{BranchProtection, JITMemoryKind, JITMemoryProvider, SystemMemoryProvider};
use cranelift_module::{ModuleError, ModuleResult};
use vsonar_ir::{Op, Operand, Program};

use super::compiler::Compiler;
use super::emit::Shape;
use super::entries;
use super::helpers::Helpers;
use super::lanes::LaneBlock;
use super::owned::OwnedModule;
use super::target::{self, Effort};
use crate::detector::{CompiledDetector, Detector};
use crate::exec::operations::{Place, Subject, check_all};
use crate::vision::{LANES, WindowSums};

impl Subject for Compiler {
    fn run(&mut self, program: &Program, place: Place, iter2: &[[f32; LANES]; 5]) -> [f32; LANES] {
        let code = self.compile(program).expect("compiles");
        let mut block = Box::new(LaneBlock::new());
        block.iter2 = *iter2;
        block.out = [[-7.0; LANES]; 5];
        if place == Place::Column {
            assert!(code.run_column(false, &mut block, LANES));
        } else {
            code.run_loop(false, &mut block, LANES, &[&[]; Operand::COUNT]);
        }
        block.out[0]
    }
}

#[test]
fn every_operation_means_what_the_table_says() {
    let helpers = Arc::new(Helpers::new().expect("this machine has a back end"));
    for shape in Shape::ALL {
        let mut compiler = Compiler::new(shape, Arc::clone(&helpers)).expect("this machine has a back end");
        check_all(&mut compiler, &format!("{shape:?}"));
    }
}

#[test]
fn long_operations_have_helpers() {
    let helpers = Helpers::new().expect("this machine has a back end");
    for shape in Shape::ALL {
        for op in [Op::Sin, Op::Cos, Op::Tan, Op::Atan, Op::Atan2] {
            assert!(helpers.address(op, shape).is_some(), "{} {shape:?}", op.name());
        }
        assert!(helpers.address(Op::PDiv, shape).is_none());
    }
}

#[test]
fn functions_pass_the_code_generators_verifier() {
    let helpers = Helpers::new().expect("this machine has a back end");
    let isa = target::host(Effort::Fast).expect("this machine has a back end");
    let mut context = FunctionBuilderContext::new();
    let mut verified = 0;
    for seed in 0..300 {
        let program = vsonar_ir::generate::program(seed, 32, 24, 40);
        for program in [vsonar_ir::opt::optimise(&program), program] {
            for (shape, helpers) in Shape::ALL.into_iter().flat_map(|s| [(s, None), (s, Some(&helpers))]) {
                for kind in entries::entries(&program) {
                    let mut f = Function::new();
                    entries::function(&program, kind, shape, &*isa, helpers, &mut context, &mut f);
                    verify_function(&f, &*isa).unwrap_or_else(|e| panic!("seed {seed}, {shape:?}: {e}\n{f}"));
                    verified += 1;
                }
            }
        }
    }
    assert!(verified > 1000, "only {verified} functions");
}

/// Memory that counts how often it is freed.
struct Counted(SystemMemoryProvider, Arc<AtomicUsize>);

impl JITMemoryProvider for Counted {
    fn allocate(&mut self, size: usize, align: u64, kind: JITMemoryKind) -> io::Result<*mut u8> {
        self.0.allocate(size, align, kind)
    }

    unsafe fn free_memory(&mut self) {
        self.1.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise is this one.
        unsafe { self.0.free_memory() };
    }

    fn finalize(&mut self, _: BranchProtection) -> ModuleResult<()> {
        Err(ModuleError::Allocation { err: io::Error::from(io::ErrorKind::PermissionDenied) })
    }
}

#[test]
fn a_module_is_freed_whatever_ends_the_work_on_it() {
    let isa = target::host(Effort::Fast).expect("this machine has a back end");
    let freed = Arc::new(AtomicUsize::new(0));
    let module = || {
        let memory = Counted(SystemMemoryProvider::new(), Arc::clone(&freed));
        OwnedModule::new(isa.clone(), Some(Box::new(memory)))
    };
    drop(module());
    assert_eq!(freed.load(Ordering::Relaxed), 1);
    let panicked = std::panic::catch_unwind(AssertUnwindSafe(|| {
        let _module = module();
        std::panic::resume_unwind(Box::new("between making and keeping"));
    }));
    assert!(panicked.is_err());
    assert_eq!(freed.load(Ordering::Relaxed), 2);
    let mut module = module();
    let refused = module.finalize().expect_err("the system refuses");
    assert_eq!(refused.kind(), io::ErrorKind::PermissionDenied);
    drop(module);
    assert_eq!(freed.load(Ordering::Relaxed), 3);
}

/// A mask of the uniform region that a lane asks for is made in lanes too, with all masks that it is made of.
#[test]
fn long_chains_of_masks_do_not_exhaust_the_stack() {
    let mut text =
        "vir 1\nimage 16x16\nloop 2 up 2x2\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  uniform\n    \
                    v0 = y\n    v1 = const 4\n    v2 = lt v0 v1\n"
            .to_string();
    const LAST: usize = 60_000;
    for reg in 3..=LAST {
        text.push_str(&format!("    v{reg} = not v{}\n", reg - 1));
    }
    text.push_str(&format!("  varying\n    v{} = window raw\n", LAST + 1));
    text.push_str(&format!("    v{} = select v{LAST} v{} v0\n  next a v{}\n", LAST + 2, LAST + 1, LAST + 2));
    let program = vsonar_ir::text::parse(&text).expect("a program");
    let image = image::GrayImage::from_fn(16, 16, |x, y| image::Luma([(x * 5 + y) as u8]));
    let expected = vsonar_ir::reference::answer(&program, &WindowSums::new(&image), 3.0);
    let compile = move || CompiledDetector::compile(&program).expect("compiles");
    let thread = std::thread::Builder::new().stack_size(1 << 20).spawn(compile).expect("a thread");
    let detector = thread.join().expect("no panic");
    let mut rows = [0.0];
    detector.detect(&image, &[3], &mut rows).expect("sound arguments");
    assert_eq!(rows, [expected]);
}
