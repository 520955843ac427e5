//! What the benches share: the executors that they compare. (The command's list is `Choice`, in `src/cli`.)

// Not every bench needs all of them.
#![allow(dead_code, unreachable_pub)]

use std::sync::Arc;

use vsonar::exec::Executor;
use vsonar::exec::auto::AutoExecutor;
use vsonar::exec::batch::BatchExecutor;
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::exec::reference::ReferenceExecutor;
use vsonar::exec::tree::TreeExecutor;

/// All executors, the fastest first.
pub fn all() -> Vec<Arc<dyn Executor>> {
    let cranelift = |shape| CraneliftExecutor::new(shape).expect("this machine has a back end");
    vec![
        Arc::new(AutoExecutor::new()),
        Arc::new(BatchExecutor::widest()),
        Arc::new(cranelift(Shape::Lanes4)),
        Arc::new(cranelift(Shape::Scalar)),
        Arc::new(ReferenceExecutor),
        Arc::new(TreeExecutor),
    ]
}

/// Those that are fast enough to be compared with other engines.
pub fn fast() -> Vec<Arc<dyn Executor>> {
    all().into_iter().filter(|executor| !vsonar::benchmark::is_slow(&**executor)).collect()
}
