//! Whether two samples differ by more than chance: the test of Mann and Whitney (*On a Test of Whether one of Two
//! Random Variables is Stochastically Larger than the Other*, 1947), which is Wilcoxon's rank-sum test (1945).

/// Largest product of the sizes of two samples without ties for which the exact distribution is computed.
const EXACT: usize = 400;

/// The two-sided p value of the hypothesis that both samples are of one distribution; `None` if one is empty.
///
/// Exact where there are no ties and the sizes are small (product up to 400, so 20 and 20): the smaller tail doubled,
/// at most 1. Else by the normal approximation with the correction of the variance for ties (Lehmann, *Nonparametrics*,
/// 1975) and the continuity correction of 1/2.
pub fn rank_sum(first: &[f64], second: &[f64]) -> Option<f64> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let (n, m) = (first.len(), second.len());
    let u = wins(first, second);
    let ties = ties(first, second);
    if ties == 0.0 && n * m <= EXACT {
        // Without ties no pair counts half.
        let smaller = (u as usize).min(n * m - u as usize);
        return Some(exact(n, m, smaller));
    }
    let (n, m) = (n as f64, m as f64);
    let total = n + m;
    let variance = n * m / 12.0 * (total + 1.0 - ties / (total * (total - 1.0)));
    let distance = ((u - n * m / 2.0).abs() - 0.5).max(0.0);
    if variance <= 0.0 {
        // All values are equal.
        return Some(1.0);
    }
    // 2 (1 - Phi(z)) = erfc(z / sqrt(2)).
    Some(libm::erfc(distance / libm::sqrt(2.0 * variance)))
}

/// The statistic U: pairs in which the value of the first sample is greater; equal ones count half.
pub(super) fn wins(first: &[f64], second: &[f64]) -> f64 {
    let pair = |a: f64, b: f64| f64::from(u8::from(a > b)) + 0.5 * f64::from(u8::from(a == b));
    first.iter().map(|&a| second.iter().map(|&b| pair(a, b)).sum::<f64>()).sum()
}

/// The sum of t³ - t over all groups of t equal values of both samples together.
fn ties(first: &[f64], second: &[f64]) -> f64 {
    let mut all = [first, second].concat();
    all.sort_unstable_by(f64::total_cmp);
    let sizes = all.chunk_by(|a, b| a == b).map(|group| group.len() as f64);
    sizes.map(|t| t * t * t - t).sum()
}

/// Twice the probability of a U of at most `u`, cut to 1, if all orders of `n` and `m` values are equally likely.
fn exact(n: usize, m: usize, u: usize) -> f64 {
    // How many orders have which U: the coefficients of the Gaussian binomial, the product over i from 1 to n of
    // (1 - q^(m+i)) / (1 - q^i), multiplied and divided factor by factor up to q^u. All are below 2^38, which is more
    // than there are orders of 20 and 20 values.
    let mut orders = vec![0i64; u + 1];
    orders[0] = 1;
    for i in 1..=n {
        for power in (m + i..=u).rev() {
            orders[power] -= orders[power - m - i];
        }
        for power in i..=u {
            orders[power] += orders[power - i];
        }
    }
    let all = (1..=n as u128).fold(1u128, |all, i| all * (m as u128 + i) / i);
    let tail: i64 = orders.iter().sum();
    (2.0 * tail as f64 / all as f64).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The p value by counting all ways to choose which of the values are the first sample's.
    fn counted(first: &[f64], second: &[f64]) -> f64 {
        let all = [first, second].concat();
        let (n, m) = (first.len(), second.len());
        let observed = wins(first, second).min((n * m) as f64 - wins(first, second));
        let (mut tail, mut ways) = (0u32, 0u32);
        for chosen in (0u32..1 << all.len()).filter(|bits| bits.count_ones() as usize == n) {
            let part = |of: u32| -> Vec<f64> {
                (0..all.len()).filter(|&i| chosen >> i & 1 == of).map(|i| all[i]).collect()
            };
            ways += 1;
            tail += u32::from(wins(&part(1), &part(0)) <= observed);
        }
        (2.0 * f64::from(tail) / f64::from(ways)).min(1.0)
    }

    #[test]
    fn exact_values_are_those_of_counting() {
        let values = [0.7, 3.1, 2.2, 9.5, 4.4, 8.1, 1.3, 6.6, 5.2, 7.9, 0.1];
        for n in 1..values.len() {
            let (first, second) = values.split_at(n);
            let (p, counted) = (rank_sum(first, second).expect("not empty"), counted(first, second));
            assert!((p - counted).abs() < 1e-14, "{n}: {p} {counted}");
        }
    }

    /// Critical values at 0.05, two-sided, of tables of the test (Siegel, *Nonparametric Statistics*, 1956): at U the
    /// difference is significant, at U + 1 it is not.
    #[test]
    fn critical_values_of_the_tables() {
        for (n, m, critical) in [(5, 5, 2), (8, 8, 13), (10, 10, 23), (15, 15, 64), (20, 20, 127), (4, 10, 5)]
        {
            assert!(exact(n, m, critical) <= 0.05, "{n} {m}: {}", exact(n, m, critical));
            assert!(exact(n, m, critical + 1) > 0.05, "{n} {m}");
            assert_eq!(exact(n, m, critical), exact(m, n, critical));
        }
        assert_eq!(exact(20, 20, 200), 1.0);
    }

    #[test]
    fn the_approximation_is_near_the_exact_value() {
        let first: Vec<f64> = (0..20).map(|i| f64::from(i * 7 % 20) + 0.5).collect();
        for shift in [0.0, 2.0, 4.0, 6.0] {
            let second: Vec<f64> = (0..20).map(|i| f64::from(i) + shift).collect();
            let exact = rank_sum(&first, &second).expect("not empty");
            // One value more on both sides, far out on either end, takes it over the limit.
            let first: Vec<f64> = first.iter().copied().chain([-99.0, 99.0]).collect();
            let second: Vec<f64> = second.iter().copied().chain([-98.0, 98.0]).collect();
            let near = rank_sum(&first, &second).expect("not empty");
            assert!((exact - near).abs() < 0.12 && near > 0.0, "{shift}: {exact} {near}");
        }
    }

    #[test]
    fn ties_by_hand() {
        // U = 4.5 of 6, ties 2³ - 2 = 6: variance 6/12 (6 - 6/20) = 2.85, z = (1.5 - 0.5) / 1.68819 = 0.59235, and
        // 2 (1 - Phi(z)) = 0.55362 by a table of the normal distribution.
        let p = rank_sum(&[2.0, 4.0], &[1.0, 2.0, 3.0]).expect("not empty");
        assert!((p - 0.5536).abs() < 2e-4, "{p}");
        assert_eq!(rank_sum(&[1.0, 2.0, 3.0], &[2.0, 4.0]), Some(p));
        assert_eq!(rank_sum(&[5.0; 9], &[5.0; 9]), Some(1.0));
        assert_eq!((rank_sum(&[], &[1.0]), rank_sum(&[1.0], &[])), (None, None));
        // Far apart.
        let p = rank_sum(&[1.0; 30], &[2.0; 30]).expect("not empty");
        assert!(p < 1e-13 && p > 0.0, "{p}");
    }
}
