//! What the file exports: the functions of the header, and what they share.

use std::fmt::Write;

use vsonar_ir::op::REGISTER_NAMES;

use super::literal;
use super::loops::{LoopText, iter2};
use crate::export::{ABI, Request, header};

/// The type of an image.
pub(super) fn image(prefix: &str) -> String {
    format!(
        "/* A frame: pixel (x, y) is luma[y * row_stride + x * pixel_stride]. */\ntypedef struct {{\n    \
         const uint8_t *luma;\n    size_t row_stride, pixel_stride;\n}} {prefix}_image;\n\n"
    )
}

/// The exported functions and, before them, the answer of one column and the checks.
pub(super) fn entries(request: &Request, loops: &[LoopText<'_>]) -> String {
    let prefix = request.symbol.as_str();
    let mut out = answer(prefix, loops) + &check(request) + &detect(prefix);
    if request.camera.is_some() {
        out.push_str(&ranges(request));
        out.push_str(&reset(request));
    }
    out + &info(request)
}

fn answer(prefix: &str, loops: &[LoopText<'_>]) -> String {
    let mut out = format!(
        "/* The answer in one column: register a of the last loop. */\n\
         static float {prefix}_answer(const {prefix}_image *image, float x_obstacle)\n{{\n    float a;\n"
    );
    let [before @ .., last] = loops else { unreachable!("there is a second loop") };
    let passed: Vec<usize> = last.takes().collect();
    for k in &passed {
        let _ = match before {
            [] => writeln!(out, "    const float {} = 0.0f;", iter2(*k)),
            _ => writeln!(out, "    float {};", iter2(*k)),
        };
    }
    for first in before {
        let finals: String = passed.iter().map(|k| format!(", &{}", iter2(*k))).collect();
        // The first loop runs before any register of it is there.
        let none: String = first.takes().map(|_| ", 0.0f").collect();
        let _ = writeln!(out, "    {prefix}_loop_1(image, x_obstacle{none}{finals});");
    }
    let args: String = passed.iter().map(|k| format!(", {}", iter2(*k))).collect();
    let _ = write!(
        out,
        "    {prefix}_loop_2(image, x_obstacle{args}, &{});\n    return a;\n}}\n\n",
        REGISTER_NAMES[0]
    );
    out
}

fn check(request: &Request) -> String {
    let (prefix, upper) = (request.symbol.as_str(), request.symbol.upper());
    format!(
        "/* Checks what both ways of looking at a frame are given. */\n\
         static int {prefix}_check(size_t row_stride, size_t pixel_stride, const int32_t *columns, size_t n)\n{{\n    \
         size_t i;\n    \
         if (pixel_stride == 0 || pixel_stride > (size_t)PTRDIFF_MAX / {upper}_WIDTH ||\n        \
         row_stride < ({upper}_WIDTH - 1) * pixel_stride + 1 || row_stride > (size_t)PTRDIFF_MAX / {upper}_HEIGHT)\n        \
         return {upper}_ERROR_STRIDE;\n    \
         for (i = 0; i < n; i++) {{\n        \
         if (columns[i] < 0 || columns[i] >= {upper}_WIDTH)\n            \
         return {upper}_ERROR_COLUMN;\n    }}\n    return 0;\n}}\n\n"
    )
}

/// The beginning of both ways of looking at a frame.
fn opening(prefix: &str, upper: &str, missing: &str) -> String {
    format!(
        "    {prefix}_image image;\n    size_t i;\n    int error;\n    if (n == 0)\n        return 0;\n    \
         if (luma == NULL || columns == NULL || {missing})\n        return {upper}_ERROR_NULL;\n    \
         error = {prefix}_check(row_stride, pixel_stride, columns, n);\n    if (error != 0)\n        return error;\n    \
         image.luma = luma;\n    image.row_stride = row_stride;\n    image.pixel_stride = pixel_stride;\n"
    )
}

fn detect(prefix: &str) -> String {
    let opening = opening(prefix, &prefix.to_ascii_uppercase(), "rows == NULL");
    format!(
        "VSONAR_NO_CALLS\nint {prefix}_detect(const uint8_t *luma, size_t row_stride, size_t pixel_stride, const int32_t *columns,\n    \
         size_t n, float *rows)\n{{\n{opening}    for (i = 0; i < n; i++)\n        \
         rows[i] = {prefix}_answer(&image, (float)columns[i]);\n    return 0;\n}}\n\n"
    )
}

fn ranges(request: &Request) -> String {
    let (prefix, median) = (request.symbol.as_str(), header::has_median(request));
    let missing = if median { "state == NULL || ranges == NULL" } else { "ranges == NULL" };
    let opening = opening(prefix, &request.symbol.upper(), missing);
    let row = if median {
        format!(
            "        const float newest = {prefix}_answer(&image, column);\n        \
             const float row = {prefix}_median_of_three(newest, state[2 * i], state[2 * i + 1]);\n        \
             state[2 * i + 1] = state[2 * i];\n        state[2 * i] = newest;\n"
        )
    } else {
        format!("        const float row = {prefix}_answer(&image, column);\n")
    };
    let unused = if median { "" } else { "    (void)state;\n" };
    format!(
        "VSONAR_NO_CALLS\nint {prefix}_ranges(const uint8_t *luma, size_t row_stride, size_t pixel_stride, const int32_t *columns,\n    \
         size_t n, float *state, {prefix}_range *ranges)\n{{\n{opening}{unused}    for (i = 0; i < n; i++) {{\n        \
         const float column = (float)columns[i];\n{row}        {prefix}_place(column, row, &ranges[i]);\n    }}\n    \
         return 0;\n}}\n\n"
    )
}

fn reset(request: &Request) -> String {
    let prefix = request.symbol.as_str();
    let body = if header::has_median(request) {
        let nan = literal::float(prefix, f32::NAN);
        format!(
            "    size_t i;\n    for (i = 0; state != NULL && i < 2 * n; i++)\n        state[i] = {nan};\n"
        )
    } else {
        "    (void)state;\n    (void)n;\n".into()
    };
    format!("VSONAR_NO_CALLS\nvoid {prefix}_reset(float *state, size_t n)\n{{\n{body}}}\n\n")
}

fn info(request: &Request) -> String {
    let (prefix, program, provenance) = (request.symbol.as_str(), &request.program, &request.provenance);
    let text = |name: &str, text: &str| {
        let text = literal::text(text, "    ");
        let space = if text.starts_with('\n') { "" } else { " " };
        format!("static const char {prefix}_{name}_text[] ={space}{text};\n")
    };
    let texts =
        text("data", provenance.data.as_deref().unwrap_or_default()) + &text("program", &provenance.program);
    let (correct, cases) = provenance.answers();
    let seed = provenance.seed.unwrap_or_default();
    format!(
        "{texts}\nconst {prefix}_info_t *{prefix}_info(void)\n{{\n    static const {prefix}_info_t info = {{\n        \
         {ABI}, {}, {}, {}, {}, /* interface, width, height, median, ranges */\n        \
         {correct}, {cases}, /* correct answers of so many */\n        \
         {}, UINT64_C({seed}), /* seed */\n        \
         \"{}\", \"{prefix}\", {prefix}_data_text, {prefix}_program_text,\n    }};\n    return &info;\n}}\n",
        program.width(),
        program.height(),
        header::median(request),
        i32::from(request.camera.is_some()),
        i32::from(provenance.seed.is_some()),
        env!("CARGO_PKG_VERSION"),
    )
}
