//! The Python binding of an exported detector: one module over its shared library, of the standard library's `ctypes`
//! alone.

use super::{ABI, Request, header};

/// What every binding has in common. Words in `@` are replaced.
const TEMPLATE: &str = include_str!("binding.py");
/// What a binding with ranges has beside.
const RANGES: &str = include_str!("binding_ranges.py");
/// What a binding without ranges says of them.
const ROWS: &str = include_str!("binding_rows.py");

/// The whole module, `NAME.py`. It loads the shared library `NAME` that stands beside it.
pub fn python(request: &Request) -> String {
    let program = &request.program;
    // As a C string holds it.
    let text = request.provenance.program.replace('\0', "");
    let ranges = if request.camera.is_some() { RANGES } else { ROWS };
    TEMPLATE
        .replace("@RANGES@\n", ranges)
        .replace("@NAME@", request.symbol.as_str())
        .replace("@VERSION@", env!("CARGO_PKG_VERSION"))
        .replace("@ABI@", &ABI.to_string())
        .replace("@WIDTH@", &program.width().to_string())
        .replace("@HEIGHT@", &program.height().to_string())
        .replace("@MEDIAN@", &header::median(request).to_string())
        .replace("@PROGRAM@", &crc32fast::hash(text.as_bytes()).to_string())
        .replace("@HAS_RANGES@", &i32::from(request.camera.is_some()).to_string())
}
