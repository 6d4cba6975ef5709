//! The exact rank-sum test `[MannWhitney1947]`: are the values of one set larger than those of another?

/// The p value: probability of at least this many pairs with a value of `above` over one of `below`, if every order of all
/// values is equally likely. 1 if a set is empty.
///
/// The test assumes no distribution: an outlier counts as one value. Equal values count as not above, which increases the p
/// value.
pub fn chance(below: &[f64], above: &[f64]) -> f64 {
    let pairs = above.iter().map(|a| below.iter().filter(|b| a > b).count()).sum::<usize>();
    // Sum the small terms first.
    fractions(below.len(), above.len())[pairs..].iter().rev().sum::<f64>().min(1.0)
}

/// The smallest p value for sets of these sizes, when all values of one exceed all of the other.
pub fn least_chance(below: usize, above: usize) -> f64 {
    (1..=above).map(|j| j as f64 / (below + j) as f64).product()
}

/// Fraction of the orders of `n` and `m` values that have 0, 1, … n m pairs in which one of the `m` values is above.
fn fractions(n: usize, m: usize) -> Vec<f64> {
    // Of i and j values the highest is one of the m, above all i, in the fraction j / (i + j) of the orders, or else one of the
    // n. A row holds all j of one i.
    let mut row: Vec<Vec<f64>> = vec![vec![1.0]; m + 1];
    for i in 1..=n {
        for j in 1..=m {
            let mut fractions = vec![0.0; i * j + 1];
            let of_m = j as f64 / (i + j) as f64;
            row[j - 1].iter().enumerate().for_each(|(pairs, fraction)| fractions[pairs + i] += of_m * fraction);
            row[j].iter().enumerate().for_each(|(pairs, fraction)| fractions[pairs] += (1.0 - of_m) * fraction);
            row[j] = fractions;
        }
    }
    row.pop().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_match_published_tables() {
        let orders: Vec<f64> = fractions(2, 2).iter().map(|fraction| (6.0 * fraction).round()).collect();
        assert_eq!(orders, [1.0, 1.0, 2.0, 1.0, 1.0]);
        assert!((fractions(3, 5)[7] - 6.0 / 56.0).abs() < 1e-12 && (least_chance(7, 7) - 1.0 / 3432.0).abs() < 1e-15);
        // Large sets do not overflow.
        let many = fractions(100, 100);
        assert!((many.iter().sum::<f64>() - 1.0).abs() < 1e-9 && least_chance(100, 100) > 0.0);
        assert_eq!((chance(&[], &[1.0]), chance(&[1.0], &[])), (1.0, 1.0));
    }

    #[test]
    fn p_values_match_an_enumeration_of_all_orders() {
        // All ways to choose three of seven values for the upper set.
        let values: Vec<f64> = (0..7).map(|i| f64::from(i) * 1.7).collect();
        let sets: Vec<(Vec<f64>, Vec<f64>)> = (0..128u32)
            .filter(|set| set.count_ones() == 3)
            .map(|set| (0..7).partition(|i| set & (1 << i) == 0))
            .map(|(below, above): (Vec<usize>, Vec<usize>)| {
                (below.iter().map(|i| values[*i]).collect(), above.iter().map(|i| values[*i]).collect())
            })
            .collect();
        for level in [0.03, 0.1, 0.3, 0.6] {
            let count = sets.iter().filter(|(below, above)| chance(below, above) <= level).count();
            assert!(count as f64 / sets.len() as f64 <= level + 1e-12, "{count} at {level}");
        }
        assert!((chance(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]) - 0.05).abs() < 1e-12);
        assert!((chance(&[4.0, 5.0, 6.0], &[1.0, 2.0, 3.0]) - 1.0).abs() < 1e-12);
        assert!((chance(&[1.0, 1.0], &[1.0, 1.0]) - 1.0).abs() < 1e-12, "equal values are not above");
    }
}
