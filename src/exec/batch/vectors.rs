//! The vector widths of this machine, and calls into code that is compiled for one of them.

use pulp::{Simd, WithSimd};

/// How wide the interpreter's vectors are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Vectors {
    /// No vectors: one case after the other.
    Scalar,
    /// Four cases: SSE 4.2 (x86-64-v2) or NEON.
    V128,
    /// Eight cases: AVX2 (x86-64-v3).
    V256,
    /// Sixteen cases: AVX-512 (x86-64-v4).
    V512,
}

impl Vectors {
    /// Every width, whether or not this machine has it.
    pub const ALL: [Vectors; 4] = [Vectors::Scalar, Vectors::V128, Vectors::V256, Vectors::V512];

    /// The widest that this machine has.
    pub fn widest() -> Vectors {
        Vectors::ALL.into_iter().rfind(|v| v.is_available()).unwrap_or(Vectors::Scalar)
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        InstructionSet::of(self).is_some()
    }

    /// The name in `--executor` of the interpreter with this width.
    pub const fn executor(self) -> &'static str {
        match self {
            Vectors::Scalar => "batch-scalar",
            Vectors::V128 => "batch-128",
            Vectors::V256 => "batch-256",
            Vectors::V512 => "batch-512",
        }
    }

    /// How many cases a vector holds.
    pub const fn lanes(self) -> usize {
        match self {
            Vectors::Scalar => 1,
            Vectors::V128 => 4,
            Vectors::V256 => 8,
            Vectors::V512 => 16,
        }
    }
}

/// An instruction set that was found on this machine.
#[derive(Debug, Clone, Copy)]
pub(super) enum InstructionSet {
    Scalar(pulp::Scalar),
    #[cfg(target_arch = "x86_64")]
    V2(pulp::x86::V2),
    #[cfg(target_arch = "x86_64")]
    V3(pulp::x86::V3),
    #[cfg(target_arch = "x86_64")]
    V4(pulp::x86::V4),
    #[cfg(target_arch = "aarch64")]
    Neon(pulp::aarch64::Neon),
}

impl InstructionSet {
    /// What every machine has.
    pub(super) const NONE: InstructionSet = InstructionSet::Scalar(pulp::Scalar);

    /// The instruction set with vectors of this width, if the machine has one.
    pub(super) fn of(vectors: Vectors) -> Option<InstructionSet> {
        match vectors {
            Vectors::Scalar => Some(InstructionSet::Scalar(pulp::Scalar::new())),
            #[cfg(target_arch = "x86_64")]
            Vectors::V128 => pulp::x86::V2::try_new().map(InstructionSet::V2),
            #[cfg(target_arch = "x86_64")]
            Vectors::V256 => pulp::x86::V3::try_new().map(InstructionSet::V3),
            #[cfg(target_arch = "x86_64")]
            Vectors::V512 => pulp::x86::V4::try_new().map(InstructionSet::V4),
            #[cfg(target_arch = "aarch64")]
            Vectors::V128 => pulp::aarch64::Neon::try_new().map(InstructionSet::Neon),
            #[cfg(not(target_arch = "x86_64"))]
            _ => None,
        }
    }

    /// Runs `work` in code that is compiled for this instruction set.
    #[inline]
    pub(super) fn run<W: WithSimd>(self, work: W) -> W::Output {
        match self {
            InstructionSet::Scalar(simd) => simd.vectorize(work),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::V2(simd) => Simd::vectorize(simd, work),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::V3(simd) => Simd::vectorize(simd, work),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::V4(simd) => Simd::vectorize(simd, work),
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon(simd) => Simd::vectorize(simd, work),
        }
    }
}
