//! Several comparisons at once.

/// The p values corrected for their number by Holm's method (*A Simple Sequentially Rejective Multiple Test Procedure*,
/// 1979), in the order given: the smallest of n is multiplied by n, the next by n - 1 and so on; none becomes less
/// than one before it, or more than 1. To call significant what is below a level then errs anywhere among them with
/// at most that probability, whatever depends on what.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut corrected = vec![0.0; p_values.len()];
    let mut greatest = 0.0f64;
    for (rank, &i) in order.iter().enumerate() {
        greatest = greatest.max((p_values.len() - rank) as f64 * p_values[i]).min(1.0);
        corrected[i] = greatest;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        assert_eq!(holm(&[]), Vec::<f64>::new());
        assert_eq!(holm(&[0.25]), [0.25]);
        // 3 * 1/64, 2 * 1/32, then 1 * 3/64, which must not be less than the one before.
        assert_eq!(holm(&[3.0 / 64.0, 1.0 / 64.0, 1.0 / 32.0]), [4.0 / 64.0, 3.0 / 64.0, 4.0 / 64.0]);
        // 4 * 0.5 is cut to 1, and so is all after it.
        assert_eq!(holm(&[0.75, 0.5, 0.625, 0.875]), [1.0; 4]);
        assert_eq!(holm(&[0.25, 0.25]), [0.5, 0.5]);
    }
}
