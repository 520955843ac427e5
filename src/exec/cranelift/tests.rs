//! Compiled code: every operation, helpers, and the code generator's own verifier.

use std::sync::Arc;

use cranelift_codegen::ir::Function;
use cranelift_codegen::verify_function;
use cranelift_frontend::FunctionBuilderContext;
use vsonar_ir::{Op, Operand, Program};

use super::compiler::Compiler;
use super::emit::Shape;
use super::entries;
use super::helpers::Helpers;
use super::lanes::LaneBlock;
use super::target::{self, Effort};
use crate::exec::operations::{Place, Subject, check_all};
use crate::vision::LANES;

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
