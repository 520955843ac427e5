//! The secret in the address.

use std::fmt;
use std::hint::black_box;
use std::io;
use std::str::FromStr;

/// 128 random bits, written as 32 hexadecimal digits.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// Digits of a token.
    const DIGITS: usize = 32;

    /// A new one, from the system's random numbers.
    ///
    /// # Errors
    /// If the system gives none.
    pub fn random() -> io::Result<Token> {
        let mut bytes = [0; Token::DIGITS / 2];
        getrandom::fill(&mut bytes).map_err(|e| io::Error::other(e.to_string()))?;
        Ok(Token(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Whether this text is the token; takes as long wherever the first difference is.
    pub(super) fn is(&self, text: &str) -> bool {
        let differences = self.0.bytes().zip(text.bytes()).fold(0, |all, (a, b)| black_box(all | (a ^ b)));
        text.len() == self.0.len() && black_box(differences) == 0
    }
}

impl FromStr for Token {
    type Err = ();

    fn from_str(text: &str) -> Result<Token, ()> {
        let digits = text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
        if text.len() == Token::DIGITS && digits { Ok(Token(text.to_string())) } else { Err(()) }
    }
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for Token {
    /// Does not tell it, for logs are read by others.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_and_know_themselves() {
        let [a, b] = [(); 2].map(|()| Token::random().expect("random numbers"));
        assert_ne!(a, b);
        let text = a.to_string();
        assert!(a.is(&text) && !a.is(&b.to_string()));
        for end in 0..Token::DIGITS {
            assert!(!a.is(&text[..end]));
        }
        assert!(!a.is(&format!("{text}0")));
        assert_eq!(text.parse(), Ok(a));
        for wrong in ["", "0", &"g".repeat(32), &"A".repeat(32), &"0".repeat(33)] {
            assert!(wrong.parse::<Token>().is_err(), "{wrong}");
        }
    }
}
