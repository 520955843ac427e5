//! Columns to be labelled, or asked for, where nobody names them.

/// So many columns of images of this width, ascending, each in the middle of its equal part.
///
/// ```
/// assert_eq!(vsonar::dataset::spread(4, 40), [5, 15, 25, 35]);
/// ```
pub fn spread(columns: u32, width: u32) -> Vec<u32> {
    let (n, width) = (u64::from(columns), u64::from(width));
    (0..n).map(|i| ((2 * i + 1) * width / (2 * n)) as u32).collect()
}
