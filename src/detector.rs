//! Detectors: a gray image and columns in, rows out.
//!
//! Evolved and compiled, exported, hand-written or ideal: whatever finds obstacles is a [`Detector`]. This module
//! holds the trait and what makes a detector of a program: [`CompiledDetector`], [`InterpretedDetector`], and
//! [`ProgramDetector`], which is the first where this machine can compile the program and else the second.

use std::sync::Arc;

use image::GrayImage;
use vsonar_ir::Program;

use crate::exec::ExecError;
use crate::exec::batch::BatchExecutor;
use crate::export::native::{JitRows, NativeError};
use crate::tree::Individual;
use crate::vision::{CaseSet, Lane, WindowSums};

/// Why an image could not be looked at.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DetectError {
    /// The image is not of the detector's size.
    #[error(
        "the detector is for images of {width}x{height} pixels, but the image has \
         {image_width}x{image_height}; scale it, or compile the detector for its size"
    )]
    ImageSize {
        /// Width the detector is for.
        width: u32,
        /// Height the detector is for.
        height: u32,
        /// The image's width.
        image_width: u32,
        /// The image's height.
        image_height: u32,
    },
    /// A column outside the image.
    #[error("column {column} is outside the image, whose columns are 0 to {}", .width - 1)]
    Column {
        /// The column asked for.
        column: u32,
        /// The image's width.
        width: u32,
    },
    /// Not as many places for rows as columns.
    #[error("{columns} columns need as many places for rows, not {rows}")]
    Rows {
        /// How many columns were asked for.
        columns: usize,
        /// How many rows there is room for.
        rows: usize,
    },
}

/// Finds the row of the lowest non-ground pixel in columns of an image.
pub trait Detector {
    /// Width of the images it takes, in pixels.
    fn width(&self) -> u32;

    /// Height of the images it takes, in pixels.
    fn height(&self) -> u32;

    /// Writes, for each of `columns` (in pixels from the left), the row of the lowest non-ground pixel, in pixels
    /// from the top. An evolved detector's answer may be fractional, outside the image, or not finite.
    ///
    /// # Errors
    /// If the image is of another size, a column is outside it, or `rows` is not as long as `columns`. No row
    /// has been written then.
    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError>;
}

/// Whether a detector for images of this width and height can be asked so, as [`Detector::detect`] says.
pub(crate) fn check_arguments(
    (width, height): (u32, u32),
    image: &GrayImage,
    columns: &[u32],
    rows: &[f32],
) -> Result<(), DetectError> {
    let (image_width, image_height) = image.dimensions();
    if (width, height) != (image_width, image_height) {
        return Err(DetectError::ImageSize { width, height, image_width, image_height });
    }
    if let Some(&column) = columns.iter().find(|&&column| column >= width) {
        return Err(DetectError::Column { column, width });
    }
    if columns.len() != rows.len() {
        return Err(DetectError::Rows { columns: columns.len(), rows: rows.len() });
    }
    Ok(())
}

/// A program compiled to native code, to be called on images from any number of threads.
///
/// ```
/// use vsonar::detector::{CompiledDetector, Detector};
///
/// // Goes up from the bottom until the gradient exceeds 50, and answers that row.
/// let program = vsonar::ir::text::parse("\
/// vir 1
/// image 64x48
/// loop 2 up 3x3
/// column
///   v0 = x-obstacle
///   result v0
/// body
///   varying
///     v0 = y
///     v1 = window gradient
///     v2 = const 50
///     v3 = lt v2 v1
///   next a v0
///   break v3
/// ")?;
/// let detector = CompiledDetector::compile(&program)?;
///
/// // A bright wall ends at row 19; the floor below is dark.
/// let image = image::GrayImage::from_fn(64, 48, |_, y| image::Luma([if y < 20 { 200 } else { 40 }]));
/// let mut rows = [0.0; 3];
/// detector.detect(&image, &[5, 30, 60], &mut rows)?;
/// assert_eq!(rows, [21.0; 3]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct CompiledDetector {
    program: Program,
    code: JitRows,
}

impl CompiledDetector {
    /// Compiles a program for this machine. Optimise it first ([`vsonar_ir::opt::optimise`]).
    ///
    /// # Errors
    /// If there is no code generator for this machine, the system refuses executable memory, or the program is too
    /// long to be compiled ([`crate::exec::MAX_COMPILED`]).
    pub fn compile(program: &Program) -> Result<CompiledDetector, ExecError> {
        let code = JitRows::compile(program).map_err(|error| match error {
            NativeError::Memory(error) => ExecError::Memory(std::io::Error::other(error)),
            NativeError::TooLong { instructions } => ExecError::TooLong { instructions },
            other => ExecError::Compile(other.to_string()),
        })?;
        Ok(CompiledDetector { program: program.clone(), code })
    }

    /// Lowers, optimises and compiles an individual for images of `width` x `height` pixels.
    ///
    /// # Errors
    /// As [`CompiledDetector::compile`], or if there cannot be programs for images of this size.
    pub fn compile_individual(
        individual: &Individual,
        width: u32,
        height: u32,
    ) -> Result<CompiledDetector, ExecError> {
        if !Program::fits(width, height) {
            return Err(ExecError::Side { width, height });
        }
        let program = vsonar_ir::opt::optimise(&crate::lower::lower(individual, width, height));
        CompiledDetector::compile(&program)
    }

    /// The program.
    pub const fn program(&self) -> &Program {
        &self.program
    }
}

impl Detector for CompiledDetector {
    fn width(&self) -> u32 {
        self.program.width()
    }

    fn height(&self) -> u32 {
        self.program.height()
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        check_arguments((self.width(), self.height()), image, columns, rows)?;
        let code = self.code.run(image.as_raw(), self.width() as usize, columns, rows);
        assert_eq!(code, 0, "the arguments have been checked");
        Ok(())
    }
}

/// A program run by the batch interpreter, to be called on images from any number of threads.
///
/// It gives the bits of a [`CompiledDetector`] and needs no executable memory, but it computes every image operator over
/// the whole of each image, which takes milliseconds.
#[derive(Debug)]
pub struct InterpretedDetector {
    program: Program,
    executor: BatchExecutor,
}

impl InterpretedDetector {
    /// A detector that interprets the program. Optimise it first ([`vsonar_ir::opt::optimise`]).
    pub fn new(program: &Program) -> InterpretedDetector {
        InterpretedDetector { program: program.clone(), executor: BatchExecutor::widest() }
    }
}

impl Detector for InterpretedDetector {
    fn width(&self) -> u32 {
        self.program.width()
    }

    fn height(&self) -> u32 {
        self.program.height()
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        check_arguments((self.width(), self.height()), image, columns, rows)?;
        let lanes = columns.iter().map(|&column| Lane { image: 0, column }).collect();
        let cases = CaseSet::new(vec![Arc::new(WindowSums::new(image))], lanes);
        let cases = cases.unwrap_or_else(|fault| unreachable!("the arguments have been checked: {fault}"));
        let run = self.executor.batch_worker().run(&self.program, &cases, rows);
        run.unwrap_or_else(|fault| unreachable!("the image is of the program's size: {fault}"));
        Ok(())
    }
}

/// A program as a detector: compiled where this machine can compile it, else interpreted, with the same bits.
///
/// ```
/// use vsonar::detector::{Detector, ProgramDetector};
/// use vsonar::{ir::opt, lower::lower};
/// let individual = "(individual (iterate-down 3x3 x-obstacle (set-a y)))".parse()?;
/// let detector = ProgramDetector::new(&opt::optimise(&lower(&individual, 64, 48)));
/// let mut rows = [0.0];
/// detector.detect(&image::GrayImage::new(64, 48), &[10], &mut rows)?;
/// assert_eq!(rows, [46.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ProgramDetector(Made);

#[derive(Debug)]
enum Made {
    Compiled(Box<CompiledDetector>),
    Interpreted(Box<InterpretedDetector>, ExecError),
}

impl ProgramDetector {
    /// Compiles the program or, if that cannot be done, prepares it to be interpreted. Optimise it first
    /// ([`vsonar_ir::opt::optimise`]).
    pub fn new(program: &Program) -> ProgramDetector {
        ProgramDetector(match CompiledDetector::compile(program) {
            Ok(detector) => Made::Compiled(Box::new(detector)),
            Err(error) => Made::Interpreted(Box::new(InterpretedDetector::new(program)), error),
        })
    }

    /// Why the program is interpreted, if it is.
    pub const fn why_interpreted(&self) -> Option<&ExecError> {
        match &self.0 {
            Made::Compiled(_) => None,
            Made::Interpreted(_, error) => Some(error),
        }
    }

    fn made(&self) -> &dyn Detector {
        match &self.0 {
            Made::Compiled(detector) => detector.as_ref(),
            Made::Interpreted(detector, _) => detector.as_ref(),
        }
    }
}

impl Detector for ProgramDetector {
    fn width(&self) -> u32 {
        self.made().width()
    }

    fn height(&self) -> u32 {
        self.made().height()
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        self.made().detect(image, columns, rows)
    }
}

impl<D: Detector + ?Sized> Detector for Arc<D> {
    fn width(&self) -> u32 {
        (**self).width()
    }

    fn height(&self) -> u32 {
        (**self).height()
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        (**self).detect(image, columns, rows)
    }
}

/// How a robot moved between two frames, by its wheels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Metres forward.
    pub forward: f64,
    /// Radians to the left.
    pub turn: f64,
}

/// A detector that may remember the earlier frames of a sequence. Every [`Detector`] is one that does not.
pub trait SequenceDetector {
    /// Width and height of the images it takes, in pixels.
    fn size(&self) -> (u32, u32);

    /// Forgets all frames: another sequence begins.
    fn restart(&mut self);

    /// As [`Detector::detect`], for the next frame of the sequence. `motion` is how the robot moved since the frame
    /// before, where that is known.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    fn next(
        &mut self,
        image: &GrayImage,
        motion: Option<Motion>,
        columns: &[u32],
        rows: &mut [f32],
    ) -> Result<(), DetectError>;
}

impl<D: Detector> SequenceDetector for D {
    fn size(&self) -> (u32, u32) {
        (self.width(), self.height())
    }

    fn restart(&mut self) {}

    fn next(
        &mut self,
        image: &GrayImage,
        _: Option<Motion>,
        columns: &[u32],
        rows: &mut [f32],
    ) -> Result<(), DetectError> {
        self.detect(image, columns, rows)
    }
}
