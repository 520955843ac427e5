//! A static library around an object file.

use std::io::Cursor;

use ar_archive_writer::{ArchiveKind, DEFAULT_OBJECT_READER, NewArchiveMember, write_archive_to_stream};

use super::native::Target;

/// The static library with one member, `NAME.o`, and an index of its symbols. It holds no times and no user, so that
/// the same detector gives the same file.
///
/// # Errors
/// If the object file cannot be read.
pub fn archive(name: &str, object: &[u8], target: &Target) -> std::io::Result<Vec<u8>> {
    let kind = if target.is_apple() {
        ArchiveKind::Darwin
    } else if target.is_windows() {
        ArchiveKind::Coff
    } else {
        ArchiveKind::Gnu
    };
    let members = [NewArchiveMember::new(object, &DEFAULT_OBJECT_READER, format!("{name}.o"))];
    let mut out = Cursor::new(Vec::new());
    write_archive_to_stream(&mut out, &members, kind, false, None)?;
    Ok(out.into_inner())
}
