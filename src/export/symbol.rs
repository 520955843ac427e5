//! The prefix of exported names.

use super::reserved;

/// A C identifier, the prefix of every exported name: `NAME` in `NAME_detect`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol(String);

/// Why a text is no prefix.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SymbolError {
    /// It is no C identifier, or one that C and C++ keep for themselves.
    #[error(
        "{0:?} cannot begin the exported names: take a C identifier, a letter and then letters, digits and single \
         underscores, at most 64 in all, as in `front_camera`"
    )]
    Form(String),
    /// It is the name of something else.
    #[error(
        "{name:?} cannot begin the exported names: it is {owner}; take another one, as in `front_camera`"
    )]
    Taken {
        /// The name.
        name: String,
        /// Whose it is.
        owner: &'static str,
    },
}

impl Symbol {
    /// The prefix of this name.
    ///
    /// # Errors
    /// If it is no C identifier, begins with an underscore or has two in a row (which C and C++ keep for themselves),
    /// or is taken: a keyword of C, C++ or Python, a module of Python, a header or library of C.
    pub fn new(name: &str) -> Result<Symbol, SymbolError> {
        let begins = name.starts_with(|c: char| c.is_ascii_alphabetic());
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let ends = !name.ends_with('_') && !name.contains("__");
        if !(begins && plain && ends && name.len() <= 64) {
            return Err(SymbolError::Form(name.to_string()));
        }
        match reserved::owner(name) {
            Some(owner) => Err(SymbolError::Taken { name: name.to_string(), owner }),
            None => Ok(Symbol(name.to_string())),
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
        for wrong in ["", "2x", "_x", "x_", "a__b", "a-b", "a b", "é", &long] {
            assert_eq!(Symbol::new(wrong), Err(SymbolError::Form(wrong.to_string())));
        }
        for taken in ["int", "class", "lambda", "None", "ctypes", "math", "libc", "size"] {
            let error = Symbol::new(taken).expect_err("it is taken");
            assert!(matches!(&error, SymbolError::Taken { name, .. } if name == taken), "{error}");
        }
    }
}
