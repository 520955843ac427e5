//! The C form of an exported detector: one readable, self-contained C99 file.
//!
//! What the file guarantees:
//!
//! * *The bits of every executor.* It is written from the same formulas, one statement an operation, and asks the
//!   compiler for neither fused nor reassociated nor wider arithmetic: contraction is turned off in the file, and options
//!   that change arithmetic are refused with `#error` as far as a compiler tells of them. (`-ffp-contract=fast`, given
//!   to Clang by hand, overrides the file without a trace; so does a processor set to flush subnormals.)
//! * *The interface of the header*, which it holds too: the same text under the same guard.
//! * *Nothing but C.* No library is called, not even `memcpy`; no heap, no variable that changes outside the stack. Sums
//!   of 64 bits occur only for squares of Moravec differences, and are never divided nor converted as such.
//! * *Only what the program needs is computed*: its operators, over the pixels of its windows.
//!
//! The columns are independent of one another. In each, a loop goes over the rows of the image, adds the sums of a new
//! row between the sides of the window to the sums over the window, runs the body, and takes the oldest row's sums off.
//!
//! ```
//! use vsonar::export::{Provenance, Request, Symbol, c};
//! let text = std::fs::read_to_string("examples/fmrb.gp")?;
//! let program = vsonar::lower::lower(&text.parse()?, 320, 240);
//! let request = Request {
//!     symbol: Symbol::new("fmrb")?,
//!     program: vsonar::ir::opt::optimise(&program),
//!     provenance: Provenance { program: text, ..Provenance::default() },
//!     camera: None,
//!     median: false,
//! };
//! assert!(c::source(&request).contains("int fmrb_detect("));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod entries;
mod functions;
pub(super) mod literal;
mod live;
mod loops;
mod operators;
mod rows;
mod windows;
mod writer;

use std::collections::BTreeSet;

use self::loops::LoopText;
use super::{Request, header};

/// What stands above everything else: the arithmetic that the file needs.
const ARITHMETIC: &str = include_str!("arithmetic.h");

/// The whole file, `NAME.c`.
pub fn source(request: &Request) -> String {
    let prefix = request.symbol.as_str();
    let program = &request.program;
    let size = (program.width(), program.height());
    let (first, second) = live::live(program);
    let loops: Vec<LoopText<'_>> = first
        .iter()
        .map(|live| LoopText::new(prefix, 1, live, size))
        .chain([LoopText::new(prefix, 2, &second, size)])
        .collect();

    // Written from the end: what is called is known once the callers are written.
    let mut entries = String::new();
    if let Some(camera) = &request.camera {
        entries.push_str(&functions::place(prefix, camera, size));
        if header::has_median(request) {
            entries.push_str(&functions::median(prefix));
        }
    }
    entries.push_str(&entries::entries(request, &loops));
    let mut body: String = loops.iter().map(LoopText::definitions).collect();

    let mut operators = BTreeSet::new();
    let mut ops = BTreeSet::new();
    for (text, live) in loops.iter().zip(first.iter().chain([&second])) {
        operators.extend(operators::functions(&text.windows().operands));
        functions::called(live, &mut ops);
    }
    let operators: String = operators.iter().map(|function| function.definition(prefix)).collect();
    let operations: String = ops.iter().map(|op| functions::operation(prefix, *op)).collect();
    if body.contains(&format!("{prefix}_wide(")) {
        body.insert_str(0, &windows::wide(prefix));
    }
    body = operations + &operators + &body + &entries;
    let bits = functions::bits(prefix, &body);

    let declarations = header::header(request, None);
    format!("{ARITHMETIC}\n{declarations}\n{}{bits}{body}", entries::image(prefix))
}
