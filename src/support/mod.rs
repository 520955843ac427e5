//! Files and folders as every part of the library reads and writes them.
//!
//! | module | what it is for |
//! |---|---|
//! | [`bounded`] | reading a file up to a limit, so that neither a device nor a pipe nor a huge file stops a command |
//! | [`temporary`] | new files and folders beside their place, under names that nobody can foresee |
//! | [`durable`] | files that are wholly there or not at all, also after a crash |
//! | [`lock`] | one process at a time |
//! | [`warnings`] | what the file system lacks, for the user to know |

pub mod bounded;
pub mod durable;
pub mod lock;
pub mod temporary;
pub mod warnings;
