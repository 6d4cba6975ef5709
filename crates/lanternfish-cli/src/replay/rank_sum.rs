//! Whether one set of values lies above another: the rank-sum test `[MannWhitney1947]`, exact.

/// The probability that so many pairs or more, a value of `above` over one of `below`, are found by chance: where every order of all the
/// values is equally likely. 1 where a set is empty.
///
/// It asks for no distribution of the values: one value that is far off counts as one. Equal values count as not above, which makes the
/// probability larger.
pub fn chance(below: &[f64], above: &[f64]) -> f64 {
    let pairs = above.iter().map(|a| below.iter().filter(|b| a > b).count()).sum::<usize>();
    // The small ones first.
    fractions(below.len(), above.len())[pairs..].iter().rev().sum::<f64>().min(1.0)
}

/// The smallest probability that sets of these sizes can have: of all values of the one above all of the other.
pub fn least_chance(below: usize, above: usize) -> f64 {
    (1..=above).map(|j| j as f64 / (below + j) as f64).product()
}

/// In which share of the orders of `n` and `m` values there are 0, 1, … n m pairs in which one of the `m` is above.
fn fractions(n: usize, m: usize) -> Vec<f64> {
    // Of i and j values the highest is one of the m, above all i, as often as j of i + j, or one of the n. A row: all j of one i.
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
    fn orders_are_those_of_the_tables() {
        let orders: Vec<f64> = fractions(2, 2).iter().map(|fraction| (6.0 * fraction).round()).collect();
        assert_eq!(orders, [1.0, 1.0, 2.0, 1.0, 1.0]);
        assert!((fractions(3, 5)[7] - 6.0 / 56.0).abs() < 1e-12 && (least_chance(7, 7) - 1.0 / 3432.0).abs() < 1e-15);
        // Large ones stay numbers.
        let many = fractions(100, 100);
        assert!((many.iter().sum::<f64>() - 1.0).abs() < 1e-9 && least_chance(100, 100) > 0.0);
        assert_eq!((chance(&[], &[1.0]), chance(&[1.0], &[])), (1.0, 1.0));
    }

    #[test]
    fn the_chance_is_that_of_all_orders() {
        // Every way to choose which three of seven values are the upper set's.
        let values: Vec<f64> = (0..7).map(|i| f64::from(i) * 1.7).collect();
        let sets: Vec<(Vec<f64>, Vec<f64>)> = (0..128u32)
            .filter(|set| set.count_ones() == 3)
            .map(|set| (0..7).partition(|i| set & (1 << i) == 0))
            .map(|(below, above): (Vec<usize>, Vec<usize>)| {
                (below.iter().map(|i| values[*i]).collect(), above.iter().map(|i| values[*i]).collect())
            })
            .collect();
        for level in [0.03, 0.1, 0.3, 0.6] {
            let found = sets.iter().filter(|(below, above)| chance(below, above) <= level).count();
            assert!(found as f64 / sets.len() as f64 <= level + 1e-12, "{found} at {level}");
        }
        assert!((chance(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]) - 0.05).abs() < 1e-12);
        assert!((chance(&[4.0, 5.0, 6.0], &[1.0, 2.0, 3.0]) - 1.0).abs() < 1e-12);
        assert!((chance(&[1.0, 1.0], &[1.0, 1.0]) - 1.0).abs() < 1e-12, "what is equal is not above");
    }
}
