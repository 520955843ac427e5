//! The `vsonar` command.

fn main() {}
