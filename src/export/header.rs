//! The C header of an exported detector, for C and C++: the interface with its documentation.

use std::fmt::Write;

use super::c::literal::{comment, quoted};
use super::{ABI, MEDIAN, Request};

/// Whether the ranges come from the median of three frames. Without a camera there are no ranges.
pub(super) fn has_median(request: &Request) -> bool {
    request.median && request.camera.is_some()
}

/// Of how many frames the median is taken; 1 for none.
pub(super) fn median(request: &Request) -> u32 {
    if has_median(request) { MEDIAN } else { 1 }
}

/// The whole header, `NAME.h`. `stack_bytes` is the stack that the native code needs at most; there is no such number
/// for code that is still to be compiled.
pub fn header(request: &Request, stack_bytes: Option<usize>) -> String {
    let (name, up) = (request.symbol.as_str(), request.symbol.upper());
    let mut out = opening(request, stack_bytes.is_some());
    let _ = write!(
        out,
        "#ifndef {up}_VSONAR_H\n#define {up}_VSONAR_H\n\n#include <stddef.h>\n#include <stdint.h>\n\n\
         #ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n"
    );
    out.push_str(&constants(request, stack_bytes));
    out.push_str(&detect(name, &up));
    if request.camera.is_some() {
        out.push_str(&ranges(request));
    }
    out.push_str(&info(name));
    out + "#ifdef __cplusplus\n}\n#endif\n\n#endif\n"
}

fn opening(request: &Request, native: bool) -> String {
    let (name, program, provenance) = (request.symbol.as_str(), &request.program, &request.provenance);
    let (width, height) = (program.width(), program.height());
    let stack = if native {
        format!("{}_STACK_BYTES at most", request.symbol.upper())
    } else {
        "some hundred bytes (the compiler knows:\n * -fstack-usage)".to_string()
    };
    let mut out = format!(
        "/* {name}: a visual obstacle detector, exported by vsonar {}.\n *\n * It takes a gray image of {width} x {height} \
         pixels and columns in it, and finds in each column the row of the lowest\n * pixel that is not floor. Rows and \
         columns are in pixels and count from 0 at the top left.\n *\n \
         * All functions may be called from any number of threads at once (a state from one at a time). They use no heap,\n \
         * no library and no variable that outlives a call; of stack, {stack}.\n * The answers are exact to the bit \
         wherever binary32 is rounded to nearest even and subnormals are kept, as is usual:\n * do not call them with \
         the processor set otherwise.\n *\n",
        env!("CARGO_PKG_VERSION"),
    );
    let mut known = Vec::new();
    if let Some(data) = &provenance.data {
        known.push(format!("data set: {data}"));
    }
    if let Some(seed) = provenance.seed {
        known.push(format!("seed of the run: {seed}"));
    }
    if let Some((correct, cases)) = provenance.fitness {
        known.push(format!("fitness: {correct} of {cases} training cases correct"));
    }
    known.push("the program:".into());
    out.push_str(&comment(&known.join("\n"), " * "));
    out.push_str(&comment(&provenance.program, " *   "));
    out + " */\n"
}

fn constants(request: &Request, stack_bytes: Option<usize>) -> String {
    let (up, program) = (request.symbol.upper(), &request.program);
    let mut out = String::new();
    let mut constant = |name: &str, value: String, about: &str| {
        let _ = writeln!(out, "#define {up}_{name} {value} /* {about} */");
    };
    constant("ABI", ABI.to_string(), "version of this interface: it grows when a meaning changes");
    constant("WIDTH", program.width().to_string(), "of the image, in pixels");
    constant("HEIGHT", program.height().to_string(), "of the image, in pixels");
    constant("VSONAR_VERSION", format!("\"{}\"", env!("CARGO_PKG_VERSION")), "what exported it");
    if let Some(bytes) = stack_bytes {
        constant("STACK_BYTES", bytes.to_string(), "stack that a call needs at most, in bytes");
    }
    constant("HAS_RANGES", i32::from(request.camera.is_some()).to_string(), "1: with ranges, 0: rows only");
    constant(
        "MEDIAN",
        median(request).to_string(),
        "frames of whose rows the median is believed; 1: no state",
    );
    let floats = if has_median(request) { "(2 * (size_t)(n))" } else { "((size_t)0 * (size_t)(n))" };
    constant("STATE_FLOATS(n)", floats.into(), "floats of state for n columns");
    if let Some(data) = &request.provenance.data {
        constant("DATA", quoted(data), "the data set it was evolved on");
    }
    if let Some(seed) = request.provenance.seed {
        constant("SEED", format!("UINT64_C({seed})"), "of the run it was evolved in");
    }
    if let Some((correct, cases)) = request.provenance.fitness {
        constant("CORRECT", correct.to_string(), "training cases answered correctly");
        constant("CASES", cases.to_string(), "training cases in all");
    }
    if let Some(camera) = &request.camera {
        constant("CAMERA_HEIGHT", format!("{:?}", camera.height), "of the lens above the floor, in metres");
        constant(
            "CAMERA_PITCH",
            format!("({:?})", camera.pitch),
            "of the axis below the horizontal, in degrees",
        );
        constant("CAMERA_FIELD_OF_VIEW", format!("{:?}", camera.field_of_view), "horizontal, in degrees");
        constant(
            "CAMERA_DISTORTION",
            format!("({:?})", camera.distortion),
            "radial term of the division model",
        );
    }
    let _ = write!(
        out,
        "\n/* What the functions return when they refuse; nothing has been written then. The first that applies, in this \
         order. */\n\
         #define {up}_ERROR_NULL (-1) /* a null pointer where one is needed */\n\
         #define {up}_ERROR_STRIDE (-2) /* a stride of 0, too small for the image, or too large for the address space */\n\
         #define {up}_ERROR_COLUMN (-3) /* a column below 0, or {up}_WIDTH or more */\n\n"
    );
    out
}

/// The parameters that both ways of looking at a frame have.
const FRAME: &str =
    "const uint8_t *luma, size_t row_stride, size_t pixel_stride, const int32_t *columns,\n    size_t n";

fn detect(name: &str, up: &str) -> String {
    format!(
        "/* Finds the obstacles of a frame.\n *\n * luma: the pixels, 0 to 255; pixel (x, y) is luma[y * row_stride + \
         x * pixel_stride]. Nothing else is read.\n * row_stride: bytes from a pixel to the one below, at least \
         ({up}_WIDTH - 1) * pixel_stride + 1.\n * pixel_stride: bytes from a pixel to the next on the right: 1 for gray \
         images, 2 for the luma of YUYV.\n * columns: n columns, each 0 to {up}_WIDTH - 1, in any order.\n \
         * rows: room for n answers: rows of the lowest pixel that is not floor, in pixels from the top, unrounded. An \
         answer\n *   may lie outside the image or be no finite number: then nothing is known of the column.\n \
         * Returns 0, or a negative {up}_ERROR. With n = 0 it does nothing, and the pointers may be null. */\n\
         int {name}_detect({FRAME}, float *rows);\n\n"
    )
}

fn ranges(request: &Request) -> String {
    let (name, up) = (request.symbol.as_str(), request.symbol.upper());
    let (believed, state, reset) = if has_median(request) {
        (
            "the median of three frames, as far as they are finite",
            format!(
                "{up}_STATE_FLOATS(n) floats that belong to these columns: {name}_reset before the first frame, then left alone"
            ),
            "Forgets the frames seen: before the first one, or when the robot has been moved. n as for ranges.",
        )
    } else {
        (
            "that of this frame",
            "not used, and may be null".to_string(),
            "Does nothing: no frame is remembered.",
        )
    };
    format!(
        "/* What is known of a column. Lengths in metres, along the floor from the point below the lens; angles in \
         radians. */\n\
         typedef struct {name}_range {{\n    \
         float row;      /* the row believed: {believed} */\n    \
         float bearing;  /* direction of the obstacle, positive to the left of straight ahead */\n    \
         float distance; /* to the obstacle; infinite: none in view; NaN: invalid */\n    \
         float nearest;  /* distance if it stood one row lower; none in view: that of the image's top row */\n    \
         float farthest; /* distance if it stood one row higher; infinite at the horizon */\n    \
         int32_t status; /* one of the three below */\n}} {name}_range;\n\n\
         #define {up}_OBSTACLE 0 /* an obstacle at the distance given */\n\
         #define {up}_NONE_IN_VIEW 1 /* floor as far as the camera sees */\n\
         #define {up}_INVALID 2 /* the detector gave no number: nothing is known */\n\n\
         /* Finds the obstacles of a frame and their distances. As {name}_detect, but:\n \
         * state: {state}.\n * ranges: room for n results. */\n\
         int {name}_ranges({FRAME}, float *state, {name}_range *ranges);\n\n\
         /* {reset} */\nvoid {name}_reset(float *state, size_t n);\n\n"
    )
}

fn info(name: &str) -> String {
    format!(
        "/* What this detector is and where it comes from. */\n\
         typedef struct {name}_info_t {{\n    \
         int32_t abi, width, height, median, has_ranges; /* the constants above */\n    \
         int32_t correct, cases; /* correct answers of so many training cases; -1 if unknown */\n    \
         int32_t has_seed;       /* 1 if the seed is known */\n    \
         uint64_t seed;          /* of the run it was evolved in */\n    \
         const char *version;    /* of vsonar */\n    \
         const char *name;       /* what the exported names begin with */\n    \
         const char *data;       /* the data set; empty if unknown */\n    \
         const char *program;    /* the program's text */\n}} {name}_info_t;\n\n\
         /* The one constant object of this kind. Texts are UTF-8 and end with a zero. */\n\
         const {name}_info_t *{name}_info(void);\n\n"
    )
}
