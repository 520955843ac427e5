//! What a pixel is of, and the label that follows for a column.

/// What is seen at a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Surface {
    /// The floor, or whatever else can be driven on.
    Ground,
    /// Anything but the ground.
    Other,
    /// Nobody knows.
    Ignored,
}

/// The label of a column, given from the top down: the lowest row that is not ground, 0 if all are.
///
/// Where it depends on what an ignored pixel is of, there is none.
///
/// ```
/// use vsonar::dataset::import::{Surface::*, label};
///
/// assert_eq!(label(&[Other, Other, Ground, Ground]), Some(1));
/// assert_eq!(label(&[Ground, Ground]), Some(0));
/// assert_eq!(label(&[Ignored, Other, Ground]), Some(1));
/// assert_eq!(label(&[Other, Ignored, Ground]), None);
/// ```
pub fn label(column: &[Surface]) -> Option<u32> {
    let lowest =
        |wanted: fn(Surface) -> bool| column.iter().rposition(|&surface| wanted(surface)).unwrap_or(0);
    let row = lowest(|surface| surface == Surface::Other);
    (row == lowest(|surface| surface != Surface::Ground)).then_some(row as u32)
}

#[cfg(test)]
mod tests {
    use super::Surface::*;
    use super::*;

    #[test]
    fn a_label_is_the_lowest_row_that_is_not_ground() {
        assert_eq!(label(&[Other; 5]), Some(4));
        assert_eq!(label(&[Ground, Other, Ground, Other, Ground]), Some(3));
        assert_eq!(label(&[Other, Ground, Ground]), Some(0));
        // Ignored at the top alone: ground all the way and an obstacle in the topmost row have one label.
        assert_eq!(label(&[Ignored, Ground, Ground]), Some(0));
        assert_eq!(label(&[Ground, Ignored, Ground]), None);
        assert_eq!(label(&[Other, Ground, Ignored]), None);
        assert_eq!(label(&[]), Some(0));
    }
}
