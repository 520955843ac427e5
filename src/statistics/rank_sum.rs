//! Whether two samples differ by more than chance: the test of Mann and Whitney (*On a Test of Whether one of Two
//! Random Variables is Stochastically Larger than the Other*, 1947), which is Wilcoxon's rank-sum test (1945).

/// Largest product of the sizes of two samples for which the exact distribution is computed.
const EXACT: usize = 400;

/// The two-sided p value of the hypothesis that both samples are of one distribution; `None` if one is empty.
///
/// Exact where the sizes are small (product up to 400, so 20 and 20): of all ways to choose which of the values are the
/// first sample's, the share whose rank sum is at least as far from the mean as the observed one; equal values have the
/// mean of their ranks. Else by the normal approximation with the correction of the variance for ties (Lehmann,
/// *Nonparametrics*, 1975) and the continuity correction of 1/2.
pub fn rank_sum(first: &[f64], second: &[f64]) -> Option<f64> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let (n, m) = (first.len(), second.len());
    let u = wins(first, second);
    let mut all = [first, second].concat();
    all.sort_unstable_by(f64::total_cmp);
    let groups: Vec<usize> = all.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
    if n * m <= EXACT {
        // Twice U is whole, and as far from its mean as twice the rank sum.
        return Some(exact(&groups, n, ((2.0 * u) as usize).abs_diff(n * m)));
    }
    Some(approximate(n, m, u, &groups))
}

/// The statistic U: pairs in which the value of the first sample is greater; equal ones count half.
pub(super) fn wins(first: &[f64], second: &[f64]) -> f64 {
    let pair = |a: f64, b: f64| f64::from(u8::from(a > b)) + 0.5 * f64::from(u8::from(a == b));
    first.iter().map(|&a| second.iter().map(|&b| pair(a, b)).sum::<f64>()).sum()
}

/// The share of all choices of `n` values, out of values in ascending groups of equal ones, for which twice the rank sum
/// is at least `distance` from its mean. A table of the numbers of choices by size and sum is filled value by value.
fn exact(groups: &[usize], n: usize, distance: usize) -> f64 {
    let total: usize = groups.iter().sum();
    // The smaller part has the same distances, and fewer sizes.
    let n = n.min(total - n);
    let (width, mean) = (2 * n * total + 1, n * (total + 1));
    // At most the binomial of 40 over 20 choices, some 2^37.
    let mut choices = vec![0u64; (n + 1) * width];
    choices[0] = 1;
    let mut below = 0;
    for &group in groups {
        // Twice the mean of the ranks below + 1 to below + group.
        let rank = 2 * below + group + 1;
        for _ in 0..group {
            for size in (1..=n).rev() {
                let (smaller, larger) = choices.split_at_mut(size * width);
                let smaller = &smaller[(size - 1) * width..];
                larger[rank..width].iter_mut().zip(smaller).for_each(|(to, from)| *to += from);
            }
        }
        below += group;
    }
    let sums = &choices[n * width..];
    let far = sums.iter().enumerate().filter(|(sum, _)| sum.abs_diff(mean) >= distance);
    far.map(|(_, choices)| choices).sum::<u64>() as f64 / sums.iter().sum::<u64>() as f64
}

/// The normal approximation of the p value for a U of samples of `n` and `m` values in groups of equal ones.
fn approximate(n: usize, m: usize, u: f64, groups: &[usize]) -> f64 {
    let (n, m) = (n as f64, m as f64);
    let total = n + m;
    let ties: f64 = groups.iter().map(|&t| t as f64).map(|t| t * t * t - t).sum();
    let variance = n * m / 12.0 * (total + 1.0 - ties / (total * (total - 1.0)));
    let distance = ((u - n * m / 2.0).abs() - 0.5).max(0.0);
    if variance <= 0.0 {
        // All values are equal.
        return 1.0;
    }
    // 2 (1 - Phi(z)) = erfc(z / sqrt(2)).
    libm::erfc(distance / libm::sqrt(2.0 * variance))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The p value by counting all ways to choose which of the values are the first sample's.
    fn counted(first: &[f64], second: &[f64]) -> f64 {
        let all = [first, second].concat();
        let (n, m) = (first.len(), second.len());
        let distance = |first: &[f64], second: &[f64]| (wins(first, second) - (n * m) as f64 / 2.0).abs();
        let observed = distance(first, second);
        let (mut far, mut ways) = (0u32, 0u32);
        for chosen in (0u32..1 << all.len()).filter(|bits| bits.count_ones() as usize == n) {
            let part = |of: u32| -> Vec<f64> {
                (0..all.len()).filter(|&i| chosen >> i & 1 == of).map(|i| all[i]).collect()
            };
            ways += 1;
            far += u32::from(distance(&part(1), &part(0)) >= observed);
        }
        f64::from(far) / f64::from(ways)
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

    #[test]
    fn exact_values_of_ties_are_those_of_counting() {
        for (first, second, expected) in [
            (&[1.0; 3][..], &[2.0; 3][..], 0.1),
            (&[1.0; 4], &[2.0; 4], 2.0 / 70.0),
            (&[1.0; 5], &[2.0; 5], 2.0 / 252.0),
            (&[1.0, 2.0, 2.0, 3.0, 3.0], &[3.0, 4.0, 4.0, 5.0, 5.0], 6.0 / 252.0),
        ] {
            assert_eq!(rank_sum(first, second), Some(expected));
            assert_eq!(rank_sum(first, second), Some(counted(first, second)));
        }
        // All values of few, in all ways to part them.
        let mut random = crate::tree::Random::stream(5, 0, 0);
        for distinct in 1..7 {
            let values: Vec<f64> = (0..12).map(|_| random.index(distinct) as f64 / 7.0).collect();
            for n in 1..values.len() {
                let (first, second) = values.split_at(n);
                assert_eq!(rank_sum(first, second), Some(counted(first, second)), "{first:?} {second:?}");
            }
        }
        // The largest there are.
        assert_eq!(rank_sum(&[1.0; 20], &[2.0; 20]), Some(2.0 / 137_846_528_820.0));
        assert_eq!(rank_sum(&[1.0], &[2.0; 400]), Some(1.0 / 401.0));
    }

    /// Critical values at 0.05, two-sided, of tables of the test (Siegel, *Nonparametric Statistics*, 1956): at U the
    /// difference is significant, at U + 1 it is not.
    #[test]
    fn critical_values_of_the_tables() {
        for (n, m, critical) in [(5, 5, 2), (8, 8, 13), (10, 10, 23), (15, 15, 64), (20, 20, 127), (4, 10, 5)]
        {
            let exact = |n: usize, m: usize, u: usize| exact(&vec![1; n + m], n, (2 * u).abs_diff(n * m));
            assert!(exact(n, m, critical) <= 0.05, "{n} {m}: {}", exact(n, m, critical));
            assert!(exact(n, m, critical + 1) > 0.05, "{n} {m}");
            assert_eq!(exact(n, m, critical), exact(m, n, critical));
        }
        assert_eq!(exact(&[1; 40], 20, 0), 1.0);
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
        // Ranks 1, 2.5, 2.5, 4, 5: of the ten pairs five are as far from their mean 6 as 2.5 + 5 is: 1 + 2.5 twice,
        // 2.5 + 5 twice, and 4 + 5.
        assert_eq!(rank_sum(&[2.0, 4.0], &[1.0, 2.0, 3.0]), Some(0.5));
        assert_eq!(rank_sum(&[1.0, 2.0, 3.0], &[2.0, 4.0]), Some(0.5));
        // U = 4.5 of 6, ties 2³ - 2 = 6: variance 6/12 (6 - 6/20) = 2.85, z = (1.5 - 0.5) / 1.68819 = 0.59235, and
        // 2 (1 - Phi(z)) = 0.55362 by a table of the normal distribution.
        let p = approximate(2, 3, 4.5, &[1, 2, 1, 1]);
        assert!((p - 0.5536).abs() < 2e-4, "{p}");
        assert_eq!(rank_sum(&[5.0; 9], &[5.0; 9]), Some(1.0));
        assert_eq!((rank_sum(&[], &[1.0]), rank_sum(&[1.0], &[])), (None, None));
        // Far apart.
        let p = rank_sum(&[1.0; 30], &[2.0; 30]).expect("not empty");
        assert!(p < 1e-13 && p > 0.0, "{p}");
    }
}
