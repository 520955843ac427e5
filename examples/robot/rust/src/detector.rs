//! The exported detector, safely: what `detector.h` declares, checked.

use std::ffi::{c_char, c_int};

/// `detector_info_t` of the header.
#[repr(C)]
#[allow(dead_code)] // It has to have the fields of the header; not all of them are needed here.
struct Info {
    abi: i32,
    width: i32,
    height: i32,
    median: i32,
    has_ranges: i32,
    correct: i32,
    cases: i32,
    has_seed: i32,
    seed: u64,
    version: *const c_char,
    name: *const c_char,
    data: *const c_char,
    program: *const c_char,
}

extern "C" {
    fn detector_info() -> *const Info;
    fn detector_detect(
        luma: *const u8,
        row_stride: usize,
        pixel_stride: usize,
        columns: *const i32,
        n: usize,
        rows: *mut f32,
    ) -> c_int;
}

/// The version of the interface that the declarations above are of.
const ABI: i32 = 1;

/// The detector that this program is linked with.
#[derive(Debug, Clone, Copy)]
pub struct Detector {
    width: usize,
    height: usize,
}

impl Detector {
    /// The detector; an error if its interface is another than the one declared here.
    pub fn new() -> Result<Detector, String> {
        // SAFETY: the function takes nothing and returns the address of a constant. Its first field is the version of
        // the interface whatever that is, and nothing else is read before that is known to be ours.
        let abi = unsafe { (*detector_info()).abi };
        if abi != ABI {
            return Err(format!("the detector's interface is of version {abi}, not {ABI}: see its header"));
        }
        // SAFETY: the interface is of the version whose `detector_info_t` is `Info`; the constant lives as long as the
        // program and is never written.
        let info = unsafe { &*detector_info() };
        let size = |side: i32| usize::try_from(side).map_err(|_| "the detector has no size".to_string());
        Ok(Detector { width: size(info.width)?, height: size(info.height)? })
    }

    /// Width of the images, in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height of the images, in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The row of the lowest pixel that is not floor, in each of the columns. `luma` is the image, row by row. A row may
    /// lie outside the image or be no finite number: then nothing is known.
    pub fn detect(&self, luma: &[u8], columns: &[i32]) -> Result<Vec<f32>, String> {
        let pixels = self.width * self.height;
        if luma.len() != pixels {
            return Err(format!("the image has {} pixels, not {pixels}", luma.len()));
        }
        let mut rows = vec![f32::NAN; columns.len()];
        // SAFETY: `luma` has width x height pixels, so that row_stride = width and pixel_stride = 1 reach none beyond
        // it. `columns` and `rows` are of the length given. The three are not written by anyone else meanwhile: two are
        // borrowed, the third is ours. The function keeps none of them.
        let error = unsafe {
            detector_detect(luma.as_ptr(), self.width, 1, columns.as_ptr(), columns.len(), rows.as_mut_ptr())
        };
        match error {
            0 => Ok(rows),
            -3 => Err(format!("a column is outside the image, whose columns are 0 to {}", self.width - 1)),
            other => Err(format!("the detector refuses: error {other}")),
        }
    }
}
