//! What native code is made for.

use std::str::FromStr;

use cranelift_codegen::isa::{self, OwnedTargetIsa};
use cranelift_codegen::settings::{self, Configurable};
use target_lexicon::{
    Architecture, BinaryFormat, OperatingSystem, PointerWidth, Riscv64Architecture, Triple,
};

use crate::exec::cranelift::{Effort, Shape};

/// A machine: its triple and how much of its instruction set may be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    triple: Triple,
    cpu: Cpu,
}

/// A level of instruction sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cpu {
    name: &'static str,
    /// What it is, for people.
    meaning: &'static str,
    /// The code generator's settings.
    enables: &'static [&'static str],
    /// Whether there are vectors of 128 bits.
    vectors: bool,
}

/// The name of the level that stands for the machine this process runs on.
const NATIVE: &str = "native";

const X86_64: [Cpu; 3] = [
    Cpu { name: "v1", meaning: "every 64-bit x86 processor", enables: &[], vectors: true },
    Cpu { name: "v2", meaning: "SSE 4.2, from about 2009 on", enables: &["x86-64-v2"], vectors: true },
    Cpu {
        name: "v3",
        meaning: "AVX2, from about 2015 on",
        enables: &["x86-64-v3", "has_avx"],
        vectors: true,
    },
];
const AARCH64: [Cpu; 1] =
    [Cpu { name: "generic", meaning: "every 64-bit Arm processor", enables: &[], vectors: true }];
const RISCV64: [Cpu; 2] = [
    Cpu { name: "generic", meaning: "RV64GC, one column at a time", enables: &["has_c"], vectors: false },
    Cpu {
        name: "v",
        meaning: "with the vector extension",
        enables: &["has_c", "has_v", "has_zvl128b"],
        vectors: true,
    },
];
const S390X: [Cpu; 1] = [Cpu { name: "generic", meaning: "z14 and later", enables: &[], vectors: true }];

/// The triples that are known to work, for messages. Others of the same processors and formats are taken too.
pub const KNOWN: [&str; 7] = [
    "x86_64-unknown-linux-gnu",
    "aarch64-unknown-linux-gnu",
    "riscv64gc-unknown-linux-gnu",
    "s390x-unknown-linux-gnu",
    "x86_64-apple-darwin",
    "aarch64-apple-darwin",
    "x86_64-pc-windows-msvc",
];

/// Why native code cannot be made for a target.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// Not a triple, or none that code can be generated for.
    #[error(
        "{0:?} is no target that code can be made for; the known ones are {known}; the C source serves every other",
        known = KNOWN.join(", ")
    )]
    Unknown(String),
    /// The level is not one of the processor's.
    #[error("{cpu:?} is no level of {processor}; there are {levels}")]
    Cpu {
        /// What was asked for.
        cpu: String,
        /// The processor.
        processor: String,
        /// The levels there are.
        levels: String,
    },
    /// The code generator refuses the settings.
    #[error("the code generator refuses {target}: {message}")]
    Refused {
        /// The triple.
        target: String,
        /// What it says.
        message: String,
    },
}

impl Target {
    /// The machine this process runs on, with the lowest level of instruction sets, so that the code runs on its
    /// like as well.
    pub fn host() -> Target {
        let triple = Triple::host();
        let cpu = levels(&triple).first().copied();
        // A process on a machine that Cranelift does not know gets as far as the code generator's own refusal.
        let cpu = cpu.unwrap_or(Cpu { name: "generic", meaning: "", enables: &[], vectors: false });
        Target { triple, cpu }
    }

    /// This very machine, with all its instructions.
    pub(crate) fn native() -> Target {
        Target { cpu: Cpu { name: NATIVE, ..Target::host().cpu }, ..Target::host() }
    }

    /// The target of this triple (without: this machine's) and level (without: the lowest; `native`: all that this
    /// machine has).
    ///
    /// # Errors
    /// If there is no such target or level.
    pub fn new(triple: Option<&str>, cpu: Option<&str>) -> Result<Target, TargetError> {
        let host = Triple::host();
        let triple = match triple {
            None => host.clone(),
            Some(text) => Triple::from_str(text).map_err(|_| TargetError::Unknown(text.to_string()))?,
        };
        // The object writer lacks relocations of the other pairs.
        let format = match triple.architecture {
            Architecture::X86_64 => [BinaryFormat::Elf, BinaryFormat::Macho, BinaryFormat::Coff].as_slice(),
            Architecture::Aarch64(_) => &[BinaryFormat::Elf, BinaryFormat::Macho],
            _ => &[BinaryFormat::Elf],
        };
        let levels = levels(&triple);
        // Addresses have 64 bits in the code and in what `NAME_info` gives.
        let wide = triple.pointer_width() == Ok(PointerWidth::U64);
        // UEFI loads another format than the triple's.
        let firmware = triple.operating_system == OperatingSystem::Uefi;
        if levels.is_empty() || !format.contains(&triple.binary_format) || !wide || firmware {
            return Err(TargetError::Unknown(triple.to_string()));
        }
        // What this machine has is asked of the running system, calling convention and format included.
        let of_host = |t: &Triple| (t.architecture, t.operating_system, t.binary_format);
        let is_host = of_host(&triple) == of_host(&host);
        let cpu = match cpu {
            None => levels[0],
            Some(NATIVE) if is_host => Cpu { name: NATIVE, ..levels[0] },
            Some(name) => levels.iter().copied().find(|cpu| cpu.name == name).ok_or_else(|| {
                let mut all: Vec<String> =
                    levels.iter().map(|cpu| format!("{} ({})", cpu.name, cpu.meaning)).collect();
                if is_host {
                    all.push(format!("{NATIVE} (what this machine has)"));
                }
                TargetError::Cpu {
                    cpu: name.to_string(),
                    processor: triple.architecture.to_string(),
                    levels: all.join(", "),
                }
            })?,
        };
        Ok(Target { triple, cpu })
    }

    /// The triple.
    pub fn triple(&self) -> String {
        self.triple.to_string()
    }

    /// The level of instruction sets.
    pub const fn cpu(&self) -> &'static str {
        self.cpu.name
    }

    /// Whether its programs run on this machine.
    pub fn is_host(&self) -> bool {
        let host = Triple::host();
        (self.triple.architecture, self.triple.operating_system) == (host.architecture, host.operating_system)
    }

    /// Whether the operating system is Windows.
    pub fn is_windows(&self) -> bool {
        self.triple.operating_system == OperatingSystem::Windows
    }

    /// Whether the operating system is one of Apple's.
    pub fn is_apple(&self) -> bool {
        self.triple.binary_format == BinaryFormat::Macho
    }

    /// What the processor is called in the names of cross compilers.
    pub(crate) fn processor(&self) -> String {
        match self.triple.architecture {
            Architecture::Riscv64(_) => "riscv64".to_string(),
            other => other.to_string(),
        }
    }

    /// How many columns are looked at at a time.
    pub(crate) const fn shape(&self) -> Shape {
        if self.cpu.vectors { Shape::Lanes4 } else { Shape::Scalar }
    }

    /// The code generator. Its code is independent of its position, for it refers to nothing but its own module, and
    /// to that from where it is; the setting of that name would send it through tables of addresses.
    ///
    /// A frame may be larger than the page that guards a stack's end. With `probes` each page is touched in turn, so
    /// that too small a stack is a fault, not damage to what lies below it. That takes up to a page of stack more.
    pub(crate) fn isa(&self, effort: Effort, probes: bool) -> Result<OwnedTargetIsa, TargetError> {
        let refused = |message: String| TargetError::Refused { target: self.triple(), message };
        let mut flags = settings::builder();
        for (name, value) in [
            ("opt_level", effort.level()),
            ("regalloc_algorithm", "backtracking"),
            ("enable_verifier", if cfg!(debug_assertions) { "true" } else { "false" }),
            ("is_pic", "false"),
            ("use_colocated_libcalls", "false"),
            ("unwind_info", "false"),
            ("preserve_frame_pointers", "false"),
            ("machine_code_cfg_info", "false"),
            // Windows grows a stack page by page.
            ("enable_probestack", if probes || self.is_windows() { "true" } else { "false" }),
            ("probestack_strategy", "inline"),
            ("enable_heap_access_spectre_mitigation", "false"),
            ("enable_table_access_spectre_mitigation", "false"),
        ] {
            flags.set(name, value).map_err(|e| refused(format!("the setting {name}={value}: {e}")))?;
        }
        let mut builder = if self.cpu.name == NATIVE {
            cranelift_native::builder().map_err(|e| refused(e.to_string()))?
        } else {
            isa::lookup(self.triple.clone()).map_err(|e| refused(e.to_string()))?
        };
        for name in self.cpu.enables {
            builder.enable(name).map_err(|e| refused(format!("the setting {name}: {e}")))?;
        }
        builder.finish(settings::Flags::new(flags)).map_err(|e| refused(e.to_string()))
    }
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.triple, self.cpu.name)
    }
}

/// The levels of a processor, the lowest first; none where there is no code generator.
fn levels(triple: &Triple) -> &'static [Cpu] {
    match triple.architecture {
        Architecture::X86_64 => &X86_64,
        Architecture::Aarch64(target_lexicon::Aarch64Architecture::Aarch64) => &AARCH64,
        // All levels compute with floating-point registers, which smaller ones lack.
        Architecture::Riscv64(
            Riscv64Architecture::Riscv64 | Riscv64Architecture::Riscv64gc | Riscv64Architecture::Riscv64a23,
        ) => &RISCV64,
        Architecture::S390x => &S390X,
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_known_target_has_a_code_generator_at_every_level() {
        for triple in KNOWN {
            let levels = levels(&Triple::from_str(triple).expect("a triple"));
            assert!(!levels.is_empty());
            for cpu in levels {
                let target = Target::new(Some(triple), Some(cpu.name)).expect("known");
                target.isa(Effort::Best, false).unwrap_or_else(|e| panic!("{target}: {e}"));
            }
        }
        Target::host().isa(Effort::Best, true).expect("this machine has a back end");
        Target::native().isa(Effort::Best, true).expect("this machine has a back end");
    }

    #[test]
    fn unknown_ones_name_the_known() {
        for wrong in [
            "",
            "vax",
            "armv7-unknown-linux-gnueabihf",
            "wasm32-unknown-unknown",
            "aarch64-pc-windows-msvc",
            "riscv64imac-unknown-none-elf",
            "x86_64-unknown-linux-gnux32",
            "aarch64-unknown-linux-gnu_ilp32",
            "x86_64-unknown-uefi",
        ] {
            let error = Target::new(Some(wrong), None).expect_err(wrong).to_string();
            assert!(error.contains("riscv64gc-unknown-linux-gnu"), "{error}");
        }
        let error =
            Target::new(Some("x86_64-unknown-linux-gnu"), Some("v9")).expect_err("no level").to_string();
        assert!(error.contains("v3 (AVX2"), "{error}");
    }

    #[test]
    fn native_is_of_this_system_alone() {
        let host = Target::new(None, Some("native")).expect("this machine");
        assert_eq!(host, Target::native());
        for triple in KNOWN.iter().filter(|triple| !Target::new(Some(triple), None).expect("known").is_host())
        {
            let error = Target::new(Some(triple), Some("native")).expect_err(triple).to_string();
            assert!(!error.contains("what this machine has"), "{error}");
        }
    }
}
