//! The prefix of exported names.

/// A C identifier, the prefix of every exported name: `NAME` in `NAME_detect`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol(String);

/// Why a text is no prefix.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} cannot begin the exported names: take a C identifier, a letter and then letters, digits and single \
     underscores, at most 64 in all, that is no keyword of C, C++ or Python, nor a module that the Python binding \
     imports, as in `front_camera`"
)]
pub struct SymbolError(pub String);

/// Words that C or C++ keep for themselves. `NAME_detect` would be no keyword, but `NAME` stands alone in file names
/// and in the Python module, which is not to hide those that it imports (`binding.py`) either.
const KEYWORDS: &str = "auto break case char const continue default do double else enum extern float for goto if \
    inline int long register restrict return short signed sizeof static struct switch typedef union unsigned void \
    volatile while alignas alignof and asm bitand bitor bool catch class compl constexpr delete explicit export \
    false friend mutable namespace new noexcept not nullptr operator or private protected public template this throw \
    true try typeid typename using virtual wchar_t xor as assert async await def del elif except finally from global \
    import in is lambda nonlocal pass raise with yield \
    None True False ctypes collections os sys";

impl Symbol {
    /// The prefix of this name.
    ///
    /// # Errors
    /// If it is no C identifier, begins with an underscore or has two in a row (which C and C++ keep for themselves),
    /// or is a keyword of C, C++ or Python, or one of Python's modules that the binding needs.
    pub fn new(name: &str) -> Result<Symbol, SymbolError> {
        let begins = name.starts_with(|c: char| c.is_ascii_alphabetic());
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let ends = !name.ends_with('_') && !name.contains("__");
        if begins && plain && ends && name.len() <= 64 && !KEYWORDS.split(' ').any(|word| word == name) {
            Ok(Symbol(name.to_string()))
        } else {
            Err(SymbolError(name.to_string()))
        }
    }

    /// The prefix.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The prefix of macros: the same in capitals.
    pub fn upper(&self) -> String {
        self.0.to_ascii_uppercase()
    }
}

impl std::fmt::Display for Symbol {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers() {
        for good in ["a", "fmrb", "front_camera", "X2"] {
            assert_eq!(Symbol::new(good).map(|s| s.to_string()), Ok(good.to_string()));
        }
        let long = "x".repeat(65);
        for wrong in [
            "", "2x", "_x", "x_", "a__b", "a-b", "a b", "int", "class", "lambda", "None", "ctypes", "é",
            &long,
        ] {
            assert_eq!(Symbol::new(wrong), Err(SymbolError(wrong.to_string())));
        }
    }
}
