//! What every part of the library uses: files and folders, and text from outside.
//!
//! | module | what it is for |
//! |---|---|
//! | [`bounded`] | reading a file up to a limit, so that neither a device nor a pipe nor a huge file stops a command |
//! | [`temporary`] | new files and folders beside their place, under names that nobody can foresee |
//! | [`durable`] | files that are wholly there or not at all, also after a crash |
//! | [`lock`] | one process at a time |
//! | [`printable`] | text from outside, made safe to show |
//! | [`warnings`] | what the file system lacks, for the user to know |

pub mod bounded;
pub mod durable;
pub mod lock;
pub mod printable;
pub mod temporary;
pub mod warnings;
