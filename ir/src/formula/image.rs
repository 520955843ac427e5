//! Image operators.
